# SPDX-License-Identifier: GPL-3.0-or-later
"""Operators outside Edit Mode: they take all faces but hidden ones; disabled ones say why."""

import bpy
import numpy as np
import pytest
import shapes


def hide(ob, faces):
    mask = np.zeros(len(ob.data.polygons), bool)
    mask[faces] = True
    ob.data.polygons.foreach_set("hide", mask)
    return mask


def loops_of(ob, faces):
    return np.repeat(faces, [len(p.vertices) for p in ob.data.polygons])


@pytest.mark.parametrize("name", ["unwrap", "improve", "pack", "conformal"])
def test_hidden_faces_keep_their_uvs(name):
    ob = shapes.grid(6, uv=True)
    shapes.set_uv(ob, shapes.plane(ob) * [0.3, 0.7])
    hidden = loops_of(ob, hide(ob, range(12)))
    before = shapes.uv_of(ob)
    assert getattr(bpy.ops.uv, f"flipfree_{name}")() == {"FINISHED"}
    after = shapes.uv_of(ob)
    assert np.array_equal(after[hidden], before[hidden])
    assert not np.array_equal(after[~hidden], before[~hidden])


def test_hidden_faces_are_not_checked():
    ob = shapes.two_sheets()
    uv = shapes.uv_of(ob)
    uv[:64] *= [0.0, 1.0]  # the large sheet, a line
    shapes.set_uv(ob, uv)
    hide(ob, range(16))
    assert bpy.ops.uv.flipfree_check() == {"FINISHED"}
    assert len(shapes.selected(ob, "face")) == 32, "nothing wrong: the selection stays"
    hide(ob, [])
    assert bpy.ops.uv.flipfree_check() == {"FINISHED"}
    assert shapes.selected(ob, "face") == list(range(16))


def test_a_mesh_that_is_hidden_throughout_is_refused_with_the_cure():
    ob = shapes.grid(3, uv=True)
    hide(ob, range(9))
    shapes.refused(ob, "all faces are hidden. Alt H", bpy.ops.uv.flipfree_unwrap)


def test_an_object_that_is_hidden_throughout_is_passed_over_beside_others():
    hidden, other = shapes.grid(3, "Hidden", uv=True), shapes.grid(3, "Other", uv=True, x=3.0)
    hide(hidden, range(9))
    hidden.select_set(True)
    before = shapes.everything(hidden), shapes.everything(other)
    assert bpy.ops.uv.flipfree_unwrap() == {"FINISHED"}
    assert shapes.everything(hidden) == before[0]
    assert shapes.everything(other) != before[1]


def refusal(name):
    space, operator = name.split(".")
    with pytest.raises(RuntimeError) as caught:
        getattr(getattr(bpy.ops, space), operator)()
    return str(caught.value)


def test_disabled_operators_say_why(part):
    tools = [tool.operator for tool in part("ui.tools").all_tools()]
    always = {"view3d.flipfree_show_field", "uv.flipfree_show"}
    for name in set(tools) - always:
        text = refusal(name)
        assert "poll() failed, context is incorrect" not in text, name
        assert len(text.split("poll()")[1].strip()) > 10, name


def test_an_operator_that_wants_a_uv_map_says_so():
    shapes.grid(3)
    assert "has no UV map yet: unwrap it first" in refusal("uv.flipfree_check")
