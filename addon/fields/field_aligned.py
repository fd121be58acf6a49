# SPDX-License-Identifier: GPL-3.0-or-later
"""Field-Aligned Seamless Map (thesis 6, docs/field-aligned.md)."""

import inspect
import math

import bpy
import numpy as np

import flipfree

from .. import solver
from ..meshes import cones, fields, mesh_io, separated
from ..operators import cone_sums, options, seamless
from . import sources

FIELDS = {
    "curvature": "Curvature: Along the directions in which the surface bends most and least, as far as it bends; smooth "
    "elsewhere",
    "smooth": "Smooth: With as little turning as the surface allows: least distortion",
    "edges": "Sharp Edges: Along the edges that are marked as sharp and, if none is, along those at which the surface folds; "
    "smooth elsewhere",
    "flow": "Edge Flow: Along the edges of faces with four corners; smooth elsewhere",
    "attribute": "Face Attribute: One direction of each face, in object coordinates, is in an attribute of faces: drawn by "
    "Geometry Nodes, or that of an earlier run",
    "cones": "Marked Cones: The smoothest one with the cones of the cone groups and `cone_angle`, and no others, and with the "
    "turns of the rings that Mark Line, Path or Loop marked",
    "file": "Field File: One that other software made for this mesh: .rawfield, .ffield, or a rotation form, a number per "
    "half-edge",
    "signature": "Signature File: The smoothest one with the cones and turning numbers of a JSON file",
}
# Those that need nothing but the mesh.
FOLLOWED = {name: FIELDS[name] for name in ("curvature", "smooth", "edges", "flow")}

BOUNDARIES = {
    "aligned_or_free": "Along the Axes: The field follows the boundary, which runs exactly along u and v, with corners where "
    "it is sharp. Where no such map is found, the boundary is free, and the report says so",
    "aligned": "Along the Axes Only: The same, but nothing is changed if no such map is found",
    "free": "Free: As near to the surface as the inside allows: for ragged rims",
}

DENSITIES = {
    "uniform": "Uniform: One scale everywhere, as far as the field lets it",
    "painted": "Painted: Denser where a vertex group has weight",
    "attribute": "Attribute: A positive number per point or face: the length in the map of a length 1 there, relative to the "
    "others",
}


class FieldAlignedTask(seamless.SeamlessTask):
    """All connected parts of the faces in one map that follows a field, with its cones."""

    failed_cure = "take a smoother field, or clean up thin faces"

    @property
    def poor_cure(self):
        cure = "Subdivide or remesh where polygons are coarse, or take a smoother field"
        return cure if self.given.sizing is None else f"{cure}, or less difference in density"

    reroute = write_field = True

    def __init__(self, snapshot, given, **options):
        """given: what the mesh says, or a MeshProblem that reading it met. options: as of a seamless map."""
        known = isinstance(given, sources.Given)
        super().__init__(
            snapshot,
            known and given.cones or {},
            cone_sums.submesh_boundary(snapshot),
            **options,
        )
        self.given = given
        self.field = None
        self.off = 0.0  # degrees between map and field, mean by area
        self.sharp = self.sharp_missed = 0  # edges that shall be lines of the map

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
        self.sharp = max(found.certificate.feature_edges, 0)
        self.sharp_missed = len(found.certificate.features_missed)
        yield from self.take((yield from self.finishing(found)))
        if may_be_free and self.boundary == "free":
            self.freed_boundaries = sum(
                bool(self.boundary_vertices[self.snapshot.triangles[part]].any())
                for part in self.components()
            )

    def finishing(self, found):
        """What is done to the map before it is placed."""
        return found
        yield

    def _follow(self, aligned):
        """The field, and the map that follows it."""
        self.span = (0.0, 0.2)
        if self.given.field is not None:
            self.field = self.given.field
        else:
            given = self.given.signature
            if self.given.cones is not None:
                self.quarters = self._marked_quarters()
                self._refuse_unbalanced(self.components())
                given = flipfree.Signature(self.quarters, self.given.loops)
            self.field = yield solver.cross_field(
                self.snapshot,
                # Where near cones are merged, those that densities need would be merged first.
                sizing=None if self.given.follow["simplify"] else self.given.sizing,
                signature=given,
                boundary=aligned,
                **self.given.follow,
            )
        self.span = (0.2, 0.9)
        follow = self.given.follow
        return (
            yield solver.field_aligned(
                self.snapshot,
                field=self.field,
                features=follow["sharp_edges"] if self.exact_edges() else None,
                sizing=self.given.sizing,
                boundary="aligned" if aligned else "free",
                **self.values("engine reroute optimise"),
            )
        )

    def exact_edges(self):
        """Whether what the field follows exactly shall be lines of the map."""
        wanted = self.given.features and self.given.follow["edge_weight"] == 1.0
        return wanted and self.optimise and self.pin_group is None

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


# Options of the operator that say what the field is; the others are the task's.
_OF_SOURCE = frozenset(inspect.signature(sources.look).parameters)


def make_task(snapshot, *, task=None, **options) -> FieldAlignedTask:
    source = {name: value for name, value in options.items() if name in _OF_SOURCE}
    try:
        snapshot = separated.separated(snapshot)
        given = sources.look(snapshot, **source)
    except mesh_io.MeshProblem as problem:  # of this object: others go on
        given = problem
    others = {name: value for name, value in options.items() if name not in _OF_SOURCE}
    return (task or FieldAlignedTask)(snapshot, given, **others)


def summary(tasks: list[FieldAlignedTask]) -> str:
    """The report line, without the time."""
    sizes = [sum(c.triangles for c in t.certificates) for t in tasks]
    off = sum(t.off * size for t, size in zip(tasks, sizes, strict=True)) / max(sum(sizes), 1)
    sharp, missed = (sum(getattr(t, name) for t in tasks) for name in ("sharp", "sharp_missed"))
    exact = f", {sharp - missed} of {sharp} sharp edges on lines" if sharp else ""
    return seamless.figures(tasks, f", {off:.1f} degrees off the field{exact}")


class AlongField:
    """Options of operators whose maps follow a field."""

    curvature: options.real(
        "Curvature: How much curvature counts against smoothness; 0 not at all",
        (0.5, 0.0, 1.0),
        subtype="FACTOR",
    )
    sharp_angle: options.real(
        "Sharp from: Edges at which the surface folds by more are followed, where none is marked as sharp",
        (sources.SHARP, 0.0, math.pi),
        subtype="ANGLE",
    )
    boundary: options.choice("Boundary: Where the surface is open", BOUNDARIES)


class Densities:
    """Options of operators that make some places denser than others."""

    density: options.choice("Density: How large the map is, relative to the surface", DENSITIES)
    density_name: options.words("From: Vertex group, or attribute, with the density")
    density_ratio: options.real(
        "Ratio: How many times longer the map is where the vertex group has its full weight than where it has none",
        (2.0, 0.1, 10.0),
    )

    def draw_option(self, layout, context, name):
        ob = context.object
        if name not in {"attribute", "density_name"} or ob is None or ob.type != "MESH":
            layout.prop(self, name)
        elif name == "density_name" and self.density == "painted":
            layout.prop_search(self, name, ob, "vertex_groups")
        else:
            layout.prop_search(self, name, ob.data, "attributes")

    def needs(self):
        return {
            "density_name": self.density != "uniform",
            "density_ratio": self.density == "painted",
        }


class UV_OT_flipfree_field_aligned(AlongField, Densities, options.MapOperator, bpy.types.Operator):
    bl_idname = "uv.flipfree_field_aligned"
    bl_label = "Field-Aligned Seamless Map"
    bl_description = (
        "Compute four directions in every face that follow the surface, and a seamless map whose lines follow them: "
        "textures run along the form. The cut is marked as seams"
    )
    option_names = (
        "field_from curvature sharp_angle edge_weight attribute field_file merge_cones density "
        "density_name density_ratio boundary optimise fit mark_cuts mark_cones write_field "
        "meet_pins engine reroute"
    ).split()
    advanced = ("engine", "reroute")

    field_from: options.choice("Field: What the lines of the map run along", FIELDS)
    edge_weight: options.real(
        "Weight: How much edges count against smoothness; 1: they are followed exactly",
        (1.0, 0.01, 1.0),
        subtype="FACTOR",
    )
    attribute: options.words(
        "Attribute: Attribute of faces with a vector each: one of the field's four directions, in object coordinates",
        default=fields.NAME,
    )
    field_file: options.words(
        "File: With the field or the signature of the whole mesh, whose triangles and vertices it counts",
        subtype="FILE_PATH",
    )
    merge_cones: options.flag(
        "Merge Near Cones: Near cones that bend opposite ways are merged: fewer seams, and a field that turns a little more. "
        "Off, densities are met more nearly: what makes room for them are pairs of such cones",
        on=True,
    )
    optimise: options.flag("Optimise: Bring the map to the field; the seams keep matching", on=True)
    fit: options.fit_unit_square()
    mark_cuts: options.mark_cuts(", with their quarter turns in the attribute `seam_turns`")
    mark_cones: options.flag(
        "Mark Cones: Put the field's cones into the groups `Cone +1`, `Cone -1`, ... in place of those that are marked there; "
        "for the other maps with cones, and for drawing them",
        on=True,
    )
    write_field: options.flag(
        f"Write Field: Store a direction per face in the attribute `{fields.NAME}`; for other tools, and for drawing it over "
        "the model",
        on=True,
    )

    meet_pins: options.meet_pins()
    engine: options.engine()
    reroute: options.flag(
        "Reroute: Padding: branches of the cut are led around cones until all loops turn as the field does. Off: they turn as "
        "they happen to, with the field's cones alone",
        on=True,
    )

    def needs(self):
        return super().needs() | {
            "field_file": self.field_from in {"file", "signature"},
            "curvature": self.field_from == "curvature",
            "sharp_angle": self.field_from == "edges",
            "edge_weight": self.field_from in {"edges", "flow"},
            "attribute": self.field_from == "attribute",
            "merge_cones": self.field_from not in {"attribute", "cones", "file", "signature"},
        }

    make_task = staticmethod(make_task)
    summary = staticmethod(summary)
