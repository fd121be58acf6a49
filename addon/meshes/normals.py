# SPDX-License-Identifier: GPL-3.0-or-later
"""Custom normals of a mesh that gets new faces.

Blender stores them as angles against the surface around each corner, which are others once edges are added there. So they
are carried as vectors through the change, where they are interpolated like any attribute, and given to the new mesh as
custom normals.
"""

import bpy
import numpy as np

from .. import compat
from . import selection

LAYER = "flipfree_normals"


def take(ob: bpy.types.Object) -> np.ndarray | None:
    """(#loops, 3) float32 normals of the corners, in either mode; None if none were customised."""
    with selection.whole_mesh(ob) as mesh:
        if not mesh.has_custom_normals:
            return None
        values = compat.values(mesh.corner_normals, "vector", np.float32, 3)
    return values


def put_into(bm, normals: np.ndarray) -> None:
    """As a layer of corners; this makes references to elements stale."""
    layer = bm.loops.layers.float_vector.new(LAYER)
    row = iter(normals.tolist())
    for face in bm.faces:
        for loop in face.loops:
            loop[layer] = next(row)


def restore(ob: bpy.types.Object) -> None:
    """What `put_into` stored, as the mesh's custom normals; leaves Edit Mode for a moment."""
    with selection.in_object_mode(ob) as mesh:
        give(mesh)


def give(mesh: bpy.types.Mesh) -> None:
    """What the attribute LAYER of corners has, as custom normals; the attribute goes."""
    values = compat.attribute(mesh, LAYER, "CORNER", "FLOAT_VECTOR")
    mesh.attributes.remove(mesh.attributes[LAYER])
    length = np.linalg.norm(values, axis=1)
    values[length > 0] /= length[length > 0, None]
    mesh.normals_split_custom_set(values.tolist())
