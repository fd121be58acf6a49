# SPDX-License-Identifier: GPL-3.0-or-later
"""The one place that knows how Blender's versions differ. Each function here has a test in tests/blender/.

Seen in 4.3.2 and 5.2.2. Everything takes a mesh outside edit mode (or a copy of one, see mesh_io.read), because
attribute arrays are empty while a mesh is being edited.
"""

import bpy
import numpy as np

# A mesh can have this many UV maps; `uv_layers.new` returns None beyond it.
MAX_UV_LAYERS = 8


def unwrap_menu() -> type:
    """The menu that holds the unwrap methods. From 4.3 on the 3D viewport's UV menu draws the same one; appending
    to both would show every entry twice."""
    return bpy.types.IMAGE_MT_uvs_unwrap


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


def pinned_loops(mesh: bpy.types.Mesh, layer_name: str) -> np.ndarray:
    """(#loops,) bool. `uv_layer.pin` does not exist before `pin_ensure()` in 5.2; the attribute is there in both."""
    values = _bool_attribute(mesh, f".pn.{layer_name}", len(mesh.loops))
    return np.zeros(len(mesh.loops), dtype=bool) if values is None else values


def set_pinned_loops(mesh: bpy.types.Mesh, layer_name: str, mask: np.ndarray) -> None:
    """Writes pins through the attribute: 4.3.2 leaves random pins behind when they are written through
    `layer.data`. References to the mesh's layers are stale afterwards."""
    name = f".pn.{layer_name}"
    if mesh.attributes.get(name) is None:
        mesh.attributes.new(name, "BOOLEAN", "CORNER")
    mesh.attributes[name].data.foreach_set("value", np.ascontiguousarray(mask, dtype=bool))


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
    starts = np.empty(faces, dtype=np.int32)
    mesh.polygons.foreach_get("loop_start", starts)
    return np.logical_and.reduceat(corners, starts) if faces else np.zeros(0, dtype=bool)


def seam_edges(mesh: bpy.types.Mesh) -> np.ndarray:
    """(#edges,) bool. The attribute's name differs (`.uv_seam`, `uv_seam`); the property does not."""
    values = np.empty(len(mesh.edges), dtype=bool)
    mesh.edges.foreach_get("use_seam", values)
    return values


def set_seam_edges(mesh: bpy.types.Mesh, mask: np.ndarray) -> None:
    mesh.edges.foreach_set("use_seam", np.ascontiguousarray(mask, dtype=bool))
