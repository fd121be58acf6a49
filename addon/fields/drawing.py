# SPDX-License-Identifier: GPL-3.0-or-later
"""The field and the cones of the selected objects, drawn over them in 3D viewports until they are switched off.

Crosses are the face attribute `flipfree_field`, octahedra the cones of the groups `Cone +1`, `Cone -1`, ... and `cone_angle`: red
where the surface bends inwards to a corner, green at saddles. Nothing of it is kept with the file.

What is drawn is looked at anew at every redraw (the selected objects), and read anew whenever Blender says that some geometry
changed: no reference to Blender's data lives from one redraw to the next.
"""

import math
from dataclasses import dataclass

import bmesh
import bpy
import gpu
import numpy as np
from bpy.app import handlers
from gpu_extras.batch import batch_for_shader

from ..meshes import cones, fields

FIELD_COLOUR = (0.05, 0.25, 0.75, 1.0)
CORNER_COLOUR = (0.83, 0.15, 0.11, 1.0)
SADDLE_COLOUR = (0.12, 0.62, 0.23, 1.0)
# Lengths relative to the square root of a face's area: half a cross, half a line's width, above the face; and of the mesh's
# size: an octahedron.
_ARM, _WIDTH, _LIFT = 0.38, 0.035, 0.04
_CONE = 0.012
# While a mesh is edited, larger ones would make each of Blender's redraws slow.
_MOST_EDITED = 50_000

_state: dict = {"handle": None, "batches": {}}


@dataclass
class Shapes:
    """Triangles in object coordinates: (k, 3) vertices, three for each."""

    field: np.ndarray
    corners: np.ndarray
    saddles: np.ndarray


@dataclass
class _Read:
    """What is drawn of a mesh."""

    centre: np.ndarray  # (k, 3) of the faces with a direction
    normal: np.ndarray
    direction: np.ndarray
    area: np.ndarray
    cone: np.ndarray  # (c, 3)
    curvature: np.ndarray  # (c,) of its sign
    size: float


def shapes_of(ob: bpy.types.Object) -> Shapes:
    """What is drawn of an object, in either mode."""
    read = _edited(ob) if ob.mode == "EDIT" else _at_rest(ob)
    bent = read.curvature > 0
    return Shapes(
        _crosses(read),
        _octahedra(read.cone[bent], _CONE * read.size),
        _octahedra(read.cone[~bent], _CONE * read.size),
    )


def _size(points: np.ndarray) -> float:
    return float(np.linalg.norm(np.ptp(points, axis=0))) if len(points) else 0.0


def _signs(found: dict[int, float], boundary: np.ndarray) -> np.ndarray:
    flat = np.where(boundary[list(found)], math.pi, 2 * math.pi)
    return flat - np.array(list(found.values()))


def _at_rest(ob) -> _Read:
    mesh = ob.data
    points = np.empty((len(mesh.vertices), 3), np.float32)
    mesh.vertices.foreach_get("co", points.ravel())
    boundary = cones.boundary_vertices(mesh)
    found = cones.read(ob, mesh, boundary)
    attribute = mesh.attributes.get(fields.NAME)
    known = attribute is not None and (attribute.domain, attribute.data_type) == (
        "FACE",
        "FLOAT_VECTOR",
    )
    count = len(mesh.polygons) if known else 0
    centre, normal, direction = (np.zeros((count, 3), np.float32) for _ in range(3))
    area = np.zeros(count, np.float32)
    if known:
        mesh.polygons.foreach_get("center", centre.ravel())
        mesh.polygons.foreach_get("normal", normal.ravel())
        mesh.polygons.foreach_get("area", area)
        attribute.data.foreach_get("vector", direction.ravel())
    return _Read(
        centre,
        normal,
        direction,
        area,
        points[list(found)].reshape(-1, 3),
        _signs(found, boundary),
        _size(points),
    )


def _edited(ob) -> _Read:
    bm = bmesh.from_edit_mesh(ob.data)
    layer = bm.faces.layers.float_vector.get(fields.NAME)
    faces = list(bm.faces) if layer is not None and len(bm.faces) <= _MOST_EDITED else []
    turns, groups = [], cones.groups(ob)
    deform = bm.verts.layers.deform.active
    angle = bm.verts.layers.float.get(cones.ATTRIBUTE)
    places = []
    for vertex in bm.verts:
        flat = math.pi if vertex.is_boundary else 2 * math.pi
        bends = 0.0
        if deform is not None:
            bends = sum(float(t) for i, t in groups.items() if vertex[deform].get(i, 0.0) > 0.0)
        if angle is not None and vertex[angle] > 0.0:
            bends = flat - vertex[angle]
        if bends:
            turns.append(bends)
            places.append(tuple(vertex.co))

    def vectors(values):
        return np.array(values, np.float32).reshape(-1, 3)

    return _Read(
        vectors([f.calc_center_median() for f in faces]),
        vectors([f.normal for f in faces]),
        vectors([f[layer] for f in faces]),
        np.array([f.calc_area() for f in faces], np.float32),
        vectors(places),
        np.array(turns),
        _size(vectors([v.co for v in bm.verts])),
    )


def _crosses(read: _Read) -> np.ndarray:
    """Two thin rectangles on each face that has a direction."""
    along = (
        read.direction - read.normal * np.einsum("ij,ij->i", read.direction, read.normal)[:, None]
    )
    length = np.linalg.norm(along, axis=1)
    good = (length > 1e-6) & np.isfinite(length) & (read.area > 0)
    x = along[good] / length[good, None]
    y = np.cross(read.normal[good], x)
    unit = np.sqrt(read.area[good])[:, None]
    middle = read.centre[good] + _LIFT * unit * read.normal[good]
    parts = []
    for a, b in ((x, y), (y, x)):
        arm, side = _ARM * unit * a, _WIDTH * unit * b
        p, q, r, s = (
            middle - arm - side,
            middle + arm - side,
            middle + arm + side,
            middle - arm + side,
        )
        parts += [p, q, r, p, r, s]
    return np.stack(parts, axis=1).reshape(-1, 3).astype(np.float32)


def _octahedra(places: np.ndarray, radius: float) -> np.ndarray:
    tips = radius * np.concatenate([np.eye(3), -np.eye(3)])
    corners = [(a, b, c) for a in (0, 3) for b in (1, 4) for c in (2, 5)]
    one = tips[np.array(corners).ravel()]
    return (places[:, None, :] + one).reshape(-1, 3).astype(np.float32)


def _key(ob) -> tuple:
    return ob.name, ob.mode, getattr(ob.data, "session_uid", ob.data.as_pointer())


def _draw() -> None:
    context = bpy.context
    shader = gpu.shader.from_builtin("UNIFORM_COLOR")
    gpu.state.depth_test_set("LESS_EQUAL")
    gpu.state.depth_mask_set(True)
    alive = {}
    for ob in {*context.view_layer.objects.selected, context.view_layer.objects.active} - {None}:
        if ob.type != "MESH" or not ob.visible_get():
            continue
        key = _key(ob)
        batches = _state["batches"].get(key)
        if batches is None:
            shapes = shapes_of(ob)
            batches = [
                (colour, batch_for_shader(shader, "TRIS", {"pos": points}))
                for colour, points in (
                    (FIELD_COLOUR, shapes.field),
                    (CORNER_COLOUR, shapes.corners),
                    (SADDLE_COLOUR, shapes.saddles),
                )
                if len(points)
            ]
        alive[key] = batches
        with gpu.matrix.push_pop():
            gpu.matrix.multiply_matrix(ob.matrix_world)
            for colour, batch in batches:
                shader.uniform_float("color", colour)
                batch.draw(shader)
    _state["batches"] = alive
    gpu.state.depth_mask_set(False)
    gpu.state.depth_test_set("NONE")


@handlers.persistent
def _forget(*_arguments) -> None:
    _state["batches"] = {}


@handlers.persistent
def _forget_changed(_scene, depsgraph) -> None:
    if any(update.is_updated_geometry for update in depsgraph.updates):
        _forget()


_HANDLERS = (
    ("depsgraph_update_post", _forget_changed),
    ("undo_post", _forget),
    ("redo_post", _forget),
    ("load_post", _forget),
)


def is_on() -> bool:
    return _state["handle"] is not None


def switch(on: bool) -> None:
    """Starts or ends drawing in all 3D viewports."""
    if on == is_on():
        return
    if on:
        _state["handle"] = bpy.types.SpaceView3D.draw_handler_add(_draw, (), "WINDOW", "POST_VIEW")
        for name, function in _HANDLERS:
            getattr(handlers, name).append(function)
    else:
        bpy.types.SpaceView3D.draw_handler_remove(_state["handle"], "WINDOW")
        _state["handle"] = None
        for name, function in _HANDLERS:
            getattr(handlers, name).remove(function)
    _forget()
    for window in bpy.context.window_manager.windows:
        for area in window.screen.areas:
            if area.type == "VIEW_3D":
                area.tag_redraw()


def label() -> str:
    return "Hide Field and Cones" if is_on() else "Show Field and Cones"


class VIEW3D_OT_flipfree_show_field(bpy.types.Operator):
    bl_idname = "view3d.flipfree_show_field"
    bl_label = "Show Field and Cones"
    bl_description = "Draw the field and the cones of the selected objects over them in 3D viewports, or stop drawing them"
    bl_options = {"REGISTER"}

    def execute(self, context):
        if bpy.app.background:
            self.report({"ERROR"}, "Without a window there is nothing to draw in")
            return {"CANCELLED"}
        switch(not is_on())
        if is_on() and not any(_has_something(ob) for ob in context.selected_objects):
            self.report(
                {"WARNING"},
                "Nothing to draw yet: Field-Aligned Seamless Map stores a field and marks its cones, Mark Cone marks cones",
            )
        return {"FINISHED"}


def _has_something(ob) -> bool:
    return ob.type == "MESH" and (fields.NAME in ob.data.attributes or bool(cones.groups(ob)))


CLASSES = (VIEW3D_OT_flipfree_show_field,)


def unregister() -> None:
    switch(False)
