# SPDX-License-Identifier: GPL-3.0-or-later
"""Vertices that formats for the graphics card have once for each normal and texture coordinate become one again.

UVs, colours and normals are kept: they belong to corners of faces.
"""

import bmesh
import numpy as np

from flipfree.batch.models.model import welded_along

from .. import compat

_NORMALS = "flipfree_normals"


def merge_split_vertices(mesh) -> int:
    """Joins edges that were one (flipfree.batch.models.model); returns how many vertices went."""
    if not len(mesh.polygons):
        return 0
    corners = compat.corner_vertices(mesh)
    last = np.cumsum(_loop_totals(mesh)) - 1
    following = np.arange(1, len(corners) + 1)
    following[last] = last - _loop_totals(mesh) + 1
    polygon = np.repeat(np.arange(len(last)), _loop_totals(mesh))
    positions = compat.positions(mesh).astype(np.float64)
    same = welded_along(positions, corners, corners[following], polygon)
    moved = np.flatnonzero(same != np.arange(len(same)))
    if not len(moved):
        return 0
    has_normals = mesh.has_custom_normals
    if has_normals:
        values = np.empty(3 * len(corners), np.float32)
        mesh.corner_normals.foreach_get("vector", values)
        mesh.attributes.new(_NORMALS, "FLOAT_VECTOR", "CORNER").data.foreach_set("vector", values)
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
        _put_normals_back(mesh)
    return len(moved)


def _loop_totals(mesh) -> np.ndarray:
    totals = np.empty(len(mesh.polygons), np.int32)
    mesh.polygons.foreach_get("loop_total", totals)
    return totals


def _put_normals_back(mesh) -> None:
    attribute = mesh.attributes[_NORMALS]
    values = np.empty(3 * len(mesh.loops), np.float32)
    attribute.data.foreach_get("vector", values)
    mesh.attributes.remove(mesh.attributes[_NORMALS])
    mesh.normals_split_custom_set(values.reshape(-1, 3).tolist())
