# SPDX-License-Identifier: GPL-3.0-or-later
"""Conformal Map with Cones, Suggest Cones, Mark Cone, Clear Cones (thesis 4, docs/conformal-map.md)."""

import functools
import math

import bpy
import numpy as np

from .. import modal, solver
from ..meshes import cones, islands, labels, mesh_io, separated
from . import common, cone_sums, options, parts

# Radians by which a 32-bit cone angle may be off its 64-bit value (half a unit in the last place below 64).
ROUNDING = 2e-6

BOUNDARIES = {
    "free": "Free: Lengths along the boundary stay: least distortion of area",
    "straight": "Straight: Straight lines between the boundary vertices that are marked as cones, which share the turn",
    "circle": "Round: The boundary bends evenly",
    "prescribed": "Prescribed: Angles of the boundary come from the attribute `cone_angle` and cone groups; elsewhere it is "
    "straight",
}

REFINED_STARTS = {
    "auto": "Automatic: As Off: no map is known that needs one",
    "on": "On: Compute the metric on a refined surface without needles. Nothing is added to the mesh by it",
    "off": "Off: Never",
}


class ConformalTask(parts.PackedTask):
    """Every connected part of the faces is a surface of its own, with cones that must fit it alone."""

    poor_cure = "Suggest Cones finds where cones would even the scale out, or cut the surface there"

    boundary, refined_start, precision = "free", "auto", 0
    mark_cuts = True

    def __init__(
        self, snapshot, cone_angles, boundary_vertices, *, pack=True, scale_true=True, **options
    ):
        super().__init__(snapshot, packs=pack, **options)
        self.cone_angles = cone_angles  # {submesh vertex: angle}
        self.boundary_vertices = boundary_vertices
        self.pack_options = {"together": True, "scale_true": scale_true}
        self.angle_error = 0.0

    def stages(self):
        self._refuse_bad_angles()
        components = labels.groups(labels.face_components(self.snapshot.triangles))
        requests = [self._request(triangles) for triangles in components]
        lefts = []
        for triangles, (part, _, angles) in zip(components, requests, strict=True):
            if not callable(angles):
                boundary = cone_sums.submesh_boundary(part)
                lefts.append((triangles, cone_sums.curvature_left(part, angles, boundary)))
        cone_sums.refuse_unbalanced(self.snapshot, lefts)
        pieces = []
        for triangles, (part, used, angles) in zip(components, requests, strict=True):
            self.solving = used, triangles
            if callable(angles):
                angles = yield angles()
            job = solver.conformal(part, angles, self.refined_start, self.precision)
            result = self.checked((yield job))
            self.angle_error = max(self.angle_error, result.stats["angle_error"])
            pieces.append(islands.Piece(triangles, used, result))
        yield from self.put_together(pieces)

    def _refuse_bad_angles(self):
        bad = [v for v, angle in self.cone_angles.items() if not angle > 0.0]
        if bad:
            why = "has a cone angle that is not above zero. Give it less curvature"
            raise mesh_io.at_vertices(self.snapshot, bad, why)

    def _request(self, triangles):
        """(part, its submesh vertices, target angles or a function that starts computing them)."""
        part, used = self.snapshot.part(triangles)
        boundary = self.boundary_vertices[used]
        cones = {
            i: self.cone_angles[v] for i, v in enumerate(used.tolist()) if v in self.cone_angles
        }
        # Without a boundary there is nothing to choose: all angles are known.
        if self.boundary == "prescribed" or not boundary.any():
            return part, used, target_angles(part, cones, boundary)
        inner = {v: a for v, a in cones.items() if not boundary[v]}
        corners = [v for v in cones if boundary[v]]
        if self.boundary == "straight" and not corners:
            raise mesh_io.MeshProblem(
                f"{cone_sums.part_name(self.snapshot, triangles)}: a straight boundary needs corners. Mark at least three of its "
                "vertices as cones, or choose another boundary",
                "face",
                np.unique(self.snapshot.triangle_face[triangles]),
            )
        corners = corners if self.boundary == "straight" else None
        start = functools.partial(solver.boundary_angles, part, self.boundary)
        return part, used, functools.partial(start, cones=inner, corners=corners)


def target_angles(part, cones: dict[int, float], boundary: np.ndarray) -> np.ndarray:
    """Flat but for the cones. They must sum up exactly, and Blender stores angles in 32 bits: what rounding left over is
    shared among them. A larger remainder is the user's and stays."""
    angles = np.where(boundary, math.pi, 2 * math.pi)
    marked = list(cones)
    angles[marked] = list(cones.values())
    left = cone_sums.curvature_left(part, angles, boundary)
    if abs(left) < ROUNDING * len(marked):
        angles[marked] -= left / len(marked)
    return angles


def make_task(snapshot, **options) -> ConformalTask:
    snapshot = separated.separated(snapshot)
    return ConformalTask(snapshot, *cone_sums.marked(snapshot), **options)


def summary(tasks: list[ConformalTask]) -> str:
    """The report line, without the time."""
    error = max(t.angle_error for t in tasks)
    return parts.packed_summary(tasks, f", cone angles within {error:.1e} rad")


class UV_OT_flipfree_conformal(
    options.Packing, options.UseModifiers, options.MapOperator, bpy.types.Operator
):
    bl_idname = "uv.flipfree_conformal"
    bl_label = "Conformal Map with Cones"
    bl_description = (
        "Map without shear, with exactly the marked cone angles. Triangles that would flip are subdivided, "
        "the cut is marked as seams"
    )
    joint_layout = True

    boundary: options.choice("Boundary", BOUNDARIES)
    refined_start: options.choice(
        "Refined Start: Add vertices while the metric is computed, so that needle-shaped triangles do no harm",
        REFINED_STARTS,
    )
    precision: options.whole(
        "Precision: Bits of the numbers in which the metric is computed, 53 to 4096; 0: as in the preferences",
        (0, 0, 4096),
    )
    mark_cuts: options.mark_cuts()
    pack: options.flag(
        "Pack Islands: Pack the islands into the unit square. Islands of one connected part turn and scale together, so that "
        "quarter turns across seams stay quarter turns",
        on=True,
    )
    scale_true: options.flag(
        "Average Islands Scale: Separate parts get the size of their surface when they are packed. Off: the size the metric "
        "has",
        on=True,
    )

    make_task = staticmethod(make_task)
    summary = staticmethod(summary)


class SuggestTask(modal.StagedTask):
    """Each connected part of the faces by itself."""

    bound, quarter_turns = 4.0, False
    scale_ratio, bound_holds = 1.0, True

    def __init__(self, snapshot, **options):
        super().__init__(snapshot, **options)
        self.cones = {}  # {submesh vertex: angle}

    def stages(self):
        for triangles in labels.groups(labels.face_components(self.snapshot.triangles)):
            part, used = self.snapshot.part(triangles)
            found = yield solver.suggest_cones(part, **self.values("bound quarter_turns"))
            self.cones.update({int(used[v]): float(found[v]) for v in found.cones.tolist()})
            self.scale_ratio = max(self.scale_ratio, found.scale_ratio)
            self.bound_holds = self.bound_holds and found.bound_holds

    def write(self, ob):
        """Cones of quarter turns go into groups, others into the attribute."""
        boundary = cone_sums.submesh_boundary(self.snapshot)
        angles = {
            int(self.snapshot.vertex_ids[vertex]): (angle, bool(boundary[vertex]))
            for vertex, angle in self.cones.items()
        }
        cones.write(ob, angles, as_groups=self.quarter_turns)


class UV_OT_flipfree_suggest_cones(options.UseModifiers, options.MapOperator, bpy.types.Operator):
    bl_idname = "uv.flipfree_suggest_cones"
    bl_label = "Suggest Cones"
    bl_description = "Place cones one by one where a conformal map would scale most, until scales differ no more than the bound"

    bound: options.scale_bound(4.0)
    quarter_turns: options.flag(
        "Quarter Turns: Angles in multiples of 90 degrees, as seamless maps want them"
    )

    @staticmethod
    def make_task(snapshot, **options):
        return SuggestTask(separated.separated(snapshot), **options)

    @staticmethod
    def summary(tasks):
        count = sum(len(t.cones) for t in tasks)
        ratio = max(t.scale_ratio for t in tasks)
        missed = "" if all(t.bound_holds for t in tasks) else ", bound not reached"
        return f"{common.plural(count, 'cone')}, scales differ by {ratio:.3g}{missed}"


class MESH_OT_flipfree_mark_cone(common.PlainOperator, bpy.types.Operator):
    bl_idname = "mesh.flipfree_mark_cone"
    bl_label = "Mark Cone"
    bl_description = "Make the selected vertices cones of so many quarter turns (0 removes them) and say what is still missing"

    quarter_turns: options.whole(
        "Quarter Turns: Curvature in quarter turns: 1 is the corner of a cube, -1 a saddle",
        (1, -40, 3),
    )

    @classmethod
    def poll(cls, context):
        return common.allowed(
            cls, context.mode == "EDIT_MESH", "Works in Edit Mode, on selected vertices"
        )

    def work(self, context):
        ob = context.edit_object
        marked = cones.mark_selected(ob, self.quarter_turns)
        if not marked:
            raise mesh_io.MeshProblem(f"{ob.name}: no vertices are selected")
        return f"{common.plural(marked, 'cone')} marked. {cones.balance(ob)}"


class UV_OT_flipfree_clear_cones(common.PlainOperator, bpy.types.Operator):
    bl_idname = "uv.flipfree_clear_cones"
    bl_label = "Clear Cones"
    bl_description = (
        "Take away all marks of cones, those of the groups `Cone +1`, `Cone -1`, ... and those of the attribute `cone_angle`: of "
        "the selected objects, in Edit Mode of the selected vertices"
    )

    poll = classmethod(common.poll)

    def work(self, context):
        count = sum(cones.clear(ob) for ob in common.meshes(context))
        return f"{common.plural(count, 'cone')} cleared" if count else "No cone is marked there"
