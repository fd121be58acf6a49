# SPDX-License-Identifier: GPL-3.0-or-later
"""Cut Where Stretched: islands above the stretch bound, unwrapped again along seams that are found and packed with all."""

import bpy
import numpy as np

from flipfree.distortion import STRETCH_BOUND

from ... import solver
from ...meshes import labels, mesh_io
from .. import common, options, unwrap


class CutStretchedTask(unwrap.MapTask):
    flattens = True
    packs_alone = False
    bijective = False  # other islands may overlap themselves

    stretch = STRETCH_BOUND
    use_pins = mark_seams = True
    _cuts = np.zeros(0, np.int64)

    def stages(self):
        snapshot = self.snapshot
        chosen = yield from self._stretched()
        part, _ = snapshot.part(np.flatnonzero(chosen))
        found = yield solver.unwrap(
            part,
            pins={},
            seams="auto",
            stretch=self.stretch,
            bijective=True,
            may_add_cuts=True,
            cut_extremities=True,
            margin=self.margin,
            keep_places=False,
            effort=0.0,
        )
        self._cuts = mesh_io.edge_ids(part, found.cut_edges)
        uv = snapshot.corner_uv.astype(np.float64)
        # Away from the others, whose UVs must not meet them.
        uv[chosen] = found.uv / [self.aspect, 1.0] + [np.ceil(uv[..., 0].max()) + 1.0, 0.0]
        result = yield solver.pack(
            snapshot.vertices,
            snapshot.triangles,
            uv,
            unmoved=[3 * t + k for t, k in self.pins()],
            scale_true=True,
            margin=self.margin,
            aspect=self.aspect,
            effort=0.0,
        )
        yield from self.take(result)

    def _stretched(self):
        """Stages that find the triangles of stretched islands without pins. Raises MeshProblem if there are none."""
        snapshot = self.snapshot
        common.refuse_nonfinite_uvs(snapshot)
        found = yield solver.certify(snapshot, snapshot.corner_uv, aspect=self.aspect)
        label = labels.island_labels(snapshot.triangles, snapshot.corner_uv)
        stretched = np.isin(label, label[found.poor_islands])
        held = np.isin(label, label[[t for t, _ in self.pins()]])
        if (stretched & ~held).any():
            return stretched & ~held
        why = f"no island is stretched beyond {STRETCH_BOUND}"
        if stretched.any():
            why = "the islands that are stretched have pins. Unpin them, or turn off Keep Pins"
        raise mesh_io.MeshProblem(f"{snapshot.object_name}: {why}")

    def automatic_cuts(self):
        return self._cuts[~self.snapshot.seams[self._cuts]]


class UV_OT_flipfree_cut_stretched(
    options.Stretch,
    options.KeepPins,
    options.Margin,
    options.CorrectAspect,
    options.MapOperator,
    bpy.types.Operator,
):
    bl_idname = "uv.flipfree_cut_stretched"
    bl_label = "Cut Where Stretched"
    bl_description = (
        f"Unwrap the islands that are stretched beyond {STRETCH_BOUND} again, along seams that are found where they need them, "
        "and pack them with the others at one scale. Islands with pins stay"
    )
    needs_uv = True
    joint_layout = True

    mark_seams: options.flag("Mark Cuts as Seams: Mark the edges that were cut as seams", on=True)

    make_task = staticmethod(CutStretchedTask)
    summary = staticmethod(unwrap.summary)
