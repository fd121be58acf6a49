# SPDX-License-Identifier: GPL-3.0-or-later
"""Check: counts and selects what is wrong, changes nothing."""

import bpy
import numpy as np
import pytest
import shapes


def flat_map(ob):
    """UVs = x, y: no flips on a sheet."""
    shapes.set_uv(ob, [ob.data.vertices[loop.vertex_index].co[:2] for loop in ob.data.loops])


def test_a_good_map_has_nothing_wrong(capfd):
    ob = shapes.grid(5, uv=True)
    flat_map(ob)
    before = shapes.everything(ob)
    assert bpy.ops.uv.flipfree_check() == {"FINISHED"}
    assert "Nothing wrong: 1 island, 0 flips, 0 overlaps" in capfd.readouterr().out
    assert shapes.everything(ob) == before


@pytest.mark.parametrize("mode", ["OBJECT", "EDIT"])
def test_flipped_faces_are_counted_and_selected(mode, capfd):
    ob = shapes.grid(5, uv=True)
    flat_map(ob)
    uv = shapes.uv_of(ob)
    corner = np.array([loop.vertex_index for loop in ob.data.loops])
    uv[corner == 14] += np.float32([0.45, 0.0])  # beyond its neighbours
    shapes.set_uv(ob, uv)
    flips = shapes.exact_flips(ob)
    assert flips > 0
    bpy.ops.object.mode_set(mode=mode)
    if mode == "EDIT":
        bpy.ops.mesh.select_all(action="SELECT")
    assert bpy.ops.uv.flipfree_check() == {"FINISHED"}
    assert f"{flips} flips" in capfd.readouterr().out.replace("1 flip,", "1 flips,")
    bpy.ops.object.mode_set(mode="OBJECT")
    chosen = shapes.selected(ob, "face")
    assert chosen and set(chosen) <= {f.index for f in ob.data.polygons if 14 in f.vertices}


def test_mirrored_islands_count_as_flipped(capfd):
    ob = shapes.grid(3, uv=True)
    flat_map(ob)
    shapes.set_uv(ob, shapes.uv_of(ob) * np.float32([-1, 1]))
    bpy.ops.uv.flipfree_check()
    assert "18 flips" in capfd.readouterr().out


def test_uvs_that_differ_in_the_last_bits_come_with_a_cure(capfd):
    """As the UVs of Blender 4.3's own grid, which computes the sides of an edge apart."""
    ob = shapes.grid(20, uv=True)
    flat_map(ob)
    uv = shapes.uv_of(ob)
    up = np.random.default_rng(1).random(uv.shape) < 0.03
    shapes.set_uv(ob, np.where(up, np.nextafter(uv, np.float32(4)), uv))
    assert bpy.ops.uv.flipfree_check() == {"FINISHED"}
    report = capfd.readouterr().out
    assert "0 overlaps" not in report and "in the last bits only" in report
    bpy.ops.object.mode_set(mode="EDIT")
    bpy.ops.mesh.select_all(action="SELECT")
    bpy.ops.uv.select_all(action="SELECT")
    bpy.ops.uv.remove_doubles(threshold=1e-4)
    bpy.ops.object.mode_set(mode="OBJECT")
    assert bpy.ops.uv.flipfree_check() == {"FINISHED"}
    assert "Nothing wrong: 1 island, 0 flips, 0 overlaps" in capfd.readouterr().out


def test_seams_that_are_meant_get_no_such_advice(capfd):
    ob = shapes.grid(3, uv=True)
    flat_map(ob)
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
    assert shapes.selected(ob, "face") == [1]
