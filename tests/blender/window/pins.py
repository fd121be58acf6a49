# SPDX-License-Identifier: GPL-3.0-or-later
"""Live Pins in a window: pins dragged by Blender's own transform, undo, Esc, and the operator again."""

import bmesh
import bpy
import numpy as np
import shapes
from stage import SHOTS, area_of, invoke, part, press, shot, show, undo, until, wait_for_end

live = part("live.live_pins")


def selected_corner(n=12):
    """An unwrapped sheet in Edit Mode, pinned at its corners, one of which is selected in the UV editor; (object, its loops)."""
    yield from show("UV Editing")
    ob = shapes.grid(n, uv=True)
    assert bpy.ops.uv.flipfree_unwrap() == {"FINISHED"}
    vertex = shapes.corners(ob)
    pinned = np.isin(vertex, [0, n, n * (n + 1), (n + 1) ** 2 - 1])
    shapes.set_pins(ob, pinned)
    loops = np.flatnonzero(vertex == (n + 1) ** 2 - 1)
    bpy.ops.object.mode_set(mode="EDIT")
    bpy.context.tool_settings.mesh_select_mode = (True, False, False)
    bpy.context.tool_settings.use_uv_select_sync = True
    with bpy.context.temp_override(**area_of("IMAGE_EDITOR")):
        bpy.ops.image.view_all(fit_view=True)
        bpy.ops.image.view_zoom_out()
        bpy.ops.uv.select_all(action="DESELECT")
        bpy.ops.uv.select(location=shapes.uv_of(ob)[loops[0]].tolist())
    bpy.ops.ed.undo_push(message="Before")
    yield 0.5
    return ob, loops


def place():
    region = area_of("IMAGE_EDITOR")["region"]
    return region.x + region.width // 4, region.y + region.height // 2


def event(kind, value, x, y):
    window = bpy.context.window_manager.windows[0]
    window.event_simulate(type=kind, value=value, x=x, y=y)


def pixels(way):
    """(x, y) of a vector of the map in the UV editor."""
    view = area_of("IMAGE_EDITOR")["region"].view2d
    start, end = (np.array(view.view_to_region(*at, clip=False)) for at in ((0, 0), way))
    return [int(k) for k in end - start]


def drag(dx, dy, name=""):
    """G in the UV editor, the mouse moved so many pixels; not confirmed. name: of pictures of each step."""
    steps = 12 if name and SHOTS is not None else 5
    x, y = place()
    event("MOUSEMOVE", "NOTHING", x, y)
    yield 0.3
    event("G", "PRESS", x, y)
    event("G", "RELEASE", x, y)
    yield 0.3
    for i in range(1, steps + 1):
        event("MOUSEMOVE", "NOTHING", x + dx * i // steps, y + dy * i // steps)
        yield 0.1
        if name:
            shot(f"{name}_{i:02}")


def confirm(dx, dy):
    x, y = place()
    event("LEFTMOUSE", "PRESS", x + dx, y + dy)
    event("LEFTMOUSE", "RELEASE", x + dx, y + dy)
    yield 0.3


def at_rest():
    session = live.current()
    return session is None or all(one.idle for one in session.followed)


def test_live_pins_follow_a_transform_while_it_goes_on():
    ob, loops = yield from selected_corner()
    before = shapes.uv_of(ob)
    rest = np.setdiff1d(np.arange(len(before)), loops)
    assert invoke("live_pins") == {"RUNNING_MODAL"}
    yield 0.3
    shot("live_before")
    way = pixels(0.6 * (0.5 - before[loops[0]]))  # from the corner inwards
    yield from drag(*way, name="live_step")
    yield from until(lambda: live.current().updates > 0, "nothing follows the drag")
    yield from until(at_rest, "it does not come to rest")
    operators = [op.bl_idname for op in bpy.context.window_manager.windows[0].modal_operators]
    assert any("translate" in name.lower() for name in operators), operators
    shot("live_dragging")
    during = shapes.uv_of(ob)
    assert not np.array_equal(during[rest], before[rest]), "the rest stayed behind"
    yield from confirm(*way)
    yield from until(at_rest, "it does not come to rest")
    yield 0.5
    shot("live_moved")
    moved = shapes.uv_of(ob)
    assert not np.allclose(moved[loops], before[loops], atol=1e-3)
    # One step takes the pin back, and all that followed it.
    undo("IMAGE_EDITOR")
    yield 0.5
    yield from until(at_rest, "it does not come to rest")
    assert np.array_equal(shapes.uv_of(bpy.context.object), before)
    assert live.current() is not None, "undo ended it"
    press("ESC")
    yield from until(lambda: live.current() is None, "Esc does not end it")
    yield 0.4
    bpy.ops.object.mode_set(mode="OBJECT")
    assert shapes.exact_flips(bpy.context.object) == 0


def test_live_pins_cancelled_drags_and_pins_out_of_reach_leave_the_good_map():
    ob, loops = yield from selected_corner()
    before = shapes.uv_of(ob)
    assert invoke("live_pins") == {"RUNNING_MODAL"}
    yield from drag(-60, -60)
    press("ESC")
    yield 0.5
    assert live.current() is not None, "Esc was the transform's"
    yield from until(at_rest, "it does not come to rest")
    now = shapes.uv_of(ob)
    assert np.array_equal(now[loops], before[loops])
    # Past the opposite corner, which is pinned.
    vertex = np.array(
        [loop.vert.index for face in bmesh.from_edit_mesh(ob.data).faces for loop in face.loops]
    )
    (opposite,) = np.flatnonzero(vertex == 0)
    way = 1.5 * (before[opposite] - before[loops[0]])
    target, way = before[loops[0]] + way, pixels(way)
    yield from drag(*way)
    yield from confirm(*way)
    yield from until(lambda: at_rest() and live.current().problem, "nothing is said")
    yield 0.4
    shot("live_unmet")
    assert invoke("live_pins") == {"CANCELLED"}  # the second call ends it
    yield from until(lambda: live.current() is None, "it does not end")
    yield 0.5
    shot("live_ended")
    bpy.ops.object.mode_set(mode="OBJECT")
    after = shapes.uv_of(ob)
    assert shapes.exact_flips(ob) == 0
    assert not np.allclose(after[loops[0]], target, atol=0.1), "the pin was not put back"


def test_what_live_pins_wrote_beside_no_other_operator_is_one_undo_step():
    ob, loops = yield from selected_corner()
    before = shapes.uv_of(ob)
    assert invoke("live_pins") == {"RUNNING_MODAL"}
    bm = bmesh.from_edit_mesh(ob.data)
    layer = bm.loops.layers.uv.active
    for index, loop in enumerate(loop for face in bm.faces for loop in face.loops):
        if index in loops.tolist():
            loop[layer].uv.x += 0.2
    bmesh.update_edit_mesh(ob.data)
    yield from until(lambda: live.current().updates > 0, "nothing follows")
    yield from until(at_rest, "it does not come to rest")
    press("ESC")
    yield from until(lambda: live.current() is None, "Esc does not end it")
    yield 0.5
    assert not np.array_equal(shapes.uv_of(bpy.context.object), before)
    undo("IMAGE_EDITOR")
    yield 0.5
    assert bpy.context.mode == "EDIT_MESH"
    assert np.array_equal(shapes.uv_of(bpy.context.object), before)
    yield from wait_for_end()


def test_an_open_sidebar_leaves_a_transform_alone():
    """Python's looking at loops moves their data, in 5.2 under the hands of a transform."""
    ob, loops = yield from selected_corner()
    before = shapes.uv_of(ob)
    space = area_of("IMAGE_EDITOR")["area"].spaces.active
    space.show_region_ui = True
    yield 0.3
    region = next(r for r in area_of("IMAGE_EDITOR")["area"].regions if r.type == "UI")
    region.active_panel_category = "Flipfree"
    yield 0.5
    yield from drag(40, 40)
    shot("live_sidebar")
    yield from confirm(40, 40)
    space.show_region_ui = False
    moved = (shapes.uv_of(ob) != before).any(axis=1)
    assert np.array_equal(np.flatnonzero(moved), loops), np.flatnonzero(moved)
