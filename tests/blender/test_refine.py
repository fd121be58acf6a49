# SPDX-License-Identifier: GPL-3.0-or-later
"""Maps on subdivided triangles: what is replaced, what stays, what is interpolated."""

from types import SimpleNamespace

import bmesh
import bpy
import numpy as np
import pytest
import shapes


def split(snapshot, edges):
    """A result as solvers return it: these submesh edges are halved; every triangle may have one of them."""
    triangles = snapshot.triangles.tolist()
    n = len(snapshot.vertices)
    vertices = snapshot.vertices.tolist()
    middle, parents, weights = {}, [-1] * n, [[0.0] * 3] * n
    faces, parent_face = [], []
    for f, triangle in enumerate(triangles):
        parts = [triangle]
        for k in range(3):
            a, b, c = (triangle[(k + i) % 3] for i in range(3))
            key = tuple(sorted((a, b)))
            if key not in edges:
                continue
            if key not in middle:
                middle[key] = len(vertices)
                vertices.append(list((snapshot.vertices[a] + snapshot.vertices[b]) / 2))
                parents.append(f)
                weights.append([0.5 if v in key else 0.0 for v in triangle])
            m = middle[key]
            parts = [[a, m, c], [m, b, c]]
        faces += parts
        parent_face += [f] * len(parts)
    vertices = np.array(vertices)
    faces = np.array(faces, np.int32)
    uv = vertices[faces][:, :, :2].astype(np.float32) * np.float32(0.5)
    return SimpleNamespace(
        vertices=vertices,
        faces=faces,
        parent_face=np.array(parent_face, np.int32),
        vertex_parent=np.array(parents, np.int32),
        vertex_barycentric=np.array(weights),
        cut_edges=np.zeros((0, 2), np.int32),
        uv32=lambda: uv.copy(),
    )


def test_outside_edit_mode_the_same_is_selected_as_before(part):
    """In face mode: all faces around one that is not selected; Blender's own tools select that too, by its vertices."""
    ob = shapes.grid(3, bump=0.0, uv=True)
    mesh = ob.data
    ring = np.arange(9) != 4
    selection = part("meshes.selection")
    selection.select_only(ob, "face", np.flatnonzero(ring))
    snapshot = part("meshes.mesh_io").read(ob, only_selected=False)
    diagonal = next(
        tuple(sorted(pair))
        for pair in (
            (a, b)
            for t in snapshot.triangles[:2].tolist()
            for a, b in zip(t, t[1:] + t[:1], strict=True)
        )
        if sum(set(pair) <= set(t) for t in snapshot.triangles[:2].tolist()) == 2
    )
    places = [tuple(polygon.center) for polygon in mesh.polygons]
    part("meshes.refine").write(ob, snapshot, split(snapshot, {diagonal}), mark_cuts=False)
    chosen = {tuple(polygon.center): polygon.select for polygon in mesh.polygons}
    assert [chosen[place] for place in places[1:]] == ring[1:].tolist()
    assert len(mesh.polygons) == 12 and sum(polygon.select for polygon in mesh.polygons) == 11
    assert all(vertex.select for vertex in mesh.vertices)
    assert all(edge.select for edge in mesh.edges)
    assert not [a.name for a in mesh.attributes if "flipfree" in a.name]


def test_new_vertices_are_neither_pinned_nor_cones(part):
    ob = shapes.grid(2, bump=0.0, uv=True)
    shapes.set_pins(ob, np.ones(len(ob.data.loops), bool))
    for name in ("Pins", "Cone +1", "Cone -2", "Weight"):
        ob.vertex_groups.new(name=name).add(list(range(9)), 1.0, "REPLACE")
    ob.data.attributes.new("cone_angle", "FLOAT", "POINT").data.foreach_set("value", np.ones(9))
    snapshot = part("meshes.mesh_io").read(ob, only_selected=False)
    part("meshes.refine").write(ob, snapshot, split(snapshot, {(4, 7)}), mark_cuts=False)
    assert len(ob.data.vertices) == 10
    names = [{ob.vertex_groups[g.group].name for g in v.groups} for v in ob.data.vertices]
    assert names[9] == {"Weight"} and all(len(found) == 4 for found in names[:9])
    assert np.array_equal(shapes.pins_of(ob), shapes.corners(ob) != 9)
    angle = np.empty(10, np.float32)
    ob.data.attributes["cone_angle"].data.foreach_get("value", angle)
    assert angle.tolist() == [1.0] * 9 + [0.0]


def test_a_map_that_fits_the_faces_needs_no_new_ones(part):
    ob = shapes.grid(3, uv=True)
    snapshot = part("meshes.mesh_io").read(ob, only_selected=False)
    assert not part("meshes.refine").needs_new_faces(snapshot, split(snapshot, set()))


def test_a_mesh_changed_meanwhile_is_left_alone(part):
    ob = shapes.grid(2, uv=True)
    snapshot = part("meshes.mesh_io").read(ob, only_selected=False)
    result = split(snapshot, {(4, 7)})
    bm = bmesh.new()
    bm.from_mesh(ob.data)
    bmesh.ops.triangulate(bm, faces=list(bm.faces))
    bm.to_mesh(ob.data)
    bm.free()
    before = shapes.everything(ob)
    with pytest.raises(part("meshes.mesh_io").MeshProblem, match="changed"):
        part("meshes.refine").write(ob, snapshot, result, mark_cuts=False)
    assert shapes.everything(ob) == before


def test_faces_that_blender_cannot_have_are_refused_before_anything_is_written(part):
    """Two quads that share a peak's two sides: Blender gives each the triangle of these. The cure that is named works."""
    ob = shapes.add(
        "Peak",
        [(-0.3, 0, 0), (0, 0, 1), (0.3, 0, 0), (0, 1, 0), (0, -1, 0)],
        [(0, 1, 2, 3), (2, 1, 0, 4)],
        uv=True,
    )
    read, refine = part("meshes.mesh_io").read, part("meshes.refine")
    snapshot = read(ob, only_selected=False)
    assert sum(set(t) == {0, 1, 2} for t in snapshot.triangles.tolist()) == 2
    before = [tuple(polygon.vertices) for polygon in ob.data.polygons]
    with pytest.raises(part("meshes.mesh_io").MeshProblem, match="Poke Faces") as caught:
        refine.write(ob, snapshot, split(snapshot, {(0, 1)}), mark_cuts=False)
    assert caught.value.kind == "face" and caught.value.elements.tolist() == [0, 1]
    assert [tuple(polygon.vertices) for polygon in ob.data.polygons] == before
    shapes.enter("EDIT")
    bpy.ops.mesh.poke()
    bpy.ops.object.mode_set(mode="OBJECT")
    snapshot = read(ob, only_selected=False)
    refine.write(ob, snapshot, split(snapshot, {(0, 1)}), mark_cuts=False)
    assert len(ob.data.vertices) == 8 and len(ob.data.polygons) == 10
