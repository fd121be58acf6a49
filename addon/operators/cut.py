# SPDX-License-Identifier: GPL-3.0-or-later
"""Admissible Cut: the branches at right angles that seamless maps are padded along, as seams (thesis 5.2.1, 6.5)."""

import bpy
import numpy as np

import flipfree

from .. import solver
from ..meshes import islands, marks, selection, separated
from . import common, cone_sums, options, parts, seamless

FOLLOWED = {
    "cones": "Marked Cones: Those of the cone groups and `cone_angle`, and no others",
    "field": "Smooth Field: The same, and loops of the cut turn as the smoothest field with these cones does; along marked "
    "rings as these say",
}


class CutTask(seamless.SeamlessTask):
    """All connected parts, which are closed, with the marked cones."""

    flattens = False  # UVs stay

    follow, select_corners = "cones", False
    found = None

    def __init__(self, snapshot, angles, boundary, loops, **options):
        super().__init__(snapshot, angles, boundary, **options)
        self.loops = loops

    def stages(self):
        self.quarters = self._marked_quarters()
        self._refuse_unbalanced(self.components())
        field = None
        if self.follow == "field":
            wanted = flipfree.Signature(self.quarters, self.loops)
            field = yield solver.cross_field(self.snapshot, signature=wanted)
        self.found = found = yield solver.admissible_cut(self.snapshot, self.quarters, field)
        self.result = islands.placed(found, self._old_uv(found), split_cuts=True)

    def _old_uv(self, found) -> np.ndarray:
        """(m', 3, 2): the map that the mesh has, at the corners of the refined faces."""
        triangles, parent = self.snapshot.triangles, found.parent_face
        corners = triangles[found.vertex_parent[found.faces]]
        same = corners[..., None] == triangles[parent][:, None, None, :]
        weights = np.einsum("ckj,ckjd->ckd", found.vertex_barycentric[found.faces], same)
        return np.einsum("ckd,cdx->ckx", weights, self.snapshot.corner_uv[parent])

    def stored_map(self):
        return None

    def island_count(self) -> int:
        split, _ = flipfree.split_fans(self.result.faces, cuts=self.result.cut_edges)
        return len(np.unique(flipfree.islands(split)[0]))

    def writing(self, ob):
        yield from parts.PartsTask.writing(self, ob)
        if self.select_corners:
            old, ids = len(self.snapshot.vertices), self.snapshot.vertex_ids
            new = self.snapshot.counts[0] + np.arange(len(self.result.vertices) - old)
            nodes = np.unique(self.found.corners[:, 0])
            selection.select_only(ob, "vertex", np.concatenate([ids, new])[nodes])


def make_task(snapshot, **options) -> CutTask:
    snapshot = separated.separated(snapshot)
    loops = marks.loops(bpy.data.objects[snapshot.object_name], snapshot)
    return CutTask(snapshot, *cone_sums.marked(snapshot), loops, **options)


class UV_OT_flipfree_cut(options.UseModifiers, options.MapOperator, bpy.types.Operator):
    bl_idname = "uv.flipfree_cut"
    bl_label = "Admissible Cut"
    bl_description = (
        "Mark seams that cut a closed surface into disks with right-angled corners, as many as the marked cones ask for. UVs "
        "stay as they are; edges are split where the seams need room"
    )

    follow: options.choice("For: What a map along these seams shall have", FOLLOWED)
    select_corners: options.flag("Select Corners: Select the vertices at which seams meet")

    make_task = staticmethod(make_task)

    @staticmethod
    def summary(tasks):
        branches = sum(len(t.found.branches) for t in tasks)
        corners = sum(len(t.found.corners) for t in tasks)
        disks = sum(t.island_count() for t in tasks)
        return (
            f"{common.plural(branches, 'branch', 'branches')}, {common.plural(corners, 'corner')}, "
            f"{common.plural(disks, 'disk')}, {parts.added(tasks)}"
        )
