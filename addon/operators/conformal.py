# SPDX-License-Identifier: GPL-3.0-or-later
"""Conformal Map with Cones, Suggest Cones, Mark Cone (thesis 4, docs/conformal-blender.md)."""

import math

import bpy
import numpy as np

from .. import cones, mesh_io, modal, refine, solver
from . import common

# Radians by which a 32-bit cone angle may be off its 64-bit value (half a unit in the last place below 64).
ROUNDING = 2e-6

BOUNDARIES = (
    ("free", "Free", "Lengths along the boundary stay: least distortion of area"),
    (
        "straight",
        "Straight",
        "Straight lines between the boundary vertices that are marked as cones, which share the turn",
    ),
    ("circle", "Round", "The boundary bends evenly"),
    (
        "prescribed",
        "Prescribed",
        "Angles of the boundary come from the attribute `cone_angle` and cone groups; elsewhere it is straight",
    ),
)


def _cones_of(ob, snapshot) -> tuple[dict[int, float], np.ndarray]:
    """({submesh vertex: angle}, (#Sv,) bool boundary of the submesh). A mesh vertex with several fans marks each."""
    if ob.mode == "EDIT":
        ob.update_from_editmode()
    mesh = ob.data.copy()
    try:
        boundary = submesh_boundary(snapshot)
        whole = np.zeros(len(mesh.vertices), bool)
        whole[snapshot.vertex_ids[boundary]] = True
        angles = cones.read(ob, mesh, whole)
    finally:
        bpy.data.meshes.remove(mesh)
    marked = {i: angles[v] for i, v in enumerate(snapshot.vertex_ids.tolist()) if v in angles}
    return marked, boundary


def submesh_boundary(snapshot) -> np.ndarray:
    """(#Sv,) bool: vertices on edges with one triangle."""
    ends = np.concatenate([snapshot.triangles[:, e] for e in ((0, 1), (1, 2), (2, 0))])
    ends = np.sort(ends, axis=1)
    edges, uses = np.unique(ends, axis=0, return_counts=True)
    result = np.zeros(len(snapshot.vertices), bool)
    result[edges[uses == 1].ravel()] = True
    return result


class ConformalTask(modal.Task):
    def __init__(self, snapshot, cone_angles, boundary_vertices, *, boundary, mark_cuts):
        super().__init__(snapshot)
        self.cone_angles = cone_angles
        self.boundary_vertices = boundary_vertices
        self.boundary = boundary
        self.mark_cuts = mark_cuts
        self.result = None
        self.new_vertices = 0
        self._have_angles = False

    def start(self):
        bad = [v for v, angle in self.cone_angles.items() if not angle > 0.0]
        if bad:
            ids = self.snapshot.vertex_ids[bad]
            raise mesh_io.MeshProblem(
                f"{self.snapshot.object_name}: vertex {ids[0]}{mesh_io.more(ids)} has a cone angle that is not "
                "above zero. Give it less curvature",
                "vertex",
                ids,
            )
        self._balance()
        if self.boundary == "prescribed":
            self._have_angles = True
            return solver.conformal(self.snapshot, self._prescribed())
        inner = {v: a for v, a in self.cone_angles.items() if not self.boundary_vertices[v]}
        corners = [v for v in self.cone_angles if self.boundary_vertices[v]]
        if self.boundary == "straight" and not corners:
            raise mesh_io.MeshProblem(
                f"{self.snapshot.object_name}: a straight boundary needs corners. Mark at least three of its "
                "vertices as cones, or choose another boundary"
            )
        return solver.boundary_angles(
            self.snapshot, boundary=self.boundary, cones=inner, corners=corners
        )

    def _balance(self) -> None:
        """On a closed surface the cones must sum up exactly, and Blender stores angles in 32 bits: what rounding left
        over is shared among them. A larger remainder is the user's, and the solver will name it."""
        if self.boundary_vertices.any() or not self.cone_angles:
            return
        triangles = self.snapshot.triangles
        characteristic = len(self.snapshot.vertices) - len(triangles) // 2
        total = sum(2 * math.pi - angle for angle in self.cone_angles.values())
        left = 2 * math.pi * characteristic - total
        if abs(left) < ROUNDING * len(self.cone_angles):
            share = left / len(self.cone_angles)
            self.cone_angles = {v: angle - share for v, angle in self.cone_angles.items()}

    def _prescribed(self) -> np.ndarray:
        angles = np.where(self.boundary_vertices, math.pi, 2 * math.pi)
        for vertex, angle in self.cone_angles.items():
            angles[vertex] = angle
        return angles

    def collect(self, result):
        if not self._have_angles:
            self._have_angles = True
            return solver.conformal(self.snapshot, result)
        if not result.certificate.ok:
            raise mesh_io.MeshProblem(
                f"{self.snapshot.object_name}: the map failed its check: "
                f"{'; '.join(result.certificate.failures)}"
            )
        self.result = result
        return None

    def write(self, ob):
        if refine.needs_new_faces(self.snapshot, self.result):
            self.new_vertices = refine.write(
                ob, self.snapshot, self.result, mark_cuts=self.mark_cuts
            )
            return
        loops, values = mesh_io.loop_values(self.snapshot, self.result.uv32())
        seams = mesh_io.edge_ids(self.snapshot, self.result.cut_edges) if self.mark_cuts else None
        mesh_io.write_uv(ob, self.snapshot, loops, values, seams)


class UV_OT_flipfree_conformal(modal.SolverOperator, bpy.types.Operator):
    bl_idname = "uv.flipfree_conformal"
    bl_label = "Conformal Map with Cones"
    bl_description = (
        "Map without shear, with exactly the marked cone angles. Triangles that would flip are subdivided, "
        "the cut is marked as seams"
    )
    bl_options = {"REGISTER", "UNDO"}
    verb = "Conformal Map"

    boundary: bpy.props.EnumProperty(name="Boundary", items=BOUNDARIES, default="free")
    mark_cuts: bpy.props.BoolProperty(
        name="Mark Cuts as Seams",
        description="Mark the edges along which the map is cut",
        default=True,
    )

    @classmethod
    def poll(cls, context):
        return common.poll(cls, context)

    def draw(self, context):
        self.layout.use_property_split = True
        self.layout.use_property_decorate = False
        self.layout.prop(self, "boundary")
        self.layout.prop(self, "mark_cuts")

    def make_run(self, context):
        snapshots, failures = common.read_meshes(context)
        tasks = []
        for snapshot in snapshots:
            marked, boundary = _cones_of(bpy.data.objects[snapshot.object_name], snapshot)
            tasks.append(
                ConformalTask(
                    snapshot, marked, boundary, boundary=self.boundary, mark_cuts=self.mark_cuts
                )
            )
        return modal.Run(tasks, failures)

    def summary(self, tasks):
        islands = sum(mesh_io.count_islands(t.result.faces, t.result.uv32()) for t in tasks)
        text = common.figures([t.result.certificate for t in tasks], islands)
        error = max(t.result.stats["angle_error"] for t in tasks)
        added = sum(t.new_vertices for t in tasks)
        text += f", cone angles within {error:.1e} rad"
        return f"{text}, {common.plural(added, 'vertex').replace('vertexs', 'vertices')} added"


class SuggestTask(modal.Task):
    def __init__(self, snapshot, *, bound, quarter_turns):
        super().__init__(snapshot)
        self.bound = bound
        self.quarter_turns = quarter_turns
        self.suggestion = None

    def start(self):
        return solver.suggest_cones(
            self.snapshot, bound=self.bound, quarter_turns=self.quarter_turns
        )

    def collect(self, result):
        self.suggestion = result

    def write(self, ob):
        """Cones of quarter turns go into groups, others into the attribute."""
        boundary = submesh_boundary(self.snapshot)
        angles = {}
        for vertex in self.suggestion.cones.tolist():
            angles[int(self.snapshot.vertex_ids[vertex])] = (
                float(self.suggestion[vertex]),
                bool(boundary[vertex]),
            )
        cones.write(ob, angles, as_groups=self.quarter_turns)


class UV_OT_flipfree_suggest_cones(modal.SolverOperator, bpy.types.Operator):
    bl_idname = "uv.flipfree_suggest_cones"
    bl_label = "Suggest Cones"
    bl_description = "Place cones one by one where a conformal map would scale most, until scales differ no more than the bound"
    bl_options = {"REGISTER", "UNDO"}
    verb = "Suggest Cones"

    bound: bpy.props.FloatProperty(
        name="Scale Bound",
        description="Largest ratio between the largest and the smallest scale of the map",
        default=4.0,
        min=1.01,
        soft_max=100.0,
    )
    quarter_turns: bpy.props.BoolProperty(
        name="Quarter Turns",
        description="Angles in multiples of 90 degrees, as seamless maps want them",
        default=False,
    )

    @classmethod
    def poll(cls, context):
        return common.poll(cls, context)

    def make_run(self, context):
        snapshots, failures = common.read_meshes(context)
        tasks = [
            SuggestTask(s, bound=self.bound, quarter_turns=self.quarter_turns) for s in snapshots
        ]
        return modal.Run(tasks, failures)

    def summary(self, tasks):
        count = sum(len(t.suggestion.cones) for t in tasks)
        ratio = max(t.suggestion.scale_ratio for t in tasks)
        missed = "" if all(t.suggestion.bound_holds for t in tasks) else ", bound not reached"
        return f"{common.plural(count, 'cone')}, scales differ by {ratio:.3g}{missed}"


class MESH_OT_flipfree_mark_cone(bpy.types.Operator):
    bl_idname = "mesh.flipfree_mark_cone"
    bl_label = "Mark Cone"
    bl_description = "Make the selected vertices cones of so many quarter turns (0 removes them) and say what is still missing"
    bl_options = {"REGISTER", "UNDO"}

    quarter_turns: bpy.props.IntProperty(
        name="Quarter Turns",
        description="Curvature in quarter turns: 1 is the corner of a cube, -1 a saddle",
        default=1,
        min=-40,
        max=3,
    )

    @classmethod
    def poll(cls, context):
        if context.mode != "EDIT_MESH":
            cls.poll_message_set("Works in Edit Mode, on selected vertices")
            return False
        return True

    def execute(self, context):
        ob = context.edit_object
        marked = cones.mark_selected(ob, self.quarter_turns)
        if not marked:
            self.report({"ERROR"}, f"{ob.name}: no vertices are selected")
            return {"CANCELLED"}
        self.report({"INFO"}, f"{common.plural(marked, 'cone')} marked. {cones.balance(ob)}")
        return {"FINISHED"}


CLASSES = (
    UV_OT_flipfree_conformal,
    UV_OT_flipfree_suggest_cones,
    MESH_OT_flipfree_mark_cone,
)
