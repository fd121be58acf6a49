# SPDX-License-Identifier: GPL-3.0-or-later
"""Select Faces by Map: what is chosen, by islands too, in both modes."""

import bpy
import numpy as np
import pytest
import shapes


def chosen(**options):
    """Faces that are selected afterwards, by object; ends in object mode."""
    assert bpy.ops.uv.flipfree_select_faces(**options) == {"FINISHED"}
    if bpy.context.mode != "OBJECT":
        bpy.ops.object.mode_set(mode="OBJECT")
    return shapes.selected(bpy.context.object, "face")


def sheets():
    """Face 0 of the large one (0 to 15) is an island that is mirrored, face 15 a point; the small one (16 to 31) is too flat."""
    ob = shapes.two_sheets(squeezed=True)
    uv = shapes.uv_of(ob)
    uv[0:4] = uv[0:4][::-1]
    uv[60:64] = uv[60]
    shapes.set_uv(ob, uv)
    for polygon in ob.data.polygons:
        polygon.select = False
    return ob


@pytest.mark.parametrize("mode", ["OBJECT", "EDIT"])
def test_mirrored_islands_and_faces_without_area(mode):
    sheets()
    bpy.ops.object.mode_set(mode=mode)
    assert chosen(what="mirrored") == [0]
    bpy.ops.object.mode_set(mode=mode)
    assert chosen(what="degenerate") == [15]


def test_whole_islands():
    """What was torn off is an island of its own."""
    ob = sheets()
    uv = shapes.uv_of(ob)
    corner = shapes.corners(ob)
    plane = shapes.plane(ob)
    uv[:64] = plane[:64] * 0.1
    uv[corner == 12] += [0.2, 0.2]
    shapes.set_uv(ob, uv)
    faces = chosen(what="flipped")
    assert 0 < len(faces) < 16
    assert chosen(what="flipped", islands=True) == list(range(16))


def test_stacked_islands_overlap():
    ob = shapes.two_sheets()
    uv = shapes.uv_of(ob)
    uv[64:] -= [0.6, 0.0]
    shapes.set_uv(ob, uv)
    assert chosen(what="overlapping") == list(range(32))


def test_the_worst_faces_make_up_the_share_of_the_surface():
    ob = shapes.two_sheets(squeezed=True)
    assert chosen(what="worst", share=1.0)[0] >= 16, "the small sheet is the sheared one"
    area = np.array([p.area for p in ob.data.polygons])
    for share in (1.0, 10.0, 50.0):
        faces = chosen(what="sheared", share=share)
        got = area[faces].sum() / area.sum()
        assert share / 100 <= got <= share / 100 + 2 * area.max() / area.sum()
    assert chosen(what="sheared", share=100.0) == list(range(32))


def test_where_nothing_is_wrong_the_selection_stays():
    ob = shapes.grid(4, uv=True)
    assert bpy.ops.uv.flipfree_unwrap() == {"FINISHED"}
    shapes.activate(ob)
    before = shapes.selection(ob)
    for what in ("flipped", "degenerate", "overlapping"):
        assert bpy.ops.uv.flipfree_select_faces(what=what) == {"FINISHED"}
    assert shapes.selection(ob) == before


def test_small_faces_are_those_with_the_least_pixels():
    ob = shapes.grid(4, bump=0.0, uv=True)
    uv = shapes.plane(ob)
    uv[:, 0] = np.where(uv[:, 0] < 0, 0.1, 1.0) * uv[:, 0]
    shapes.set_uv(ob, uv)
    assert chosen(what="small", share=50.0) == list(range(8))
