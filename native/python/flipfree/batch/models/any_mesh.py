"""Commands that take any mesh: unwrap, improve, repair, pack, rectify, check; and what they make of maps for textures that are no
squares (--aspect)."""

from __future__ import annotations

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
from ..numbers import margin
from .model import Model, Solved


def _taken(options: dict[str, Any], names: str) -> dict[str, Any]:
    """Options that calls have by the same name."""
    return {name: options[name] for name in names.split()}


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


def improve(model: Model, options: dict[str, Any]) -> Solved:
    found = improve_map(
        (model.vertices, model.faces, model.uv()),
        keep_bijective=not options["allow_overlaps"],
        **_taken(options, "iterations aspect"),
        **model.limits,
    )
    return Solved(found.certificate, found)


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


def pack(model: Model, options: dict[str, Any]) -> Solved:
    found = pack_map(
        model.vertices,
        model.faces,
        model.uv(),
        scale_true=not options["keep_sizes"],
        margin=margin(options),
        **_taken(options, "rotation stack_similar stack_mirrored tile tiles effort aspect"),
        **model.limits,
    )
    warnings = []
    if not found.stats.get("margin_met", 1):
        warnings.append(
            f"The gap of {options['margin_pixels']:g} pixels (--margin-pixels) is not met everywhere."
        )
    return Solved(found.certificate, found, warnings, {"fill": float(found.stats["fill"])})


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


def check(model: Model, options: dict[str, Any]) -> Solved:
    certificate = certify(
        model.vertices,
        model.faces,
        model.uv(),
        bijective=True,
        disjoint=not options["allow_stacked"],
        mirrored="islands",
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
