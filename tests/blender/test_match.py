# SPDX-License-Identifier: GPL-3.0-or-later
"""Match Pins through its operator."""

import bpy
import numpy as np
import pytest
import shapes


def flat(ob):
    """UVs of the sheet = its x, y; returns (loops, 2) and the vertex of each loop."""
    corner = np.array([loop.vertex_index for loop in ob.data.loops])
    uv = np.array([ob.data.vertices[v].co[:2] for v in corner], np.float32)
    shapes.set_uv(ob, uv)
    return uv, corner


def pinned_sheet(moves, n=8):
    ob = shapes.grid(n, bump=0.2, uv=True)
    uv, corner = flat(ob)
    for vertex, offset in moves.items():
        uv[corner == vertex] += np.float32(offset)
    shapes.set_uv(ob, uv)
    shapes.set_pins(ob, np.isin(corner, list(moves)))
    return ob, uv, corner


def met(ob, moves, uv, corner):
    """Every corner of a pinned vertex has its target, bit for bit."""
    after = shapes.uv_of(ob)
    now = np.array([loop.vertex_index for loop in ob.data.loops])
    for vertex in moves:
        target = uv[corner == vertex][0].tobytes()
        assert {value.tobytes() for value in after[now == vertex]} == {target}


@pytest.mark.parametrize("mode", ["OBJECT", "EDIT"])
def test_moved_pins_are_met_without_a_flip(mode):
    moves = {20: (0.05, 0.0), 40: (0.0, -0.06), 60: (-0.05, 0.03)}
    ob, uv, corner = pinned_sheet(moves)
    bpy.ops.object.mode_set(mode=mode)
    if mode == "EDIT":
        bpy.ops.mesh.select_all(action="SELECT")
    assert bpy.ops.uv.flipfree_match() == {"FINISHED"}
    bpy.ops.object.mode_set(mode="OBJECT")
    assert shapes.exact_flips(ob) == 0
    met(ob, moves, uv, corner)


def test_pins_that_swap_places_are_met_even_if_faces_must_be_subdivided():
    moves = {30: (0.5, 0.0), 32: (-0.5, 0.0)}
    ob, uv, corner = pinned_sheet(moves)
    area = sum(p.area for p in ob.data.polygons)
    assert bpy.ops.uv.flipfree_match() == {"FINISHED"}
    assert shapes.exact_flips(ob) == 0
    met(ob, moves, uv, corner)
    assert sum(p.area for p in ob.data.polygons) == pytest.approx(area, rel=0.01)


def test_the_group_pins_counts():
    ob, uv, corner = pinned_sheet({40: (0.07, 0.02)})
    shapes.set_pins(ob, np.zeros(len(corner), bool))
    ob.vertex_groups.new(name="Pins").add([40, 0], 1.0, "REPLACE")
    assert bpy.ops.uv.flipfree_match() == {"FINISHED"}
    met(ob, [40, 0], uv, corner)


def test_islands_without_pins_stay():
    ob, uv, corner = pinned_sheet({10: (0.02, 0.01)})
    for edge in ob.data.edges:
        edge.use_seam = all(abs(ob.data.vertices[v].co.x) < 1e-6 for v in edge.vertices)
    assert bpy.ops.uv.flipfree_match() == {"FINISHED"}
    after = shapes.uv_of(ob)
    right = np.array([p.center.x > 0 for p in ob.data.polygons]).repeat(4)
    assert after[right].tobytes() == uv[right].tobytes()
    assert (after[~right] != uv[~right]).any()


def test_two_vertices_on_one_point_are_named_and_selected():
    ob, uv, corner = pinned_sheet({30: (0.0, 0.0), 50: (0.0, 0.0)})
    uv[np.isin(corner, [30, 50])] = 0.25
    shapes.set_uv(ob, uv)
    before = shapes.everything(ob)
    with pytest.raises(RuntimeError, match="contradict"):
        bpy.ops.uv.flipfree_match()
    assert shapes.everything(ob) == before
    assert shapes.selected(ob, "vertex") == [30, 50]


def test_without_pins_there_is_nothing_to_match():
    ob = shapes.grid(4, uv=True)
    flat(ob)
    with pytest.raises(RuntimeError, match="no UV is pinned"):
        bpy.ops.uv.flipfree_match()
