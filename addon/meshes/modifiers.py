# SPDX-License-Identifier: GPL-3.0-or-later
"""Where the vertices of a mesh are once its modifiers and shape keys have moved them, as the viewport shows it."""

import bpy
import numpy as np

from .. import compat

# Those that leave faces as they are; a test compares with what they do.
KEEP_FACES = {
    *("ARMATURE", "CAST", "CLOTH", "COLLISION", "CORRECTIVE_SMOOTH", "CURVE", "DATA_TRANSFER"),
    *("DISPLACE", "HOOK", "LAPLACIANDEFORM", "LAPLACIANSMOOTH", "LATTICE", "MESH_CACHE"),
    *("MESH_DEFORM", "MESH_SEQUENCE_CACHE", "NORMAL_EDIT", "SHRINKWRAP", "SIMPLE_DEFORM"),
    *("SMOOTH", "SOFT_BODY", "SURFACE", "SURFACE_DEFORM", "UV_PROJECT", "UV_WARP"),
    *("VERTEX_WEIGHT_EDIT", "VERTEX_WEIGHT_MIX", "VERTEX_WEIGHT_PROXIMITY", "WARP", "WAVE"),
    "WEIGHTED_NORMAL",
}


def positions(ob: bpy.types.Object, mesh: bpy.types.Mesh) -> np.ndarray | str:
    """(#vertices, 3) float32; or why there are none: the faces are no longer those of the mesh.

    mesh: that of the object as it is outside Edit Mode, or a copy of it.
    """
    evaluated = ob.evaluated_get(bpy.context.evaluated_depsgraph_get())
    shaped = evaluated.to_mesh()
    try:
        if shaped is not None and _same_faces(mesh, shaped):
            return compat.positions(shaped)
        made = 0 if shaped is None else len(shaped.polygons)
    finally:
        evaluated.to_mesh_clear()
    at_fault = ", ".join(m.name for m in shown(ob) if m.type not in KEEP_FACES)
    return (
        f"{ob.name}: its modifiers make other faces ({len(mesh.polygons)} became {made}"
        f"{': ' + at_fault if at_fault else ''}), and UVs are those of the mesh's own. Hide such modifiers in the viewport or "
        "apply them, or turn off Use Modifiers in the redo panel"
    )


def shown(ob: bpy.types.Object) -> list[bpy.types.Modifier]:
    """Those that the viewport has."""
    editing = ob.mode == "EDIT"
    return [m for m in ob.modifiers if m.show_viewport and (m.show_in_editmode or not editing)]


def _same_faces(mesh: bpy.types.Mesh, shaped: bpy.types.Mesh) -> bool:
    def sizes(of):
        return len(of.vertices), len(of.edges), len(of.loops), len(of.polygons)

    return sizes(mesh) == sizes(shaped) and all(
        np.array_equal(read(mesh), read(shaped))
        for read in (compat.corner_vertices, compat.edge_vertices, compat.face_starts)
    )
