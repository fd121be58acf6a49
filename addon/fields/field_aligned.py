# SPDX-License-Identifier: GPL-3.0-or-later
"""Field-Aligned Seamless Map (thesis 6, docs/field-aligned.md)."""

import math

import bpy
import numpy as np

import flipfree

from .. import solver
from ..meshes import cones, fields, mesh_io, separated
from ..operators import common, cone_sums, options, parts, seamless
from . import sources

FIELDS = (
    (
        "curvature",
        "Curvature",
        "Along the directions in which the surface bends most and least, as far as it bends; smooth elsewhere",
    ),
    ("smooth", "Smooth", "With as little turning as the surface allows: least distortion"),
    (
        "edges",
        "Sharp Edges",
        "Along the edges that are marked as sharp and, if none is, along those at which the surface folds; smooth elsewhere",
    ),
    ("flow", "Edge Flow", "Along the edges of faces with four corners; smooth elsewhere"),
    (
        "attribute",
        "Face Attribute",
        "One direction of each face, in object coordinates, is in an attribute of faces: drawn by Geometry Nodes, or that "
        "of an earlier run",
    ),
    (
        "cones",
        "Marked Cones",
        "The smoothest one with the cones of the cone groups and `cone_angle`, and no others; closed surfaces only",
    ),
)

BOUNDARIES = (
    (
        "aligned_or_free",
        "Along the Axes",
        "The field follows the boundary, which runs exactly along u and v, with corners where it is sharp. Where no such map is "
        "found, the boundary is free, and the report says so",
    ),
    (
        "aligned",
        "Along the Axes Only",
        "The same, but nothing is changed if no such map is found",
    ),
    ("free", "Free", "As near to the surface as the inside allows: for ragged rims"),
)

DENSITIES = (
    ("uniform", "Uniform", "One scale everywhere, as far as the field lets it"),
    ("painted", "Painted", "Denser where a vertex group has weight"),
    (
        "attribute",
        "Attribute",
        "A positive number per point or face: the length in the map of a length 1 there, relative to the others",
    ),
)


class FieldAlignedTask(seamless.SeamlessTask):
    """All connected parts of the faces in one map that follows a field, with its cones."""

    failed_cure = "take a smoother field, or clean up thin faces"

    @property
    def poor_cure(self):
        cure = "Subdivide or remesh where polygons are coarse, or take a smoother field"
        return cure if self.given.sizing is None else f"{cure}, or less difference in density"

    def __init__(
        self,
        snapshot,
        given,
        *,
        boundary="aligned_or_free",
        optimise=True,
        fit=True,
        mark_cuts=True,
        mark_cones=True,
        write_field=True,
    ):
        """given: what the mesh says, or a MeshProblem that reading it met."""
        known = isinstance(given, sources.Given)
        super().__init__(
            snapshot,
            known and given.cones or {},
            cone_sums.submesh_boundary(snapshot),
            boundary=boundary,
            optimise=optimise,
            fit=fit,
            mark_cuts=mark_cuts,
            mark_cones=mark_cones,
        )
        self.given = given
        self.write_field = write_field
        self.field = None
        self.off = 0.0  # degrees between map and field, mean by area

    @property
    def cures(self):
        return {
            **super().cures,
            "bad angles": self.cure("take another source for the field, or smooth it there"),
        }

    def stages(self):
        if isinstance(self.given, mesh_io.MeshProblem):
            raise self.given
        may_be_free = self.boundary == "aligned_or_free" and self.boundary_vertices.any()
        try:
            found = yield from self._follow(self.boundary != "free")
        except (flipfree.InvalidInput, flipfree.Infeasible, flipfree.NotConverged):
            if not may_be_free:
                raise
            self.boundary = "free"
            found = yield from self._follow(False)
        self.quarters = {int(v): int(k) for v, k in found.certificate.quarter_cones}
        if self.boundary != "free":
            self.quarters |= self._corners(found)
        self.off = math.degrees(found.stats["angle_mean"])
        yield from self.take(found)
        if may_be_free and self.boundary == "free":
            self.freed_boundaries = sum(
                bool(self.boundary_vertices[self.snapshot.triangles[part]].any())
                for part in self.components()
            )

    def _follow(self, aligned):
        """The field, and the map that follows it."""
        self.span = (0.0, 0.2)
        if self.given.directions is not None:
            self.field = flipfree.CrossField(self.given.directions)
        else:
            given = None
            if self.given.cones is not None:
                given = self.quarters = self._marked_quarters()
                self._refuse_unbalanced(self.components())
            self.field = yield solver.cross_field(
                self.snapshot,
                # Where near cones are merged, those that densities need would be merged first.
                sizing=None if self.given.follow["simplify"] else self.given.sizing,
                cones=given,
                boundary=aligned,
                **self.given.follow,
            )
        self.span = (0.2, 0.9)
        return (
            yield solver.field_aligned(
                self.snapshot,
                self.field,
                sizing=self.given.sizing,
                boundary="aligned" if aligned else "free",
                optimise=self.optimise,
            )
        )

    def _corners(self, found):
        """{submesh vertex: quarter turns} where the boundary of the map is not straight."""
        uv = found.uv64[..., 0] + 1j * found.uv64[..., 1]
        ahead, back = (np.roll(uv, -k, axis=1) - uv for k in (1, 2))
        angle = np.angle(back / ahead).ravel() / (math.pi / 2)
        total = np.bincount(found.faces.ravel(), angle)[: len(self.boundary_vertices)]
        turns = np.rint(total).astype(int)
        bent = np.flatnonzero(self.boundary_vertices & (turns != 2))
        return {int(v): int(turns[v]) for v in bent}

    def mark(self, ob):
        if self.mark_cones:
            ids = self.snapshot.vertex_ids
            flat = np.where(self.boundary_vertices, 2, 4)
            bent = {int(ids[v]): int(flat[v]) - k for v, k in self.quarters.items()}
            cones.replace(ob, ids.tolist(), bent)
        if self.write_field:
            fields.write(ob, *fields.of_faces(self.snapshot, self.field.directions))


def make_task(
    snapshot,
    *,
    boundary="aligned_or_free",
    optimise=True,
    fit=True,
    mark_cuts=True,
    mark_cones=True,
    write_field=True,
    **source,
) -> FieldAlignedTask:
    """source: arguments of sources.look."""
    try:
        snapshot = separated.separated(snapshot)
        given = sources.look(snapshot, **source)
    except mesh_io.MeshProblem as problem:  # of this object: others go on
        given = problem
    return FieldAlignedTask(
        snapshot,
        given,
        boundary=boundary,
        optimise=optimise,
        fit=fit,
        mark_cuts=mark_cuts,
        mark_cones=mark_cones,
        write_field=write_field,
    )


def summary(tasks: list[FieldAlignedTask]) -> str:
    """The report line, without the time."""
    certificates = [c for t in tasks for c in t.certificates]
    triangles = sum(c.triangles for c in certificates)
    mean = sum(c.energy * c.triangles for c in certificates) / max(triangles, 1)
    off = sum(t.off * c.triangles for t in tasks for c in t.certificates) / max(triangles, 1)
    edges = sum(c.seam_edges for c in certificates)
    return ", ".join(
        [
            common.plural(sum(t.island_count() for t in tasks), "island"),
            common.plural(sum(len(t.quarters) for t in tasks), "cone"),
            f"{off:.1f} degrees off the field",
            f"{sum(c.seams_exact32 for c in certificates)} of {common.plural(edges, 'seam edge')} exact",
            common.plural(sum(max(c.flips32, 0) for c in certificates), "flip"),
            f"distortion mean {mean:.3f} max {max(c.max_energy for c in certificates):.3g} on "
            + common.plural(triangles, "triangle"),
            parts.added(tasks),
        ]
    ) + common.separated_text(certificates)


class UV_OT_flipfree_field_aligned(options.MapOperator, bpy.types.Operator):
    bl_idname = "uv.flipfree_field_aligned"
    bl_label = "Field-Aligned Seamless Map"
    bl_description = (
        "Compute four directions in every face that follow the surface, and a seamless map whose lines follow them: "
        "textures run along the form. The cut is marked as seams"
    )
    bl_options = {"REGISTER", "UNDO"}
    verb = "Field-Aligned Map"
    option_names = (
        "field_from",
        "curvature",
        "sharp_angle",
        "edge_weight",
        "attribute",
        "merge_cones",
        "density",
        "density_name",
        "density_ratio",
        "boundary",
        "optimise",
        "fit",
        "mark_cuts",
        "mark_cones",
        "write_field",
    )

    field_from: bpy.props.EnumProperty(
        name="Field",
        description="What the lines of the map run along",
        items=FIELDS,
        default="curvature",
    )
    curvature: bpy.props.FloatProperty(
        name="Curvature",
        description="How much curvature counts against smoothness; 0 not at all",
        default=0.5,
        min=0.0,
        max=1.0,
        subtype="FACTOR",
    )
    sharp_angle: bpy.props.FloatProperty(
        name="Sharp from",
        description="Edges at which the surface folds by more are followed, where none is marked as sharp",
        default=sources.SHARP,
        min=0.0,
        max=math.pi,
        subtype="ANGLE",
    )
    edge_weight: bpy.props.FloatProperty(
        name="Weight",
        description="How much edges count against smoothness; 1: they are followed exactly",
        default=1.0,
        min=0.01,
        max=1.0,
        subtype="FACTOR",
    )
    attribute: bpy.props.StringProperty(
        name="Attribute",
        description="Attribute of faces with a vector each: one of the field's four directions, in object coordinates",
        default=fields.NAME,
    )
    merge_cones: bpy.props.BoolProperty(
        name="Merge Near Cones",
        description="Near cones that bend opposite ways are merged: fewer seams, and a field that turns a little more. Off, "
        "densities are met more nearly: what makes room for them are pairs of such cones",
        default=True,
    )
    density: bpy.props.EnumProperty(
        name="Density",
        description="How large the map is, relative to the surface",
        items=DENSITIES,
        default="uniform",
    )
    density_name: bpy.props.StringProperty(
        name="From",
        description="Vertex group, or attribute, with the density",
    )
    density_ratio: bpy.props.FloatProperty(
        name="Ratio",
        description="How many times longer the map is where the vertex group has its full weight than where it has none",
        default=2.0,
        min=0.1,
        max=10.0,
    )
    boundary: bpy.props.EnumProperty(
        name="Boundary",
        description="Where the surface is open",
        items=BOUNDARIES,
        default="aligned_or_free",
    )
    optimise: bpy.props.BoolProperty(
        name="Optimise",
        description="Bring the map to the field; the seams keep matching",
        default=True,
    )
    fit: options.fit_unit_square()
    mark_cuts: options.mark_cuts(", with their quarter turns in the attribute `seam_turns`")
    mark_cones: bpy.props.BoolProperty(
        name="Mark Cones",
        description=(
            "Put the field's cones into the groups `Cone +1`, `Cone -1`, ... in place of those that are marked there; for "
            "the other maps with cones, and for drawing them"
        ),
        default=True,
    )
    write_field: bpy.props.BoolProperty(
        name="Write Field",
        description=(
            f"Store a direction per face in the attribute `{fields.NAME}`; for other tools, and for drawing it over the model"
        ),
        default=True,
    )

    def has_effect(self, name):
        needs = {
            "curvature": self.field_from == "curvature",
            "sharp_angle": self.field_from == "edges",
            "edge_weight": self.field_from in {"edges", "flow"},
            "attribute": self.field_from == "attribute",
            "merge_cones": self.field_from not in {"attribute", "cones"},
            "density_name": self.density != "uniform",
            "density_ratio": self.density == "painted",
        }
        return needs.get(name, True)

    def draw_option(self, layout, context, name):
        ob = context.object
        if name not in {"attribute", "density_name"} or ob is None or ob.type != "MESH":
            layout.prop(self, name)
        elif name == "density_name" and self.density == "painted":
            layout.prop_search(self, name, ob, "vertex_groups")
        else:
            layout.prop_search(self, name, ob.data, "attributes")

    def make_task(self, snapshot, **options):
        return make_task(snapshot, **options)

    def summary(self, tasks):
        return summary(tasks)


CLASSES = (UV_OT_flipfree_field_aligned,)
