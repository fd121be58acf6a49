# SPDX-License-Identifier: GPL-3.0-or-later
"""Seams of a mesh: marked, and nothing else changed."""

import bmesh
import numpy as np

from .. import compat
from . import mesh_io


def mark(ob, snapshot: mesh_io.Snapshot, seams: np.ndarray, *, cleared: np.ndarray) -> None:
    """Marks edges (ids) as seams, after `cleared` ones are none any more. Raises MeshProblem, with nothing changed, if the
    mesh is no longer the one that was read."""
    mesh = ob.data
    if mesh_io.counts(ob) != snapshot.counts:
        raise mesh_io.MeshProblem(
            f"{ob.name}: the mesh was changed while its seams were looked for. Run the operator again"
        )
    if ob.mode == "EDIT":
        bm = bmesh.from_edit_mesh(mesh)
        bm.edges.ensure_lookup_table()
        for edges, value in ((cleared, False), (seams, True)):
            for edge in edges.tolist():
                bm.edges[edge].seam = value
        bmesh.update_edit_mesh(mesh, loop_triangles=False, destructive=False)
        return
    marked = compat.seam_edges(mesh)
    marked[cleared] = False
    marked[seams] = True
    compat.set_seam_edges(mesh, marked)
    mesh.update()
