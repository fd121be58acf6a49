# SPDX-License-Identifier: GPL-3.0-or-later
"""Properties of operators, preferences and scenes, each with one text: "Name: what it is"."""

import bpy


def _named(kind, text: str, **more):
    name, _, description = text.partition(": ")
    return kind(name=name, description=description, **more)


def flag(text: str, *, on: bool = False):
    return _named(bpy.props.BoolProperty, text, default=on)


def words(text: str, **more):
    return _named(bpy.props.StringProperty, text, **more)


def choice(text: str, items: dict[str, str], *, default: str = ""):
    """items: {identifier: "Name: what it is"}. default: without it the first one."""
    rows = [(key, *item.partition(": ")[::2]) for key, item in items.items()]
    return _named(bpy.props.EnumProperty, text, items=rows, default=default or rows[0][0])


def real(text: str, bounds: tuple, **more):
    """bounds: default, least, and most if there is one. more: soft_max, precision, subtype as Blender has them."""
    return _bounded(bpy.props.FloatProperty, text, *bounds, **more)


def whole(text: str, bounds: tuple, **more):
    return _bounded(bpy.props.IntProperty, text, *bounds, **more)


def _bounded(kind, text: str, default, least, most=None, **more):
    return _named(
        kind, text, default=default, min=least, **({} if most is None else {"max": most}), **more
    )
