# SPDX-License-Identifier: GPL-3.0-or-later
"""Straighten Chain: selected edges onto a straight line, exactly, and the rest of their island flip-free around it.

The line is a hard constraint of Match Pins: what the user pinned stays where it is as well.
"""

import math

import bpy
import numpy as np

from ...meshes import labels, mesh_io, separated
from .. import match, options
from . import orient

DIRECTIONS = (
    ("ends", "Between the Ends", "The ends of each chain stay where they are"),
    ("axis", "Nearest Axis", "Each chain lies along u or v, whichever is nearer, about its middle"),
)


class StraightenTask(match.MatchTask):
    poor_cure = "Straighten a shorter chain, or mark seams beside it"

    def __init__(self, snapshot, selected, *, direction="ends", **values):
        """selected: (k, 2) mesh vertices of the selected edges."""
        ob = bpy.data.objects[snapshot.object_name]
        super().__init__(snapshot, match.group_vertices(ob), **values)
        self.selected = np.sort(labels.edge_keys(selected))
        self.direction = direction
        self.chains = 0

    def _collect_pins(self, found):
        super()._collect_pins(found)
        self.chains = 0
        for island in found:
            chains = self._chains(island)
            if not chains:
                island.pins.clear()  # it stays as it is
            for chain in chains:
                self._pin(island, chain)
            self.chains += len(chains)
        if not self.chains:
            raise mesh_io.MeshProblem(
                f"{self.snapshot.object_name}: the selected edges make no chain. Select edges that follow each other, two or more"
            )

    def _chains(self, island) -> list[list[int]]:
        """Paths of two edges or more in the island's own vertices: chains along a seam are one on either side of it."""
        edges = island.edges()
        in_mesh = self.snapshot.vertex_ids[island.submesh[edges]]
        near: dict[int, list[int]] = {}
        for a, b in edges[np.isin(labels.edge_keys(in_mesh), self.selected)].tolist():
            near.setdefault(a, []).append(b)
            near.setdefault(b, []).append(a)
        crossing = [v for v, others in near.items() if len(others) > 2]
        if crossing:
            self._refuse(
                island,
                crossing,
                "joins more than two selected edges. Straighten one chain at a time",
            )
        found, done = [], set()
        for start in [v for v, others in near.items() if len(others) == 1]:
            if start in done:
                continue
            chain = [start]
            while True:
                following = [w for w in near[chain[-1]] if w not in chain[-2:]]
                if not following:
                    break
                chain.append(following[0])
            done |= {chain[0], chain[-1]}
            if len(chain) > 2:
                found.append(chain)
        rings = set(near) - {v for chain in found for v in chain} - done
        if rings:
            self._refuse(
                island,
                sorted(rings),
                "lies on a closed ring, which has no ends. Leave out one of its edges",
            )
        return found

    def _refuse(self, island, vertices, why):
        ids = self.snapshot.vertex_ids[island.submesh[vertices]]
        raise mesh_io.MeshProblem(
            f"{self.snapshot.object_name}: vertex {ids[0]}{mesh_io.more(ids)} {why}", "vertex", ids
        )

    def _pin(self, island, chain):
        """Along the line as far apart as on the surface."""
        uv = np.empty((len(island.vertices), 2))
        uv[island.faces] = self.snapshot.corner_uv[island.triangles]
        steps = np.linalg.norm(np.diff(island.vertices[chain], axis=0), axis=1)
        along = np.append(0.0, np.cumsum(steps))
        share = along / along[-1] if along[-1] > 0 else np.linspace(0.0, 1.0, len(chain))
        start, end = self._ends(uv[chain[0]], uv[chain[-1]])
        targets = (start + share[:, None] * (end - start)).astype(np.float32)
        for vertex, target in zip(chain, targets.tolist(), strict=True):
            wanted = tuple(map(float, target))
            if island.pins.setdefault(vertex, wanted) != wanted:
                self._refuse(island, [vertex], "is pinned beside the line. Unpin it with Alt P")

    def _ends(self, start, end):
        if self.direction == "ends":
            return start, end
        middle, way = (start + end) / 2, end - start
        seen = np.array([self.aspect, 1.0])  # as long on the texture as it was
        axis = int(abs(way[1]) > abs(way[0] * self.aspect))
        half = np.zeros(2)
        half[axis] = math.copysign(math.hypot(*(way * seen)) / 2, way[axis]) / seen[axis]
        # The same 32-bit number along the whole chain, so that it lies on the axis bit for bit.
        middle = middle.astype(np.float32).astype(np.float64)
        return middle - half, middle + half


class UV_OT_flipfree_straighten(
    options.NoOverlaps,
    options.TimeLimit,
    options.CorrectAspect,
    options.MapOperator,
    bpy.types.Operator,
):
    bl_idname = "uv.flipfree_straighten"
    bl_label = "Straighten Chain"
    bl_description = (
        "Put chains of selected edges onto straight lines in the map, exactly, and map the rest of their islands around them "
        "without flips. Pinned UVs stay"
    )
    bl_options = {"REGISTER", "UNDO"}
    verb = "Straighten Chain"
    needs_uv = True
    option_names = ("direction", "bijective", "may_add", "correct_aspect", "max_seconds")

    direction: bpy.props.EnumProperty(
        name="Line", description="Where the line lies", items=DIRECTIONS, default="ends"
    )
    may_add: bpy.props.BoolProperty(
        name="May Add Vertices",
        description="Triangles are subdivided where the line leaves no other way. Off: such lines are refused",
        default=True,
    )

    @classmethod
    def poll(cls, context):
        if context.mode != "EDIT_MESH":
            cls.poll_message_set("Works in Edit Mode, on chains of selected edges")
            return False
        return super().poll(context)

    def make_run(self, context):
        values = self.values(context)
        return orient.whole_objects_with_edges(
            context,
            lambda snapshot, chosen: StraightenTask(
                separated.separated(snapshot), chosen, **values
            ),
        )

    def summary(self, tasks):
        count = sum(task.chains for task in tasks)
        return f"{count} chain{'s' * (count != 1)} straight: {match.summary(tasks)}"


CLASSES = (UV_OT_flipfree_straighten,)
