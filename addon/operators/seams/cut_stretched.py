# SPDX-License-Identifier: GPL-3.0-or-later
"""Cut Where Stretched: islands above the stretch bound are unwrapped again along seams that are found; the others stay."""

import bpy
import numpy as np

from flipfree.distortion import STRETCH_BOUND

from ... import solver
from ...meshes import labels, mesh_io
from .. import common, options, unwrap


class CutStretchedTask(unwrap.UnwrapTask):
    def stages(self):
        whole = self.snapshot
        common.refuse_nonfinite_uvs(whole)
        found = yield solver.certify(whole, whole.corner_uv, aspect=self.aspect)
        label = labels.island_labels(whole.triangles, whole.corner_uv)
        chosen = np.isin(label, label[found.poor_islands])
        if not chosen.any():
            raise mesh_io.MeshProblem(
                f"{whole.object_name}: no island is stretched beyond {STRETCH_BOUND}"
            )
        self.leave_out(~chosen)
        yield from super().stages()


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
        "and put them beside the others, which stay"
    )
    verb = "Cut Where Stretched"
    needs_uv = True
    joint_layout = True
    option_names = ("stretch", "use_pins", "mark_seams", "margin", "correct_aspect")

    mark_seams: options.flag("Mark Cuts as Seams", "Mark the edges that were cut as seams", on=True)

    make_task = staticmethod(CutStretchedTask)
    summary = staticmethod(unwrap.summary)


CLASSES = (UV_OT_flipfree_cut_stretched,)
