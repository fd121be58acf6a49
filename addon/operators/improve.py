# SPDX-License-Identifier: GPL-3.0-or-later
"""Improve: less distortion for a flip-free map, without a flip on the way (docs/unwrap.md)."""

import bpy
import numpy as np

from .. import mesh_io, modal, solver
from . import common, options
from .unwrap import MapTask


class ImproveTask(modal.StagedTask, MapTask):
    def __init__(
        self,
        snapshot,
        *,
        bijective=True,
        use_pins=True,
        iterations=200,
        pack=False,
        margin=0.005,
    ):
        super().__init__(snapshot)
        self.bijective = bijective
        self.use_pins = use_pins
        self.iterations = iterations
        self.pack = pack
        self.margin = margin

    def stages(self):
        snapshot = self.snapshot
        common.refuse_nonfinite_uvs(snapshot)
        pins = common.pins_of(snapshot) if self.use_pins else {}
        result = yield solver.improve(
            snapshot, pins=pins, bijective=self.bijective, iterations=self.iterations
        )
        if self.pack:
            result = yield solver.pack(
                snapshot.vertices,
                snapshot.triangles,
                result.uv,
                margin=self.margin,
                keep_bijective=self.bijective,
                unmoved=np.array([3 * t + k for t, k in pins], np.int32),
            )
        self.take(result)


def summary(tasks: list[ImproveTask]) -> str:
    """The report line, without the time."""
    islands = sum(mesh_io.count_islands(t.snapshot.triangles, t.result.uv32()) for t in tasks)
    return common.figures([t.certificate for t in tasks], islands)


class UV_OT_flipfree_improve(
    options.NoOverlaps,
    options.KeepPins,
    options.Packing,
    options.MapOperator,
    bpy.types.Operator,
):
    bl_idname = "uv.flipfree_improve"
    bl_label = "Improve Flip-Free Map"
    bl_description = "Lower the distortion of a UV map that has no flips, without making any; islands and pins stay"
    bl_options = {"REGISTER", "UNDO"}
    verb = "Improve"
    needs_uv = True
    option_names = ("bijective", "use_pins", "iterations", "pack", "margin")

    iterations: bpy.props.IntProperty(
        name="Iterations",
        description="At most so many steps for each island; it ends earlier when nothing is left to gain",
        default=200,
        min=1,
        max=10000,
    )

    def make_task(self, snapshot, **options):
        return ImproveTask(snapshot, **options)

    def summary(self, tasks):
        return summary(tasks)


CLASSES = (UV_OT_flipfree_improve,)
