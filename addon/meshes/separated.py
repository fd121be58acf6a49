# SPDX-License-Identifier: GPL-3.0-or-later
"""Snapshots as clean surfaces, for the solvers that want one, and their results as maps of the mesh that there is.

    Snapshot --separated--> Snapshot with copies of vertices, faces turned --solver--> Combined --on_whole--> of the first one

The copies have the ids of the mesh's own vertices, so that pins, cones and seams are found at each of them.
"""

from dataclasses import replace

import numpy as np

import flipfree

from . import islands, mesh_io


def separated(snapshot: mesh_io.Snapshot) -> mesh_io.Snapshot:
    """The snapshot itself if it is a clean surface, else one whose `whole` it is. Raises MeshProblem without a face to map."""
    try:
        clean = flipfree.separate(
            snapshot.vertices,
            snapshot.triangles,
            seams=snapshot.cuts,
            materials=snapshot.materials,
            polygons=snapshot.triangle_face,
        )
    except flipfree.InvalidInput as error:
        raise mesh_io.MeshProblem(f"{snapshot.object_name}: {error}") from error
    if not clean.mends:
        return snapshot
    at = clean.face_origin
    return replace(
        snapshot,
        vertices=clean.vertices,
        triangles=clean.faces,
        cuts=clean.edges(snapshot.cuts),
        vertex_ids=snapshot.vertex_ids[clean.vertex_origin],
        triangle_loops=_turned(snapshot.triangle_loops[at], clean.turned),
        triangle_face=snapshot.triangle_face[at],
        materials=snapshot.materials[at],
        inner_sides=np.where(
            clean.turned[:, None], snapshot.inner_sides[at][:, ::-1], snapshot.inner_sides[at]
        ),
        whole=snapshot,
        clean=clean,
    )


def on_whole(snapshot: mesh_io.Snapshot, result) -> tuple[mesh_io.Snapshot, object]:
    """A map of the snapshot (islands.Combined) as one of what it was separated from; both as they are if it was not."""
    whole, clean = snapshot.whole, snapshot.clean
    if whole is None:
        return snapshot, result
    old, given = len(snapshot.vertices), len(whole.vertices)
    number = np.append(clean.vertex_origin, given + np.arange(len(result.vertices) - old))
    swapped = clean.turned[result.parent_face]
    left_out = clean.collapsed
    left_uv = _uv_of_collapsed(snapshot, number[result.faces], result)
    parent = np.concatenate([clean.face_origin[result.parent_face], left_out])
    order = np.argsort(parent, kind="stable")
    new_parent = result.vertex_parent[old:]
    weights = _turned(result.vertex_barycentric[old:], clean.turned[new_parent])
    new_parent = clean.face_origin[new_parent]

    def of_corners(values, others):
        return np.concatenate([_turned(values, swapped), others])[order]

    combined = islands.Combined(
        vertices=np.concatenate(
            [
                whole.vertices,
                np.einsum("vk,vkd->vd", weights, whole.vertices[whole.triangles[new_parent]]),
            ]
        ),
        faces=of_corners(number[result.faces], whole.triangles[left_out]).astype(np.int32),
        parent_face=parent[order],
        vertex_parent=np.concatenate([np.full(given, -1), new_parent]),
        vertex_barycentric=np.concatenate([np.zeros((given, 3)), weights]),
        cut_edges=number[result.cut_edges].astype(np.int32),
        uv=of_corners(result.uv, left_uv.astype(np.float64)),
        stored=of_corners(result.uv32(), left_uv),
    )
    islands.close_seams(whole, combined)
    return whole, combined


def _uv_of_collapsed(snapshot, faces: np.ndarray, result) -> np.ndarray:
    """(k, 3, 2) float32 at the corners of triangles that use a vertex twice: what their face has at this vertex, or else at
    another one."""
    whole, left_out = snapshot.whole, snapshot.clean.collapsed
    left_uv = whole.corner_uv[left_out].copy()
    if not len(left_out):
        return left_uv
    face_of = snapshot.triangle_face[result.parent_face]
    beside = np.flatnonzero(np.isin(face_of, whole.triangle_face[left_out]))
    stored = result.uv32()
    known: dict = {}
    for child in beside.tolist():
        for corner in range(3):
            place = stored[child, corner]
            known.setdefault((face_of[child], None), place)
            known.setdefault((face_of[child], int(faces[child, corner])), place)
    for row, triangle in enumerate(left_out.tolist()):
        face = whole.triangle_face[triangle]
        for corner, vertex in enumerate(whole.triangles[triangle].tolist()):
            place = known.get((face, vertex), known.get((face, None)))
            if place is not None:
                left_uv[row, corner] = place
    return left_uv


def _turned(values: np.ndarray, turned: np.ndarray) -> np.ndarray:
    """(m, 3, ...) with the second and third of each of these rows in the other order."""
    result = values.copy()
    result[turned, 1], result[turned, 2] = values[turned, 2], values[turned, 1]
    return result
