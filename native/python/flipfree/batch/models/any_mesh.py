"""Commands that take any mesh: unwrap, improve, repair, pack, check."""

from __future__ import annotations

import argparse
from typing import Any

from ...calls.certification import certify
from ...calls.improving import improve as improve_map
from ...calls.improving import repair as repair_map
from ...calls.packing import pack as pack_map
from ...calls.unwrapping import unwrap as unwrap_mesh
from .. import numbers, seams
from . import texture
from .model import Model, Solved


def flags(parser: argparse.ArgumentParser, **texts: str) -> None:
    for name, text in texts.items():
        parser.add_argument(f"--{name.replace('_', '-')}", action="store_true", help=text)


def unwrap_arguments(parser: argparse.ArgumentParser) -> None:
    seams.arguments(parser)
    flags(
        parser,
        keep_charts="cut where the file's charts end",
        allow_overlaps="islands may overlap themselves",
        no_new_cuts="crush islands that would lie on top of themselves rather than cut them",
        short_cuts="do not cut closed parts along legs and fingers",
    )
    parser.add_argument(
        "--margin", type=numbers.margin, default=0.005, help="between packed islands"
    )
    texture.argument(parser)


def unwrap(model: Model, options: dict[str, Any]) -> Solved:
    found = unwrap_mesh(
        model.vertices,
        model.faces,
        cuts=model.seams if options["keep_charts"] else None,
        uncuttable=model.diagonals,
        polygons=model.file.polygons,
        seams=options["seams"],
        stretch=options["stretch"],
        bijective=not options["allow_overlaps"],
        may_add_cuts=not options["no_new_cuts"],
        cut_extremities=not options["short_cuts"],
        margin=options["margin"],
        effort=0.2 if options["aspect"] == 1.0 else 0.0,
        **model.limits,
    )
    if options["aspect"] != 1.0:
        found = texture.packed(model, found, options)
    return Solved(found.certificate, found, figures={"islands": int(found.stats["charts"])})


def improve_arguments(parser: argparse.ArgumentParser) -> None:
    flags(parser, allow_overlaps="islands may overlap themselves")
    parser.add_argument(
        "--iterations", type=numbers.iterations, default=200, help="most steps per island"
    )
    texture.argument(parser)


def improve(model: Model, options: dict[str, Any]) -> Solved:
    found = improve_map(
        (model.vertices, model.faces, model.uv()),
        keep_bijective=not options["allow_overlaps"],
        iterations=options["iterations"],
        aspect=options["aspect"],
        **model.limits,
    )
    return Solved(found.certificate, found)


def repair_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "--overlaps",
        choices=("cut", "open", "keep"),
        default="cut",
        help="what becomes of islands on themselves",
    )
    parser.add_argument(
        "--stretched",
        choices=("keep", "improve"),
        default="keep",
        help="what becomes of islands drawn out much more than an unwrap of them is",
    )
    parser.add_argument(
        "--margin", type=numbers.margin, default=0.005, help="around islands that move"
    )
    flags(parser, move_apart="islands that lie on larger ones are put where there is room")
    texture.argument(parser)


def repair(model: Model, options: dict[str, Any]) -> Solved:
    found = repair_map(
        model.vertices,
        model.faces,
        model.uv(whole=False),
        uncuttable=model.diagonals,
        overlaps=options["overlaps"],
        stretched=options["stretched"],
        disjoint=options["move_apart"],
        margin=options["margin"],
        aspect=options["aspect"],
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
    parser.add_argument(
        "--margin-pixels", type=numbers.pixels, default=2.0, help="least gap between islands"
    )
    parser.add_argument(
        "--texture-size", type=numbers.texture_size, default=1024, help="pixels to a side"
    )
    parser.add_argument(
        "--rotation", choices=("free", "straight", "quarters", "none"), default="straight"
    )
    parser.add_argument("--tile", type=numbers.tile, default=1001, help="UDIM tile to pack into")
    parser.add_argument(
        "--tiles", type=numbers.tiles, default=1, help="UDIM tiles to spread islands over"
    )
    parser.add_argument("--effort", type=numbers.effort, default=1.0, help="of the search")
    flags(
        parser,
        keep_sizes="islands keep their sizes relative to each other, not one texel density",
        stack_similar="islands of equal outline lie on top of each other",
    )
    texture.argument(parser)


def pack(model: Model, options: dict[str, Any]) -> Solved:
    found = pack_map(
        model.vertices,
        model.faces,
        model.uv(),
        margin_pixels=options["margin_pixels"],
        texture_size=options["texture_size"],
        rotation=options["rotation"],
        tile=options["tile"],
        tiles=options["tiles"],
        effort=options["effort"],
        scale_true=not options["keep_sizes"],
        stack_similar=options["stack_similar"],
        aspect=options["aspect"],
        **model.limits,
    )
    warnings = []
    if not found.stats.get("margin_met", 1):
        warnings.append(
            f"The gap of {options['margin_pixels']:g} pixels (--margin-pixels) is not met everywhere."
        )
    return Solved(found.certificate, found, warnings, {"fill": float(found.stats["fill"])})


def check_arguments(parser: argparse.ArgumentParser) -> None:
    flags(parser, allow_stacked="islands may lie on each other")
    texture.argument(parser)


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
