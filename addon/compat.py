# SPDX-License-Identifier: GPL-3.0-or-later
"""The one place that knows how Blender's versions differ. Each function here has a test in tests/blender/.

Seen in 4.3.2 and 5.2.2. Everything takes a mesh outside edit mode (or a copy of one, see mesh_io.read), because
attribute arrays are empty while a mesh is being edited.
"""

import bmesh
import bpy
import numpy as np


def use_nodes(material: bpy.types.Material) -> None:
    """From 5.0 on every material has nodes, and the switch is on its way out."""
    if bpy.app.version < (5, 0, 0):
        material.use_nodes = True


def face_materials(mesh: bpy.types.Mesh) -> np.ndarray:
    """(#faces,) int32: the material slot of each."""
    if "material_index" not in mesh.attributes:  # all have the first
        return np.zeros(len(mesh.polygons), np.int32)
    return _values(mesh, "material_index", "value", (len(mesh.polygons),), np.int32)


def uv_values(mesh: bpy.types.Mesh, layer_name: str) -> np.ndarray:
    """(#loops, 2) float32. `layer.data` has the same values fifty times slower."""
    values = np.empty((len(mesh.loops), 2), dtype=np.float32)
    mesh.uv_layers[layer_name].uv.foreach_get("vector", values.ravel())
    return values


def set_uv_values(mesh: bpy.types.Mesh, layer_name: str, values: np.ndarray) -> None:
    """Writes through the attribute: in 4.3.2 `layer.uv` writes into arrays that the mesh shares with its copies and with
    undo steps, so that undo would not bring the old UVs back."""
    values = np.ascontiguousarray(values, dtype=np.float32)
    mesh.attributes[layer_name].data.foreach_set("vector", values.ravel())


def _bool_attribute(mesh: bpy.types.Mesh, name: str, size: int) -> np.ndarray | None:
    attribute = mesh.attributes.get(name)
    if attribute is None or len(attribute.data) != size:
        return None
    values = np.empty(size, dtype=bool)
    attribute.data.foreach_get("value", values)
    return values


def _values(mesh: bpy.types.Mesh, attribute: str, key: str, shape: tuple, dtype) -> np.ndarray:
    """All values of one of Blender's own attributes: a hundred times faster than the property that shows the same."""
    values = np.empty(shape, dtype)
    mesh.attributes[attribute].data.foreach_get(key, values.ravel())
    return values


def positions(mesh: bpy.types.Mesh) -> np.ndarray:
    """(#vertices, 3) float32."""
    return _values(mesh, "position", "vector", (len(mesh.vertices), 3), np.float32)


def corner_vertices(mesh: bpy.types.Mesh) -> np.ndarray:
    """(#loops,) int32: the vertex of each."""
    return _values(mesh, ".corner_vert", "value", (len(mesh.loops),), np.int32)


def corner_edges(mesh: bpy.types.Mesh) -> np.ndarray:
    """(#loops,) int32: the edge from each to the next of its face."""
    return _values(mesh, ".corner_edge", "value", (len(mesh.loops),), np.int32)


def edge_vertices(mesh: bpy.types.Mesh) -> np.ndarray:
    """(#edges, 2) int32. A mesh without edges has no attribute for them."""
    if len(mesh.edges) == 0:
        return np.zeros((0, 2), np.int32)
    return _values(mesh, ".edge_verts", "value", (len(mesh.edges), 2), np.int32)


def face_starts(mesh: bpy.types.Mesh) -> np.ndarray:
    """(#faces,) int32: the first loop of each."""
    values = np.empty(len(mesh.polygons), np.int32)
    mesh.polygons.foreach_get("loop_start", values)
    return values


def triangle_faces(mesh: bpy.types.Mesh) -> np.ndarray:
    """(#loop triangles,) int32: the face of each, after calc_loop_triangles()."""
    values = np.empty(len(mesh.loop_triangles), np.int32)
    mesh.loop_triangle_polygons.foreach_get("value", values)
    return values


def pinned_loops(mesh: bpy.types.Mesh, layer_name: str) -> np.ndarray:
    """(#loops,) bool. `uv_layer.pin` does not exist before `pin_ensure()` in 5.2; the attribute is there in both."""
    values = _bool_attribute(mesh, f".pn.{layer_name}", len(mesh.loops))
    return np.zeros(len(mesh.loops), dtype=bool) if values is None else values


def uv_selected_faces(mesh: bpy.types.Mesh, layer_name: str) -> np.ndarray:
    """(#faces,) bool: faces selected in the UV editor when it does not follow the mesh selection.

    Up to 4.x the selection is kept per layer and corner (`.vs.NAME`), from 5.0 on once per mesh with its own
    face flag (`.uv_select_face`). Where neither exists nothing was ever deselected.
    """
    faces = len(mesh.polygons)
    values = _bool_attribute(mesh, ".uv_select_face", faces)
    if values is not None:
        return values
    corners = _bool_attribute(mesh, f".vs.{layer_name}", len(mesh.loops))
    if corners is None:
        return np.ones(faces, dtype=bool)
    return np.logical_and.reduceat(corners, face_starts(mesh)) if faces else np.zeros(0, dtype=bool)


def select_uv_faces(mesh: bpy.types.Mesh, faces: np.ndarray) -> None:
    """In Edit Mode: selects these faces and nothing else in UV editors that do not follow the mesh selection, and adds them
    to that, as such editors show selected faces only. Up to 4.x each layer's corners have flags, from 5.0 on bmesh has."""
    bm = bmesh.from_edit_mesh(mesh)
    chosen = set(faces.tolist())
    layer = bm.loops.layers.uv.verify()
    for face in bm.faces:
        on = face.index in chosen
        if on:
            face.hide_set(False)
            face.select_set(True)
        if hasattr(face, "uv_select"):
            face.uv_select = on
        for loop in face.loops:
            if hasattr(loop, "uv_select_vert"):
                loop.uv_select_vert = loop.uv_select_edge = on
            else:
                loop[layer].select = loop[layer].select_edge = on
    bm.select_flush_mode()
    bmesh.update_edit_mesh(mesh, loop_triangles=False, destructive=False)


def colour_icon(colour: str) -> str:
    """A square of "RED", "YELLOW" or "GREEN": its icon has another name from 4.4 on."""
    known = bpy.types.UILayout.bl_rna.functions["operator"].parameters["icon"].enum_items
    number = {"RED": 1, "YELLOW": 3, "GREEN": 4}[colour]
    names = (f"STRIP_COLOR_0{number}", f"SEQUENCE_COLOR_0{number}")
    return next((name for name in names if name in known), "INFO")


def seam_edges(mesh: bpy.types.Mesh) -> np.ndarray:
    """(#edges,) bool. The attribute's name differs (`.uv_seam`, `uv_seam`); the property does not."""
    values = np.empty(len(mesh.edges), dtype=bool)
    mesh.edges.foreach_get("use_seam", values)
    return values


def set_seam_edges(mesh: bpy.types.Mesh, mask: np.ndarray) -> None:
    mesh.edges.foreach_set("use_seam", np.ascontiguousarray(mask, dtype=bool))


def sharp_edges(mesh: bpy.types.Mesh) -> np.ndarray:
    """(#edges,) bool: marked as sharp. The attribute is there only if some edge is."""
    values = _bool_attribute(mesh, "sharp_edge", len(mesh.edges))
    return np.zeros(len(mesh.edges), dtype=bool) if values is None else values


def interpolate_loop(loop, face) -> None:
    """Gives a new corner inside `face` what that has there; its vertex stays as it is."""
    try:
        loop.copy_from_face_interp(face, False)
    except TypeError:  # 4.2 wants its arguments as one
        loop.copy_from_face_interp((face, False))


def repair_selection(mesh: bpy.types.Mesh) -> None:
    """5.0 can give a mesh made by a script a selection of edges that holds no truth values, and crashes on writing to it."""
    for name in (".select_vert", ".select_edge", ".select_poly"):
        attribute = mesh.attributes.get(name)
        if attribute is not None and attribute.data_type != "BOOLEAN":
            mesh.attributes.remove(attribute)
