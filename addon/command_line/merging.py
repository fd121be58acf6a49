# SPDX-License-Identifier: GPL-3.0-or-later
"""Vertices that formats for the graphics card have once for each normal and texture coordinate become one again.

UVs, colours and normals are kept: they belong to corners of faces.
"""

import bmesh
import numpy as np

from flipfree.batch.models.model import welded_along

from .. import compat
from ..meshes import normals


def merge_split_vertices(mesh) -> int:
    """Joins edges that were one (flipfree.batch.models.model); returns how many vertices went."""
    if not len(mesh.polygons):
        return 0
    corners = compat.corner_vertices(mesh)
    totals = compat.values(mesh.polygons, "loop_total", np.int32)
    polygon = np.repeat(np.arange(len(totals)), totals)
    positions = compat.positions(mesh).astype(np.float64)
    same = welded_along(positions, corners, corners[compat.following(mesh)], polygon)
    moved = np.flatnonzero(same != np.arange(len(same)))
    if not len(moved):
        return 0
    has_normals = mesh.has_custom_normals
    if has_normals:
        values = compat.values(mesh.corner_normals, "vector", np.float32, 3)
        stored = mesh.attributes.new(normals.LAYER, "FLOAT_VECTOR", "CORNER")
        stored.data.foreach_set("vector", values.ravel())
    work = bmesh.new()
    try:
        work.from_mesh(mesh)
        work.verts.ensure_lookup_table()
        targets = {work.verts[v]: work.verts[same[v]] for v in moved.tolist()}
        bmesh.ops.weld_verts(work, targetmap=targets)
        work.to_mesh(mesh)
    finally:
        work.free()
    mesh.update()
    if has_normals:
        normals.give(mesh)
    return len(moved)
