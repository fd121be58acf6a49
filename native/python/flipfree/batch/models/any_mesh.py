"""Commands that take any mesh: unwrap, improve, repair, pack, rectify, check; and what they make of maps for textures that are no
squares (--aspect)."""

from __future__ import annotations

import argparse
from dataclasses import replace
from typing import Any

import numpy as np
import numpy.typing as npt

from ...calls.certification import certify
from ...calls.improving import improve as improve_map
from ...calls.improving import repair as repair_map
from ...calls.rectifying import rectify as rectify_map
from ...calls.unwrapping import pack as pack_map
from ...calls.unwrapping import unwrap as unwrap_mesh
from ...results import Parametrization
from ..arguments import add_seam_arguments
from ..numbers import add_aspect, add_choice, add_flags, add_margin, add_options, margin
from .model import Model, Solved


def _taken(options: dict[str, Any], names: str) -> dict[str, Any]:
    """Options that calls have by the same name."""
    return {name: options[name] for name in names.split()}


def unwrap_arguments(parser: argparse.ArgumentParser) -> None:
    add_seam_arguments(parser)
    add_flags(
        parser,
        keep_charts="cut where the file's charts end",
        allow_overlaps="islands may overlap themselves",
        no_new_cuts="crush islands that would lie on top of themselves rather than cut them",
        short_cuts="do not cut closed parts along legs and fingers",
    )
    add_margin(parser, "least gap between islands")
    add_aspect(parser)


def unwrap(model: Model, options: dict[str, Any]) -> Solved:
    found = unwrap_mesh(
        model.vertices,
        model.faces,
        cuts=model.seams if options["keep_charts"] else None,
        uncuttable=model.diagonals,
        polygons=model.file.polygons,
        bijective=not options["allow_overlaps"],
        may_add_cuts=not options["no_new_cuts"],
        cut_extremities=not options["short_cuts"],
        margin=margin(options),
        **_taken(options, "seams stretch"),
        effort=0.2 if options["aspect"] == 1.0 else 0.0,
        **model.limits,
    )
    if options["aspect"] != 1.0:
        found = _packed(model, found, options)
    return Solved(found.certificate, found, figures={"islands": int(found.stats["charts"])})


def _packed(model: Model, found: Parametrization, options: dict[str, Any]) -> Parametrization:
    """The islands of an unwrap, as the texture shows them."""
    packed = pack_map(
        model.vertices,
        model.faces,
        found.uv / [options["aspect"], 1.0],
        margin=margin(options),
        scale_true=True,
        keep_bijective=not options["allow_overlaps"],
        effort=0.2,  # as unwrap itself packs
        aspect=options["aspect"],
        **model.limits,
    )
    return found.at(
        packed,
        certificate=replace(packed.certificate, mends=found.certificate.mends),
        stats={**found.stats, "fill": packed.stats["fill"]},
    )


def improve_arguments(parser: argparse.ArgumentParser) -> None:
    add_flags(parser, allow_overlaps="islands may overlap themselves")
    add_options(parser, iterations="most steps per island")
    add_aspect(parser)


def improve(model: Model, options: dict[str, Any]) -> Solved:
    found = improve_map(
        (model.vertices, model.faces, model.uv()),
        keep_bijective=not options["allow_overlaps"],
        **_taken(options, "iterations aspect"),
        **model.limits,
    )
    return Solved(found.certificate, found)


def repair_arguments(parser: argparse.ArgumentParser) -> None:
    add_choice(parser, "--overlaps", "cut open keep", "what becomes of islands on themselves")
    add_choice(
        parser,
        "--stretched",
        "keep improve",
        "what becomes of islands drawn out much more than an unwrap of them is",
    )
    add_margin(parser, "least gap around islands that move")
    add_flags(parser, move_apart="islands that lie on larger ones are put where there is room")
    add_aspect(parser)


def repair(model: Model, options: dict[str, Any]) -> Solved:
    found = repair_map(
        model.vertices,
        model.faces,
        model.uv(whole=False),
        uncuttable=model.diagonals,
        disjoint=options["move_apart"],
        margin=margin(options),
        **_taken(options, "overlaps stretched aspect"),
        **model.limits,
    )
    figures = {
        "islands": int(found.stats["charts"]),
        "stretched_islands": int(found.stats["stretched_charts"]),
        "improved_islands": int(found.stats["charts_improved"]),
        "islands_unwrapped_again": int(found.stats["charts_stretched_anew"]),
    }
    return Solved(found.certificate, found, figures=figures)


def pack_arguments(parser: argparse.ArgumentParser) -> None:
    add_margin(parser, "least gap between islands")
    add_choice(parser, "--rotation", "straight free quarters none")
    add_options(
        parser,
        tile="UDIM tile to pack into",
        tiles="UDIM tiles to spread islands over",
        effort="of the search",
    )
    add_flags(
        parser,
        keep_sizes="islands keep their sizes relative to each other, not one texel density",
        stack_similar="islands of equal outline lie on top of each other",
    )
    add_aspect(parser)


def pack(model: Model, options: dict[str, Any]) -> Solved:
    found = pack_map(
        model.vertices,
        model.faces,
        model.uv(),
        scale_true=not options["keep_sizes"],
        stack_similar=options["stack_similar"],
        margin=margin(options),
        **_taken(options, "rotation tile tiles effort aspect"),
        **model.limits,
    )
    warnings = []
    if not found.stats.get("margin_met", 1):
        warnings.append(
            f"The gap of {options['margin_pixels']:g} pixels (--margin-pixels) is not met everywhere."
        )
    return Solved(found.certificate, found, warnings, {"fill": float(found.stats["fill"])})


def rectify_arguments(parser: argparse.ArgumentParser) -> None:
    add_margin(parser, "least gap between islands")
    add_aspect(parser)


def rectify(model: Model, options: dict[str, Any]) -> Solved:
    found = rectify_map(
        model.vertices,
        model.faces,
        None if model.file.uv is None else model.uv(),
        polygons=model.file.polygons,
        margin=margin(options),
        aspect=options["aspect"],
        **model.limits,
    )
    return Solved(found.certificate, found, figures={"islands": int(found.stats["charts"])})


def check_arguments(parser: argparse.ArgumentParser) -> None:
    add_flags(parser, allow_stacked="islands may lie on each other")
    add_aspect(parser)


def check(model: Model, options: dict[str, Any]) -> Solved:
    certificate = certify(
        model.vertices,
        model.faces,
        model.uv(),
        bijective=True,
        disjoint=not options["allow_stacked"],
        aspect=options["aspect"],
        **model.limits,
    )
    return Solved(certificate)


def with_aspect_of_pins(
    model: Model, met: Parametrization, held: npt.NDArray[np.bool_], options: dict[str, Any]
) -> Parametrization:
    """A map that met pins, with its shape on the texture as far as what is held leaves it open."""
    places = np.empty((len(met.vertices), 2))
    places[met.faces] = met.uv
    kept = np.flatnonzero(held).tolist()
    found = improve_map(
        met,
        pins=dict(zip(kept, map(tuple, places[kept].tolist()), strict=True)),
        keep_bijective=not options["allow_overlaps"],
        repair=False,
        aspect=options["aspect"],
        **model.limits,
    )
    measured = met.certificate.provenance_failures
    return met.at(found, certificate=replace(found.certificate, provenance_failures=measured))
