# SPDX-License-Identifier: GPL-3.0-or-later
"""Meshes that are no clean surface are unwrapped, improved, packed and checked like all others, and stay as they are."""

import json

import bpy
import numpy as np
import pytest
import shapes
from broken_meshes import KINDS

from judges.any_triangles import judge_any

pytestmark = pytest.mark.halved


@pytest.mark.parametrize("seams", ["given", "auto"])
@pytest.mark.parametrize("seed", range(4))
def test_quads_of_a_broken_mesh_stay_whole(seed, seams):
    # Faces turned over, triangles that stand on sides, and doubled faces, among quads: none may need two UVs at a corner.
    ob = shapes.primitive("monkey")
    random = np.random.default_rng(seed)
    vertices = [tuple(v.co) for v in ob.data.vertices]
    faces = [list(p.vertices) for p in ob.data.polygons]
    for _ in range(20):
        face = faces[random.integers(len(faces))]
        vertices.append(tuple(np.mean([vertices[v] for v in face], axis=0) + 0.3))
        faces.append([face[0], face[1], len(vertices) - 1])
    faces += [list(faces[k]) for k in random.integers(0, 500, 5)]
    faces = [face[::-1] if random.random() < 0.2 else face for face in faces]
    ob = shapes.add("broken", vertices, faces)
    assert bpy.ops.uv.flipfree_unwrap(seams=seams) == {"FINISHED"}
    assert judged_faces(ob) == []


def test_the_report_names_what_was_separated(tmp_path):
    shapes.add("broken", *KINDS[1](np.random.default_rng(5)))
    blend, target = tmp_path / "wall.blend", tmp_path / "record.json"
    bpy.ops.wm.save_as_mainfile(filepath=str(blend))
    done = shapes.command("unwrap", blend, tmp_path / "out.blend", "--json", target)
    assert done.returncode == 0, done.stdout + done.stderr
    (record,) = json.loads(target.read_text())
    assert record["ok"]
    assert list(record["separated"]) == ["edges with more than two faces"]
    assert "separated: " in record["report"]


def wall():
    """A T of three boards at one edge, and a flat board of its own."""
    vertices = [(x, y, z) for x, z in ((0, 0), (1, 0), (-1, 0), (0, 1)) for y in (0, 1)]
    vertices += [(5, 0, 0), (6, 0, 0), (6, 1, 0), (5, 1, 0)]
    faces = [(0, 2, 3, 1), (0, 1, 5, 4), (0, 6, 7, 1), (8, 9, 10, 11)]
    return shapes.add("wall", vertices, faces)


def paint(ob, slots):
    while len(ob.data.materials) < 2:
        ob.data.materials.append(bpy.data.materials.new("wood"))
    for face, slot in enumerate(slots):
        ob.data.polygons[face].material_index = slot


def joined_at_spine(ob):
    """Pairs of the faces 0, 1, 2 whose UVs agree at the edge 0 - 1."""
    uv, at = shapes.uv_of(ob), {}
    for face in list(ob.data.polygons)[:3]:
        corner = {ob.data.loops[i].vertex_index: tuple(uv[i]) for i in face.loop_indices}
        at[face.index] = corner[0], corner[1]
    return [(a, b) for a in at for b in at if a < b and at[a] == at[b]]


def test_the_flat_boards_of_a_wall_stay_together_unless_materials_say_otherwise():
    ob = wall()
    assert bpy.ops.uv.flipfree_unwrap() == {"FINISHED"}
    assert joined_at_spine(ob) == [(0, 1)]
    paint(ob, (0, 1, 1, 0))
    assert bpy.ops.uv.flipfree_unwrap() == {"FINISHED"}
    assert joined_at_spine(ob) == [(0, 1)], "flat comes first"


def test_of_boards_at_one_angle_those_of_one_material_go_together():
    ob = wall()
    for i, (x, z) in zip(
        (2, 4, 6), ((1.0, 0.0), (-0.5, 0.8660254), (-0.5, -0.8660254)), strict=True
    ):
        for k, y in ((i, 0), (i + 1, 1)):
            ob.data.vertices[k].co = (x, y, z)
    for slots in ((0, 1, 1, 0), (1, 1, 0, 0)):  # the boards 0 and 2 are wound against each other
        paint(ob, slots)
        assert bpy.ops.uv.flipfree_unwrap() == {"FINISHED"}
        (pair,) = joined_at_spine(ob)
        assert slots[pair[0]] == slots[pair[1]]


def test_select_mends_selects_what_the_report_names():
    ob = wall()
    assert bpy.ops.uv.flipfree_unwrap() == {"FINISHED"}
    assert bpy.ops.uv.flipfree_select_mends() == {"FINISHED"}
    assert ob.mode == "EDIT"
    bpy.ops.object.mode_set(mode="OBJECT")
    chosen = [edge for edge in ob.data.edges if edge.select]
    assert [tuple(sorted(edge.vertices)) for edge in chosen] == [(0, 1)]


def test_select_mends_of_several_kinds_selects_their_vertices():
    ob = wall()
    ob.data.vertices[9].co = ob.data.vertices[8].co  # an edge without length
    assert bpy.ops.uv.flipfree_unwrap() == {"FINISHED"}
    assert bpy.ops.uv.flipfree_select_mends() == {"FINISHED"}
    bpy.ops.object.mode_set(mode="OBJECT")
    assert {v.index for v in ob.data.vertices if v.select} >= {0, 1, 8, 9}


def test_select_mends_knows_that_the_mesh_is_another_one():
    ob = wall()
    assert bpy.ops.uv.flipfree_unwrap() == {"FINISHED"}
    ob.data.vertices.add(1)
    with pytest.raises(RuntimeError, match="no longer the one"):
        bpy.ops.uv.flipfree_select_mends()


def test_nothing_to_select_where_nothing_was_separated():
    shapes.grid(3)
    assert bpy.ops.uv.flipfree_unwrap() == {"FINISHED"}
    assert not bpy.ops.uv.flipfree_select_mends.poll()


def two_grids_one_with_contradicting_pins():
    ob = shapes.two_sheets(pinned=False)
    corner = shapes.corners(ob)
    uv = shapes.uv_of(ob)
    uv[np.isin(corner, [31, 36])] = 0.5  # of the small one
    shapes.set_uv(ob, uv)
    shapes.set_pins(ob, np.isin(corner, [31, 36]))
    return ob, corner


def test_an_island_that_fails_keeps_its_uvs_and_the_others_are_mapped():
    ob, corner = two_grids_one_with_contradicting_pins()
    before = shapes.uv_of(ob)
    assert bpy.ops.uv.flipfree_unwrap() == {"FINISHED"}
    after = shapes.uv_of(ob)
    small = corner >= 25
    assert (after[small] == before[small]).all()
    assert (after[~small] != before[~small]).any()
    triangles, uv = shapes.triangles_of(ob)
    large = (triangles < 25).all(axis=1)
    assert judge_any(triangles[large], uv[large]) == []
    low, high = uv[~large].reshape(-1, 2).min(axis=0), uv[~large].reshape(-1, 2).max(axis=0)
    assert not ((uv[large] > low) & (uv[large] < high)).all(axis=2).any(), "packed clear of it"
    assert bpy.ops.uv.flipfree_select_failed() == {"FINISHED"}
    bpy.ops.object.mode_set(mode="OBJECT")
    assert {v.index for v in ob.data.vertices if v.select} <= set(range(25, 50))


def test_a_map_with_one_flipped_island_is_packed_elsewhere():
    ob = shapes.two_sheets(pinned=False)
    corner = shapes.corners(ob)
    uv = shapes.uv_of(ob)
    large = corner < 25
    uv[large, 0] *= 3.0
    uv[corner == 37] += 2.0  # far across its neighbours: flips
    shapes.set_uv(ob, uv)
    assert bpy.ops.uv.flipfree_pack() == {"FINISHED"}
    after = shapes.uv_of(ob)
    assert (after[~large] == uv[~large]).all()
    assert (after[large] != uv[large]).any()


def fin(*, turned=False):
    """A grid on whose middle line a fin stands: edges of three faces."""
    vertices = [(x - 2.0, y - 2.0, 0.1 * x * y) for x in range(5) for y in range(5)]
    spine = range(10, 15)
    top = [(0.0, vertices[v][1], 3.0) for v in spine]
    n = len(vertices)
    faces = [
        (5 * x + y, 5 * x + y + 5, 5 * x + y + 6, 5 * x + y + 1) for x in range(4) for y in range(4)
    ]
    if turned:
        faces[::2] = [face[::-1] for face in faces[::2]]
    faces += [(spine[k], spine[k + 1], n + k + 1, n + k) for k in range(4)]
    return shapes.add("Fin", vertices + top, faces, uv=True)


def judged_faces(ob):
    triangles, uv = shapes.triangles_of(ob)
    return judge_any(triangles, uv)


@pytest.mark.parametrize("turned", [False, True])
def test_pins_on_broken_meshes_are_met(turned):
    ob = fin(turned=turned)
    assert bpy.ops.uv.flipfree_unwrap() == {"FINISHED"}
    corner = shapes.corners(ob)
    uv = shapes.uv_of(ob)
    pinned = np.isin(corner, [0, 4, 20, 24])
    uv[pinned] += np.float32([0.25, -0.125])
    shapes.set_uv(ob, uv)
    shapes.set_pins(ob, pinned)
    assert bpy.ops.uv.flipfree_match() == {"FINISHED"}
    assert (shapes.uv_of(ob)[pinned] == uv[pinned]).all()
    sheet = 16
    triangles, after = shapes.triangles_of(ob)
    mine = np.array([face < sheet for face in shapes.face_of_triangles(ob)])
    assert judge_any(triangles[mine], after[mine]) == []


def test_a_refined_map_of_a_broken_mesh_leaves_it_joined():
    ob = fin(turned=True)
    assert bpy.ops.uv.flipfree_unwrap() == {"FINISHED"}
    corner = shapes.corners(ob)
    uv = shapes.uv_of(ob)
    place = {
        v: uv[np.flatnonzero(corner == v)[0]].copy() for v in (6, 7, 8, 11, 12, 13, 16, 17, 18)
    }
    for a, b in (
        (6, 18),
        (8, 16),
        (11, 13),
        (7, 17),
    ):  # the middle turned by half, its outside held
        on_sheet = np.arange(len(corner)) < 64
        uv[on_sheet & (corner == a)] = place[b]
        uv[on_sheet & (corner == b)] = place[a]
    outside = [v for v in range(25) if v not in place]
    pinned = np.isin(corner, [*outside, 6, 8, 16, 18, 11, 13, 7, 17]) & (
        np.arange(len(corner)) < 64
    )
    shapes.set_uv(ob, uv)
    shapes.set_pins(ob, pinned)
    assert bpy.ops.uv.flipfree_match() == {"FINISHED"}
    assert len(ob.data.vertices) > 30
    assert shapes.edges_with_loose_ends(ob) == []
