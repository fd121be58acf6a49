# SPDX-License-Identifier: GPL-3.0-or-later
"""What the add-on draws over models and UVs."""

import bpy
import numpy as np
import shapes
from stage import (
    area_of,
    ended,
    frame_all,
    frame_view,
    part,
    picture,
    ring,
    shot,
    show,
    timed,
    undo,
    until,
    wait_for_end,
)

controls, refresh, state = part("views.controls"), part("views.refresh"), part("views.state")


def show_field():
    with bpy.context.temp_override(**area_of("VIEW_3D")):
        assert bpy.ops.view3d.flipfree_show_field("INVOKE_DEFAULT") == {"FINISHED"}


def drawn():
    """Names of the objects over which something was drawn at the last redraw."""
    bpy.ops.wm.redraw_timer(type="DRAW_WIN_SWAP", iterations=1)
    return sorted(e.name for e in refresh.entries.values() if any((e.batches or {}).values()))


def until_drawn(*names):
    yield from until(lambda: drawn() == sorted(names), lambda: f"{names} expected, {drawn()} drawn")


def legend():
    return [text for _, text in refresh.current_legend().lines]


def test_the_field_is_drawn_over_the_model_until_it_is_switched_off():
    yield from show("Layout")
    ob = ring(1)
    yield from timed("field_aligned", field_from="flow")
    frame_view()
    yield 0.4
    shot("field_off")
    show_field()
    assert state.is_on("field")
    yield from until_drawn(ob.name)
    shot("field_on")
    bpy.ops.object.mode_set(mode="EDIT")
    yield from until_drawn(ob.name)
    shot("field_edit")
    bpy.ops.mesh.select_all(action="SELECT")
    bpy.ops.mesh.subdivide()
    yield from until_drawn(ob.name)
    bpy.ops.object.mode_set(mode="OBJECT")
    yield from until_drawn(ob.name)
    other = shapes.cube("Other")
    shapes.activate(other)
    yield from until_drawn()
    shapes.activate(ob)
    bpy.data.objects.remove(other)
    bpy.ops.ed.undo_push(message="Before")
    yield from until_drawn(ob.name)
    bpy.data.objects.remove(ob)
    yield from until_drawn()
    show_field()
    assert not state.anything()
    yield from until_drawn()


def test_cones_of_a_figure_are_drawn():
    yield from show("Layout")
    ob = shapes.monkey(1)
    assert bpy.ops.uv.flipfree_field_aligned() == {"FINISHED"}
    frame_view()
    show_field()
    yield from until_drawn(ob.name)
    shot("field_monkey")
    controls.switch_off()


def is_shown(scale):
    bar = refresh.current_legend().bar
    return bar is not None and bar.scale is scale


def test_faces_are_coloured_in_both_editors_and_the_figures_follow_the_map():
    yield from show("UV Editing")
    ob = shapes.stretched_monkey()
    yield 0.3
    frame_all()
    for what, *_ in state.FACES:
        bpy.context.window_manager.flipfree_faces = what
        if what == "faults":
            yield from until(lambda: "0 faces flipped" in legend(), legend)
            yield from until_drawn()
        else:
            scale = part("views.faces").SCALES[what]
            yield from until(lambda scale=scale: is_shown(scale), legend)
            yield from until_drawn(ob.name)
        yield 0.3
        shot(f"show_{what}")
    bpy.context.window_manager.flipfree_faces = "distortion"
    shapes.enter("EDIT")
    yield from until_drawn(ob.name)
    yield 1.0
    shot("show_edit")
    before, reads = legend(), refresh.reads()
    yield 2.0
    assert refresh.reads() == reads, "a mesh at rest is not read again"
    yield from ended("improve")
    yield from until(lambda: refresh.reads() > reads and legend() != before, legend)
    assert bpy.ops.uv.flipfree_hide_all() == {"FINISHED"}
    assert not state.anything() and not refresh.entries
    yield from until_drawn()


def test_wrong_faces_are_found_while_one_works():
    yield from show("UV Editing")
    ob = shapes.two_sheets()
    uv = shapes.uv_of(ob)
    corner = shapes.corners(ob)
    uv[corner == 12] += [0.25, 0.1]  # folds what lies around the middle of the large one
    uv[corner >= 25] -= [0.5, 0.0]  # the small one onto the large one
    shapes.set_uv(ob, uv)
    ob.data.update()
    frame_all()
    bpy.context.window_manager.flipfree_faces = "faults"
    yield from until(lambda: any("pair of islands" in text for text in legend()), legend)
    yield 0.3
    shot("show_wrong")
    assert any("flipped" in text and not text.startswith("0") for text in legend()), legend()
    shapes.set_uv(ob, shapes.uv_of(ob) * [-1, 1])
    ob.data.update()
    yield from until(
        lambda: any(text.startswith(("28 ", "29 ", "30 ")) for text in legend()), legend
    )
    controls.switch_off()


def test_cones_seams_and_turns_are_shown_in_both_editors():
    yield from show("UV Editing")
    ob = ring(1)
    assert bpy.ops.uv.flipfree_seamless(bound=1.5) == {"FINISHED"}
    frame_all()
    for what in ("cones", "seams"):
        setattr(bpy.context.window_manager, f"flipfree_{what}", True)
    yield from until_drawn(ob.name)
    yield from until(lambda: any("turn" in text for text in legend()), legend)
    shot("show_seams")
    assert "The cones fit the surface" in legend()
    bpy.ops.object.mode_set(mode="EDIT")
    bpy.ops.mesh.select_all(action="DESELECT")
    bpy.ops.object.mode_set(mode="OBJECT")
    ob.data.vertices[0].select = True
    bpy.ops.object.mode_set(mode="EDIT")
    assert bpy.ops.mesh.flipfree_mark_cone(quarter_turns=1) == {"FINISHED"}
    yield from until(lambda: any("still lack" in text for text in legend()), legend)
    controls.switch_off()


def test_cleared_cones_vanish_from_both_editors_and_undo_brings_them_back():
    yield from show("UV Editing")
    name = ring(1).name
    assert bpy.ops.uv.flipfree_seamless(bound=1.5) == {"FINISHED"}
    bpy.ops.ed.undo_push(message="Before")
    frame_all()
    bpy.context.window_manager.flipfree_cones = True
    yield from until_drawn(name)
    (counted,) = (text for text in legend() if text.startswith(f"{name}: "))
    assert counted.endswith(" cones") and counted != f"{name}: 0 cones"
    shot("cones_marked")
    with bpy.context.temp_override(**area_of("IMAGE_EDITOR")):
        assert bpy.ops.uv.flipfree_clear_cones("INVOKE_DEFAULT", True) == {"FINISHED"}
    yield from until(lambda: f"{name}: 0 cones" in legend(), legend)
    shot("cones_cleared")
    assert undo() == {"FINISHED"}
    yield from until(lambda: counted in legend(), legend)
    controls.switch_off()


def test_pins_that_contradict_each_other_are_red():
    yield from show("UV Editing")
    ob = shapes.grid(8, uv=True)
    assert bpy.ops.uv.flipfree_unwrap() == {"FINISHED"}
    corner = shapes.corners(ob)
    uv = shapes.uv_of(ob)
    uv[corner == 40] = uv[corner == 30][0]
    shapes.set_uv(ob, uv)
    shapes.set_pins(ob, np.isin(corner, [10, 30, 40, 60]))
    ob.data.update()
    frame_all()
    bpy.context.window_manager.flipfree_pins = True
    yield from until(lambda: len(legend()) > 1, legend)
    yield 0.5
    shot("show_pins")
    assert legend() == ["4 pins", "2 pins cannot be met together"]
    controls.switch_off()


def test_the_checker_is_seen_in_solid_shading_and_leaves_it_as_it_was():
    yield from show("UV Editing")
    ob = shapes.monkey(1)
    assert bpy.ops.uv.flipfree_unwrap() == {"FINISHED"}
    frame_all()
    shading = area_of("VIEW_3D")["area"].spaces.active.shading
    before = shading.color_type
    for pattern in ("grid", "brick", "symmetric"):
        assert bpy.ops.uv.flipfree_checker(pattern=pattern) == {"FINISHED"}
        assert shading.color_type == "TEXTURE"
        yield 1.0
        shot(f"checker_{pattern}")
    assert bpy.ops.uv.flipfree_remove_checker() == {"FINISHED"}
    assert shading.color_type == before and not ob.modifiers
    assert bpy.ops.uv.flipfree_checker() == {"FINISHED"}
    bpy.data.objects.remove(ob)
    bpy.context.view_layer.update()
    yield 0.3
    assert bpy.ops.uv.flipfree_remove_checker() == {"FINISHED"}
    assert shading.color_type == before
    assert not [i for i in bpy.data.images if i.name.startswith("Flipfree")]
    yield 0.3


def test_faces_are_selected_by_what_is_wrong_with_them_in_a_uv_editor():
    yield from show("UV Editing")
    ob = shapes.stretched_monkey()
    shapes.enter("EDIT")
    bpy.context.tool_settings.use_uv_select_sync = True
    with bpy.context.temp_override(**area_of("IMAGE_EDITOR")):
        bpy.ops.uv.flipfree_select_faces("INVOKE_DEFAULT", what="worst")
    yield from wait_for_end()  # at once, or on a busy machine later
    yield from picture("select_worst")
    bpy.ops.object.mode_set(mode="OBJECT")
    assert 0 < len(shapes.selected(ob, "face")) < len(ob.data.polygons) // 2
