# SPDX-License-Identifier: GPL-3.0-or-later
"""Orient Islands: each turned so that an edge, its longest side or the model's upward direction lies along an axis."""

import math

import bmesh
import bpy
import numpy as np

from ... import compat, modal
from ...meshes import labels, mesh_io, selection
from .. import common, options
from . import moved

BY = {
    "box": "Longest Side: The smallest rectangle around each island gets level, its longer side along the axis",
    "edge": "Selected Edges: Selected edges lie along u or v, whichever is nearer; islands without stay",
    "up": "Upwards on the Model: What points upwards on the model (Z) points upwards in the map",
}
AXES = {
    "u": "U: To the right",
    "v": "V: Upwards",
}


class OrientTask(moved.MovedTask):
    by, axis = "box", "v"

    def __init__(self, snapshot, selected=None, **options):
        """selected: (k, 2) mesh vertices of the selected edges."""
        super().__init__(snapshot, **options)
        # Sides of triangles, from corner k to the next.
        self._chosen = np.zeros((len(snapshot.triangles), 3), bool)
        if selected is not None:
            corners = snapshot.vertex_ids[snapshot.triangles]
            for k in range(3):
                keys = labels.edge_keys(corners[:, [k, (k + 1) % 3]])
                self._chosen[:, k] = labels.members(keys, labels.edge_keys(selected))

    def place(self, triangles, uv):
        find = {"box": self._box, "edge": self._edges, "up": self._up}[self.by]
        seen = uv * [self.aspect, 1.0]
        angle = find(triangles, seen)
        return None if angle is None else turned(seen, angle) / [self.aspect, 1.0]

    def _box(self, triangles, uv) -> float | None:
        """Turns the smallest box's longer side onto the axis."""
        angle, width, height = smallest_box(uv.reshape(-1, 2))
        lies = width >= height
        return angle if lies == (self.axis == "u") else angle + math.pi / 2

    def _edges(self, triangles, uv) -> float | None:
        """Turns the mean of the selected edges, by length and up to quarter turns, onto the nearest axis."""
        total = np.zeros(2)
        for k in range(3):
            on = self._chosen[triangles, k]
            way = uv[on, (k + 1) % 3] - uv[on, k]
            length, quarter = np.hypot(*way.T), 4 * np.arctan2(way[:, 1], way[:, 0])
            total += length @ np.cos(quarter), length @ np.sin(quarter)
        return -math.atan2(total[1], total[0]) / 4 if total.any() else None

    def _up(self, triangles, uv) -> float | None:
        """Turns the mean gradient of the model's height in the map to point upwards."""
        snapshot = self.snapshot
        matrix = np.array(bpy.data.objects[snapshot.object_name].matrix_world)
        height = snapshot.vertices @ matrix[2, :3]
        z = height[snapshot.triangles[triangles]]
        a, b = uv[:, 1] - uv[:, 0], uv[:, 2] - uv[:, 0]
        za, zb = z[:, 1] - z[:, 0], z[:, 2] - z[:, 0]
        # The gradient times twice the area, which weighs it.
        u = float((za * b[:, 1] - zb * a[:, 1]).sum())
        v = float((zb * a[:, 0] - za * b[:, 0]).sum())
        scale = float(np.abs(za).sum() * np.abs(uv - uv.mean(axis=(0, 1))).max())
        if not math.hypot(u, v) > 1e-6 * scale:
            return None  # level, or as much upwards as downwards
        return math.pi / 2 - math.atan2(v, u)


def turned(uv: np.ndarray, angle: float) -> np.ndarray:
    """About the centre of its box; quarter turns without rounding of sine and cosine."""
    middle = moved.centre(uv)
    c, s = math.cos(angle), math.sin(angle)
    if abs(angle / (math.pi / 2) - round(angle / (math.pi / 2))) < 1e-12:
        c, s = float(round(c)), float(round(s))
    return middle + (uv - middle) @ np.array([[c, s], [-s, c]])


def smallest_box(points: np.ndarray) -> tuple[float, float, float]:
    """(angle to turn by, width, height afterwards) of the box of least area; one of its sides lies along the convex hull."""
    hull = convex_hull(points)
    ways = np.roll(hull, -1, axis=0) - hull
    angles = np.unique(np.mod(np.arctan2(ways[:, 1], ways[:, 0]), math.pi / 2))
    c, s = np.cos(angles), np.sin(angles)
    x = np.outer(c, hull[:, 0]) + np.outer(s, hull[:, 1])
    y = np.outer(c, hull[:, 1]) - np.outer(s, hull[:, 0])
    width, height = np.ptp(x, axis=1), np.ptp(y, axis=1)
    best = int(np.argmin(width * height))
    return -float(angles[best]), float(width[best]), float(height[best])


def convex_hull(points: np.ndarray) -> np.ndarray:
    """(h, 2) counter-clockwise (Andrew's monotone chain)."""
    ordered = np.unique(points, axis=0)
    if len(ordered) < 3:
        return ordered

    def half(sequence):
        chain: list = []
        for x, y in sequence:
            while len(chain) > 1:
                (ax, ay), (bx, by) = chain[-2:]
                if (bx - ax) * (y - ay) - (by - ay) * (x - ax) > 0:
                    break
                chain.pop()
            chain.append((x, y))
        return chain[:-1]

    rows = ordered.tolist()
    return np.array(half(rows) + half(rows[::-1]))


def selected_edges(ob) -> np.ndarray:
    """(k, 2) vertices of the selected edges, in either mode."""
    if ob.mode == "EDIT":
        bm = bmesh.from_edit_mesh(ob.data)
        bm.verts.index_update()
        pairs = [[v.index for v in e.verts] for e in bm.edges if e.select and not e.hide]
        return np.array(pairs, np.int64).reshape(-1, 2)
    with selection.whole_mesh(ob) as mesh:
        chosen = compat.values(mesh.edges, "select", bool)
        return compat.edge_vertices(mesh)[chosen].astype(np.int64)


class UV_OT_flipfree_orient(
    options.KeepPins, options.CorrectAspect, options.MapOperator, bpy.types.Operator
):
    bl_idname = "uv.flipfree_orient"
    bl_label = "Orient Islands"
    bl_description = "Turn islands about their centres so that they lie along u and v"
    needs_uv = True

    by: options.choice("By: What lies along the axis", BY)
    axis: options.choice("Axis: Along which the longest side lies", AXES, default="v")

    def needs(self):
        return {"axis": self.by == "box"}

    def make_run(self, context):
        if self.by == "edge":
            values = self.values(context)
            edges = {ob: selected_edges(ob) for ob in common.meshes(context)}
            found = common.whole_objects(
                context,
                lambda s, ob: OrientTask(s, edges[ob], **values),
                wanted=lambda ob: len(edges[ob]),
            )
            if not any(found):
                raise mesh_io.MeshProblem("No edge is selected. Select one in Edit Mode")
            return modal.Run(*found)
        return super().make_run(context)

    make_task = staticmethod(OrientTask)

    def summary(self, tasks):
        return (
            f"{common.plural(sum(t.moved for t in tasks), 'island')} turned: {moved.notes(tasks)}"
        )
