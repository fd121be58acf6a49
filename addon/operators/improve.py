# SPDX-License-Identifier: GPL-3.0-or-later
"""Improve: less distortion for a flip-free map, without a flip on the way (docs/unwrap.md)."""

import bpy

from .. import mesh_io, modal, solver
from . import common
from .unwrap import MapTask


class ImproveTask(MapTask):
    def __init__(self, snapshot, *, bijective=True, use_pins=True, iterations=200):
        super().__init__(snapshot)
        self.bijective = bijective
        self.use_pins = use_pins
        self.iterations = iterations

    def start(self):
        common.refuse_nonfinite_uvs(self.snapshot)
        pins = common.pins_of(self.snapshot) if self.use_pins else {}
        return solver.improve(
            self.snapshot, pins=pins, bijective=self.bijective, iterations=self.iterations
        )


OPTIONS = ("bijective", "use_pins", "iterations")


class UV_OT_flipfree_improve(modal.SolverOperator, bpy.types.Operator):
    bl_idname = "uv.flipfree_improve"
    bl_label = "Improve Flip-Free Map"
    bl_description = "Lower the distortion of a UV map that has no flips, without making any; islands and pins stay"
    bl_options = {"REGISTER", "UNDO"}
    verb = "Improve"

    bijective: bpy.props.BoolProperty(
        name="No Overlaps",
        description="Islands that do not overlap themselves stay so",
        default=True,
    )
    use_pins: bpy.props.BoolProperty(
        name="Keep Pins",
        description="Pinned UVs keep their place exactly",
        default=True,
    )
    iterations: bpy.props.IntProperty(
        name="Iterations",
        description="At most so many steps for each island; it ends earlier when nothing is left to gain",
        default=200,
        min=1,
        max=10000,
    )

    @classmethod
    def poll(cls, context):
        return common.poll(cls, context, needs_uv=True)

    def draw(self, context):
        self.layout.use_property_split = True
        self.layout.use_property_decorate = False
        for name in OPTIONS:
            self.layout.prop(self, name)

    def make_run(self, context):
        snapshots, failures = common.read_meshes(context)
        options = {name: getattr(self, name) for name in OPTIONS}
        tasks = [ImproveTask(s, **options) for s in snapshots if s.layer_name]
        if not tasks and not failures:
            raise mesh_io.MeshProblem("The mesh has no UV map yet. Unwrap it first")
        return modal.Run(tasks, failures)

    def summary(self, tasks):
        islands = sum(mesh_io.count_islands(t.snapshot.triangles, t.result.uv32()) for t in tasks)
        return common.figures([t.certificate for t in tasks], islands)


CLASSES = (UV_OT_flipfree_improve,)
