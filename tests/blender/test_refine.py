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


@pytest.fixture(params=["OBJECT", "EDIT"])
def refined(request, part):
    """A 2 x 2 sheet, with one diagonal and one edge between two faces halved by refine.write."""
    ob = shapes.grid(2, bump=0.0, uv=True)
    mesh = ob.data
    group = ob.vertex_groups.new(name="Weight")
    for v in range(9):
        group.add([v], v / 8, "REPLACE")
    other = mesh.uv_layers.new(name="Other", do_init=False)
    other.active = False
    mesh.uv_layers.active = mesh.uv_layers["UVMap"]
    second = np.array([mesh.vertices[loop.vertex_index].co[:2] for loop in mesh.loops], np.float32)
    mesh.attributes["Other"].data.foreach_set("vector", second.ravel())
    mesh.materials.append(bpy.data.materials.new("A"))
    mesh.materials.append(bpy.data.materials.new("B"))
    mesh.polygons[0].material_index = 1
    edge = next(e for e in mesh.edges if set(e.vertices) == {4, 7})
    edge.use_seam = edge.use_edge_sharp = True
    ob.shape_key_add(name="Basis")
    key = ob.shape_key_add(name="Up")
    for point in key.data:
        point.co.z += 1.0
    bpy.ops.object.mode_set(mode=request.param)
    if request.param == "EDIT":
        bpy.ops.mesh.select_all(action="SELECT")
    snapshot = part("meshes.mesh_io").read(ob, only_selected=False)
    diagonal = tuple(snapshot.diagonals[0].tolist())
    result = split(snapshot, {tuple(sorted(diagonal)), (4, 7)})
    before = sum(p.area for p in mesh.polygons)
    assert part("meshes.refine").needs_new_faces(snapshot, result)
    assert part("meshes.refine").write(ob, snapshot, result, mark_cuts=False) == 2
    bpy.ops.object.mode_set(mode="OBJECT")
    return SimpleNamespace(ob=ob, result=result, area=before)


def test_only_faces_with_refined_triangles_are_replaced(refined):
    mesh = refined.ob.data
    # The first face becomes 4 triangles; the two at the halved edge 3 each; the last stays a quad.
    assert sorted(len(p.vertices) for p in mesh.polygons) == [3] * 10 + [4]
    assert len(mesh.vertices) == 11
    assert sum(p.area for p in mesh.polygons) == pytest.approx(refined.area, rel=1e-3)
    assert not [e for e in mesh.edges if e.is_loose]


def test_uvs_are_the_results_bit_for_bit(refined):
    mesh = refined.ob.data
    uv = shapes.uv_of(refined.ob)
    expected = {}
    for face, values in zip(refined.result.faces, refined.result.uv32(), strict=True):
        for v, value in zip(face.tolist(), values, strict=True):
            expected[v] = value.tobytes()
    for loop in mesh.loops:
        assert uv[loop.index].tobytes() == expected[loop.vertex_index]


def test_everything_the_mesh_carries_is_interpolated(refined):
    ob, mesh = refined.ob, refined.ob.data
    ends = {9: None, 10: None}
    for new in ends:
        co = np.array(mesh.vertices[new].co)
        weights = [ob.vertex_groups["Weight"].weight(a) for a in range(9)]
        points = np.array([mesh.vertices[a].co for a in range(9)])
        pairs = [
            (a, b)
            for a in range(9)
            for b in range(a)
            if np.abs((points[a] + points[b]) / 2 - co).max() < 1e-6
        ]
        assert pairs
        got = ob.vertex_groups["Weight"].weight(new)
        assert any(got == pytest.approx((weights[a] + weights[b]) / 2, abs=1e-3) for a, b in pairs)
    other = shapes.uv_of(ob, "Other")
    for loop in mesh.loops:
        assert other[loop.index] == pytest.approx(mesh.vertices[loop.vertex_index].co[:2], abs=1e-4)
    up, basis = mesh.shape_keys.key_blocks["Up"], mesh.shape_keys.key_blocks["Basis"]
    for a, b in zip(up.data, basis.data, strict=True):
        assert a.co.z - b.co.z == pytest.approx(1.0, abs=1e-4)
    assert sorted(p.material_index for p in mesh.polygons) == [0] * 7 + [1] * 4


def test_halves_of_an_edge_keep_what_it_carried(refined):
    mesh = refined.ob.data
    middle = next(
        v.index
        for v in mesh.vertices
        if v.index >= 9
        and {4, 7} <= {u for e in mesh.edges if v.index in e.vertices for u in e.vertices}
    )
    for end in (4, 7):
        edge = next(e for e in mesh.edges if set(e.vertices) == {end, middle})
        assert edge.use_seam and edge.use_edge_sharp
    assert sum(e.use_seam for e in mesh.edges) == 2


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
    pinned = np.empty(len(ob.data.loops), bool)
    ob.data.attributes[".pn.UVMap"].data.foreach_get("value", pinned)
    corner = np.array([loop.vertex_index for loop in ob.data.loops])
    assert np.array_equal(pinned, corner != 9)
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
    bpy.ops.object.mode_set(mode="EDIT")
    bpy.ops.mesh.select_all(action="SELECT")
    bpy.ops.mesh.poke()
    bpy.ops.object.mode_set(mode="OBJECT")
    snapshot = read(ob, only_selected=False)
    refine.write(ob, snapshot, split(snapshot, {(0, 1)}), mark_cuts=False)
    assert len(ob.data.vertices) == 8 and len(ob.data.polygons) == 10
