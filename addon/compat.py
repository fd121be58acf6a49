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


def values(sequence, name: str, dtype, *shape: int) -> np.ndarray:
    """(#elements, *shape) of a property that all elements of a collection have."""
    found = np.empty((len(sequence), *shape), dtype)
    sequence.foreach_get(name, found.ravel())
    return found


#: Types of attributes whose values can be mixed -> their property, and the shape of a value.
SUMS = {
    "FLOAT": ("value", np.float32),
    "FLOAT2": ("vector", np.float32, 2),
    "FLOAT_VECTOR": ("vector", np.float32, 3),
    "FLOAT_COLOR": ("color", np.float32, 4),
    "BYTE_COLOR": ("color", np.float32, 4),
}
#: Those whose values are names for something, which have no mean.
NAMES = {
    "INT": ("value", np.int32),
    "INT8": ("value", np.int8),
    "BOOLEAN": ("value", bool),
    "INT32_2D": ("value", np.int32, 2),
    "QUATERNION": ("value", np.float32, 4),
}
TYPES = SUMS | NAMES


def rows(data, kind: str) -> np.ndarray:
    """(#elements, width) of an attribute's data, of one of TYPES."""
    return values(data, *TYPES[kind]).reshape(len(data), *(TYPES[kind][2:] or (1,)))


def attribute(mesh: bpy.types.Mesh, name: str, domain: str, kind: str) -> np.ndarray | None:
    """The values of an attribute, None unless there is one of this domain and type."""
    found = mesh.attributes.get(name)
    if found is None or (found.domain, found.data_type) != (domain, kind):
        return None
    return values(found.data, *TYPES[kind])


def made_attribute(mesh: bpy.types.Mesh, name: str, domain: str, kind: str) -> bpy.types.Attribute:
    """Of this domain and type, in place of another one of that name."""
    found = mesh.attributes.get(name)
    if found is not None and (found.domain, found.data_type) != (domain, kind):
        mesh.attributes.remove(found)
        found = None
    return found or mesh.attributes.new(name, kind, domain)


def face_materials(mesh: bpy.types.Mesh) -> np.ndarray:
    """(#faces,) int32: the material slot of each."""
    if "material_index" not in mesh.attributes:  # all have the first
        return np.zeros(len(mesh.polygons), np.int32)
    return _values(mesh, "material_index", "value", np.int32)


def uv_values(mesh: bpy.types.Mesh, layer_name: str) -> np.ndarray:
    """(#loops, 2) float32, zeros for "". `layer.data` has the same values fifty times slower."""
    if not layer_name:
        return np.zeros((len(mesh.loops), 2), np.float32)
    return values(mesh.uv_layers[layer_name].uv, "vector", np.float32, 2)


def set_uv_values(mesh: bpy.types.Mesh, layer_name: str, values: np.ndarray) -> None:
    """Writes through the attribute: in 4.3.2 `layer.uv` writes into arrays that the mesh shares with its copies and with
    undo steps, so that undo would not bring the old UVs back."""
    values = np.ascontiguousarray(values, dtype=np.float32)
    mesh.attributes[layer_name].data.foreach_set("vector", values.ravel())


def _values(mesh: bpy.types.Mesh, attribute: str, key: str, dtype, *shape: int) -> np.ndarray:
    """All values of one of Blender's own attributes: a hundred times faster than the property that shows the same."""
    return values(mesh.attributes[attribute].data, key, dtype, *shape)


def positions(mesh: bpy.types.Mesh) -> np.ndarray:
    """(#vertices, 3) float32."""
    return _values(mesh, "position", "vector", np.float32, 3)


def corner_vertices(mesh: bpy.types.Mesh) -> np.ndarray:
    """(#loops,) int32: the vertex of each."""
    return _values(mesh, ".corner_vert", "value", np.int32)


def corner_edges(mesh: bpy.types.Mesh) -> np.ndarray:
    """(#loops,) int32: the edge from each to the next of its face."""
    return _values(mesh, ".corner_edge", "value", np.int32)


def edge_vertices(mesh: bpy.types.Mesh) -> np.ndarray:
    """(#edges, 2) int32. A mesh without edges has no attribute for them."""
    if len(mesh.edges) == 0:
        return np.zeros((0, 2), np.int32)
    return _values(mesh, ".edge_verts", "value", np.int32, 2)


def face_starts(mesh: bpy.types.Mesh) -> np.ndarray:
    """(#faces,) int32: the first loop of each."""
    return values(mesh.polygons, "loop_start", np.int32)


def following(mesh: bpy.types.Mesh) -> np.ndarray:
    """(#loops,) the next loop of each one's face; faces have theirs one after the other."""
    first = face_starts(mesh)
    found = np.arange(1, len(mesh.loops) + 1)
    found[np.append(first[1:], len(found))[: len(first)] - 1] = first
    return found


def triangle_faces(mesh: bpy.types.Mesh) -> np.ndarray:
    """(#loop triangles,) int32: the face of each, after calc_loop_triangles()."""
    return values(mesh.loop_triangle_polygons, "value", np.int32)


def pinned_loops(mesh: bpy.types.Mesh, layer_name: str) -> np.ndarray:
    """(#loops,) bool. `uv_layer.pin` does not exist before `pin_ensure()` in 5.2; the attribute is there in both."""
    pinned = attribute(mesh, f".pn.{layer_name}", "CORNER", "BOOLEAN")
    return np.zeros(len(mesh.loops), dtype=bool) if pinned is None else pinned


def uv_selected_faces(mesh: bpy.types.Mesh, layer_name: str) -> np.ndarray:
    """(#faces,) bool: faces selected in the UV editor when it does not follow the mesh selection.

    Up to 4.x the selection is kept per layer and corner (`.vs.NAME`), from 5.0 on once per mesh with its own
    face flag (`.uv_select_face`). Where neither exists nothing was ever deselected.
    """
    faces = len(mesh.polygons)
    chosen = attribute(mesh, ".uv_select_face", "FACE", "BOOLEAN")
    if chosen is not None:
        return chosen
    corners = attribute(mesh, f".vs.{layer_name}", "CORNER", "BOOLEAN")
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
    return values(mesh.edges, "use_seam", bool)


def set_seam_edges(mesh: bpy.types.Mesh, mask: np.ndarray) -> None:
    mesh.edges.foreach_set("use_seam", np.ascontiguousarray(mask, dtype=bool))


def sharp_edges(mesh: bpy.types.Mesh) -> np.ndarray:
    """(#edges,) bool: marked as sharp. The attribute is there only if some edge is."""
    sharp = attribute(mesh, "sharp_edge", "EDGE", "BOOLEAN")
    return np.zeros(len(mesh.edges), dtype=bool) if sharp is None else sharp


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
