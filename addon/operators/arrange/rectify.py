# SPDX-License-Identifier: GPL-3.0-or-later
"""Rectify: islands of quads as straight strips and grids (docs/panel.md); those with pins stay."""

import bpy
import numpy as np

from ... import solver
from ...meshes import islands, labels, mesh_io
from .. import common, options, unwrap


class RectifyTask(unwrap.MapTask):
    bijective = True
    use_pins = False
    poor_cure = "Rows of very different lengths do not fit a grid: mark seams between them"

    pack_options = {"rotation": "quarters"}

    def island_labels(self):
        snapshot = self.snapshot
        of_map = labels.island_labels(snapshot.triangles, snapshot.corner_uv)
        pairs = np.column_stack([of_map, islands.seam_islands(snapshot)])
        return np.unique(pairs, axis=0, return_inverse=True)[1].ravel()

    def stages(self):
        common.refuse_nonfinite_uvs(self.snapshot)
        label, pinned = self.island_labels(), self.snapshot.pinned[self.snapshot.triangle_loops]
        held = np.isin(label, label[pinned.any(axis=1)])
        if held.all():
            name = self.snapshot.object_name
            raise mesh_io.MeshProblem(f"{name}: islands with pins stay. Unpin them with Alt P")
        self.leave_out(held)
        yield from self.take(
            (yield solver.rectify(self.snapshot, margin=self.margin, aspect=self.aspect))
        )


class UV_OT_flipfree_rectify(
    options.Margin, options.CorrectAspect, options.MapOperator, bpy.types.Operator
):
    bl_idname = "uv.flipfree_rectify"
    bl_label = "Rectify"
    bl_description = (
        "Islands of quads become straight strips and grids, rows and columns as wide as their edges are on the model, packed; "
        "tubes and rings are cut open. Islands with pins stay"
    )
    needs_uv = True
    joint_layout = True

    make_task = staticmethod(RectifyTask)
    summary = staticmethod(unwrap.summary_of_maps)
