# SPDX-License-Identifier: GPL-3.0-or-later
"""Straighten Chain: selected edges onto a straight line, exactly, and the rest of their island flip-free around it.

The line is a hard constraint of Match Pins: what the user pinned stays where it is as well.
"""

import math

import bpy
import numpy as np

from ...meshes import islands, labels, mesh_io, separated
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
            chains = islands.chains_of(self.snapshot, island, self.selected, what="selected")
            chains = [chain for chain in chains if len(chain) > 2]
            if not chains:
                island.pins.clear()  # it stays as it is
            for chain in chains:
                self._pin(island, chain)
            self.chains += len(chains)
        if not self.chains:
            raise mesh_io.MeshProblem(
                f"{self.snapshot.object_name}: the selected edges make no chain. Select edges that follow each other, two or more"
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
                why = "is pinned beside the line. Unpin it with Alt P"
                raise islands.problem_at(self.snapshot, island, [vertex], why)

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
    verb = "Straighten Chain"
    needs_uv = True
    option_names = ("direction", "bijective", "may_add", "correct_aspect", "max_seconds")

    direction: options.choice("Line", "Where the line lies", DIRECTIONS)
    may_add: options.flag(
        "May Add Vertices",
        "Triangles are subdivided where the line leaves no other way. Off: such lines are refused",
        on=True,
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
