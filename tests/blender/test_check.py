# SPDX-License-Identifier: GPL-3.0-or-later
"""Check: counts and selects what is wrong, changes nothing."""

import bpy
import numpy as np
import pytest
import shapes


def test_a_good_map_has_nothing_wrong(capfd):
    ob = shapes.grid(5, uv=True)
    shapes.flat(ob)
    before = shapes.everything(ob)
    assert bpy.ops.uv.flipfree_check() == {"FINISHED"}
    assert "Nothing wrong: 1 island, 0 flips, 0 overlaps" in capfd.readouterr().out
    assert shapes.everything(ob) == before


@pytest.mark.parametrize("mode", ["OBJECT", "EDIT"])
def test_flipped_faces_are_counted_and_selected(mode, capfd):
    ob = shapes.grid(5, uv=True)
    shapes.flat(ob)
    uv = shapes.uv_of(ob)
    corner = shapes.corners(ob)
    uv[corner == 14] += np.float32([0.45, 0.0])  # beyond its neighbours
    shapes.set_uv(ob, uv)
    flips = shapes.exact_flips(ob)
    assert flips > 0
    shapes.enter(mode)
    assert bpy.ops.uv.flipfree_check() == {"FINISHED"}
    report = capfd.readouterr().out.replace("1 flip,", "1 flips,")
    assert f"{flips} flips" in report and "0 overlaps" not in report
    assert "overlaps of islands with themselves not counted where a map has flips" in report
    bpy.ops.object.mode_set(mode="OBJECT")
    chosen = shapes.selected(ob, "face")
    assert chosen and set(chosen) <= {f.index for f in ob.data.polygons if 14 in f.vertices}


def test_turned_faces_are_counted_and_said_to_be_mirrored(capfd):
    ob = shapes.grid(5, uv=True)
    for face in (7, 12):
        ob.data.polygons[face].flip()
    shapes.flat(ob)
    turned = sum(len(ob.data.polygons[face].vertices) - 2 for face in (7, 12))
    assert bpy.ops.uv.flipfree_check() == {"FINISHED"}
    report = capfd.readouterr().out
    assert f"1 island, 0 flips, {turned} faces turned over, 0 overlaps" in report
    assert "Recalculate normals" in report


def test_islands_that_are_mirrored_as_a_whole_are_named_and_no_flips(capfd):
    ob = cubes(2, 1.0)
    uv = shapes.uv_of(ob)
    uv[:8, 0] = 3.0 - uv[:8, 0]  # two islands
    shapes.set_uv(ob, uv)
    assert bpy.ops.uv.flipfree_check() == {"FINISHED"}
    report = capfd.readouterr().out
    assert "Nothing wrong: 12 islands, 0 flips, 2 islands are mirrored, 0 overlaps" in report
    for what, count in (("flipped", "no face"), ("mirrored", "2 faces")):
        assert bpy.ops.uv.flipfree_select_faces(what=what) == {"FINISHED"}
        assert count in capfd.readouterr().out
    bpy.ops.object.mode_set(mode="OBJECT")
    uv[0] = uv[2]  # one of them has no area
    shapes.set_uv(ob, uv)
    assert bpy.ops.uv.flipfree_check() == {"FINISHED"}
    assert "2 flips, 1 island is mirrored" in capfd.readouterr().out


def cubes(count, apart):
    """So many cubes in one mesh, with one island a face; the UVs of each are moved from those of the one before."""
    corners = [(x, y, z) for z in (0, 1) for y in (0, 1) for x in (0, 1)]
    sides = [(0, 2, 3, 1), (4, 5, 7, 6), (0, 1, 5, 4), (2, 6, 7, 3), (0, 4, 6, 2), (1, 3, 7, 5)]
    vertices = [(x + 2 * i, y, z) for i in range(count) for x, y, z in corners]
    faces = [tuple(8 * i + v for v in side) for i in range(count) for side in sides]
    ob = shapes.add("Cubes", vertices, faces, uv=True)
    square = np.float32([[0, 0], [1, 0], [1, 1], [0, 1]])
    uv = [square + (1.5 * f, 1.5 * i * apart) for i in range(count) for f in range(6)]
    shapes.set_uv(ob, np.concatenate(uv) / 10)
    return ob


@pytest.mark.parametrize("mode", ["OBJECT", "EDIT"])
def test_stacked_islands_are_wrong_named_and_selected(mode, capfd):
    ob = cubes(40, 0.0)
    before = shapes.everything(ob)
    shapes.enter(mode)
    assert bpy.ops.uv.flipfree_check() == {"FINISHED"}
    report = capfd.readouterr().out
    pairs = 6 * 40 * 39 // 2
    assert "Warning" in report and "240 faces wrong, now selected: 240 islands" in report
    assert f"{pairs} pairs of islands overlap" in report and "0 overlaps" not in report
    assert "stacked: islands of the faces 0, 1, 2 and 237 more" in report
    assert "Pack the islands" in report
    bpy.ops.object.mode_set(mode="OBJECT")
    assert shapes.selected(ob, "face") == list(range(240))
    assert shapes.everything(ob) == before


def test_only_the_islands_that_are_stacked_are_selected(capfd):
    ob = cubes(3, 1.0)
    uv = shapes.uv_of(ob)
    uv[:4] += np.float32([0.0, 0.2])  # the first face onto the seventh
    shapes.set_uv(ob, uv)
    assert bpy.ops.uv.flipfree_check() == {"FINISHED"}
    report = capfd.readouterr().out
    assert "2 faces wrong" in report and "1 pair of islands overlaps" in report
    assert "stacked: islands of the faces 0, 6" in report
    assert shapes.selected(ob, "face") == [0, 6]


def test_stacked_islands_may_be_allowed(capfd):
    ob = cubes(3, 0.0)
    chosen = shapes.selection(ob)
    assert bpy.ops.uv.flipfree_check(stacked_ok=True) == {"FINISHED"}
    report = capfd.readouterr().out
    assert "Nothing wrong: 18 islands, 0 flips, 18 pairs of islands overlap" in report
    assert "Warning" not in report
    assert shapes.selection(ob) == chosen


def test_uvs_that_differ_in_the_last_bits_come_with_a_cure(capfd):
    """As the UVs of Blender 4.3's own grid, which computes the sides of an edge apart."""
    ob = shapes.grid(20, uv=True)
    shapes.flat(ob)
    uv = shapes.uv_of(ob)
    up = np.random.default_rng(1).random(uv.shape) < 0.03
    shapes.set_uv(ob, np.where(up, np.nextafter(uv, np.float32(4)), uv))
    assert bpy.ops.uv.flipfree_check() == {"FINISHED"}
    report = capfd.readouterr().out
    assert "0 overlaps" not in report and "in the last bits only" in report
    shapes.enter("EDIT")
    bpy.ops.uv.select_all(action="SELECT")
    bpy.ops.uv.remove_doubles(threshold=1e-4)
    bpy.ops.object.mode_set(mode="OBJECT")
    assert bpy.ops.uv.flipfree_check() == {"FINISHED"}
    assert "Nothing wrong: 1 island, 0 flips, 0 overlaps" in capfd.readouterr().out


def test_seams_that_are_meant_get_no_such_advice(capfd):
    ob = shapes.grid(3, uv=True)
    shapes.flat(ob)
    uv = shapes.uv_of(ob)
    uv[:4] += np.float32([0.1, 0.0])  # one face over its neighbours, cut off
    shapes.set_uv(ob, uv)
    assert bpy.ops.uv.flipfree_check() == {"FINISHED"}
    assert "last bits" not in capfd.readouterr().out


def test_a_mesh_without_uv_map_cannot_be_checked():
    shapes.grid(3)
    assert not bpy.ops.uv.flipfree_check.poll()


def test_uvs_that_are_no_numbers_are_named():
    ob = shapes.grid(3, uv=True)
    uv = shapes.uv_of(ob)
    uv[5] = np.inf
    shapes.set_uv(ob, uv)
    with pytest.raises(RuntimeError, match="face 1 has a UV that is no number"):
        bpy.ops.uv.flipfree_check()
    assert shapes.shown("face") == [1]
