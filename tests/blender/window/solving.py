# SPDX-License-Identifier: GPL-3.0-or-later
"""Runs in a window: progress, Esc, Return, undo, what is selected and reported."""

import bpy
import numpy as np
import shapes
from stage import (
    area_of,
    ended,
    escaped,
    frame_all,
    invoke,
    part,
    picture,
    picture_of_options,
    pointer,
    press,
    reset,
    ring,
    running,
    shot,
    show,
    timed,
    undo,
    wait_for_end,
)

compat, labels = part("compat"), part("meshes.labels")


def test_escape_cancels_and_leaves_everything():
    for name, make, after in (
        ("unwrap", shapes.slow, 0.6),
        ("match", lambda: pinned_monkey(3, 0.3)[0], 0.5),
        ("seamless", lambda: ring(4), 0.5),
    ):
        yield from show("Layout")
        reset()
        ob = make()
        before = shapes.everything(ob)
        yield from escaped(name, after, "progress" if name == "unwrap" else f"{name}_progress")
        assert shapes.everything(ob) == before and not ob.vertex_groups


def test_return_takes_the_map_as_it_is():
    # Where no UV editor draws: 5.2 takes ten seconds for so many faces without a graphics card.
    yield from show("Layout")
    ob = shapes.slow()
    before = shapes.uv_of(ob).tobytes()
    assert invoke() == {"RUNNING_MODAL"}
    yield 0.6
    assert running(), "too small a mesh for this test"
    shot("accept_before")
    press("RET")
    yield 0.2
    shot("accept_after")
    yield from wait_for_end(60.0)
    assert shapes.uv_of(ob).tobytes() != before
    assert shapes.exact_flips(ob) == 0


def test_a_poor_result_is_a_warning_and_its_islands_can_be_selected():
    yield from show("UV Editing")
    ob = shapes.two_sheets(squeezed=True)
    shapes.enter("EDIT")
    yield from timed()
    yield from picture("poor_warning")
    with bpy.context.temp_override(**area_of("VIEW_3D")):
        assert bpy.ops.uv.flipfree_select_poor("INVOKE_DEFAULT") == {"FINISHED"}
    yield 1.0
    shot("poor_selected")
    bpy.ops.object.mode_set(mode="OBJECT")
    assert shapes.selected(ob, "face") == list(range(16, 32))


def test_distorted_islands_are_selected_in_a_uv_editor_with_its_own_selection():
    yield from show("UV Editing")
    ob = shapes.two_sheets(squeezed=True)
    shapes.enter("EDIT")
    bpy.context.tool_settings.use_uv_select_sync = False
    with bpy.context.temp_override(**area_of("IMAGE_EDITOR")):
        assert bpy.ops.uv.flipfree_select_poor("INVOKE_DEFAULT") == {"FINISHED"}
    yield 0.4
    shot("poor_selected_uv")
    bpy.ops.object.mode_set(mode="OBJECT")
    mesh = ob.data
    chosen = compat.uv_selected_faces(mesh, mesh.uv_layers.active.name)
    assert np.flatnonzero(chosen).tolist() == list(range(16, 32))
    assert len(shapes.selected(ob, "face")) == 32, "the mesh's selection stays"


def test_a_run_from_the_menu_writes_a_map_and_is_one_undo_step():
    for mode in ("OBJECT", "EDIT"):
        reset()
        ob = shapes.grid(40, uv=True)
        name = ob.name
        shapes.set_uv(ob, np.zeros((len(ob.data.loops), 2)))
        shapes.enter(mode)
        bpy.ops.ed.undo_push(message="Before")
        yield 0.2
        before = shapes.uv_of(ob).tobytes()
        yield from ended()
        after = shapes.uv_of(ob).tobytes()
        assert after != before
        undo()
        yield 0.2
        assert bpy.context.object.mode == mode
        assert shapes.uv_of(bpy.data.objects[name]).tobytes() == before
        with bpy.context.temp_override(**area_of("VIEW_3D")):
            bpy.ops.ed.redo()
        yield 0.2
        assert shapes.uv_of(bpy.data.objects[name]).tobytes() == after
        bpy.ops.object.mode_set(mode="OBJECT")
        assert shapes.exact_flips(bpy.data.objects[name]) == 0


def test_keys_do_not_reach_the_mesh_while_solving():
    yield from show("Layout")
    ob = shapes.slow()
    assert invoke() == {"RUNNING_MODAL"}
    yield 0.3
    assert running()
    window = bpy.context.window_manager.windows[0]
    x, y = pointer("VIEW_3D")
    yield 0.2
    for key in ("X", "TAB"):
        window.event_simulate(type=key, value="PRESS", x=x, y=y)
        window.event_simulate(type=key, value="RELEASE", x=x, y=y)
    yield 0.5
    assert bpy.context.mode == "OBJECT" and ob.name in bpy.data.objects
    press("ESC")
    yield from wait_for_end(10.0)


def pinned_monkey(levels, move):
    """Suzanne in the UV editing workspace, unwrapped; six inner vertices of her face are pinned and moved."""
    ob = shapes.monkey(levels)
    assert bpy.ops.uv.flipfree_unwrap() == {"FINISHED"}
    mesh = ob.data
    uv = shapes.uv_of(ob)
    corner = np.array([loop.vertex_index for loop in mesh.loops])
    on_seam = {v for e in mesh.edges if e.use_seam for v in e.vertices}
    ends = np.bincount([loop.edge_index for loop in mesh.loops], minlength=len(mesh.edges))
    on_seam |= {v for e in mesh.edges if ends[e.index] < 2 for v in e.vertices}
    pairs = np.array([list(e.vertices) for e in mesh.edges])
    part = labels.connected_components(len(mesh.vertices), pairs[:, 0], pairs[:, 1])
    head = np.argmax(np.bincount(part))  # eyes are parts of their own
    inner = [v for v in range(len(mesh.vertices)) if v not in on_seam and part[v] == head]
    face = [v for v in inner if mesh.vertices[v].co.y < -0.2 and mesh.vertices[v].co.x > 0.05]
    random = np.random.default_rng(3)
    pins = random.choice(face, 6, replace=False)
    for vertex in pins:
        angle = random.uniform(0, 2 * np.pi)
        uv[corner == vertex] += np.float32([move * np.cos(angle), move * np.sin(angle)])
    shapes.set_uv(ob, uv)
    shapes.set_pins(ob, np.isin(corner, pins))
    return ob, {v: uv[corner == v][0].tobytes() for v in pins.tolist()}


def test_match_pins_from_the_menu_meets_them_and_is_one_undo_step():
    yield from show("UV Editing")
    ob, targets = pinned_monkey(2, 0.05)
    name = ob.name
    shapes.enter("EDIT")
    bpy.ops.ed.undo_push(message="Before")
    yield from picture("match_before")
    before = shapes.uv_of(ob).tobytes()
    yield from ended("match")
    frame_all()
    yield 0.5
    yield from picture_of_options("match_after")
    bpy.ops.object.mode_set(mode="OBJECT")
    ob = bpy.data.objects[name]
    after = shapes.uv_of(ob)
    corner = shapes.corners(ob)
    for vertex, target in targets.items():
        assert {value.tobytes() for value in after[corner == vertex]} == {target}
    assert shapes.exact_flips(ob) == 0
    bpy.ops.object.mode_set(mode="EDIT")
    while shapes.uv_of(bpy.context.object).tobytes() != before:
        assert undo() == {"FINISHED"}
    yield 0.2
    assert shapes.uv_of(bpy.data.objects[name]).tobytes() == before


def test_contradictory_pins_are_selected_on_demand():
    yield from show("UV Editing")
    ob, targets = pinned_monkey(2, 0.05)
    uv = shapes.uv_of(ob)
    corner = shapes.corners(ob)
    first, second = sorted(targets)[:2]
    uv[np.isin(corner, [first, second])] = 0.5
    shapes.set_uv(ob, uv)
    shapes.enter("EDIT")
    # Scripts get errors as exceptions; the window shows them at the bottom.
    try:
        invoke("match")
        yield from wait_for_end()
    except RuntimeError as error:
        assert "contradict" in str(error)
    yield 0.3
    assert all(bpy.context.object.data.count_selected_items()), "the selection stays"
    with bpy.context.temp_override(**area_of("VIEW_3D")):
        assert bpy.ops.uv.flipfree_select_failed("INVOKE_DEFAULT") == {"FINISHED"}
    yield 0.3
    shot("match_contradiction")
    bpy.ops.object.mode_set(mode="OBJECT")
    assert shapes.selected(ob, "vertex") == [first, second]


def test_check_selects_flipped_faces_and_improve_lowers_the_distortion():
    yield from show("UV Editing")
    ob = shapes.monkey(1)
    assert bpy.ops.uv.flipfree_unwrap() == {"FINISHED"}
    good = shapes.uv_of(ob)
    # Drawn out to the right, further the further up: stretched, not folded.
    drawn = good * np.float32([0.7, 0.7]) + np.outer(good[:, 1] ** 2, np.float32([0.3, 0.0]))
    folded = drawn.copy()
    mesh = ob.data
    corner = np.array([loop.vertex_index for loop in mesh.loops])
    corners_of = [np.flatnonzero(corner == v) for v in range(len(mesh.vertices))]
    once = {v for v, at in enumerate(corners_of) if len(np.unique(drawn[at], axis=0)) == 1}
    # A dozen vertices beyond their neighbours: each folds what lies around it, nothing else.
    for edge in list(mesh.edges)[:: len(mesh.edges) // 12]:
        v, w = edge.vertices
        if v in once and w in once and len(corners_of[v]) == 4:
            here, there = drawn[corners_of[v][0]], drawn[corners_of[w][0]]
            folded[corners_of[v]] = here + 1.7 * (there - here)
    shapes.set_uv(ob, folded)
    flips = shapes.exact_flips(ob)
    assert flips > 10
    shapes.enter("EDIT")
    yield from timed("check")
    yield from picture("check_flips")
    bpy.ops.object.mode_set(mode="OBJECT")
    assert 0 < len(shapes.selected(ob, "face")) <= 2 * flips
    shapes.set_uv(ob, drawn)
    assert shapes.exact_flips(ob) == 0
    shapes.enter("EDIT")
    yield from picture("improve_before")
    yield from timed("improve", pack=True)
    frame_all()
    yield 0.5
    yield from picture_of_options("improve_after")
    bpy.ops.object.mode_set(mode="OBJECT")
    assert shapes.exact_flips(ob) == 0
    assert shapes.uv_of(ob).tobytes() != drawn.tobytes()


def test_conformal_maps_of_several_parts_are_packed():
    yield from show("UV Editing")
    bpy.ops.mesh.primitive_ico_sphere_add(subdivisions=4)
    ball = bpy.context.object
    sheet = shapes.grid(30, bump=0.8, x=3.0)
    ball.select_set(True)
    bpy.ops.object.join()
    ob = bpy.context.object
    if ob.data.uv_layers.active is None:
        ob.data.uv_layers.new(name="UVMap")
    assert ob.name == sheet.name
    assert bpy.ops.uv.flipfree_suggest_cones(quarter_turns=True) == {"FINISHED"}
    shapes.enter("EDIT")
    yield from ended("conformal")
    frame_all()
    yield 0.5
    yield from picture_of_options("conformal")
    bpy.ops.object.mode_set(mode="OBJECT")
    uv = shapes.uv_of(ob)
    assert shapes.exact_flips(ob) == 0
    assert uv.min() > 0.0 and uv.max() < 1.0


def test_a_seamless_map_from_the_menu_is_one_undo_step():
    yield from show("UV Editing")
    ob = ring(1)
    name = ob.name
    shapes.enter("EDIT")
    bpy.ops.ed.undo_push(message="Before")
    before = shapes.uv_of(ob).tobytes()
    yield from timed("seamless", bound=1.5)
    frame_all()
    yield 0.5
    yield from picture_of_options("seamless")
    bpy.ops.object.mode_set(mode="OBJECT")
    ob = bpy.data.objects[name]
    assert shapes.exact_flips(ob) == 0
    assert "seam_turns" in ob.data.attributes and any(g.name == "Cone +1" for g in ob.vertex_groups)
    bpy.ops.object.mode_set(mode="EDIT")
    while shapes.uv_of(bpy.context.object).tobytes() != before:
        assert undo() == {"FINISHED"}
    yield 0.2
    bpy.ops.object.mode_set(mode="OBJECT")
    ob = bpy.data.objects[name]
    assert "seam_turns" not in ob.data.attributes and not ob.vertex_groups


def test_a_refused_run_shows_its_options_where_one_of_them_helps():
    yield from show("UV Editing")
    ob = shapes.cube()
    shapes.set_pins(ob, np.arange(4))
    shapes.enter("EDIT")
    bpy.ops.ed.undo_push(message="Before")
    yield 0.3
    before = shapes.uv_of(ob)
    yield from timed("match")
    yield 0.5
    shot("refused_error")
    assert np.array_equal(shapes.uv_of(ob), before)
    last = bpy.context.window_manager.operators[-1]
    assert last.bl_idname == "UV_OT_flipfree_match"
    pointer("VIEW_3D")  # away from the popup
    yield 0.5
    yield from picture_of_options("refused_options")
    # What changing an option in the panel does: the step is undone, and done again with it.
    undo()
    with bpy.context.temp_override(**area_of("VIEW_3D")):
        assert bpy.ops.uv.flipfree_match(cut_open=True) == {"FINISHED"}
    yield 0.4
    bpy.ops.object.mode_set(mode="OBJECT")
    assert shapes.exact_flips(bpy.context.object) == 0
