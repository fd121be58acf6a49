# SPDX-License-Identifier: GPL-3.0-or-later
"""Match Pins through its operator."""

import bpy
import numpy as np
import pytest
import shapes
from layouts import islands

from judges.gaps import narrowest


def pinned_sheet(moves, n=8):
    ob = shapes.grid(n, bump=0.2, uv=True)
    uv, corner = shapes.flat(ob)
    for vertex, offset in moves.items():
        uv[corner == vertex] += np.float32(offset)
    shapes.set_uv(ob, uv)
    shapes.set_pins(ob, np.isin(corner, list(moves)))
    return ob, uv, corner


def met(ob, moves, uv, corner):
    """Every corner of a pinned vertex has its target, bit for bit."""
    after = shapes.uv_of(ob)
    now = shapes.corners(ob)
    for vertex in moves:
        target = uv[corner == vertex][0].tobytes()
        assert {value.tobytes() for value in after[now == vertex]} == {target}


@pytest.mark.parametrize("mode", ["OBJECT", "EDIT"])
def test_moved_pins_are_met_without_a_flip(mode):
    moves = {20: (0.05, 0.0), 40: (0.0, -0.06), 60: (-0.05, 0.03)}
    ob, uv, corner = pinned_sheet(moves)
    shapes.enter(mode)
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


# Four inner vertices make half a turn inside a rim of pins, one row of faces away: too much of a twist for these faces.
SWAP = {v: (0.0, 0.0) for v in range(81) if max(abs(v // 9 - 4), abs(v % 9 - 4)) == 2}
SWAP |= {30: (0.5, 0.5), 32: (0.5, -0.5), 48: (-0.5, 0.5), 50: (-0.5, -0.5)}


def test_new_vertices_are_no_pins(capfd):
    moves = SWAP
    ob, uv, corner = pinned_sheet(moves)
    ob.vertex_groups.new(name="Pins").add([30, 48], 1.0, "REPLACE")
    ob.vertex_groups.new(name="Cone +1").add([30], 1.0, "REPLACE")
    before = len(ob.data.vertices)
    assert bpy.ops.uv.flipfree_match() == {"FINISHED"}
    assert f"{len(ob.data.vertices) - before} vertices added" in capfd.readouterr().out
    assert len(ob.data.vertices) > before
    pinned = shapes.pins_of(ob)
    now = shapes.corners(ob)
    assert set(now[pinned].tolist()) == set(moves)
    grouped = {g.name: set() for g in ob.vertex_groups}
    for vertex in ob.data.vertices:
        for entry in vertex.groups:
            grouped[ob.vertex_groups[entry.group].name].add(vertex.index)
    assert grouped == {"Pins": {30, 48}, "Cone +1": {30}}
    # The next run has the same pins.
    assert bpy.ops.uv.flipfree_match() == {"FINISHED"}
    met(ob, moves, uv, corner)


@pytest.mark.parametrize("mode", ["OBJECT", "EDIT"])
def test_pins_that_need_new_vertices_are_refused_if_there_may_be_none(mode):
    ob, _, _ = pinned_sheet(SWAP)
    shapes.enter(mode)
    shapes.refused(
        ob,
        r"cannot be met without \d+ new vert(ex|ices) in \d+ faces?.*May Add Vertices",
        bpy.ops.uv.flipfree_match,
        may_add=False,
    )
    assert shapes.shown("face")


def test_islands_on_each_other_are_counted(capfd):
    ob, uv, corner = pinned_sheet({20: (0.05, 0.0), 60: (0.0, 0.0)})
    right = shapes.seam_in_the_middle(ob)
    uv[right] -= np.float32([0.9, 0.0])
    shapes.set_uv(ob, uv)
    assert bpy.ops.uv.flipfree_match() == {"FINISHED"}
    report = capfd.readouterr().out
    assert "1 pair of islands overlaps" in report and "0 overlaps" not in report


def test_the_group_pins_counts():
    ob, uv, corner = pinned_sheet({40: (0.07, 0.02)})
    shapes.set_pins(ob, np.zeros(len(corner), bool))
    ob.vertex_groups.new(name="Pins").add([40, 0], 1.0, "REPLACE")
    assert bpy.ops.uv.flipfree_match() == {"FINISHED"}
    met(ob, [40, 0], uv, corner)


def test_islands_without_pins_stay():
    ob, uv, corner = pinned_sheet({10: (0.02, 0.01)})
    right = shapes.seam_in_the_middle(ob)
    assert bpy.ops.uv.flipfree_match() == {"FINISHED"}
    after = shapes.uv_of(ob)
    assert after[right].tobytes() == uv[right].tobytes()
    assert (after[~right] != uv[~right]).any()


def test_without_pins_there_is_nothing_to_match():
    ob = shapes.grid(4, uv=True)
    shapes.flat(ob)
    with pytest.raises(RuntimeError, match="no UV is pinned"):
        bpy.ops.uv.flipfree_match()


def test_each_island_meets_its_own_pins():
    moves = {20: (0.05, 0.0), 60: (-0.05, 0.03)}  # left and right of x = 0
    ob, uv, corner = pinned_sheet(moves)
    right = shapes.seam_in_the_middle(ob)
    uv[right] += np.float32([4.0, 0.0])
    shapes.set_uv(ob, uv)
    assert bpy.ops.uv.flipfree_match() == {"FINISHED"}
    assert shapes.exact_flips(ob) == 0
    met(ob, moves, uv, corner)
    after = shapes.uv_of(ob)
    assert after[~right].max() < 3.0 < after[right, 0].min()


def test_islands_without_pins_are_unwrapped_on_demand(capfd):
    ob, uv, corner = pinned_sheet({10: (0.02, 0.01)})
    right = shapes.seam_in_the_middle(ob)
    uv[right] = uv[right] * np.float32([1.0, 0.2]) + np.float32([4.0, 0.0])
    shapes.set_uv(ob, uv)
    assert bpy.ops.uv.flipfree_match(rest="unwrap") == {"FINISHED"}
    assert "2 islands" in capfd.readouterr().out
    after = shapes.uv_of(ob)
    assert (after[right] != uv[right]).any() and shapes.exact_flips(ob) == 0
    size = np.ptp(after[right], axis=0)
    assert size.max() > 1.5 * size.min(), "no longer squeezed"
    assert narrowest(islands(ob), 0.1).distance >= 4 / 1024, "beside the island with pins"
    met(ob, {10: 0}, uv, corner)


def pinned_cube():
    ob = shapes.cube()
    mesh = ob.data
    if not mesh.uv_layers:
        mesh.uv_layers.new(name="UVMap")
    corner = np.array([loop.vertex_index for loop in mesh.loops])
    uv = np.random.default_rng(1).random((len(corner), 2)).astype(np.float32)
    for vertex, place in {0: (0.1, 0.2), 6: (0.8, 0.7)}.items():
        uv[corner == vertex] = place
    shapes.set_uv(ob, uv)
    shapes.set_pins(ob, np.isin(corner, [0, 6]))
    return ob, uv, corner


def test_a_closed_island_is_named_with_the_cure():
    ob, _, _ = pinned_cube()
    shapes.refused(
        ob, r"island of face 0 \(6 faces\) is closed.*Cut Open", bpy.ops.uv.flipfree_match
    )
    assert shapes.shown("face") == list(range(6))


def test_a_closed_island_can_be_cut_open():
    ob, uv, corner = pinned_cube()
    assert bpy.ops.uv.flipfree_match(cut_open=True) == {"FINISHED"}
    assert shapes.exact_flips(ob) == 0
    assert any(edge.use_seam for edge in ob.data.edges)
    met(ob, [0, 6], uv, corner)


def test_handles_are_named():
    ob = shapes.primitive("torus", major_segments=12, minor_segments=8)
    if not ob.data.uv_layers:
        ob.data.uv_layers.new(name="UVMap")
    shapes.set_uv(ob, np.full((len(ob.data.loops), 2), 0.5))
    shapes.set_pins(ob, [ob.data.polygons[0].loop_start])
    for edge in ob.data.edges:
        edge.use_seam = edge.index == ob.data.edges[0].index
    with pytest.raises(RuntimeError, match="cannot be flattened in one piece"):
        bpy.ops.uv.flipfree_match()


def pin_the_rim(ob, uv, corner, place):
    """Pins the sheet's boundary; place: angle along it -> (u, v)."""
    rim = [v.index for v in ob.data.vertices if max(abs(v.co.x), abs(v.co.y)) > 0.999]
    for vertex in rim:
        x, y, _ = ob.data.vertices[vertex].co
        uv[corner == vertex] = place(np.arctan2(y, x))
    shapes.set_uv(ob, uv)
    shapes.set_pins(ob, np.isin(corner, rim))
    return rim


def test_a_pinned_rim_is_the_target_polygon():
    ob, uv, corner = pinned_sheet({})
    rim = pin_the_rim(ob, uv, corner, lambda a: (2 * np.cos(a), 0.5 * np.sin(a)))
    assert bpy.ops.uv.flipfree_match() == {"FINISHED"}
    assert shapes.exact_flips(ob) == 0
    met(ob, rim, uv, corner)


@pytest.mark.parametrize(
    ("place", "words"),
    [
        (lambda a: (np.cos(a), -np.sin(a)), "clockwise"),
        (lambda a: (np.sin(2 * a), np.sin(a)), "turns once"),
    ],
)
def test_a_rim_that_bounds_no_map_is_named_and_selected(place, words):
    ob, uv, corner = pinned_sheet({})
    rim = pin_the_rim(ob, uv, corner, place)
    with pytest.raises(RuntimeError, match=words):
        bpy.ops.uv.flipfree_match()
    chosen = shapes.shown("vertex")
    assert chosen and set(chosen) <= set(rim)


def test_two_places_for_one_vertex_are_named_and_selected():
    ob, uv, corner = pinned_sheet({30: (0.0, 0.0)})
    uv[np.flatnonzero(corner == 30)[0]] += np.float32(0.1)
    shapes.set_uv(ob, uv)
    with pytest.raises(RuntimeError, match="vertex 30 is pinned to two places"):
        bpy.ops.uv.flipfree_match()
    assert shapes.shown("vertex") == [30]


def test_an_island_with_one_pin_keeps_its_size_and_direction():
    ob, uv, corner = pinned_sheet({})
    turned = uv @ np.array(
        [[0.0, 0.25], [-0.25, 0.0]], np.float32
    )  # a quarter turn, a quarter of the size
    turned[corner == 40] += np.float32([3.0, 0.5])
    shapes.set_uv(ob, turned)
    shapes.set_pins(ob, corner == 40)
    assert bpy.ops.uv.flipfree_match() == {"FINISHED"}
    assert shapes.exact_flips(ob) == 0
    met(ob, [40], turned, corner)
    after = shapes.uv_of(ob)
    assert after.mean(0) == pytest.approx([3.0, 0.5], abs=0.05)
    way = after[corner == 76][0] - after[corner == 4][0]  # the sheet's x
    assert way == pytest.approx([0.0, 0.5], abs=0.05)


def test_vertices_that_pins_need_on_a_seam_split_both_sides():
    """Random pins on both islands of a sheet: whatever has to be added on the seam, the sheet stays closed there."""
    on_seam = 0
    for seed in range(24):
        ob = shapes.grid(8, bump=0.2, uv=True)
        uv, corner = shapes.flat(ob)
        shapes.seam_in_the_middle(ob)
        random = np.random.default_rng(seed)
        x = np.array([v.co.x for v in ob.data.vertices])
        pins = np.concatenate(
            [random.choice(np.flatnonzero(side), 12, replace=False) for side in (x < -0.1, x > 0.1)]
        )
        for vertex, place in zip(pins, random.random((24, 2)), strict=True):
            uv[corner == vertex] = place + [3.0 * (x[vertex] > 0), 0.0]
        shapes.set_uv(ob, uv)
        shapes.set_pins(ob, np.isin(corner, pins))
        old = len(ob.data.vertices)
        assert bpy.ops.uv.flipfree_match(bijective=False, straight_lines=False) == {"FINISHED"}
        assert shapes.exact_flips(ob) == 0
        met(ob, pins.tolist(), uv, corner)
        mesh = ob.data
        place = np.array([v.co for v in mesh.vertices])
        on_seam += int((np.abs(place[old:, 0]) < 1e-6).sum())
        uses = np.bincount([loop.edge_index for loop in mesh.loops], minlength=len(mesh.edges))
        for edge in mesh.edges:
            ends = place[list(edge.vertices)]
            outer = [(np.abs(ends[:, k] - s) < 1e-6).all() for k in (0, 1) for s in (-1.0, 1.0)]
            assert uses[edge.index] == (1 if any(outer) else 2), "the sheet came apart"
            assert edge.use_seam == (np.abs(ends[:, 0]) < 1e-6).all()
        if on_seam and seed >= 3:
            return
    raise AssertionError("no seed needed a vertex on the seam: this test says nothing")


def test_without_time_nothing_is_changed_and_the_limit_is_named():
    ob, _, _ = pinned_sheet({30: (0.5, 0.0), 32: (-0.5, 0.0)}, n=40)
    shapes.refused(
        ob, "in the time allowed.*Allow more time", bpy.ops.uv.flipfree_match, max_seconds=1e-4
    )


def test_there_is_a_limit_of_time_unless_it_is_turned_off():
    operator = bpy.ops.uv.flipfree_match.get_rna_type().properties["max_seconds"]
    assert 60.0 <= operator.default <= 600.0
    moves = {20: (0.05, 0.0), 40: (0.0, -0.06)}
    ob, uv, corner = pinned_sheet(moves)
    assert bpy.ops.uv.flipfree_match(max_seconds=0.0) == {"FINISHED"}
    met(ob, moves, uv, corner)
