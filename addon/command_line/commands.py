# SPDX-License-Identifier: GPL-3.0-or-later
"""The commands of `blender -b -c flipfree`: one line each in COMMANDS, with its options and what they mean for the operator's
task."""

from collections.abc import Callable
from dataclasses import dataclass

from flipfree.batch import arguments, numbers

from ..fields import arguments as field_arguments
from ..operators import check, common, conformal, match, seamless, unwrap
from ..operators.mending import improve, repair
from ..operators.options import MAX_SECONDS
from ..operators.packing import pack


@dataclass(frozen=True)
class Command:
    """`arguments` adds the options to a parser; `options`: parsed ones -> (task maker, summary, options of the task)."""

    text: str
    arguments: Callable
    options: Callable
    writes: bool = True
    advice: Callable = common.advice


def _flags(parser, **texts):
    for name, text in texts.items():
        parser.add_argument(f"--{name.replace('_', '-')}", action="store_true", help=text)


# For --aspect.
IMAGE = "image"

_OVERLAPS = "islands may overlap themselves"


def _unwrap_arguments(parser):
    arguments.add_seam_arguments(parser)
    _flags(
        parser,
        keep_placement="islands stay where they were, if that is a usable layout; otherwise all are packed",
        allow_overlaps=_OVERLAPS,
        no_new_cuts="crush islands that would lie on top of themselves rather than cut them",
        short_cuts="do not cut closed parts along legs and fingers",
        ignore_pins="treat pinned UVs as any other",
        mark_seams="mark automatic cuts as seams",
    )
    _margin(parser)
    _aspect(parser)


def _match_arguments(parser):
    _flags(
        parser,
        allow_overlaps=_OVERLAPS,
        bend_lines="edges between two pins may bend where triangles are subdivided",
        cut_open="cut pinned islands open that are closed or have handles",
        unwrap_rest="unwrap islands without pins; otherwise they stay",
        no_new_vertices="refuse pins that cannot be met by the mesh as it is",
    )
    parser.add_argument(
        "--max-seconds",
        type=numbers.real(0.0),
        default=MAX_SECONDS,
        help="most per island, 0 for no limit (default %(default)g)",
    )
    _aspect(parser)


def _improve_arguments(parser):
    _flags(
        parser,
        pack="pack all islands into the unit square",
        allow_overlaps=_OVERLAPS,
        ignore_pins="treat pinned UVs as any other",
    )
    parser.add_argument(
        "--iterations", type=numbers.iterations, default=200, help="most steps per island"
    )
    _margin(parser)
    _aspect(parser)


def _repair_arguments(parser):
    parser.add_argument(
        "--overlaps",
        choices=[name for name, _, _ in repair.OVERLAPS],
        default="cut",
        help="what becomes of islands that lie on themselves (default %(default)s)",
    )
    parser.add_argument(
        "--stretched",
        choices=[name for name, _, _ in repair.STRETCHED],
        default="keep",
        help="what becomes of islands drawn out much more than an unwrap of them is (default %(default)s)",
    )
    _flags(
        parser,
        move_apart="islands that lie on larger ones are put where there is room",
        ignore_pins="treat pinned UVs as any other",
        mark_seams="mark the map's cuts as seams where islands had to be cut",
    )
    _margin(parser)
    _aspect(parser)


def _pack_arguments(parser):
    parser.add_argument(
        "--margin-pixels", type=numbers.pixels, default=2.0, help="least gap between islands"
    )
    parser.add_argument(
        "--texture-size", type=numbers.texture_size, default=1024, help="pixels to a side"
    )
    parser.add_argument(
        "--rotation", choices=[name for name, _, _ in pack.ROTATIONS], default="straight"
    )
    parser.add_argument("--tile", type=numbers.tile, default=1001, help="UDIM tile to pack into")
    parser.add_argument(
        "--tiles", type=numbers.tiles, default=1, help="UDIM tiles to spread islands over"
    )
    parser.add_argument(
        "--effort", type=numbers.effort, default=1.0, help="of the search (default %(default)g)"
    )
    _flags(
        parser,
        keep_sizes="islands keep their sizes relative to each other, not one texel density",
        stack_similar="islands of equal outline lie on top of each other",
        ignore_pins="treat pinned UVs as any other",
    )
    _aspect(parser)


def _conformal_arguments(parser):
    boundaries = [name for name, _, _ in conformal.BOUNDARIES]
    parser.add_argument("--boundary", choices=boundaries, default="free")
    parser.add_argument(
        "--refined-start",
        choices=[name for name, _, _ in conformal.REFINED_STARTS],
        default="auto",
        help="compute the metric on a surface without needles",
    )
    _flags(
        parser,
        no_seams="do not mark the cuts as seams",
        no_pack="leave islands where the layout puts them",
        metric_scale="pack parts in the size of their metric, not of their surface",
    )
    _margin(parser)


def _seamless_arguments(parser):
    parser.add_argument(
        "--cones",
        choices=[name for name, _, _ in seamless.CONES],
        default="auto",
        help="marked ones, suggested ones, or suggested where none are marked (auto)",
    )
    parser.add_argument(
        "--bound",
        type=numbers.bound,
        default=2.0,
        help="of the scale, for suggested cones (default %(default)g)",
    )
    parser.add_argument(
        "--boundary",
        choices=[name for name, _, _ in seamless.BOUNDARIES],
        default="aligned_or_free",
        help="boundaries along u and v (aligned: or no map at all), or free",
    )
    parser.add_argument(
        "--engine", choices=[name for name, _, _ in seamless.ENGINES], default="auto"
    )
    _flags(
        parser,
        no_optimise="leave the distortion as the engine does",
        no_seams="do not mark the cuts as seams, nor their quarter turns",
        no_cones="do not mark suggested cones",
        surface_scale="one UV unit is one unit of the object; otherwise the map fits the unit square",
    )


def _check_arguments(parser):
    parser.add_argument(
        "--allow-stacked", action="store_true", help="islands may lie on each other"
    )
    _aspect(parser)


def _aspect(parser):
    parser.add_argument(
        "--aspect",
        type=lambda text: text if text == IMAGE else numbers.aspect(text),
        default=1.0,
        metavar="W:H",
        help="of the texture, if it is no square: 2, 16:9, 2048x1024; image: that of the first object's material",
    )


def _margin(parser):
    parser.add_argument(
        "--margin", type=numbers.margin, default=0.005, help="between packed islands"
    )


def _unwrap_options(given):
    return (
        unwrap.UnwrapTask,
        unwrap.summary,
        {
            "bijective": not given.allow_overlaps,
            "seams": given.seams,
            "stretch": given.stretch,
            "may_add_cuts": not given.no_new_cuts,
            "cut_extremities": not given.short_cuts,
            "use_pins": not given.ignore_pins,
            "mark_seams": given.mark_seams,
            "keep_placement": given.keep_placement,
            "margin": given.margin,
            "aspect": given.aspect,
        },
    )


def _match_options(given):
    return (
        match.make_task,
        match.summary,
        {
            "bijective": not given.allow_overlaps,
            "straight_lines": not given.bend_lines,
            "cut_open": given.cut_open,
            "rest": "unwrap" if given.unwrap_rest else "keep",
            "may_add": not given.no_new_vertices,
            "max_seconds": given.max_seconds,
            "aspect": given.aspect,
        },
    )


def _improve_options(given):
    return (
        improve.ImproveTask,
        improve.summary,
        {
            "bijective": not given.allow_overlaps,
            "use_pins": not given.ignore_pins,
            "iterations": given.iterations,
            "pack": given.pack,
            "margin": given.margin,
            "aspect": given.aspect,
        },
    )


def _repair_options(given):
    return (
        repair.RepairTask,
        repair.summary,
        {
            "overlaps": given.overlaps,
            "stretched": given.stretched,
            "disjoint": given.move_apart,
            "use_pins": not given.ignore_pins,
            "mark_seams": given.mark_seams,
            "margin": given.margin,
            "aspect": given.aspect,
        },
    )


def _pack_options(given):
    return (
        pack.PackTask,
        pack.summary,
        {
            "margin_pixels": given.margin_pixels,
            "texture_size": given.texture_size,
            "rotation": given.rotation,
            "stack_similar": given.stack_similar,
            "same_density": not given.keep_sizes,
            "use_pins": not given.ignore_pins,
            "tile": given.tile,
            "tiles": given.tiles,
            "effort": given.effort,
            "aspect": given.aspect,
        },
    )


def _conformal_options(given):
    return (
        conformal.make_task,
        conformal.summary,
        {
            "boundary": given.boundary,
            "refined_start": given.refined_start,
            "mark_cuts": not given.no_seams,
            "pack": not given.no_pack,
            "scale_true": not given.metric_scale,
            "margin": given.margin,
        },
    )


def _seamless_options(given):
    return (
        seamless.make_task,
        seamless.summary,
        {
            "cones_from": given.cones,
            "boundary": given.boundary,
            "bound": given.bound,
            "optimise": not given.no_optimise,
            "mark_cuts": not given.no_seams,
            "mark_cones": not given.no_cones,
            "fit": not given.surface_scale,
            "engine": given.engine,
        },
    )


def _check_options(given):
    options = {"stacked_ok": given.allow_stacked, "aspect": given.aspect}
    return check.CheckTask, check.summary, options


_FIELD = Command(
    "a seamless map along a field", field_arguments.add_arguments, field_arguments.options
)

COMMANDS = {
    "unwrap": Command("unwrap every mesh", _unwrap_arguments, _unwrap_options),
    "match": Command("meet the pins of every mesh exactly", _match_arguments, _match_options),
    "improve": Command("less distortion", _improve_arguments, _improve_options),
    "repair": Command(
        "mend flipped, collapsed and overlapping faces", _repair_arguments, _repair_options
    ),
    "pack": Command("nest the islands of all meshes into one tile", _pack_arguments, _pack_options),
    "conformal": Command(
        "maps without shear, with the marked cones", _conformal_arguments, _conformal_options
    ),
    "seamless": Command(
        "seams that match by quarter turns", _seamless_arguments, _seamless_options
    ),
    "field": _FIELD,
    "field-aligned": _FIELD,
    "check": Command(
        "the certificate of every UV map", _check_arguments, _check_options, False, check.advice
    ),
}
