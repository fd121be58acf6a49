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
        triangle_loops=clean.corners(snapshot.triangle_loops),
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
    arrays, of_corners = clean.carried(result)
    left_uv = _uv_of_collapsed(snapshot, arrays.pop("numbers")[result.faces], result)
    combined = islands.Combined(
        **arrays, uv=of_corners(result.uv, left_uv), stored=of_corners(result.uv32(), left_uv)
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
