# SPDX-License-Identifier: GPL-3.0-or-later
"""Menus and sidebar."""

import bpy
import numpy as np
import shapes
from stage import (
    area_of,
    ended,
    frame_all,
    part,
    picture,
    picture_of_options,
    pointer,
    press,
    reset,
    ring,
    shot,
    show,
    timed,
    wait_for_end,
)


def pressed(*keys):
    for key in keys:
        press(key)
        yield 0.4


def test_the_menus_draw_the_submenu():
    yield from show("UV Editing")
    shapes.monkey(2)
    shapes.enter("EDIT")
    yield from ended()
    frame_all()
    yield 0.4
    yield from picture_of_options("result")
    pointer("VIEW_3D", 1 / 3, 2 / 3)
    yield 0.2
    with bpy.context.temp_override(**area_of("VIEW_3D")):
        bpy.ops.wm.call_menu(name="VIEW3D_MT_uv_map")
    yield 0.3
    yield from pressed("UP_ARROW", "RIGHT_ARROW")  # the last entry is ours; it opens
    shot("menu")
    yield from pressed("ESC", "ESC")
    bpy.ops.object.mode_set(mode="OBJECT")
    for kind in ("VIEW_3D", "IMAGE_EDITOR"):
        pointer(kind, 1 / 3, 2 / 3)
        yield 0.2
        with bpy.context.temp_override(**area_of(kind)):
            bpy.ops.wm.call_menu(name="VIEW3D_MT_flipfree")
        yield 0.4
        shot(f"menu_object_{kind.lower()}")
        yield from pressed("ESC")
    assert [keymap.name for keymap, _ in part("ui.menus")._items] == list(part("ui.menus").KEYMAPS)
    with bpy.context.temp_override(**area_of("VIEW_3D")):
        bpy.ops.wm.call_menu_pie(name="VIEW3D_MT_flipfree_pie")
    yield 0.6
    shot("pie")
    yield from pressed("ESC")


def open_sidebar(kind, category="Flipfree"):
    place = area_of(kind)
    place["area"].spaces.active.show_region_ui = True
    region = next(r for r in place["area"].regions if r.type == "UI")
    region.active_panel_category = category
    return region


def test_the_sidebars_of_both_editors_show_the_tab():
    yield from show("UV Editing")
    shapes.monkey(1)
    with bpy.context.temp_override(**area_of("VIEW_3D")):
        bpy.ops.view3d.view_selected()
    for kind in ("VIEW_3D", "IMAGE_EDITOR"):
        area_of(kind)["area"].spaces.active.show_region_ui = True
    yield 0.5
    for kind in ("VIEW_3D", "IMAGE_EDITOR"):
        open_sidebar(kind)
    yield 0.5
    shot("panel_first")
    shapes.enter("EDIT")
    yield from timed()
    yield from picture("panel_unwrapped")
    for kind in ("VIEW_3D", "IMAGE_EDITOR"):
        assert open_sidebar(kind).active_panel_category == "Flipfree"
        area_of(kind)["area"].spaces.active.show_region_ui = False
    yield 0.3


def test_set_texel_density_starts_with_what_get_found_and_the_margin_is_that_of_the_scene():
    yield from show("Layout")
    ob = shapes.grid(6, uv=True)
    assert bpy.ops.uv.flipfree_unwrap() == {"FINISHED"}
    before = shapes.uv_of(ob)
    with bpy.context.temp_override(**area_of("VIEW_3D")):
        assert bpy.ops.uv.flipfree_get_density("INVOKE_DEFAULT", texture_size=512) == {"FINISHED"}
    shapes.set_uv(ob, before * 0.5)
    yield from ended("set_density")
    assert np.allclose(np.ptp(shapes.uv_of(ob), axis=0), np.ptp(before, axis=0), rtol=1e-3)
    bpy.context.scene.flipfree_margin_pixels = 100.0
    try:
        yield from ended("unwrap")
        assert shapes.uv_of(ob).min() > 0.04
    finally:
        bpy.context.scene.flipfree_texture = "1024"


def ready():
    """Selected in Edit Mode: a ring with a map."""
    ob = ring(0)
    assert bpy.ops.uv.flipfree_unwrap() == {"FINISHED"}
    shapes.enter("EDIT")
    return ob


# What does not apply to that: it is refused, with a reason.
REFUSED = {
    "uv.flipfree_cut_stretched": "no island is stretched",
    "uv.flipfree_embed": "only disks fit into a polygon",
    "uv.flipfree_match": "no UV is pinned",
    "uv.flipfree_quads": "Works in Object Mode",
    "uv.flipfree_transfer": "Works in Object Mode",
    "uv.flipfree_select_failed": "did not fail",
    "uv.flipfree_select_mends": "separated nothing",
    "uv.flipfree_hide_all": "Nothing is shown",
    "uv.flipfree_remove_checker": "No object shows a checker",
    "mesh.flipfree_mark_cone": "",
}


def test_every_operator_runs_from_both_editors_or_says_why_not():
    yield from show("UV Editing")
    for tool in part("ui.tools").all_tools():
        for kind in ("VIEW_3D", "IMAGE_EDITOR"):
            reset()
            part("errors").remember([])
            part("mends").forget()
            part("views.controls").switch_off()
            ready()
            space, name = tool.operator.split(".")
            operator = getattr(getattr(bpy.ops, space), name)
            try:
                with bpy.context.temp_override(**area_of(kind)):
                    result = operator("INVOKE_DEFAULT", True)
                assert result <= {"FINISHED", "RUNNING_MODAL"}, (tool.operator, result)
            except RuntimeError as error:
                assert REFUSED.get(tool.operator, "-") in str(error), (tool.operator, str(error))
            yield from wait_for_end()
    part("views.controls").switch_off()
    if bpy.ops.uv.flipfree_remove_checker.poll():
        bpy.ops.uv.flipfree_remove_checker()
    yield 0.2
