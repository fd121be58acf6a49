# SPDX-License-Identifier: GPL-3.0-or-later
"""Live Pins, without a window: what is followed and what is left alone; the test's own loop stands for Blender's timer."""

import time

import bmesh
import bpy
import numpy as np
import pytest
import shapes
from pinned import edited, move, pinned_grid


@pytest.fixture
def live(part):
    return part("live.live_pins")


def settle(session, *, at_rest=True, seconds=120.0):
    """Ticks until nothing is left to do."""
    deadline = time.monotonic() + seconds
    quiet = 0
    while quiet < 3 and not session.ended:
        assert time.monotonic() < deadline, "it does not settle"
        session.tick(at_rest)
        quiet = quiet + 1 if all(one.idle for one in session.followed) else 0
        time.sleep(0.01)


def ended(ob, session):
    session.stop()
    settle(session)
    assert session.ended
    bpy.ops.object.mode_set(mode="OBJECT")
    return shapes.uv_of(ob)


@pytest.mark.parametrize("at_rest", [True, False])
def test_the_island_follows_a_pin_and_meets_it_bit_for_bit(live, at_rest):
    ob, at = pinned_grid()
    before = shapes.uv_of(ob)
    session = live.Session([ob])
    assert session.text() == "0 updates, all pins met"
    for step in (0.05, 0.1, 0.2):
        target = np.float32(before[at[3][0]] + [step, step / 2])
        move(ob, at[3], target)
        settle(session, at_rest=at_rest)
        assert session.problem == ""
    after = ended(ob, session)
    assert session.updates == 3
    assert (after[at[3]] == target).all()
    for loops in at[:3]:
        assert np.array_equal(after[loops], before[loops])
    assert shapes.exact_flips(ob) == 0
    moved = (after != before).any(axis=1)
    assert moved.sum() > len(before) / 2, "the rest stayed behind"


def test_without_a_pin_it_says_what_to_do(live):
    session = live.Session([edited(shapes.grid(4, uv=True))])
    assert session.text() == "no UV is pinned yet: pin some with P and move them"
    session.close()


def test_an_island_with_one_pin_goes_with_it_as_it_is(live):
    ob, at = pinned_grid()
    bpy.ops.object.mode_set(mode="OBJECT")
    shapes.set_pins(ob, at[0])
    edited(ob)
    before = shapes.uv_of(ob)
    session = live.Session([ob])
    move(ob, at[0], np.float32(before[at[0][0]] + 0.25))
    settle(session)
    assert np.allclose(ended(ob, session) - before, 0.25, atol=1e-6)


def test_islands_without_pins_stay_bit_for_bit(live):
    ob, at = pinned_grid(4)
    bpy.ops.object.mode_set(mode="OBJECT")
    shapes.grid(4, "Other", uv=True, x=3.0)
    assert bpy.ops.uv.flipfree_unwrap() == {"FINISHED"}
    ob.select_set(True)
    bpy.context.view_layer.objects.active = ob
    bpy.ops.object.join()
    edited(ob)
    before = shapes.uv_of(ob)
    session = live.Session([ob])
    move(ob, at[1], np.float32(before[at[1][0]] + [0.1, 0.0]))
    settle(session)
    after = ended(ob, session)
    assert session.updates == 1 and np.array_equal(after[64:], before[64:])
    assert not np.array_equal(after[:64], before[:64])


def with_opposite_corners_in_one_place(live):
    """No map without flips has that: (object, session, loops of its corners, map before)."""
    ob, at = pinned_grid(4)
    before = shapes.uv_of(ob)
    session = live.Session([ob])
    move(ob, at[3], before[at[0][0]])
    settle(session)
    return ob, session, at, before


def test_pins_that_cannot_be_met_leave_the_last_good_map_and_are_put_back(live):
    ob, session, at, before = with_opposite_corners_in_one_place(live)
    assert "cannot be met" in session.problem and session.updates == 0
    assert "the last good map stays" in session.text()
    now = shapes.uv_of(ob)
    rest = np.setdiff1d(np.arange(len(now)), at[3])
    assert np.array_equal(now[rest], before[rest])
    after = ended(ob, session)
    assert "put back" in session.lost and session.unsaved
    assert np.array_equal(after, before)


def test_pins_that_come_back_from_where_they_could_not_be_met_are_no_problem(live):
    ob, session, at, before = with_opposite_corners_in_one_place(live)
    assert session.problem
    move(ob, at[3], before[at[3][0]])
    settle(session)
    assert session.problem == "" and session.updates == 0
    assert np.array_equal(ended(ob, session), before) and session.lost == ""


def test_another_layout_by_other_tools_is_taken_over(live):
    """As undo does it, or a transform of a whole island."""
    ob, at = pinned_grid()
    before = shapes.uv_of(ob)
    session = live.Session([ob])
    bm = bmesh.from_edit_mesh(ob.data)
    layer = bm.loops.layers.uv.active
    for face in bm.faces:
        for loop in face.loops:
            loop[layer].uv *= 0.5
    bmesh.update_edit_mesh(ob.data)
    bpy.context.view_layer.update()
    settle(session)
    assert session.updates == 0
    assert np.array_equal(ended(ob, session), before * np.float32(0.5))


def test_what_others_fold_goes_back_to_the_last_good_map(live):
    ob, at = pinned_grid(4)
    before = shapes.uv_of(ob)
    session = live.Session([ob])
    vertex = 2 * 5 + 2  # the middle
    bpy.ops.object.mode_set(mode="OBJECT")
    loops = [loop.index for loop in ob.data.loops if loop.vertex_index == vertex]
    edited(ob)
    move(ob, loops, (5.0, 5.0))
    settle(session)
    assert np.array_equal(ended(ob, session), before)


def test_unpinned_corners_let_the_island_go(live):
    ob, at = pinned_grid()
    before = shapes.uv_of(ob)
    session = live.Session([ob])
    move(ob, at[3], np.float32(before[at[3][0]] + [0.3, 0.3]))
    settle(session)
    bm = bmesh.from_edit_mesh(ob.data)
    layer = bm.loops.layers.uv.active
    stretched = shapes.uv_of(ob)[at[3][0]].copy()
    for index, loop in enumerate(loop for face in bm.faces for loop in face.loops):
        if index in at[3].tolist():
            loop[layer].pin_uv = False
    bmesh.update_edit_mesh(ob.data)
    bpy.context.view_layer.update()
    settle(session)
    after = ended(ob, session)
    assert session.updates == 2
    assert np.linalg.norm(after[at[3][0]] - before[at[3][0]]) < np.linalg.norm(
        stretched - before[at[3][0]]
    )


def test_a_tick_does_not_wait_for_the_solver(live, part, monkeypatch):
    ob, at = pinned_grid(4)
    before = shapes.uv_of(ob)
    session = live.Session([ob])

    class Never:
        cancelled = False

        def wait(self, seconds):
            assert seconds == 0.0 or self.cancelled
            return self.cancelled

        def cancel(self):
            self.cancelled = True

    monkeypatch.setattr(part("solver"), "improve", lambda *_, **__: Never())
    move(ob, at[3], np.float32(before[at[3][0]] + 0.1))
    for _ in range(5):
        session.tick(False)
    assert not session.followed[0].idle and "following" in session.text()
    session.close()
    assert session.followed[0].idle


def test_leaving_edit_mode_ends_it(live):
    ob, at = pinned_grid(4)
    before = shapes.uv_of(ob)
    session = live.Session([ob])
    move(ob, at[3], before[at[0][0]])
    settle(session)
    bpy.ops.object.mode_set(mode="OBJECT")
    session.tick(True)
    assert session.ended and "no longer edited" in session.lost
    assert np.array_equal(shapes.uv_of(ob), before), "pins that cannot be met were put back"


def test_large_meshes_are_refused_with_the_limit(live, part):
    ob = shapes.grid(101, uv=True)
    edited(ob)
    with pytest.raises(
        part("meshes.mesh_io").MeshProblem, match="20402 triangles .* at most 20000"
    ):
        live.Session([ob])


def test_without_a_window_it_says_so():
    pinned_grid(4)
    with pytest.raises(RuntimeError, match="Use Match Pins"):
        bpy.ops.uv.flipfree_live_pins()


def test_islands_keep_their_shape_on_a_texture_that_is_no_square(live):
    ob = shapes.grid(8, bump=0.0, uv=True)
    at = np.array([v.co[:2] for v in ob.data.vertices])
    at = at[[loop.vertex_index for loop in ob.data.loops]]
    before = (at * [0.1, 0.2] + 0.5).astype(np.float32)
    shapes.set_uv(ob, before)
    low = at[:, 1] == -1.0
    left, right = (low & (at[:, 0] == x) for x in (-1.0, 1.0))
    shapes.set_pins(ob, left | right)
    edited(ob)
    session = live.Session([ob], texture=2.0)
    move(ob, np.flatnonzero(right), np.float32([0.6001, 0.3]))
    settle(session)
    after = ended(ob, session)
    assert session.updates == 1 and abs(after - before).max() < 1e-3
