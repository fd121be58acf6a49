# SPDX-License-Identifier: GPL-3.0-or-later
"""Blender meshes to arrays and back."""

import bpy
import numpy as np
import pytest
import shapes


def test_triangles_are_blenders_own_and_loops_fit(part):
    ob = shapes.monkey(0)
    snapshot = part("meshes.mesh_io").read(ob, only_selected=False)
    ob.data.calc_loop_triangles()
    own = np.array([tuple(t.vertices) for t in ob.data.loop_triangles])
    assert np.array_equal(snapshot.vertex_ids[snapshot.triangles], own)
    corner = shapes.corners(ob)
    assert np.array_equal(corner[snapshot.triangle_loops], own)


def test_vertices_without_faces_are_left_out(part):
    ob = shapes.add("Loose", [(0, 0, 0), (5, 5, 5), (1, 0, 0), (0, 1, 0)], [(0, 2, 3)])
    snapshot = part("meshes.mesh_io").read(ob, only_selected=False)
    assert snapshot.vertex_ids.tolist() == [0, 2, 3]


def test_two_fans_that_touch_in_a_point_get_two_vertices(part):
    triangles, ids = part("meshes.mesh_io").split_fans(np.array([[0, 1, 2], [0, 3, 4]]))
    assert ids.tolist() == [0, 0, 1, 2, 3, 4]
    assert triangles[0, 0] != triangles[1, 0]


def test_closed_fans_that_touch_tip_to_tip_get_two_vertices(part):
    upper = [[0, 1, 2], [0, 2, 3], [0, 3, 1]]
    lower = [[0, 4, 5], [0, 5, 6], [0, 6, 4]]
    triangles, ids = part("meshes.mesh_io").split_fans(np.array(upper + lower))
    assert len(ids) == 8 and len(set(triangles[:, 0])) == 2


def test_faces_at_an_overfull_edge_stay_together(part):
    """The solver must see the edge to name it; a split would hide it."""
    fan = np.array([[0, 1, 2], [1, 0, 3], [0, 1, 4]])
    triangles, ids = part("meshes.mesh_io").split_fans(fan)
    assert np.array_equal(ids[triangles], fan) and len(ids) == 5


def test_cuts_and_diagonals_agree_with_sets(part):
    """On a mesh with triangles, quads and n-gons, of which any part is selected."""
    ob = shapes.monkey(0)
    mesh = ob.data
    shapes.enter("EDIT")
    bpy.ops.mesh.dissolve_limited(angle_limit=0.2)
    bpy.ops.object.mode_set(mode="OBJECT")
    random = np.random.default_rng(5)
    for edge in mesh.edges:
        edge.use_seam = bool(random.random() < 0.3)
    real = {frozenset(e.vertices) for e in mesh.edges}
    seams = {frozenset(e.vertices) for e in mesh.edges if e.use_seam}
    bpy.ops.object.mode_set(mode="EDIT")
    for share in (0.2, 0.7, 1.0):
        chosen = np.flatnonzero(random.random(len(mesh.polygons)) <= share).tolist()
        shapes.select_faces(ob, chosen)
        snapshot = part("meshes.mesh_io").read(ob, only_selected=True)
        cuts, diagonals = set(), set()
        for triangle in snapshot.triangles.tolist():
            for a, b in zip(triangle, triangle[1:] + triangle[:1], strict=True):
                ends = frozenset(snapshot.vertex_ids[[a, b]].tolist())
                if ends in seams:
                    cuts.add(frozenset((a, b)))
                if ends not in real:
                    diagonals.add(frozenset((a, b)))
        assert {frozenset(pair) for pair in snapshot.cuts.tolist()} == cuts
        assert {frozenset(pair) for pair in snapshot.diagonals.tolist()} == diagonals
        assert len(snapshot.diagonals) == len(diagonals) > 0


def test_only_selected_visible_faces_are_read_in_edit_mode(part):
    ob = shapes.grid(4)
    bpy.ops.object.mode_set(mode="EDIT")
    shapes.select_faces(ob, [1, 6])
    snapshot = part("meshes.mesh_io").read(ob, only_selected=True)
    assert sorted(set(snapshot.triangle_face.tolist())) == [1, 6]
    bpy.ops.mesh.hide()
    with pytest.raises(part("meshes.mesh_io").NothingSelected):
        part("meshes.mesh_io").read(ob, only_selected=True)


def test_reading_in_edit_mode_sees_what_was_just_edited_and_leaves_no_mesh_behind(part):
    import bmesh

    ob = shapes.grid(2, uv=True)
    shapes.enter("EDIT")
    bm = bmesh.from_edit_mesh(ob.data)
    bm.verts.ensure_lookup_table()
    bm.verts[0].co.z = 7.0
    before = len(bpy.data.meshes)
    snapshot = part("meshes.mesh_io").read(ob, only_selected=True)
    assert snapshot.vertices[0, 2] == 7.0
    assert len(bpy.data.meshes) == before


def test_a_map_torn_inside_a_face_is_refused_by_name(part):
    mesh_io = part("meshes.mesh_io")
    ob = shapes.grid(2)
    snapshot = mesh_io.read(ob, only_selected=False)
    uv = np.zeros((len(snapshot.triangles), 3, 2), np.float32)
    uv[4] += 1.0  # a triangle of face 2
    with pytest.raises(mesh_io.MeshProblem, match="face 2"):
        mesh_io.loop_values(snapshot, uv)


@pytest.mark.parametrize("mode", ["OBJECT", "EDIT"])
def test_values_are_stored_bit_for_bit_and_other_loops_keep_theirs(part, mode):
    mesh_io = part("meshes.mesh_io")
    ob = shapes.grid(3, uv=True)
    rng = np.random.default_rng(1)
    before = rng.random((len(ob.data.loops), 2), np.float32)
    shapes.set_uv(ob, before)
    bpy.ops.object.mode_set(mode=mode)
    if mode == "EDIT":
        shapes.select_faces(ob, [0, 1])
    snapshot = mesh_io.read(ob, only_selected=mode == "EDIT")
    values = rng.random((len(snapshot.triangle_loops), 3, 2)).astype(np.float32)
    loops = np.unique(snapshot.triangle_loops)
    new = rng.random((len(loops), 2), np.float32) * np.float32(1e-3)
    mesh_io.write_uv(ob, snapshot, loops, new)
    after = shapes.uv_of(ob)
    assert after[loops].tobytes() == new.tobytes()
    others = np.setdiff1d(np.arange(len(before)), loops)
    assert after[others].tobytes() == before[others].tobytes()
    assert len(values)


@pytest.mark.parametrize("mode", ["OBJECT", "EDIT"])
def test_a_mesh_without_uv_map_gets_one(part, mode):
    mesh_io = part("meshes.mesh_io")
    ob = shapes.grid(2)
    shapes.enter(mode)
    snapshot = mesh_io.read(ob, only_selected=mode == "EDIT")
    assert snapshot.layer_name == ""
    loops = np.unique(snapshot.triangle_loops)
    mesh_io.write_uv(ob, snapshot, loops, np.full((len(loops), 2), 0.25, np.float32))
    assert (shapes.uv_of(ob) == 0.25).all()


@pytest.mark.parametrize("mode", ["OBJECT", "EDIT"])
def test_a_mesh_changed_meanwhile_is_left_alone(part, mode):
    mesh_io = part("meshes.mesh_io")
    ob = shapes.grid(2, uv=True)
    snapshot = mesh_io.read(ob, only_selected=False)
    shapes.enter("EDIT")
    bpy.ops.mesh.subdivide()
    bpy.ops.object.mode_set(mode=mode)
    before = shapes.uv_of(ob).tobytes()
    loops = np.unique(snapshot.triangle_loops)
    with pytest.raises(mesh_io.MeshProblem, match="changed"):
        mesh_io.write_uv(ob, snapshot, loops, np.zeros((len(loops), 2), np.float32))
    assert shapes.uv_of(ob).tobytes() == before


@pytest.mark.parametrize("mode", ["OBJECT", "EDIT"])
@pytest.mark.parametrize("kind", ["vertex", "edge", "face"])
def test_select_only_selects_that_and_nothing_else(part, mode, kind):
    ob = shapes.grid(3)
    bpy.ops.object.mode_set(mode=mode)
    part("meshes.selection").select_only(ob, kind, np.array([2, 5]))
    bpy.ops.object.mode_set(mode="OBJECT")
    assert shapes.selected(ob, kind) == [2, 5]


def test_elements_of_the_solver_become_elements_of_the_mesh(part):
    mesh_io = part("meshes.mesh_io")
    ob = shapes.grid(3)
    bpy.ops.object.mode_set(mode="EDIT")
    shapes.select_faces(ob, [4])
    snapshot = mesh_io.read(ob, only_selected=True)
    assert mesh_io.to_mesh_elements(snapshot, "face", [1])[1].tolist() == [4]
    assert mesh_io.to_mesh_elements(snapshot, "corner", [5])[1].tolist() == [4]
    vertices = sorted(snapshot.vertex_ids.tolist())
    assert mesh_io.to_mesh_elements(snapshot, "vertex", [0, 3])[1].tolist() == [
        vertices[0],
        vertices[3],
    ]
    a, b = snapshot.triangles[0, :2]
    kind, ids = mesh_io.to_mesh_elements(snapshot, "edge", [a, b])
    assert kind == "edge" and set(ob.data.edges[ids[0]].vertices) == set(
        snapshot.vertex_ids[[a, b]].tolist()
    )
