# SPDX-License-Identifier: GPL-3.0-or-later
"""The shape of the texture that UVs are made for: of the image in the UV editor, or else of the active object's material."""

import bpy
import numpy as np

# Beyond, an image is a strip, and nobody unwraps for it.
_MOST = 16.0


def active(context) -> float:
    """Width over height, 1 without an image."""
    return _of(_in_editor(context) or _in_material(context.view_layer.objects.active)) or 1.0


def of_material(ob) -> float | None:
    """That of the image in an object's active material, if there is one."""
    return _of(_in_material(ob))


def shown(ob) -> float:
    """For what is drawn over an object: of the image in its active material, or else in the first UV editor that has one."""
    return _of(_in_material(ob) or _in_any_editor()) or 1.0


def sides(ratio: float) -> np.ndarray:
    """(2,): how long u and v are on a texture of this shape, whose longer side is 1."""
    return np.array([min(ratio, 1.0), min(1.0 / ratio, 1.0)])


def _of(image) -> float | None:
    if image is None:
        return None
    (width, height), (x, y) = image.size, image.display_aspect
    ratio = width * x / (height * y)
    return ratio if 1.0 / _MOST <= ratio <= _MOST else 1.0


def _usable(image) -> bool:
    """An image with pixels, not what a render or the compositor shows."""
    return (
        image is not None
        and image.type not in {"RENDER_RESULT", "COMPOSITING"}
        and min(image.size) > 0
    )


def _in_any_editor() -> bpy.types.Image | None:
    for window in bpy.context.window_manager.windows:
        for area in window.screen.areas:
            image = area.spaces.active.image if area.type == "IMAGE_EDITOR" else None
            if _usable(image):
                return image
    return None


def _in_editor(context) -> bpy.types.Image | None:
    area = context.area
    if area is None or area.type != "IMAGE_EDITOR":
        return None
    image = area.spaces.active.image
    return image if _usable(image) else None


def _in_material(ob) -> bpy.types.Image | None:
    """Of the active node if that is an image texture, else of the first one."""
    material = None if ob is None else ob.active_material
    if material is None or material.node_tree is None:
        return None
    nodes = material.node_tree.nodes
    for node in (nodes.active, *nodes):
        if node is not None and node.type == "TEX_IMAGE" and _usable(node.image):
            return node.image
    return None
