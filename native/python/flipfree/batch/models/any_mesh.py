"""Commands that take any mesh: unwrap, improve, repair, pack, rectify, check; and what they make of maps for textures that are no
squares (--aspect)."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import flipfree as ff

from ...distortion import STRETCH_BOUND
from .model import ASPECT, MARGIN, OVERLAPS, Model, Solved, command, taken


@command(
    f"""islands onto the plane, packed
--seams auto|given  auto: also where islands are closed, have handles, or would be stretched more than --stretch; given: no more
    than it takes to open them
--stretch={STRETCH_BOUND}  of automatic seams: lengths change by about this factor at most
--keep-charts  cut where the file's charts end
{OVERLAPS}
--no-new-cuts  crush islands that would lie on top of themselves rather than cut them
--short-cuts  do not cut closed parts along legs and fingers
{MARGIN}{ASPECT}""",
    cure="--seams auto and a lower --stretch cut it further",
)
def unwrap(model: Model, options: dict[str, Any]) -> Solved:
    found = model.call(
        ff.unwrap,
        cuts=model.seams if options["keep_charts"] else None,
        uncuttable=model.diagonals,
        polygons=model.file.polygons,
        **taken(options, "seams stretch bijective may_add_cuts cut_extremities margin"),
        effort=0.2 if options["aspect"] == 1.0 else 0.0,
    )
    if options["aspect"] != 1.0:  # as the texture shows the islands
        how = taken(options, "margin keep_bijective aspect")
        uv = found.uv / [options["aspect"], 1.0]
        packed = model.call(ff.pack, uv, scale_true=True, effort=0.2, **how)
        told = replace(packed.certificate, mends=found.certificate.mends)
        stats = {**found.stats, "fill": packed.stats["fill"]}
        found = found.at(packed, certificate=told, stats=stats)
    return Solved(found.certificate, found, figures={"islands": int(found.stats["charts"])})


@command(f"less distortion\n{OVERLAPS}--iterations=200  most steps per island{ASPECT}")
def improve(model: Model, options: dict[str, Any]) -> Solved:
    mesh = model.vertices, model.faces, model.uv()
    found = ff.improve(mesh, **taken(options, "keep_bijective iterations aspect"), **model.limits)
    return Solved(found.certificate, found)


@command(
    f"""flips mended
--overlaps cut|open|keep  what becomes of islands on themselves
--stretched keep|improve  what becomes of islands drawn out much more than an unwrap of them is
{MARGIN}
--move-apart  islands that lie on larger ones are put where there is room
{ASPECT}"""
)
def repair(model: Model, options: dict[str, Any]) -> Solved:
    how = taken(options, "overlaps stretched margin aspect") | {"uncuttable": model.diagonals}
    uv = model.uv(whole=False)
    found = model.call(ff.repair, uv, disjoint=options["move_apart"], **how)
    told = {
        "islands": "charts",
        "stretched_islands": "stretched_charts",
        "improved_islands": "charts_improved",
        "islands_unwrapped_again": "charts_stretched_anew",
    }
    figures = {name: int(found.stats[stat]) for name, stat in told.items()}
    return Solved(found.certificate, found, figures=figures)


@command(
    f"""islands nested into a tile
{MARGIN}
--rotation straight|free|quarters|none
--tile=1001  UDIM tile to pack into
--tiles=1  UDIM tiles to spread islands over
--effort=1  of the search
--keep-sizes  islands keep their sizes relative to each other, not one texel density
--stack-similar  islands of equal outline lie on top of each other
--stack-mirrored  with it, mirror images too, mirrored
{ASPECT}"""
)
def pack(model: Model, options: dict[str, Any]) -> Solved:
    names = "scale_true margin rotation stack_similar stack_mirrored tile tiles effort aspect"
    found = model.call(ff.pack, model.uv(), **taken(options, names))
    gap = f"The gap of {options['margin_pixels']:g} pixels (--margin-pixels) is not met everywhere."
    warnings = [] if found.stats.get("margin_met", 1) else [gap]
    return Solved(found.certificate, found, warnings, {"fill": float(found.stats["fill"])})


@command(f"islands of quads as straight strips and grids\n{MARGIN}{ASPECT}")
def rectify(model: Model, options: dict[str, Any]) -> Solved:
    uv = None if model.file.uv is None else model.uv()
    how = taken(options, "margin aspect")
    found = model.call(ff.rectify, uv, polygons=model.file.polygons, **how)
    return Solved(found.certificate, found, figures={"islands": int(found.stats["charts"])})


@command(
    f"the certificate of a map\n--allow-stacked  islands may lie on each other{ASPECT}",
    writes=False,
)
def check(model: Model, options: dict[str, Any]) -> Solved:
    how = taken(options, "disjoint aspect")
    certificate = model.call(ff.certify, model.uv(), bijective=True, mirrored="islands", **how)
    return Solved(certificate)
