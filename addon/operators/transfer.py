# SPDX-License-Identifier: GPL-3.0-or-later
"""Transfer Through UVs: from one surface to another over their common map (thesis 3.4.1, docs/match-pins.md)."""

import bpy
import numpy as np

import flipfree

from .. import compat, modal
from ..meshes import mesh_io, refine, selection
from . import common, options


class TransferTask(modal.Task):
    """source: snapshot of the object that is taken from. carried: of that object (carried_by)."""

    def __init__(self, snapshot, source, carried, *, shape=True):
        super().__init__(snapshot)
        self.source = source
        self.carried = carried
        self.shape = shape
        self.writes = snapshot.object_name != source.object_name

    def start(self):
        if not self.writes:
            return
        both = self.snapshot, self.source
        for snapshot in both:
            common.refuse_nonfinite_uvs(snapshot)
        try:
            there = flipfree.compose(*((s.vertices, s.triangles, s.corner_uv) for s in both))
            face, self.weights = there.map_corners()
        except flipfree.InvalidInput as error:
            raise mesh_io.MeshProblem(
                f"{self.snapshot.object_name}: its map and that of {self.source.object_name} are no maps onto one shape: {error} "
                "Embed in Polygon makes such"
            ) from error
        self.corners = self.source.triangle_loops[face]
        self.places = np.einsum(
            "mcw,mcwd->mcd", self.weights, self.source.vertices[self.source.triangles[face]]
        )

    def write(self, ob):
        if mesh_io.counts(ob) != self.snapshot.counts:
            raise mesh_io.MeshProblem(f"{ob.name}: the mesh was changed. Run the operator again")
        loops, first = np.unique(self.snapshot.triangle_loops, return_index=True)
        corners, weights = (x.reshape(-1, 3)[first] for x in (self.corners, self.weights))
        vertex_of = compat.corner_vertices(ob.data)
        points, one = np.unique(vertex_of[loops], return_index=True)
        for (name, domain, kind), values in self.carried.items():
            at = np.einsum("kw,kwd->kd", weights, values[corners])
            if domain == "GROUP":
                group = ob.vertex_groups.get(name) or ob.vertex_groups.new(name=name)
                for v, (weight,) in zip(points.tolist(), at[one].tolist(), strict=True):
                    group.add([v], weight, "REPLACE")
            elif domain == "POINT":
                _put(ob.data, name, kind, domain, points, at[one])
            else:
                _put(ob.data, name, kind, domain, loops, at)
        if not self.shape:
            return
        name = self.source.object_name
        if ob.data.shape_keys is None:
            ob.shape_key_add(name="Basis", from_mix=False)
        key = ob.data.shape_keys.key_blocks.get(name) or ob.shape_key_add(name=name, from_mix=False)
        places = compat.values(key.data, "co", np.float32, 3)
        places[points] = self.places.reshape(-1, 3)[first][one]
        key.data.foreach_set("co", places.ravel())
        key.value = 1.0


def _put(mesh, name, kind, domain, rows, values):
    """Into an attribute, unless there is another one of that name."""
    found = mesh.attributes.get(name) or mesh.attributes.new(name, kind, domain)
    if (found.data_type, found.domain) != (kind, domain):
        return
    every = compat.rows(found.data, kind)
    every[rows] = values
    found.data.foreach_set(compat.SUMS[kind][0], every.ravel())


def carried_by(ob) -> dict:
    """{(name, domain, type): (#loops, k) values}: vertex groups but for those that mark, attributes of vertices and corners but
    for the active UV map."""
    mesh, found = ob.data, {}
    vertex_of = compat.corner_vertices(mesh)
    marking = refine.marking_groups(ob)
    groups = [group for group in ob.vertex_groups if group.index not in marking]
    for group, weights in zip(groups, selection.weights(mesh, *groups), strict=True):
        found[group.name, "GROUP", ""] = weights[vertex_of, None]
    left_out = {"position", mesh.uv_layers.active.name}
    for attribute in mesh.attributes:
        kind, domain, name = attribute.data_type, attribute.domain, attribute.name
        known = kind in compat.SUMS and domain in {"POINT", "CORNER"}
        if not known or name in left_out or name.startswith(".") or attribute.is_internal:
            continue
        values = compat.rows(attribute.data, kind)
        found[name, domain, kind] = values[vertex_of] if domain == "POINT" else values
    return found


def make_task(snapshot, *, source="", shape=True) -> TransferTask:
    """source: an object's name; "": the active one."""
    ob = bpy.data.objects.get(source) if source else bpy.context.view_layer.objects.active
    if ob is None or ob.type != "MESH" or ob.data.uv_layers.active is None:
        raise mesh_io.MeshProblem(f"{source or 'The active object'} is no mesh with a UV map")
    taken = mesh_io.read(ob, only_selected=False)
    return TransferTask(snapshot, taken, carried_by(ob), shape=shape)


class UV_OT_flipfree_transfer(options.MapOperator, bpy.types.Operator):
    bl_idname = "uv.flipfree_transfer"
    bl_label = "Transfer Through UVs"
    bl_description = (
        "Each selected object gets what the active one has at the same place of its UV map: its shape, as a shape key, its "
        "vertex groups, colours and other UV maps. Both maps cover one shape, each point once, such as those of Embed in Polygon"
    )
    needs_uv = True

    source: options.words("From: Object that is taken from; empty: the active one")
    shape: options.flag("Shape Key: Take the shape, as a shape key of the object's name", on=True)

    @classmethod
    def poll(cls, context):
        return common.allowed(
            cls,
            context.mode == "OBJECT",
            "Works in Object Mode: select meshes, the one to take from last",
        ) and super().poll(context)

    make_task = staticmethod(make_task)

    def make_run(self, context):
        source = self.source or getattr(context.object, "name", "")
        if all(ob.name == source for ob in common.meshes(context)):
            raise mesh_io.MeshProblem(f"Select the meshes that shall be like {source}, too")
        return (yield from super().make_run(context))

    def draw_option(self, layout, context, name):
        if name == "source":
            layout.prop_search(self, name, context.scene, "objects")
        else:
            layout.prop(self, name)

    @staticmethod
    def summary(tasks):
        layers = len(tasks[0].carried)
        count = common.plural(sum(len(t.snapshot.vertices) for t in tasks), "vertex", "vertices")
        return f"{count} like {tasks[0].source.object_name}, {common.plural(layers, 'layer')} carried over"
