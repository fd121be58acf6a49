# SPDX-License-Identifier: GPL-3.0-or-later
"""Repair Flips: maps that hands, imports and Blender's own unwrap fold are mended, the rest stays as it was."""

import bpy
import numpy as np
import pytest
import shapes

pytestmark = pytest.mark.halved


def flat_grid(n=8):
    """Mapped by x, y."""
    ob = shapes.grid(n, uv=True)
    return ob, shapes.flat(ob)[0]


def said(capfd):
    return capfd.readouterr().out


@pytest.mark.parametrize("mode", ["OBJECT", "EDIT"])
def test_a_vertex_dragged_over_its_neighbours_goes_back_and_nothing_else_moves(mode, capfd):
    ob, uv = flat_grid()
    corner = shapes.corners(ob)
    uv[corner == 40] += np.float32(0.9)
    shapes.set_uv(ob, uv)
    assert shapes.exact_flips(ob) > 0
    shapes.enter(mode)
    assert bpy.ops.uv.flipfree_repair() == {"FINISHED"}
    bpy.ops.object.mode_set(mode="OBJECT")
    after = shapes.uv_of(ob)
    assert shapes.exact_flips(ob) == 0
    assert (after[corner != 40] == uv[corner != 40]).all()
    text = said(capfd)
    assert "before: 2 flips" in text
    assert "1 island unfolded" in text and "98 % of the UVs as before" in text


def test_a_sound_map_stays_bit_for_bit(capfd):
    ob, uv = flat_grid()
    assert bpy.ops.uv.flipfree_repair(disjoint=True, mark_seams=True) == {"FINISHED"}
    assert shapes.uv_of(ob).tobytes() == uv.tobytes()
    assert not any(edge.use_seam for edge in ob.data.edges)
    assert "nothing to repair" in said(capfd)


def test_corners_that_only_come_back_are_no_map_without_repairs(capfd):
    """Neither is an island unfolded then, nor one made anew."""
    ob, uv = flat_grid()
    corners = ob.data.polygons[27].loop_indices
    for place, what in (
        (np.nan, "4 corners without a place"),  # two of the quad's triangles each
        (-3.0, "2 flips"),
    ):
        torn = uv.copy()
        if np.isnan(place):
            torn[list(corners)[:2]] = np.nan
        else:
            torn[list(corners), 0] *= np.float32(-1)
        shapes.set_uv(ob, torn)
        assert bpy.ops.uv.flipfree_repair() == {"FINISHED"}
        assert (shapes.uv_of(ob) == uv).all()
        text = said(capfd)
        assert "nothing to repair" not in text and "% of the UVs as before" in text
        assert what.split(" ", 1)[1] in text, text
        assert ("joined to others again" in text) == (place == -3.0)


def test_islands_at_one_point_are_unwrapped_along_the_seams():
    ob = shapes.cube()
    shapes.cut_all(ob)
    if not ob.data.uv_layers.active:
        ob.data.uv_layers.new(name="UVMap")
    shapes.set_uv(ob, np.full((len(ob.data.loops), 2), 0.5, np.float32))
    assert bpy.ops.uv.flipfree_repair() == {"FINISHED"}
    assert shapes.exact_flips(ob) == 0
    uv = shapes.uv_of(ob).reshape(6, 4, 2)
    assert len(np.unique(uv.mean(axis=1).round(4), axis=0)) == 6
    assert uv.min() >= 0.0 and uv.max() <= 1.0


@pytest.mark.parametrize("overlaps", ["cut", "open", "keep"])
def test_an_island_on_itself(overlaps):
    ob = shapes.grid(12, uv=True)
    flat = np.array([ob.data.vertices[v].co[:2] for v in shapes.corners(ob)])
    angle, radius = 1.5 * np.pi * (flat[:, 0] + 1.0), 3.0 - flat[:, 1]
    for vertex in ob.data.vertices:
        vertex.co.x *= 12.0
    before = np.column_stack([radius * np.cos(angle), radius * np.sin(angle)]).astype(np.float32)
    before = before[:, ::-1] if shapes_flipped(ob, before) else before
    shapes.set_uv(ob, before)
    assert shapes.exact_flips(ob) == 0
    assert bpy.ops.uv.flipfree_repair(overlaps=overlaps, mark_seams=True) == {"FINISHED"}
    assert shapes.exact_flips(ob) == 0
    seams = sum(edge.use_seam for edge in ob.data.edges)
    assert (seams > 0) == (overlaps == "cut")
    assert (shapes.uv_of(ob) == before).all() == (overlaps == "keep")


def test_a_stretched_island_is_counted_and_improved_on_demand(capfd):
    ob, uv = flat_grid()
    shapes.set_uv(ob, uv * np.float32([1, 3]))
    before = shapes.uv_of(ob)
    assert bpy.ops.uv.flipfree_repair() == {"FINISHED"}
    assert (shapes.uv_of(ob) == before).all()
    text = said(capfd)
    assert "nothing to repair" in text and "1 island stretched" in text
    assert "Stretched Islands: Improve" in text
    assert bpy.ops.uv.flipfree_repair(stretched="improve") == {"FINISHED"}
    after = shapes.uv_of(ob)
    assert shapes.exact_flips(ob) == 0
    assert np.ptp(after[:, 1]) < 1.3 * np.ptp(after[:, 0])
    assert np.abs(after.mean(axis=0) - before.mean(axis=0)).max() < 0.05
    text = said(capfd)
    assert "1 island less stretched" in text and "island stretched" not in text


def shapes_flipped(ob, uv):
    shapes.set_uv(ob, uv)
    return shapes.exact_flips(ob) > 0


def test_pins_hold():
    ob, uv = flat_grid()
    corner = shapes.corners(ob)
    uv[corner == 40] += np.float32([0.3, 0.1])
    uv[corner == 20] += np.float32(0.9)
    shapes.set_uv(ob, uv)
    shapes.set_pins(ob, np.isin(corner, [40]))
    assert bpy.ops.uv.flipfree_repair() == {"FINISHED"}
    assert shapes.exact_flips(ob) == 0
    assert (shapes.uv_of(ob)[corner == 40] == uv[corner == 40]).all()


@pytest.mark.parametrize("method", ["ANGLE_BASED", "CONFORMAL"])
@pytest.mark.parametrize("moved", [8, 12])
def test_what_blender_unwraps_around_moved_pins_is_unfolded(method, moved):
    """Blender's own unwrap meets pins by folding faces."""
    ob = shapes.monkey(1)
    assert bpy.ops.uv.flipfree_unwrap() == {"FINISHED"}
    corner = shapes.corners(ob)
    uv = shapes.uv_of(ob)
    random = np.random.default_rng(moved)
    inner = [
        v
        for v in range(len(ob.data.vertices))
        if len(np.unique(uv[corner == v], axis=0)) == 1 and (corner == v).sum() == 4
    ]
    chosen = random.choice(inner, moved, replace=False)
    for v in chosen:
        uv[corner == v] += random.normal(size=2).astype(np.float32) * np.float32(0.15)
    shapes.set_uv(ob, uv)
    shapes.set_pins(ob, np.isin(corner, chosen))
    shapes.enter("EDIT")
    bpy.ops.uv.select_all(action="SELECT")
    assert bpy.ops.uv.unwrap(method=method, margin=0.0) == {"FINISHED"}
    bpy.ops.object.mode_set(mode="OBJECT")
    folds = shapes.exact_flips(ob)
    assert bpy.ops.uv.flipfree_repair(use_pins=False) == {"FINISHED"}
    assert folds > 0
    assert shapes.exact_flips(ob) == 0
