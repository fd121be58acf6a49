# SPDX-License-Identifier: GPL-3.0-or-later
"""Quad Remesh: the surface as a mesh of quads along a cross field (docs/quads.md)."""

import dataclasses

import bpy
import numpy as np

from .. import modal, scene, solver
from ..fields import field_aligned, sources
from ..meshes import mesh_io, separated
from ..meshes.writing import carried as writing
from . import common, options

FIELDS = {
    "automatic": "Automatic: Smooth, and a little along curvature where that makes no more irregular vertices",
    **field_aligned.FOLLOWED,
}


SYMMETRIES = {
    "none": "None: Both sides as they are",
    **{axis: f"{axis.upper()}: Left and right of the object's {axis.upper()}" for axis in "xyz"},
}


class QuadsTask(modal.StagedTask):
    """own: (#Sv, 3) the snapshot's vertices in the object; its `vertices` are turned and scaled into the scene."""

    cures = {
        "bad angles": "Round it off there, or choose another Field",
        "time limit reached": "Allow more time in the preferences, or ask for fewer Quads",
    }

    target, edge_length, field_from, adaptive = 2000, 0.0, "automatic", 0.0
    symmetry, replace = None, True

    def __init__(self, snapshot, own, **options):
        """options: those of density as sources.look() has them."""
        self.density = {k: options.pop(k) for k in list(options) if k.startswith("density")}
        super().__init__(snapshot, **options)
        self.own = own

    def stages(self):
        name = self.snapshot.object_name
        if self.replace and len(self.snapshot.other_loops):
            raise mesh_io.MeshProblem(
                f"{name}: some faces are hidden, and would be lost. Alt H in Edit Mode reveals them, or turn off Replace"
            )
        field = features = None
        own = self.field_from in ("automatic", "edges")
        given = sources.look(
            self.snapshot,
            field_from="smooth" if self.field_from == "automatic" else self.field_from,
            merge_cones=self.density.get("density", "uniform") == "uniform",
            **self.density,
        )
        if own or self.symmetry:
            features = given.follow["sharp_edges"] if given.features else None
        else:
            self.span = (0.0, 0.2)
            field = yield solver.cross_field(self.snapshot, sizing=given.sizing, **given.follow)
            self.span = (0.2, 1.0)
        self.result = yield solver.quads(
            self.snapshot,
            field=field,
            features=features,
            sizing=given.sizing,
            **self.values("adaptive symmetry"),
            **self.values("edge_length" if self.edge_length else "target"),
        )

    def write(self, ob):
        old, found = ob.data, self.result
        if mesh_io.counts(ob) != self.snapshot.counts:
            raise mesh_io.MeshProblem(
                f"{ob.name}: the mesh was changed while its quads were computed. Run the operator again"
            )
        carried = writing.Carried(ob, self.snapshot, self.own, found, self.symmetry)
        mesh = carried.mesh(old.name)
        if self.replace:
            name = old.name
            old.user_remap(mesh)
            bpy.data.meshes.remove(old)
            mesh.name = name
        else:
            ob = self._beside(ob, mesh)
        carried.give(ob)

    def _beside(self, ob, mesh):
        """A copy of the object with this mesh, in its collections; it is selected in place of the object, which is hidden."""
        made = ob.copy()
        made.data = mesh
        made.name = f"{ob.name} Quads"
        for collection in ob.users_collection:
            collection.objects.link(made)
        active = bpy.context.view_layer.objects.active == ob
        ob.select_set(False)
        ob.hide_set(True)
        made.select_set(True)
        if active:
            bpy.context.view_layer.objects.active = made
        return made


def make_task(snapshot, *, symmetry="none", **options) -> QuadsTask:
    snapshot = separated.separated(snapshot)
    ob = bpy.data.objects[snapshot.object_name]
    if symmetry == "none":
        placed = scene.placed_vertices(snapshot.vertices, snapshot.triangles, ob)
    else:  # about the object's own plane
        placed = snapshot.vertices * np.abs(ob.matrix_world.to_scale())
    whole = dataclasses.replace(snapshot, vertices=placed)
    axis = None if symmetry == "none" else symmetry
    return QuadsTask(whole, snapshot.vertices, symmetry=axis, **options)


def summary(tasks: list[QuadsTask]) -> str:
    """The report line, without the time."""
    found = [task.result.certificate for task in tasks]
    quads, genus, borders = (
        sum(getattr(c, name) for c in found) for name in ("quads", "genus", "borders")
    )
    kept = f"genus {genus}" + (f" and {common.plural(borders, 'border')}" if borders else "")
    sharp, missed = (
        sum(task.result.stats[name] for task in tasks) for name in ("features", "features_missed")
    )
    close = sum(task.result.stats["features_close"] for task in tasks)
    nearer = f" but {close} at less than a fifth of a quad from others" if close else ""
    exact = f"{sharp - missed} of {sharp} sharp edges kept{nearer}, " if sharp else ""
    clean = [task.snapshot.clean for task in tasks if task.snapshot.clean is not None]
    return (
        f"{common.plural(quads, 'quad')}, {sum(len(c.irregular) for c in found)} irregular, "
        f"{sum(len(c.turned) for c in found)} turned, {kept} kept, {exact}"
        f"off by {100.0 * max(c.hausdorff for c in found):.2g} % at most{common.separated_text(clean)}"
    )


class UV_OT_flipfree_quads(field_aligned.Densities, options.MapOperator, bpy.types.Operator):
    bl_idname = "uv.flipfree_quads"
    bl_label = "Quad Remesh"
    bl_description = (
        "Make a mesh of quads of the surface, with its topology, whose edges follow a field. Materials, UV maps, vertex groups, "
        "shape keys, attributes and marks of edges are carried over"
    )
    option_names = (
        "target edge_length field_from adaptive density density_name density_ratio symmetry replace"
    ).split()

    target: options.whole("Quads: About how many quads each object becomes", (2000, 1, 10_000_000))
    edge_length: options.real(
        "Edge Length: How long the sides of quads are in the scene; 0: as their number makes them",
        (0.0, 0.0),
        subtype="DISTANCE",
    )
    field_from: options.choice("Field: What the edges of quads run along", FIELDS)
    adaptive: options.real(
        "Adaptive: How much denser quads are where the surface bends more; at 100 they are off it by about as much everywhere. "
        "There are more irregular vertices then",
        (0.0, 0.0, 100.0),
        subtype="PERCENTAGE",
    )
    symmetry: options.choice(
        "Symmetry: The half on the positive side of this axis of the object becomes quads, along a field of its own and, with "
        "that Field, sharp edges; and is mirrored",
        SYMMETRIES,
    )
    replace: options.flag(
        "Replace: The quads take the place of the object's mesh. Off: they are a new object, and the old one is hidden"
    )

    make_task = staticmethod(make_task)
    summary = staticmethod(summary)

    @classmethod
    def poll(cls, context):
        return common.allowed(
            cls, context.mode == "OBJECT", "Works in Object Mode"
        ) and super().poll(context)

    def needs(self):
        return super().needs() | {"target": not self.edge_length}

    def advice(self, tasks):
        raised = any(task.result.stats.get("count_raised") for task in tasks)
        return "Whole numbers leave no mesh of so few quads: there are more" if raised else ""
