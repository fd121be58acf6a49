# SPDX-License-Identifier: GPL-3.0-or-later
"""The commands of `blender -b -c flipfree`: operators of the table `ui.tools` that have a word there, each with its options.

    name="Mark Cuts as Seams", default=True       --no-seams       an option that is on at first has the word that turns it off
    EnumProperty(default="auto")                  --engine padding
    FloatProperty(min=0.0, subtype="ANGLE")       --sharp-from 30  degrees

An option's name is its word, unless WORDS has another one.
"""

import argparse
import math

import bpy

from flipfree.batch import arguments

from .. import texture
from ..operators.options import MapOperator
from ..ui import tools

# For --aspect.
IMAGE = "image"

# Option of an operator -> its word here.
WORDS = {
    "bijective": "allow_overlaps",
    "cones_from": "cones",
    "cut_extremities": "short_cuts",
    "density_name": "density_from",
    "disjoint": "move_apart",
    "field_from": "field",
    "fit": "surface_scale",
    "mark_cones": "no_cones",
    "mark_cuts": "no_seams",
    "may_add": "no_new_vertices",
    "may_add_cuts": "no_new_cuts",
    "merge_cones": "keep_near_cones",
    "same_density": "keep_sizes",
    "scale_true": "metric_scale",
    "sharp_angle": "sharp_from",
    "stacked_ok": "allow_stacked",
    "straight_lines": "bend_lines",
    "use_pins": "ignore_pins",
    "write_field": "no_field",
}
# Options that are choices in a window, and a flag here: (word, what it chooses).
FLAGS = {"rest": ("unwrap_rest", "unwrap")}
# Of a window alone.
_LEFT_OUT = {"replace", "select_corners", "select_cuts", "use_modifiers"}
# Those that reach elsewhere than in the package's command line.
_OWN_RANGE = {"max_seconds", "stretch", "tile_count"}
# Numbers of more digits than Blender's floats have are not what anybody typed.
_DIGITS = 6


def word_of(name: str, default) -> str:
    word = FLAGS[name][0] if name in FLAGS else WORDS.get(name, name)
    return f"no_{name}" if default is True and word == name else word


def options_of(operator) -> dict:
    """Name -> Blender's description of it."""
    space, name = operator.bl_idname.split(".")
    properties = getattr(getattr(bpy.ops, space), name).get_rna_type().properties
    return {n: properties[n] for n in operator.option_names if n not in _LEFT_OUT}


def add_options(operator, parser: argparse.ArgumentParser) -> None:
    for name, option in options_of(operator).items():
        if name == "correct_aspect":
            _add_aspect(parser)
        else:
            _add(parser, name, option)


def values_of(operator, given: argparse.Namespace) -> dict:
    """Parsed options as those of the operator's tasks."""
    found = {}
    for name, option in options_of(operator).items():
        if name == "correct_aspect":
            found["aspect"] = given.aspect
            continue
        value = getattr(given, word_of(name, option.default))
        if name in FLAGS:
            value = FLAGS[name][1] if value else option.default
        elif option.type == "BOOLEAN":
            value = value != option.default
        elif option.subtype == "ANGLE":
            value = math.radians(value)
        found[name] = value
    return texture.with_margin(found)


def _add(parser, name: str, option) -> None:
    word = word_of(name, option.default)
    flag, text = f"--{word.replace('_', '-')}", option.description.replace("%", "%%")
    if option.type == "BOOLEAN" or name in FLAGS:
        text = f"not: {option.name}. {text}" if option.default is True else text
        parser.add_argument(flag, action="store_true", help=text or option.name)
    elif option.type == "ENUM":
        choices = [item.identifier for item in option.enum_items]
        parser.add_argument(flag, choices=choices, default=option.default, help=text)
    elif option.type == "STRING":
        parser.add_argument(flag, default=option.default, help=text)
    elif name in arguments.KINDS.keys() - _OWN_RANGE:
        parser.add_argument(flag, type=arguments.KINDS[name], default=_default(option), help=text)
    else:
        parser.add_argument(flag, type=_number(option), default=_default(option), help=text)


def _default(option):
    if option.type == "INT":
        return option.default
    value = math.degrees(option.default) if option.subtype == "ANGLE" else option.default
    return float(f"{value:.{_DIGITS}g}")


def _number(option):
    low, high = option.hard_min, option.hard_max
    if option.type == "INT":
        return arguments.whole(low, high)
    if option.subtype == "ANGLE":
        low, high = math.degrees(low), math.degrees(high)
    low, high = (float(f"{bound:.{_DIGITS}g}") for bound in (low, high))
    return arguments.real(low, high if high < 1e30 else math.inf)


def _add_aspect(parser) -> None:
    parser.add_argument(
        "--aspect",
        type=lambda text: text if text == IMAGE else arguments.aspect(text),
        default=1.0,
        metavar="W:H",
        help="of the texture, if it is no square: 2, 16:9, 2048x1024; image: that of the first object's material",
    )


COMMANDS: dict[str, type[MapOperator]] = {
    word: tool.cls for tool in tools.all_tools() for word in tool.command.split()
}


def add_to(commands) -> None:
    """A parser for each, among those of argparse."""
    for name, operator in COMMANDS.items():
        text = operator.bl_description
        added = commands.add_parser(name, help=text, description=text)
        arguments.add_run_arguments(added, writes=operator.writes)
        add_options(operator, added)
        arguments.add_model_arguments(added, has_limit=added.get_default("max_seconds") is not None)
