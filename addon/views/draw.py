# SPDX-License-Identifier: GPL-3.0-or-later
"""The callbacks of the 3D viewport and of the UV editor: what `refresh` has read, onto the screen."""

import blf
import bpy
import gpu
import numpy as np
from bpy_extras.view3d_utils import location_3d_to_region_2d
from gpu_extras.batch import batch_for_shader
from mathutils import Matrix, Vector

from . import legend, refresh, shapes

_handles: list = []
# In front of the model's own faces by so much of the depth range, so that both do not shimmer.
_RAISED = 2e-5
_LINE_WIDTH = 2.5
_DISC = 4.5  # pixels


def start() -> None:
    if _handles:
        return
    for space, function, when in (
        (bpy.types.SpaceView3D, _surface, "POST_VIEW"),
        (bpy.types.SpaceView3D, _over_surface, "POST_PIXEL"),
        (bpy.types.SpaceImageEditor, _map, "POST_VIEW"),
        (bpy.types.SpaceImageEditor, _over_map, "POST_PIXEL"),
    ):
        _handles.append((space, space.draw_handler_add(function, (), "WINDOW", when)))


def stop() -> None:
    while _handles:
        space, handle = _handles.pop()
        space.draw_handler_remove(handle, "WINDOW")


def _visible(context) -> list:
    """(entry, object) of what this window's view layer has."""
    found = []
    for entry in refresh.entries.values():
        ob = context.view_layer.objects.get(entry.name)
        if ob is not None and ob.visible_get():
            found.append((entry, ob))
    return found


def _in_uv_editor(context) -> bool:
    return context.area is not None and context.area.ui_type == "UV"


def _surface() -> None:
    context = bpy.context
    gpu.state.depth_test_set("LESS_EQUAL")
    gpu.state.blend_set("ALPHA")
    for entry, ob in _visible(context):
        with gpu.matrix.push_pop():
            gpu.matrix.multiply_matrix(ob.matrix_world)
            for shape, batch in _batches(entry, shapes.SURFACE):
                with gpu.matrix.push_pop_projection():
                    if shape.raised:
                        nearer = Matrix.Identity(4)
                        nearer[2][3] = -_RAISED * (4.0 if shape.kind == "LINES" else 1.0)
                        gpu.matrix.load_projection_matrix(
                            nearer @ gpu.matrix.get_projection_matrix()
                        )
                    gpu.state.depth_mask_set(not shape.raised)
                    _draw(shape, batch)
    gpu.state.depth_mask_set(False)
    gpu.state.depth_test_set("NONE")
    gpu.state.blend_set("NONE")


def _map() -> None:
    context = bpy.context
    if not _in_uv_editor(context):
        return
    gpu.state.blend_set("ALPHA")
    for entry, _ in _visible(context):
        for shape, batch in _batches(entry, shapes.MAP):
            _draw(shape, batch)
    gpu.state.blend_set("NONE")


def _over_surface() -> None:
    context = bpy.context
    region, view = context.region, context.region_data
    placed = []
    for entry, ob in _visible(context):
        turned = ob.matrix_world.to_3x3().inverted_safe().transposed()
        for mark in entry.drawing.marks:
            if mark.place != shapes.SURFACE:
                continue
            place = ob.matrix_world @ Vector(mark.at)
            at = location_3d_to_region_2d(region, view, place)
            if at is not None and _is_in_front(view, place, turned, mark.normal):
                placed.append((mark, at.x, at.y))
    _draw_marks(placed)
    _draw_legend(context)


def _is_in_front(view, place: Vector, turned: Matrix, normal: tuple | None) -> bool:
    """Whether the surface looks at the viewer there. turned: takes normals of the object into the scene."""
    if normal is None:
        return True
    if view.is_perspective:
        towards = view.view_matrix.inverted().translation - place
    else:
        towards = view.view_rotation @ Vector((0.0, 0.0, 1.0))
    return (turned @ Vector(normal)).dot(towards) > 0.0


def _over_map() -> None:
    context = bpy.context
    if not _in_uv_editor(context):
        return
    to_region = context.region.view2d.view_to_region
    _draw_marks(
        [
            (mark, *to_region(mark.at[0], mark.at[1], clip=False))
            for entry, _ in _visible(context)
            for mark in entry.drawing.marks
            if mark.place == shapes.MAP
        ]
    )
    _draw_legend(context)


def _draw_marks(placed: list) -> None:
    """placed: (mark, x, y) in pixels."""
    ui = bpy.context.preferences.system.ui_scale
    dots = [row for row in placed if row[0].colour[3] > 0]
    if dots:
        at = np.array([(x, y) for _, x, y in dots])
        colours = np.array([mark.colour for mark, _, _ in dots])
        for radius, colour in ((_DISC * ui, colours * [0, 0, 0, 1]), (_DISC * ui - 1, colours)):
            legend.rectangles(np.column_stack([at - radius, at + radius]), colour)
    blf.size(0, 12 * ui)
    blf.enable(0, blf.SHADOW)
    blf.shadow(0, 5, 0, 0, 0, 1)
    for mark, x, y in placed:
        if mark.text:
            legend.write(x + 7 * ui, y + 4 * ui, mark.text, (1, 1, 1, 1))
    blf.disable(0, blf.SHADOW)


def _draw_legend(context) -> None:
    """Beside the sidebar, where this lies over the region."""
    covered = sum(
        r.width
        for r in context.area.regions
        if r.type == "UI" and r.width > 1 and context.preferences.system.use_region_overlap
    )
    ui = context.preferences.system.ui_scale
    legend.draw(refresh.current_legend(), context.region.width - covered, round(30 * ui))


def _batches(entry: refresh.Entry, place: str) -> list:
    """(shape, batch) of all shapes of one place."""
    if entry.batches is None:
        entry.batches = {}
    if place not in entry.batches:
        entry.batches[place] = [
            (shape, _batch(shape))
            for shape in entry.drawing.shapes
            if shape.place == place and len(shape.pos)
        ]
    return entry.batches[place]


def _batch(shape: shapes.Shape):
    values = {"pos": np.ascontiguousarray(shape.pos, np.float32)}
    if isinstance(shape.colour, np.ndarray):
        values["color"] = np.ascontiguousarray(shape.colour, np.float32)
    return batch_for_shader(_shader(shape), shape.kind, values)


def _shader(shape: shapes.Shape):
    each = isinstance(shape.colour, np.ndarray)
    name = "FLAT_COLOR" if each else "UNIFORM_COLOR"
    return gpu.shader.from_builtin(f"POLYLINE_{name}" if shape.kind == "LINES" else name)


def _draw(shape: shapes.Shape, batch) -> None:
    shader = _shader(shape)
    shader.bind()
    if not isinstance(shape.colour, np.ndarray):
        shader.uniform_float("color", shape.colour)
    if shape.kind == "LINES":
        region = bpy.context.region
        shader.uniform_float("viewportSize", (region.width, region.height))
        shader.uniform_float("lineWidth", _LINE_WIDTH * bpy.context.preferences.system.ui_scale)
    batch.draw(shader)
