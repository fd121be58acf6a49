# SPDX-License-Identifier: GPL-3.0-or-later
"""Tasks that hand parts of an object to the solver one by one, and write one map of all."""

from dataclasses import replace

import numpy as np

from .. import modal, solver
from ..meshes import mesh_io, refine, separated
from . import common


class PartsTask(modal.StagedTask):
    """Subclasses' `stages` set `solving` before each job and `result` (islands.Combined) at the end."""

    flattens = True
    mark_cuts = True  # edges along which the result is cut become seams

    def __init__(self, snapshot):
        super().__init__(snapshot)
        self.result = None
        self.certificates = []
        self.judged = []
        self.island_overlaps = 0
        self.new_vertices = 0
        # (submesh vertices, triangles) of the part that the solver has, or None: its ids are the snapshot's.
        self.solving = None

    def checked(self, result):
        """The result of a part, its certificate kept for the report."""
        common.refuse_uncertified(self.snapshot, result.certificate)
        _, triangles = self.solving
        faces = self.snapshot.triangle_face[triangles[result.parent_face]]
        self.judge(result.certificate, faces)
        return result

    def judge(self, certificate, faces):
        """Keeps a certificate for the report; the first one lists what the whole mesh was separated for."""
        if self.snapshot.clean is not None and not self.judged:
            certificate = replace(certificate, mends=self.snapshot.clean.mends)
        self.certificates.append(certificate)
        self.judged.append(common.Judged(certificate, faces))

    def surface(self):
        """(vertices, triangles) of the map."""
        return self.result.vertices, self.result.faces

    def in_snapshot(self, kind, ids):
        """Ids of the surface as those of the snapshot, which has no new vertices."""
        if kind == "face":
            ids = self.result.parent_face[ids]
        elif kind == "corner":
            kind, ids = "face", self.result.parent_face[ids // 3]
        elif (ids >= len(self.snapshot.vertices)).any():
            return "none", []
        return kind, ids.tolist()

    def stored_map(self):
        return *self.surface(), self.result.uv32()

    def look_at_islands(self):
        """Last stage: counts the islands that lie on each other in the map as it will be stored."""
        result = self.result
        certificate = yield solver.certify_arrays(
            result.vertices, result.faces, result.uv32(), bijective=False
        )
        self.island_overlaps = max(certificate.island_overlaps, 0)

    def explain(self, error):
        """The solver's ids are those of a part: to the snapshot's. Where it names none: the whole part."""
        if self.solving is None:
            return
        submesh, triangles = self.solving
        error.vertices = submesh
        ids = np.asarray(error.elements, dtype=np.int64).ravel()
        if error.kind in ("vertex", "edge") and len(ids):
            error.elements = submesh[ids[ids < len(submesh)]].tolist()
        elif error.kind in ("face", "corner") and len(ids):
            faces = ids // 3 if error.kind == "corner" else ids
            error.kind, error.elements = "face", triangles[faces[faces < len(triangles)]].tolist()
        elif len(triangles) < len(self.snapshot.triangles):
            error.kind, error.elements = "face", triangles.tolist()

    def writing(self, ob):
        snapshot, result = separated.on_whole(self.snapshot, self.result)
        if refine.needs_new_faces(snapshot, result):
            self.new_vertices = refine.write(ob, snapshot, result, mark_cuts=self.mark_cuts)
            return
        loops, values = mesh_io.loop_values(snapshot, result.uv32())
        seams = mesh_io.edge_ids(snapshot, result.cut_edges) if self.mark_cuts else None
        yield
        yield from mesh_io.writing_uv(ob, snapshot, loops, values, seams)


def added(tasks: list[PartsTask]) -> str:
    """How many vertices the tasks added, in words."""
    count = sum(task.new_vertices for task in tasks)
    return f"{common.plural(count, 'vertex', 'vertices')} added"
