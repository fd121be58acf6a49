# SPDX-License-Identifier: GPL-3.0-or-later
"""What the add-on draws over models and UVs."""

import bpy
import shapes
from stage import (
    area_of,
    frame_view,
    invoke,
    modal_from_the_start,
    part,
    ring,
    shot,
    show,
    wait_for_end,
)

drawing = part("fields.drawing")


def show_field():
    with bpy.context.temp_override(**area_of("VIEW_3D")):
        assert bpy.ops.view3d.flipfree_show_field("INVOKE_DEFAULT") == {"FINISHED"}


def drawn():
    """Names of the objects over which something was drawn at the last redraw."""
    bpy.ops.wm.redraw_timer(type="DRAW_WIN_SWAP", iterations=1)
    return sorted(key[0] for key, batches in drawing._state["batches"].items() if batches)


def test_the_field_is_drawn_over_the_model_until_it_is_switched_off():
    show("Layout")
    yield 0.5
    ob = ring(1)
    with modal_from_the_start():
        assert invoke("field_aligned", field_from="flow") == {"RUNNING_MODAL"}
        yield 0.5
        yield from wait_for_end()
    frame_view()
    yield 0.4
    shot("field_off")
    show_field()
    yield 0.4
    shot("field_on")
    assert drawing.is_on() and drawn() == [ob.name]
    bpy.ops.object.mode_set(mode="EDIT")
    yield 0.3
    assert drawn() == [ob.name]
    shot("field_edit")
    bpy.ops.mesh.select_all(action="SELECT")
    bpy.ops.mesh.subdivide()
    yield 0.3
    assert drawn() == [ob.name]
    bpy.ops.object.mode_set(mode="OBJECT")
    yield 0.3
    assert drawn() == [ob.name]
    other = shapes.cube("Other")
    shapes.activate(other)
    yield 0.3
    assert drawn() == []
    shapes.activate(ob)
    bpy.data.objects.remove(other)
    bpy.ops.ed.undo_push(message="Before")
    yield 0.3
    assert drawn() == [ob.name]
    bpy.data.objects.remove(ob)
    yield 0.3
    assert drawn() == []
    show_field()
    yield 0.2
    assert not drawing.is_on() and drawn() == []


def test_cones_of_a_figure_are_drawn():
    show("Layout")
    yield 0.5
    ob = shapes.monkey(1)
    assert bpy.ops.uv.flipfree_field_aligned() == {"FINISHED"}
    frame_view()
    show_field()
    yield 0.6
    shot("field_monkey")
    assert drawn() == [ob.name]
    drawing.switch(False)
