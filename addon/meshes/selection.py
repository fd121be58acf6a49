# SPDX-License-Identifier: GPL-3.0-or-later
"""What is selected: which faces are worked on, and showing places, in Edit Mode and outside."""

from collections.abc import Iterable
from contextlib import contextmanager

import bmesh
import bpy
import numpy as np

from .. import compat


def hidden_faces(mesh: bpy.types.Mesh) -> np.ndarray:
    """(#faces,) bool."""
    return _flags(mesh.polygons, "hide")


def selected_faces(mesh: bpy.types.Mesh, in_uv_editor: bool) -> np.ndarray:
    """(#faces,) bool: selected and visible. in_uv_editor: selected there as well."""
    chosen = _flags(mesh.polygons, "select") & ~hidden_faces(mesh)
    active = mesh.uv_layers.active
    if in_uv_editor and active:
        chosen &= compat.uv_selected_faces(mesh, active.name)
    return chosen


@contextmanager
def whole_mesh(ob):
    """The object's mesh with all of its attributes, in either mode; to be read only."""
    if ob.mode != "EDIT":
        yield ob.data
        return
    ob.update_from_editmode()
    mesh = ob.data.copy()
    try:
        yield mesh
    finally:
        bpy.data.meshes.remove(mesh)


@contextmanager
def in_object_mode(ob):
    """The object's mesh outside Edit Mode, to be written to."""
    editing = ob.mode == "EDIT"
    if editing:
        bpy.ops.object.mode_set(mode="OBJECT")
    try:
        yield ob.data
    finally:
        if editing:
            bpy.ops.object.mode_set(mode="EDIT")


def weights(mesh, *groups) -> np.ndarray:
    """(#groups, #vertices) float64 of a mesh outside edit mode, 0 where a vertex is not in a group."""
    rows = {group.index: row for row, group in enumerate(groups)}
    found = np.zeros((len(groups), len(mesh.vertices)))
    for vertex in mesh.vertices if groups else ():
        for entry in vertex.groups:
            if entry.group in rows:
                found[rows[entry.group], vertex.index] = entry.weight
    return found


def vertices(ob) -> np.ndarray:
    """Ids of the selected vertices."""
    with whole_mesh(ob) as mesh:
        return np.flatnonzero(_flags(mesh.vertices, "select"))


def in_group(ob, name: str) -> np.ndarray:
    """Ids of the vertices with a weight in the vertex group, none if there is none."""
    group = ob.vertex_groups.get(name)
    if group is None:
        return np.zeros(0, np.int64)
    with whole_mesh(ob) as mesh:
        return np.flatnonzero(weights(mesh, group)[0])


def _flags(sequence, name: str) -> np.ndarray:
    return compat.values(sequence, name, bool)


_MODES = {"vertex": "VERT", "edge": "EDGE", "face": "FACE"}


def select_only(ob: bpy.types.Object, kind: str, elements: np.ndarray, *, modes=()) -> None:
    """Selects these elements and nothing else, in the select modes `modes` or the one that shows them. No-op for kind
    "none"."""
    if kind == "none" or len(elements) == 0:
        return
    mesh = ob.data
    modes = set(modes) or {kind}
    if ob.mode == "EDIT":
        bm = bmesh.from_edit_mesh(mesh)
        bm.select_mode = {_MODES[mode] for mode in modes}
        bpy.context.tool_settings.mesh_select_mode = [name in modes for name in _MODES]
        for sequence in (bm.verts, bm.edges, bm.faces):
            for element in sequence:
                element.select = False
        sequence = {"vertex": bm.verts, "edge": bm.edges, "face": bm.faces}[kind]
        sequence.ensure_lookup_table()
        for index in elements.tolist():
            if sequence[index].hide:
                sequence[index].hide_set(False)
            sequence[index].select_set(True)
        bm.select_flush_mode()
        bmesh.update_edit_mesh(mesh, loop_triangles=False, destructive=False)
        return
    chosen = {
        "vertex": np.zeros(len(mesh.vertices), bool),
        "edge": np.zeros(len(mesh.edges), bool),
        "face": np.zeros(len(mesh.polygons), bool),
    }
    chosen[kind][elements] = True
    # Larger elements carry their smaller ones, as Blender itself keeps them.
    if kind == "face":
        loop_vertices = compat.corner_vertices(mesh)
        loop_edges = compat.corner_edges(mesh)
        totals = compat.values(mesh.polygons, "loop_total", np.int32)
        in_face = np.repeat(chosen["face"], totals)
        chosen["vertex"][loop_vertices[in_face]] = True
        chosen["edge"][loop_edges[in_face]] = True
    elif kind == "edge":
        edges = compat.edge_vertices(mesh)
        chosen["vertex"][edges[chosen["edge"]].ravel()] = True
    store(mesh, chosen["vertex"], chosen["edge"], chosen["face"])


_CARRIED = "flipfree_selected"  # 1: selected, 2: not; 0: of an element that the mesh had not


def carry(bm: bmesh.types.BMesh, mesh: bpy.types.Mesh) -> None:
    """Notes in `bm`, just read from `mesh`, what is selected there. Blender's own marks do not last: what is deleted or made
    selects all faces whose vertices are selected. Makes references to elements stale."""
    for sequence, elements in _kinds(bm, mesh):
        layer = sequence.layers.int.new(_CARRIED)
        for element, chosen in zip(sequence, _flags(elements, "select").tolist(), strict=True):
            element[layer] = 1 if chosen else 2


def carried(bm: bmesh.types.BMesh, new_vertices: Iterable[bmesh.types.BMVert]) -> list[np.ndarray]:
    """What `carry` noted, for vertices, edges and faces, in their order; new vertices and edges are selected with a face. The
    notes are taken out."""
    vertex, edge, face = (s.layers.int[_CARRIED] for s in (bm.verts, bm.edges, bm.faces))
    for v in new_vertices:
        v[vertex] = 0  # not what it was interpolated from

    def chosen(element, layer):
        with_face = element[layer] == 0 and any(f[face] == 1 for f in element.link_faces)
        return with_face or element[layer] == 1

    found = [
        np.array([chosen(v, vertex) for v in bm.verts], bool),
        np.array([chosen(e, edge) for e in bm.edges], bool),
        np.array([f[face] == 1 for f in bm.faces], bool),
    ]
    bm.verts.layers.int.remove(vertex)
    bm.edges.layers.int.remove(edge)
    bm.faces.layers.int.remove(face)
    return found


def store(mesh: bpy.types.Mesh, vertices: np.ndarray, edges: np.ndarray, faces: np.ndarray) -> None:
    """In object mode, (#elements,) bool each."""
    compat.repair_selection(mesh)
    mesh.vertices.foreach_set("select", vertices)
    mesh.edges.foreach_set("select", edges)
    mesh.polygons.foreach_set("select", faces)
    mesh.update()


def _kinds(bm, mesh):
    return (bm.verts, mesh.vertices), (bm.edges, mesh.edges), (bm.faces, mesh.polygons)
