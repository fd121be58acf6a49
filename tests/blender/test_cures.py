# SPDX-License-Identifier: GPL-3.0-or-later
"""What our messages tell the user to do, done as they say it: the run then succeeds.

Each cure starts from what a user has after the error: everything selected, as before the run, or what Select Where It Failed
selected. A text that names neither works from both.
"""

import bpy
import numpy as np
import pytest
import shapes

mesh = bpy.ops.mesh


def not_a_number():
    ob = shapes.grid(3, uv=True)
    ob.data.vertices[5].co.x = float("nan")
    return ob


def twice():
    return shapes.add(
        "Repeat", [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0)], [(0, 1, 1, 2), (0, 2, 3)], uv=True
    )


def test_a_vertex_that_is_nowhere_is_deleted():
    ob = not_a_number()
    bpy.ops.object.mode_set(mode="EDIT")
    mesh.select_mode(type="VERT")
    mesh.select_all(action="SELECT")
    with pytest.raises(RuntimeError, match="Delete"):
        bpy.ops.uv.flipfree_unwrap()
    assert bpy.ops.uv.flipfree_select_failed() == {"FINISHED"}
    mesh.delete(type="VERT")
    bpy.ops.object.mode_set(mode="OBJECT")
    assert bpy.ops.uv.flipfree_unwrap() == {"FINISHED"}
    assert shapes.exact_flips(ob) == 0


@pytest.mark.parametrize("operator", ["unwrap", "conformal"])
def test_a_face_that_uses_a_vertex_twice_is_mapped_as_far_as_it_is_one(operator):
    ob = twice()
    assert getattr(bpy.ops.uv, f"flipfree_{operator}")() == {"FINISHED"}
    assert np.isfinite(shapes.uv_of(ob)).all()


@pytest.mark.parametrize("cure", ["repair", "unwrap"])
def test_a_map_with_flips_is_repaired_or_unwrapped_first(cure):
    ob = shapes.grid(3, uv=True)
    uv = shapes.plane(ob)
    shapes.set_uv(ob, uv * (-1, 1))
    with pytest.raises(RuntimeError, match="Use Repair Flips, or unwrap it first"):
        bpy.ops.uv.flipfree_pack()
    assert getattr(bpy.ops.uv, f"flipfree_{cure}")() == {"FINISHED"}
    assert bpy.ops.uv.flipfree_pack() == {"FINISHED"}


def test_pins_that_contradict_each_other_are_unpinned_where_it_failed():
    ob = shapes.grid(4, uv=True)
    corner = shapes.corners(ob)
    uv = shapes.plane(ob)
    uv[np.isin(corner, [6, 18])] = 0.0
    shapes.set_uv(ob, uv)
    shapes.set_pins(ob, np.isin(corner, [6, 18]))
    with pytest.raises(RuntimeError, match="contradict(.|\n)*unpin"):
        bpy.ops.uv.flipfree_match()
    assert shapes.shown("vertex") == [6, 18]
    shapes.set_pins(ob, corner == 6)  # Alt P on the other one
    assert bpy.ops.uv.flipfree_match() == {"FINISHED"}


def test_cones_that_do_not_sum_up_are_suggested():
    ob = shapes.primitive("ico_sphere", subdivisions=2)
    ob.vertex_groups.new(name="Cone +1").add([0, 1], 1.0, "REPLACE")
    with pytest.raises(RuntimeError, match="Suggest Cones places them, Mark Cone"):
        bpy.ops.uv.flipfree_conformal()
    assert bpy.ops.uv.flipfree_suggest_cones(quarter_turns=True) == {"FINISHED"}
    assert bpy.ops.uv.flipfree_conformal() == {"FINISHED"}


def sphere():
    return shapes.primitive("uv_sphere")


@pytest.mark.parametrize("cure", ["quarter turns", "clear", "suggested"])
@pytest.mark.parametrize("mode", ["OBJECT", "EDIT"])
def test_cones_that_were_suggested_for_conformal_maps_are_no_dead_end_for_seamless_ones(mode, cure):
    ob = sphere()
    shapes.enter(mode)
    assert bpy.ops.uv.flipfree_suggest_cones() == {"FINISHED"}
    with pytest.raises(RuntimeError, match="multiples of 90.*Quarter Turns.*Clear Cones"):
        bpy.ops.uv.flipfree_seamless()
    options = {}
    if cure == "quarter turns":
        assert bpy.ops.uv.flipfree_suggest_cones(quarter_turns=True) == {"FINISHED"}
    elif cure == "clear":
        assert bpy.ops.uv.flipfree_clear_cones() == {"FINISHED"}
    else:
        options["cones_from"] = "suggested"
    assert bpy.ops.uv.flipfree_seamless(**options) == {"FINISHED"}
    bpy.ops.object.mode_set(mode="OBJECT")
    assert shapes.exact_flips(ob) == 0


@pytest.mark.parametrize("operator", ["seamless", "field_aligned"])
def test_flat_text_gets_a_seamless_map_with_a_free_boundary(operator):
    bpy.ops.object.text_add()
    bpy.context.object.data.body = "Text"
    bpy.ops.object.convert(target="MESH")
    run = getattr(bpy.ops.uv, f"flipfree_{operator}")
    try:
        run()
    except RuntimeError as error:
        assert "Choose 'Boundary: Free'" in str(error)
    assert run(boundary="free") == {"FINISHED"}
    assert shapes.exact_flips(bpy.context.object) == 0


@pytest.mark.parametrize("module", ["operators.seamless", "fields.field_aligned"])
@pytest.mark.parametrize("boundary", ["aligned", "free"])
def test_boundaries_that_need_not_be_straight_are_named_where_they_are(part, module, boundary):
    for ob, has_boundary in ((shapes.grid(3), True), (shapes.cube(), False)):
        snapshot = part("meshes.mesh_io").read(ob, only_selected=False)
        task = part(module).make_task(snapshot, boundary=boundary)
        for code in ("certificate failed", "factorization failed"):
            named = "Boundary: Free" in task.cures[code]
            assert named == (has_boundary and boundary == "aligned")


def test_cones_that_no_seamless_map_has_are_marked_anew():
    ob = shapes.cube()
    ob.data.attributes.new("cone_angle", "FLOAT", "POINT").data[2].value = 1.0
    with pytest.raises(RuntimeError, match="Quarter Turns.*Clear Cones.*Cones: Suggested"):
        bpy.ops.uv.flipfree_seamless()
    ob.data.attributes["cone_angle"].data[2].value = 0.0
    assert bpy.ops.uv.flipfree_seamless() == {"FINISHED"}
    ob.vertex_groups["Cone +1"].remove([0])
    with pytest.raises(RuntimeError, match="[+]1 quarter turns(.|\n)*Quarter Turns.*Mark Cone"):
        bpy.ops.uv.flipfree_seamless()
    bpy.ops.object.mode_set(mode="EDIT")
    shapes.select(ob, "vertex", [0])
    assert bpy.ops.mesh.flipfree_mark_cone(quarter_turns=1) == {"FINISHED"}
    mesh.select_all(action="SELECT")
    assert bpy.ops.uv.flipfree_seamless() == {"FINISHED"}
    bpy.ops.object.mode_set(mode="OBJECT")
    assert shapes.exact_flips(ob) == 0
