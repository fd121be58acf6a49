# SPDX-License-Identifier: GPL-3.0-or-later
"""Size of the texture and padding, in pixels: once per scene, in the sidebar. What operators start with, and densities mean."""

import bpy

from .properties import real, whole

SIZE, MARGIN = 1024, 4.0
# Pixels of padding for a texture of so many to a side: what is left of them after eight mip levels is one.
_PRESETS = {size: size / 256.0 for size in (512, 1024, 2048, 4096, 8192)}
_NAMES = ("texture_size", "margin_pixels")


def size() -> int:
    """Pixels of the texture's longer side, in the scene of the window."""
    return bpy.context.scene.flipfree_texture_size


def margin() -> float:
    """In widths of the texture."""
    scene = bpy.context.scene
    return scene.flipfree_margin_pixels / scene.flipfree_texture_size


def take(operator) -> None:
    """Options of an operator that were not set become those of the scene, as the redo panel shows them then."""
    for name in _NAMES:
        if hasattr(operator, name) and not operator.properties.is_property_set(name):
            setattr(operator, name, getattr(bpy.context.scene, f"flipfree_{name}"))


def with_margin(values: dict) -> dict:
    """Of options those that a task wants: its margin in widths of the texture."""
    if "margin_pixels" in values:
        values["margin"] = values.pop("margin_pixels") / values.pop("texture_size")
    return values


def draw(layout, context) -> None:
    layout.prop(context.scene, "flipfree_texture")
    row = layout.row(align=True)
    for name, text in zip(_NAMES, ("Size", "Margin"), strict=True):
        row.prop(context.scene, f"flipfree_{name}", text=text)


def _preset(scene) -> int:
    at = list(_PRESETS.items())
    now = (scene.flipfree_texture_size, scene.flipfree_margin_pixels)
    return at.index(now) + 1 if now in at else 0


def _set_preset(scene, index: int) -> None:
    if index > 0:
        now = list(_PRESETS.items())[index - 1]
        scene.flipfree_texture_size, scene.flipfree_margin_pixels = now


def register() -> None:
    properties = bpy.types.Scene
    properties.flipfree_texture_size = whole(
        "Texture Size: Pixels of the texture's longer side, by which margins and texel densities are measured",
        (SIZE, 16, 65536),
    )
    properties.flipfree_margin_pixels = real(
        "Margin: Least gap between packed islands in pixels of the texture; half of it to the tile's border",
        (MARGIN, 0.0),
        soft_max=64.0,
        precision=1,
    )
    properties.flipfree_texture = bpy.props.EnumProperty(
        name="Texture",
        description="Size and margin that go together; every operator starts with those of the scene",
        items=[
            ("custom", "Custom", "Size and margin as they are set below", 0),
            *(
                (str(size), f"{size} px", f"{margin:g} px between islands", i)
                for i, (size, margin) in enumerate(_PRESETS.items(), start=1)
            ),
        ],
        get=_preset,
        set=_set_preset,
    )


def unregister() -> None:
    for name in (*_NAMES, "texture"):
        delattr(bpy.types.Scene, f"flipfree_{name}")
