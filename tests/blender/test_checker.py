# SPDX-License-Identifier: GPL-3.0-or-later
"""The checker: what is shown, and that nothing of it stays."""

import bpy
import numpy as np
import pytest
import shapes
from test_aspect import with_image

PATTERNS = ("grid", "brick", "symmetric")
KINDS = ("materials", "images", "node_groups", "textures")


@pytest.fixture(autouse=True)
def no_leftovers():
    for kind in KINDS:
        collection = getattr(bpy.data, kind)
        for block in list(collection):
            if block.users == 0 or block.name.startswith("Flipfree"):
                collection.remove(block)
    yield


def state(ob):
    """All that concerns an object's materials and modifiers, and what the file has."""
    indices = np.zeros(len(ob.data.polygons), np.int32)
    ob.data.polygons.foreach_get("material_index", indices)
    return (
        [(slot.link, slot.material and slot.material.name) for slot in ob.material_slots],
        [m and m.name for m in ob.data.materials],
        indices.tolist(),
        sorted(a.name for a in ob.data.attributes),
        [(m.name, m.type) for m in ob.modifiers],
        {kind: sorted(b.name for b in getattr(bpy.data, kind)) for kind in KINDS},
    )


def plain(ob):
    pass


def with_two_materials(ob):
    for name in ("Red", "Green"):
        ob.data.materials.append(bpy.data.materials.new(name))
    ob.data.polygons[2].material_index = 1


def with_a_slot_of_the_object(ob):
    with_two_materials(ob)
    ob.material_slots[1].link = "OBJECT"
    ob.material_slots[1].material = bpy.data.materials.new("Own")


def with_an_empty_slot(ob):
    ob.data.materials.append(None)


def with_modifiers(ob):
    ob.modifiers.new("Subdivision", "SUBSURF")


def shown(ob):
    """The one material that all evaluated faces have."""
    evaluated = ob.evaluated_get(bpy.context.evaluated_depsgraph_get())
    mesh = evaluated.to_mesh()
    names = {mesh.materials[p.material_index].name for p in mesh.polygons}
    evaluated.to_mesh_clear()
    assert len(names) == 1
    return names.pop()


@pytest.mark.parametrize("pattern", PATTERNS)
@pytest.mark.parametrize(
    "prepare",
    [plain, with_two_materials, with_a_slot_of_the_object, with_an_empty_slot, with_modifiers],
)
def test_materials_are_exactly_as_before(prepare, pattern):
    ob = shapes.cube()
    prepare(ob)
    before = state(ob)
    assert bpy.ops.uv.flipfree_checker(pattern=pattern) == {"FINISHED"}
    assert shown(ob) == f"Flipfree Checker {pattern} UVMap"
    assert state(ob)[:4] == before[:4], "not even while it is shown"
    assert bpy.ops.uv.flipfree_remove_checker() == {"FINISHED"}
    assert state(ob) == before


def test_another_pattern_replaces_the_first():
    ob = shapes.cube()
    before = state(ob)
    for pattern in PATTERNS:
        assert bpy.ops.uv.flipfree_checker(pattern=pattern) == {"FINISHED"}
        assert len(ob.modifiers) == 1 and shown(ob) == f"Flipfree Checker {pattern} UVMap"
        assert len([i for i in bpy.data.images if i.name.startswith("Flipfree")]) == 1
    assert bpy.ops.uv.flipfree_remove_checker() == {"FINISHED"}
    assert state(ob) == before


def test_it_shows_the_active_map_of_each_object():
    first, second = shapes.cube("First"), shapes.cube("Second")
    second.data.uv_layers.active = second.data.uv_layers.new(name="Other")
    first.select_set(True)
    assert bpy.ops.uv.flipfree_checker(pattern="brick") == {"FINISHED"}
    assert shown(first).endswith("brick UVMap") and shown(second).endswith("brick Other")
    assert bpy.ops.uv.flipfree_remove_checker() == {"FINISHED"}
    assert not first.modifiers and not second.modifiers


def test_objects_that_share_a_mesh_are_shown_each_for_itself():
    first = shapes.cube("First")
    second = bpy.data.objects.new("Second", first.data)
    bpy.context.scene.collection.objects.link(second)
    assert bpy.ops.uv.flipfree_checker() == {"FINISHED"}
    assert len(first.modifiers) == 1 and not second.modifiers


def test_in_edit_mode_too():
    ob = shapes.cube()
    bpy.ops.object.mode_set(mode="EDIT")
    assert bpy.ops.uv.flipfree_checker() == {"FINISHED"}
    assert ob.modifiers[0].show_in_editmode
    assert bpy.ops.uv.flipfree_remove_checker() == {"FINISHED"}
    assert not ob.modifiers


def test_without_checker_there_is_nothing_to_remove():
    shapes.cube()
    with pytest.raises(RuntimeError, match="No object shows a checker"):
        bpy.ops.uv.flipfree_remove_checker()


def test_the_symmetric_pattern_is_the_same_after_a_quarter_turn(part):
    pixels = part("checker.patterns").pixels("symmetric")
    assert np.array_equal(np.rot90(pixels), pixels)
    assert not np.array_equal(
        np.rot90(part("checker.patterns").pixels("brick")), part("checker.patterns").pixels("brick")
    )


def test_maps_are_computed_on_the_mesh_below_the_checker():
    ob = shapes.grid(6, uv=True)
    assert bpy.ops.uv.flipfree_checker() == {"FINISHED"}
    assert bpy.ops.uv.flipfree_unwrap() == {"FINISHED"}
    assert shapes.exact_flips(ob) == 0


@pytest.mark.parametrize("pattern", PATTERNS)
def test_squares_are_squares_on_the_texture_that_the_object_has(part, pattern):
    ob = with_image(shapes.cube(), 2048, 1024)
    assert bpy.ops.uv.flipfree_checker(pattern=pattern) == {"FINISHED"}
    assert shown(ob) == f"Flipfree Checker {pattern} 1024x512 UVMap"
    (image,) = [i for i in bpy.data.images if i.name.startswith("Flipfree")]
    assert tuple(image.size) == (1024, 512)
    assert bpy.ops.uv.flipfree_remove_checker() == {"FINISHED"}
    assert shown(ob) == "Material"
    # The same pixels on fewer rows: nothing is squeezed.
    pixels = part("checker.patterns").pixels
    assert np.array_equal(pixels("symmetric", 2.0), pixels("symmetric")[:512])
    assert np.array_equal(pixels("brick", 0.5), pixels("brick")[:, :512])
