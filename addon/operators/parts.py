# SPDX-License-Identifier: GPL-3.0-or-later
"""Tasks that hand parts of an object to the solver one by one, and write one map of all."""

from dataclasses import replace

import numpy as np

from .. import modal, solver
from ..meshes import islands, labels, mesh_io, refine, separated
from . import common

# Of a certificate, what depends on how the map is rounded.
AS_STORED = (
    *("triangles", "flips32", "overlaps", "energy", "max_energy", "energy_p99"),
    *("level", "stretched", "area", "poor_islands", "needles", "failed_faces"),
)


class PartsTask(modal.StagedTask):
    """Subclasses' `stages` set `solving` before each job and `result` (islands.Combined) at the end."""

    flattens = True
    mark_cuts = True  # edges along which the result is cut become seams
    judged = ()

    def __init__(self, snapshot, **options):
        super().__init__(snapshot, **options)
        self.result = None
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
        self.judged.append(modal.Judged(certificate, faces))

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

    def island_count(self) -> int:
        return labels.count_islands(self.result.faces, self.result.uv32())

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


class PackedTask(PartsTask):
    """Parts that are maps of their own shape and size: packed, if `packs`, or where their solvers put them. Subclasses have
    `pack_options`."""

    packs = True
    # Where no other object takes part; otherwise all are laid out together (layout.py).
    packs_alone = True
    keep_placement = False
    aspect = 1.0
    margin = 0.0
    pieces: tuple = ()

    def pins(self) -> dict:
        return {}

    def uv_on_texture(self) -> np.ndarray:
        return self.result.uv

    def put_together(self, pieces):
        """Last stages: the result of pieces (islands.Piece)."""
        self.solving = None
        self.pieces = pieces
        self.result = islands.combine(self.snapshot, pieces)
        if self.packs and not self.packs_alone:
            return
        if self.packs:
            packed = yield solver.pack(
                *self.surface(), self.result.uv, margin=self.margin, **self.pack_options
            )
            self.result.uv, self.result.stored = packed.uv, packed.uv32()
        yield from self._look_at_stored()
        yield from self.look_at_islands()

    def lay_out(self, uv, stored, stats, mirrored):
        """Stages that take a layout of all objects."""
        self.result.uv, self.result.stored = uv, stored
        yield from self._look_at_stored()
        yield from self.look_at_islands()

    def _look_at_stored(self):
        """The solver judged its own map in 64 bits; the report speaks of what will be stored, where overlaps may be others."""
        result = self.result
        for i, piece in enumerate(self.pieces):
            rows = np.isin(result.parent_face, piece.triangles)
            found = yield solver.certify_arrays(
                result.vertices, result.faces[rows], result.uv32()[rows], bijective=True
            )
            stored = {name: getattr(found, name) for name in AS_STORED}
            certificate = replace(self.judged[i].certificate, **stored)
            faces = self.snapshot.triangle_face[result.parent_face[rows]]
            self.judged[i] = modal.Judged(certificate, faces)


def added(tasks: list[PartsTask]) -> str:
    """How many vertices the tasks added, in words."""
    count = sum(task.new_vertices for task in tasks)
    return f"{common.plural(count, 'vertex', 'vertices')} added"


def packed_summary(tasks: list[PackedTask], more: str = "") -> str:
    """The report line, without the time. more: said after the figures of the map."""
    text = common.figures(tasks, sum(t.island_overlaps for t in tasks))
    return f"{text}{more}, {added(tasks)}"
