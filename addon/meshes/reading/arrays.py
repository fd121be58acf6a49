# SPDX-License-Identifier: GPL-3.0-or-later
"""A mesh as arrays, taken at once: what is made of them may wait, and the mesh may change meanwhile."""

from dataclasses import dataclass

import bpy
import numpy as np

from ... import compat
from .. import labels

# Of large arrays, at once: what is made on the way stays in memory that the process has. New memory costs more than what is
# done in it.
_ROWS = 1 << 16


@dataclass
class Taken:
    name: str  # of the object
    layer_name: str  # "" if the mesh has no UV map
    counts: tuple  # of vertices, edges, loops, faces
    positions: np.ndarray  # (#vertices, 3) float32
    unmodified: np.ndarray | None  # the mesh's own positions, if these are others
    loops: np.ndarray  # (t, 3) of Blender's triangles
    faces: np.ndarray  # (t,) the face of each
    corner_vertices: np.ndarray  # (#loops,)
    face_loops: np.ndarray  # (#faces, 2): the first and the last loop of each
    edges: np.ndarray  # (#edges, 2)
    seams: np.ndarray  # (#edges,) bool
    materials: np.ndarray  # (#faces,)
    uv: np.ndarray  # (#loops, 2) float32, zeros without a UV map
    pinned: np.ndarray  # (#loops,) bool
    chosen: np.ndarray | None  # (#faces,) bool: what is worked on, None for all


def counts(mesh: bpy.types.Mesh) -> tuple:
    return len(mesh.vertices), len(mesh.edges), len(mesh.loops), len(mesh.polygons)


def take(name: str, mesh: bpy.types.Mesh, chosen=None, shape=None) -> Taken:
    """Of a mesh that is not in edit mode. shape: (#vertices, 3), other positions than its own."""
    active = mesh.uv_layers.active
    layer_name = active.name if active else ""
    mesh.calc_loop_triangles()
    loops = compat.values(mesh.loop_triangles, "loops", np.int32, 3)
    starts = compat.face_starts(mesh)
    ends = np.append(starts[1:], len(mesh.loops)) - 1
    return Taken(
        name=name,
        layer_name=layer_name,
        counts=counts(mesh),
        positions=compat.positions(mesh) if shape is None else shape,
        unmodified=None if shape is None else compat.positions(mesh),
        loops=loops,
        faces=compat.triangle_faces(mesh),
        corner_vertices=compat.corner_vertices(mesh),
        face_loops=np.column_stack([starts, ends]),
        edges=compat.edge_vertices(mesh),
        seams=compat.seam_edges(mesh),
        materials=compat.face_materials(mesh),
        uv=compat.uv_values(mesh, layer_name),
        pinned=compat.pinned_loops(mesh, layer_name),
        chosen=chosen,
    )


def inner_sides(taken: Taken) -> np.ndarray:
    """(t, 3) bool: sides that are diagonals of their face. A face's loops follow each other."""
    loops, faces = taken.loops, taken.faces
    if len(loops) == len(taken.face_loops):
        return np.zeros(loops.shape, bool)  # triangles only
    inner = np.empty(loops.shape, bool)
    for begin in range(0, len(loops), _ROWS):
        rows = slice(begin, begin + _ROWS)
        at = loops[rows]
        first, last = (taken.face_loops[faces[rows], k][:, None] for k in range(2))
        following = np.where(at == last, first, at + 1)
        inner[rows] = following != np.roll(at, -1, axis=1)
    return inner


def cuts(corners: np.ndarray, triangles: np.ndarray, seam_vertices: np.ndarray) -> np.ndarray:
    """Seams inside the submesh as (s, 2) submesh vertex pairs."""
    if not len(seam_vertices):
        return np.zeros((0, 2), np.int32)
    near = np.zeros(max(int(corners.max()), int(seam_vertices.max())) + 1, bool)
    near[seam_vertices] = True
    flags = near[corners]
    rows, sides = np.nonzero(flags & np.roll(flags, -1, axis=1))
    following = (sides + 1) % 3
    in_mesh = np.column_stack([corners[rows, sides], corners[rows, following]])
    in_submesh = np.column_stack([triangles[rows, sides], triangles[rows, following]])
    on_seam = labels.members(labels.edge_keys(in_mesh), labels.edge_keys(seam_vertices))
    pairs = np.sort(in_submesh[on_seam], axis=1)
    return np.unique(pairs, axis=0).astype(np.int32)


def not_finite(positions: np.ndarray, corners: np.ndarray) -> np.ndarray:
    """Vertices of these corners with a coordinate that is no number."""
    finite = np.isfinite(positions).all(axis=1)
    if finite.all():
        return np.zeros(0, np.int64)
    used = np.zeros(len(positions), bool)
    used[corners] = True
    return np.flatnonzero(used & ~finite)
