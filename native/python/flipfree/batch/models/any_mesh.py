"""Commands that take any mesh: unwrap, improve, repair, pack, rectify, check; and what they make of maps for textures that are no
squares (--aspect)."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import flipfree as ff

from .model import Model, Solved, taken


def unwrap(model: Model, options: dict[str, Any]) -> Solved:
    found = model.call(
        ff.unwrap,
        cuts=model.seams if options["keep_charts"] else None,
        uncuttable=model.diagonals,
        polygons=model.file.polygons,
        **taken(options, "seams stretch bijective may_add_cuts cut_extremities margin"),
        effort=0.2 if options["aspect"] == 1.0 else 0.0,
    )
    if options["aspect"] != 1.0:
        found = _packed(model, found, options)
    return Solved(found.certificate, found, figures={"islands": int(found.stats["charts"])})


def _packed(model: Model, found: ff.Parametrization, options: dict[str, Any]) -> ff.Parametrization:
    """The islands of an unwrap, as the texture shows them."""
    packed = model.call(
        ff.pack,
        found.uv / [options["aspect"], 1.0],
        scale_true=True,
        effort=0.2,  # as unwrap itself packs
        **taken(options, "margin keep_bijective aspect"),
    )
    return found.at(
        packed,
        certificate=replace(packed.certificate, mends=found.certificate.mends),
        stats={**found.stats, "fill": packed.stats["fill"]},
    )


def improve(model: Model, options: dict[str, Any]) -> Solved:
    mesh = model.vertices, model.faces, model.uv()
    found = ff.improve(mesh, **taken(options, "keep_bijective iterations aspect"), **model.limits)
    return Solved(found.certificate, found)


def repair(model: Model, options: dict[str, Any]) -> Solved:
    found = model.call(
        ff.repair,
        model.uv(whole=False),
        uncuttable=model.diagonals,
        disjoint=options["move_apart"],
        **taken(options, "overlaps stretched margin aspect"),
    )
    told = {
        "islands": "charts",
        "stretched_islands": "stretched_charts",
        "improved_islands": "charts_improved",
        "islands_unwrapped_again": "charts_stretched_anew",
    }
    figures = {name: int(found.stats[stat]) for name, stat in told.items()}
    return Solved(found.certificate, found, figures=figures)


def pack(model: Model, options: dict[str, Any]) -> Solved:
    names = "scale_true margin rotation stack_similar stack_mirrored tile tiles effort aspect"
    found = model.call(ff.pack, model.uv(), **taken(options, names))
    warnings = []
    if not found.stats.get("margin_met", 1):
        warnings.append(
            f"The gap of {options['margin_pixels']:g} pixels (--margin-pixels) is not met everywhere."
        )
    return Solved(found.certificate, found, warnings, {"fill": float(found.stats["fill"])})


def rectify(model: Model, options: dict[str, Any]) -> Solved:
    uv = None if model.file.uv is None else model.uv()
    found = model.call(
        ff.rectify, uv, polygons=model.file.polygons, **taken(options, "margin aspect")
    )
    return Solved(found.certificate, found, figures={"islands": int(found.stats["charts"])})


def check(model: Model, options: dict[str, Any]) -> Solved:
    how = taken(options, "disjoint aspect")
    certificate = model.call(ff.certify, model.uv(), bijective=True, mirrored="islands", **how)
    return Solved(certificate)


def with_aspect_of_pins(
    model: Model, met: ff.Parametrization, held: Any, options: dict[str, Any]
) -> ff.Parametrization:
    """A map that met pins, with its shape on the texture as far as the held ones leave it open."""
    found = ff.improve(
        met, pins=held, repair=False, **taken(options, "keep_bijective aspect"), **model.limits
    )
    measured = met.certificate.provenance_failures
    return met.at(found, certificate=replace(found.certificate, provenance_failures=measured))
