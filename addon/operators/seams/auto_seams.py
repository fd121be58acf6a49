# SPDX-License-Identifier: GPL-3.0-or-later
"""Auto Seams: marks where to cut (docs/auto-seams.md)."""

import math

import bpy
import numpy as np

from flipfree.distortion import STRETCH_BOUND

from ... import modal, solver
from ...meshes import fields, mesh_io, seams
from .. import common, options

# How many times a seam's length costs where a group has its full weight.
AVOIDED = 100.0
SOUGHT = 0.01


def edge_weights(snapshot, avoid: str, seek: str):
    """(edges, factors) of vertex groups by name, "" for none, as ff.auto_seams wants them; None without any. Raises
    MeshProblem where there is no such group."""
    ob = bpy.data.objects[snapshot.object_name]
    factors = np.ones(len(snapshot.vertices))
    for name, factor, what in (
        (avoid, AVOIDED, "what seams avoid"),
        (seek, SOUGHT, "where seams go"),
    ):
        if name:
            factors *= fields.painted(ob, snapshot, name, factor, what)
    if np.all(factors == 1.0):
        return None
    edges = fields.edges(snapshot)
    return edges, np.sqrt(factors[edges[:, 0]] * factors[edges[:, 1]])


class AutoSeamsTask(modal.Task):
    stretch, keep_seams, sharp_edges, sharp_angle = STRETCH_BOUND, True, False, 0.0
    avoid_group = seek_group = ""
    problem = weights = None
    found = np.zeros(0, np.int64)

    def __init__(self, snapshot, **options):
        super().__init__(snapshot, **options)
        try:
            self.weights = edge_weights(snapshot, self.avoid_group, self.seek_group)
        except mesh_io.MeshProblem as problem:  # of this object: others go on
            self.problem = problem

    def start(self):
        if self.problem is not None:
            raise self.problem
        return solver.auto_seams(
            self.snapshot,
            cuts=self.snapshot.cuts if self.keep_seams else None,
            stretch=self.stretch,
            sharp_angle=self.sharp_angle if self.sharp_edges else None,
            weights=self.weights,
        )

    def collect(self, result):
        self.found = mesh_io.edge_ids(self.snapshot, result)

    def own_edges(self) -> np.ndarray:
        """Edges of the faces that are worked on."""
        return mesh_io.edge_ids(self.snapshot, fields.edges(self.snapshot))

    def write(self, ob):
        cleared = np.zeros(0, np.int64) if self.keep_seams else self.own_edges()
        seams.mark(ob, self.snapshot, self.found, cleared=cleared)

    def added(self) -> int:
        return int((~self.snapshot.seams[self.found]).sum()) if self.keep_seams else len(self.found)


class UV_OT_flipfree_auto_seams(
    options.Stretch, options.UseModifiers, options.MapOperator, bpy.types.Operator
):
    bl_idname = "uv.flipfree_auto_seams"
    bl_label = "Auto Seams"
    bl_description = (
        "Mark short seams along which the mesh can be unwrapped with no more stretch than allowed, in few islands. "
        "UVs stay as they are"
    )
    option_names = (
        "stretch keep_seams sharp_edges sharp_angle avoid_group seek_group use_modifiers"
    ).split()

    keep_seams: options.flag(
        "Keep Seams: Seams that are marked already stay, and only what is missing is added. Off: they are cleared first",
        on=True,
    )
    sharp_edges: options.flag("Cut Sharp Edges: All edges sharper than the angle become seams")
    sharp_angle: options.real(
        "Angle: Between the faces of an edge, from which on it counts as sharp",
        (math.radians(60.0), math.radians(1.0), math.pi),
        subtype="ANGLE",
    )
    avoid_group: options.words(
        "No Seams in: Vertex group: where it is painted, seams are avoided; a seam costs up to 100 times its length there"
    )
    seek_group: options.words(
        "Seams in: Vertex group: where it is painted, seams are sought; a seam costs down to a hundredth of its length there"
    )

    def draw_option(self, layout, context, name):
        ob = context.object
        if name.endswith("_group") and ob is not None and ob.type == "MESH":
            layout.prop_search(self, name, ob, "vertex_groups")
        else:
            super().draw_option(layout, context, name)

    def needs(self):
        return {"sharp_angle": self.sharp_edges}

    make_task = staticmethod(AutoSeamsTask)

    @staticmethod
    def summary(tasks):
        return f"{common.plural(sum(t.added() for t in tasks), 'edge')} marked as seams"
