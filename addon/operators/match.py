# SPDX-License-Identifier: GPL-3.0-or-later
"""Match Pins: pinned UVs met bit for bit without a fold, subdividing where that is needed (thesis 3.3, docs/unwrap.md)."""

from types import SimpleNamespace

import bpy
import numpy as np

from .. import mesh_io, modal, refine, solver
from . import common

GROUP = "Pins"


class Island:
    """One seam island as a mesh of its own."""

    def __init__(self, snapshot, triangles: np.ndarray):
        self.triangles = triangles  # ids of the snapshot's triangles
        faces, submesh = mesh_io.split_fans(snapshot.triangles[triangles], snapshot.cuts)
        self.faces = faces
        self.submesh = submesh  # island vertex -> submesh vertex
        self.vertices = snapshot.vertices[submesh]
        self.pins: dict[int, tuple[float, float]] = {}

    def boundary_loops(self) -> list[list[int]]:
        """Vertices of each loop in order, the surface on the left."""
        start = self.faces.ravel()
        end = np.roll(self.faces, -1, axis=1).ravel()
        inner = set(zip(end.tolist(), start.tolist(), strict=True))
        follow = {
            a: b for a, b in zip(start.tolist(), end.tolist(), strict=True) if (a, b) not in inner
        }
        loops = []
        while follow:
            loop = [min(follow)]
            vertex = follow.pop(loop[0])
            while vertex != loop[0]:
                loop.append(vertex)
                vertex = follow.pop(vertex)
            loops.append(loop)
        return loops


def islands_of(snapshot) -> list[Island]:
    """Seam islands of the snapshot, by their first triangle."""
    triangles = snapshot.triangles
    split, _ = mesh_io.split_fans(triangles, snapshot.cuts)
    m = len(triangles)
    ends = [(k, (k + 1) % 3) for k in range(3)]
    key = np.concatenate([np.sort(split[:, e], axis=1) for e in ends]).astype(np.int64)
    code = key[:, 0] << 32 | key[:, 1]
    order = np.argsort(code, kind="stable")
    same = np.flatnonzero(code[order][1:] == code[order][:-1])
    label = mesh_io.connected_components(m, order[same] % m, order[same + 1] % m)
    return [Island(snapshot, np.flatnonzero(label == root)) for root in np.unique(label)]


class MatchTask(modal.Task):
    def __init__(self, snapshot, group_vertices, *, bijective):
        super().__init__(snapshot)
        self.group_vertices = group_vertices  # mesh vertices of the group `Pins`
        self.bijective = bijective
        self.results = []
        self.result = None
        self.new_vertices = 0
        self._waiting = []
        self._island = None

    def start(self):
        self._waiting = [island for island in islands_of(self.snapshot)]
        for island in self._waiting:
            self._collect_pins(island)
        self._waiting = [island for island in self._waiting if island.pins]
        if not self._waiting:
            raise mesh_io.MeshProblem(
                f"{self.snapshot.object_name}: no UV is pinned. Pin some with P in the UV editor, or put vertices "
                f"into the group '{GROUP}'"
            )
        return self._next()

    def _collect_pins(self, island):
        """Pinned corners as pins of the island's vertices; two places for one vertex are refused by name."""
        snapshot = self.snapshot
        loops = snapshot.triangle_loops[island.triangles]
        in_group = np.isin(snapshot.vertex_ids[island.submesh[island.faces]], self.group_vertices)
        rows, corners = np.nonzero(snapshot.pinned[loops] | in_group)
        for row, corner in zip(rows.tolist(), corners.tolist(), strict=True):
            vertex = int(island.faces[row, corner])
            target = tuple(map(float, snapshot.uv[loops[row, corner]]))
            mesh_vertex = int(snapshot.vertex_ids[island.submesh[vertex]])
            if not np.isfinite(target).all():
                raise mesh_io.MeshProblem(
                    f"{snapshot.object_name}: vertex {mesh_vertex} has a pinned UV that is no number. Unpin it with Alt P",
                    "vertex",
                    [mesh_vertex],
                )
            if island.pins.setdefault(vertex, target) != target:
                raise mesh_io.MeshProblem(
                    f"{snapshot.object_name}: vertex {mesh_vertex} is pinned to two places in one island. Mark a seam "
                    "between them, or unpin one with Alt P",
                    "vertex",
                    [mesh_vertex],
                )

    def _next(self):
        if not self._waiting:
            return None
        island = self._island = self._waiting.pop(0)
        loops = island.boundary_loops()
        boundary_loop = boundary_uv = None
        points = dict(island.pins)
        if len(loops) == 1 and all(v in points for v in loops[0]):
            boundary_loop = loops[0]
            boundary_uv = [points.pop(v) for v in boundary_loop]
        return solver.match(
            island.vertices,
            island.faces,
            points=points,
            boundary_loop=boundary_loop,
            boundary_uv=boundary_uv,
            bijective=self.bijective and boundary_uv is None,
        )

    def explain(self, error):
        """The solver's ids are the island's: to the snapshot's."""
        island = self._island
        if island is None:
            return
        ids = np.asarray(error.elements, dtype=np.int64).ravel()
        if error.kind in ("vertex", "edge"):
            ids = ids[ids < len(island.submesh)]
            error.elements = island.submesh[ids].tolist()
        elif error.kind == "face":
            error.elements = island.triangles[ids[ids < len(island.triangles)]].tolist()

    def collect(self, result):
        if not result.certificate.ok:
            raise mesh_io.MeshProblem(
                f"{self.snapshot.object_name}: the map failed its check: "
                f"{'; '.join(result.certificate.failures)}"
            )
        self._refuse_new_vertices_on_seams(self._island, result)
        self.results.append((self._island, result))
        job = self._next()
        if job is None:
            self.result = self._combined()
        return job

    def _refuse_new_vertices_on_seams(self, island, result):
        """A seam has faces of another island, or of the same one, on its other side, which know nothing of the vertex."""
        n = len(island.vertices)
        if len(result.vertices) == n or not len(self.snapshot.cuts):
            return
        seams = {tuple(pair) for pair in np.sort(self.snapshot.cuts, axis=1).tolist()}
        for v in range(n, len(result.vertices)):
            corners = island.faces[result.vertex_parent[v]][result.vertex_barycentric[v] != 0.0]
            if len(corners) == 2 and tuple(sorted(island.submesh[corners].tolist())) in seams:
                ids = self.snapshot.vertex_ids[island.submesh[corners]]
                raise mesh_io.MeshProblem(
                    f"{self.snapshot.object_name}: these pins need a new vertex on the seam between vertices "
                    f"{ids[0]} and {ids[1]}, which the other side does not have. Subdivide that edge, or move a pin",
                    "vertex",
                    ids,
                )

    def _combined(self):
        """One result over the snapshot: triangles of islands without pins keep their UVs."""
        snapshot = self.snapshot
        n = len(snapshot.vertices)
        done = np.zeros(len(snapshot.triangles), bool)
        vertices, faces, uv = [snapshot.vertices], [], []
        parent_face, vertex_parent, weights = [], [np.full(n, -1)], [np.zeros((n, 3))]
        total = n
        for island, result in self.results:
            done[island.triangles] = True
            old = len(island.vertices)
            new = len(result.vertices) - old
            number = np.concatenate([island.submesh, np.arange(total, total + new)])
            total += new
            vertices.append(result.vertices[old:])
            vertex_parent.append(island.triangles[result.vertex_parent[old:]])
            weights.append(result.vertex_barycentric[old:])
            faces.append(number[result.faces])
            parent_face.append(island.triangles[result.parent_face])
            uv.append(result.uv32())
        rest = np.flatnonzero(~done)
        faces.append(snapshot.triangles[rest])
        parent_face.append(rest)
        uv.append(snapshot.corner_uv[rest])
        parent_face = np.concatenate(parent_face)
        order = np.argsort(parent_face, kind="stable")
        stored = np.concatenate(uv)[order]
        return SimpleNamespace(
            vertices=np.concatenate(vertices),
            faces=np.concatenate(faces)[order].astype(np.int32),
            parent_face=parent_face[order],
            vertex_parent=np.concatenate(vertex_parent),
            vertex_barycentric=np.concatenate(weights),
            cut_edges=np.zeros((0, 2), np.int32),
            uv32=lambda: stored,
        )

    def write(self, ob):
        if refine.needs_new_faces(self.snapshot, self.result):
            self.new_vertices = refine.write(ob, self.snapshot, self.result, mark_cuts=False)
            return
        loops, values = mesh_io.loop_values(self.snapshot, self.result.uv32())
        mesh_io.write_uv(ob, self.snapshot, loops, values)


class UV_OT_flipfree_match(modal.SolverOperator, bpy.types.Operator):
    bl_idname = "uv.flipfree_match"
    bl_label = "Match Pins"
    bl_description = (
        "Map every island with pins so that pinned UVs keep their place exactly and nothing folds; "
        "triangles are subdivided only where no other way is left"
    )
    bl_options = {"REGISTER", "UNDO"}
    verb = "Match Pins"

    bijective: bpy.props.BoolProperty(
        name="No Overlaps",
        description="Islands with a free boundary may not overlap themselves",
        default=True,
    )

    @classmethod
    def poll(cls, context):
        return common.poll(cls, context, needs_uv=True)

    def make_run(self, context):
        snapshots, failures = common.read_meshes(context)
        tasks = [
            MatchTask(s, _group_vertices(bpy.data.objects[s.object_name]), bijective=self.bijective)
            for s in snapshots
            if s.layer_name
        ]
        if not tasks and not failures:
            raise mesh_io.MeshProblem("The mesh has no UV map yet. Unwrap it first")
        return modal.Run(tasks, failures)

    def summary(self, tasks):
        certificates = [result.certificate for task in tasks for _, result in task.results]
        added = sum(task.new_vertices for task in tasks)
        noun = "vertex" if added == 1 else "vertices"
        return f"{common.figures(certificates, len(certificates))}, {added} {noun} added"


def _group_vertices(ob) -> list[int]:
    group = ob.vertex_groups.get(GROUP)
    if group is None:
        return []
    if ob.mode == "EDIT":
        ob.update_from_editmode()
    return [
        v.index
        for v in ob.data.vertices
        if any(g.group == group.index and g.weight > 0.0 for g in v.groups)
    ]


CLASSES = (UV_OT_flipfree_match,)
