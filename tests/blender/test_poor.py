# SPDX-License-Identifier: GPL-3.0-or-later
"""Results that are valid but stretched beyond the bound: a warning that says where, and Select Stretched Islands."""

import bpy
import numpy as np
import pytest
import shapes


def warnings(out):
    return [line for line in out.splitlines() if line.startswith("Warning:")]


@pytest.mark.parametrize("operator", ["unwrap", "improve", "match"])
def test_a_poor_result_is_a_warning_that_names_the_islands(operator, capfd):
    shapes.two_sheets(squeezed=True)
    assert getattr(bpy.ops.uv, f"flipfree_{operator}")() == {"FINISHED"}
    (line,) = warnings(capfd.readouterr().out)
    assert "2 islands, 0 flips, 0 overlaps" in line
    assert "3 % of the surface is stretched beyond 1.25: 1 island" in line and "at face 16" in line
    cure = {"match": "Move pins nearer", "unwrap": "unpin some of the pins"}.get(operator)
    cure = cure or "Mark more seams there"
    assert cure in line and "Select Stretched Islands" in line


@pytest.mark.parametrize("operator", ["unwrap", "improve", "match"])
def test_a_good_result_is_none(operator, capfd):
    shapes.two_sheets()
    assert getattr(bpy.ops.uv, f"flipfree_{operator}")() == {"FINISHED"}
    out = capfd.readouterr().out
    assert not warnings(out) and "stretched" not in out


def test_check_warns_of_a_poor_map_though_nothing_is_wrong(capfd):
    ob = shapes.two_sheets(squeezed=True)
    chosen = shapes.selection(ob)
    assert bpy.ops.uv.flipfree_check() == {"FINISHED"}
    (line,) = warnings(capfd.readouterr().out)
    assert (
        "No flips and no overlaps, but badly stretched: 2 islands" in line
        and "the worst at face 16" in line
    )
    assert shapes.selection(ob) == chosen


@pytest.mark.parametrize("mode", ["OBJECT", "EDIT"])
def test_distorted_islands_are_selected_whole(mode, capfd):
    ob = shapes.two_sheets(squeezed=True)
    before = shapes.everything(ob)
    bpy.ops.object.mode_set(mode=mode)
    if mode == "EDIT":  # what is selected before does not matter
        shapes.select_faces(ob, [3])
    assert bpy.ops.uv.flipfree_select_poor() == {"FINISHED"}
    assert "1 island stretched beyond 1.25, now selected" in capfd.readouterr().out
    assert bpy.context.mode == "EDIT_MESH"
    bpy.ops.object.mode_set(mode="OBJECT")
    assert shapes.selected(ob, "face") == list(range(16, 32))
    assert shapes.everything(ob) == before


def test_where_no_island_is_distorted_the_selection_stays(capfd):
    ob = shapes.two_sheets()
    bpy.ops.object.mode_set(mode="EDIT")
    shapes.select_faces(ob, [3])
    assert bpy.ops.uv.flipfree_select_poor() == {"FINISHED"}
    assert "No island is stretched beyond 1.25" in capfd.readouterr().out
    bpy.ops.object.mode_set(mode="OBJECT")
    assert shapes.selected(ob, "face") == [3]


def test_without_a_uv_map_nothing_can_be_selected():
    shapes.grid(3)
    assert not bpy.ops.uv.flipfree_select_poor.poll()


def test_a_mean_just_above_the_bound_is_a_warning_and_just_below_is_none(capfd):
    ob = shapes.grid(4, bump=0.0, uv=True)
    at = shapes.plane(ob)
    for stretch, above in ((1.2, False), (1.35, True)):
        shapes.set_uv(ob, (at * [stretch**0.5, stretch**-0.5] + 2) / 4)
        assert bpy.ops.uv.flipfree_check() == {"FINISHED"}
        out = capfd.readouterr().out
        assert bool(warnings(out)) == above
        assert ("Nothing wrong" in out) != above and ("100 % of the surface" in out) == above


@pytest.mark.parametrize("mode", ["OBJECT", "EDIT"])
def test_cut_where_stretched_unwraps_these_islands_and_packs_all_at_one_scale(mode, capfd):
    ob = shapes.two_sheets(squeezed=True, pinned=False)
    before = shapes.uv_of(ob)
    shapes.enter(mode)
    assert bpy.ops.uv.flipfree_cut_stretched() == {"FINISHED"}
    bpy.ops.object.mode_set(mode="OBJECT")
    moved, old = (uv[:64] - uv[0] for uv in (shapes.uv_of(ob), before))
    lengths = np.linalg.norm(moved, axis=1) / np.maximum(np.linalg.norm(old, axis=1), 1e-6)
    assert np.ptp(lengths[lengths > 0]) < 1e-3, "the other island keeps its shape"
    capfd.readouterr()
    assert bpy.ops.uv.flipfree_check() == {"FINISHED"}
    line = capfd.readouterr().out
    assert "Nothing wrong: 2 islands, 0 flips, 0 overlaps" in line and "stretched" not in line
    shapes.refused(ob, "no island is stretched beyond 1.25", bpy.ops.uv.flipfree_cut_stretched)


def test_cut_where_stretched_leaves_islands_with_pins():
    ob = shapes.two_sheets(squeezed=True)
    shapes.refused(ob, "have pins. Unpin them", bpy.ops.uv.flipfree_cut_stretched)


def test_needles_are_named_with_what_ends_them(capfd):
    corners = [(0, 0, 0), (1, 0, 0), (1, 1e-5, 0), (0, 1, 0)]
    ob = shapes.add("Needle", corners, [(0, 1, 2), (0, 2, 3)], uv=True)
    shapes.set_uv(ob, np.array([(0, 0), (1, 0), (1, 1), (0, 0), (1, 1), (0, 1)], float))
    assert bpy.ops.uv.flipfree_check() == {"FINISHED"}
    assert "1 needle: Merge by Distance or Limited Dissolve" in capfd.readouterr().out
