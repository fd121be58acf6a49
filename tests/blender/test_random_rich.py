# SPDX-License-Identifier: GPL-3.0-or-later
"""Rich meshes at random through every operator: nothing that was not asked for is changed by a bit.

A sample here; FLIPFREE_RANDOM_MESHES=1000 runs so many, FLIPFREE_RANDOM_SEED=17 begins there. A failure names its seed.
"""

import os

import bpy
import numpy as np
import pytest
import random_rich
import rich
import shapes

MANY = int(os.environ.get("FLIPFREE_RANDOM_MESHES", "2"))
FIRST = int(os.environ.get("FLIPFREE_RANDOM_SEED", "0"))


def run(objects, name, mode):
    """Whether the operator ended well. In Edit Mode, with what is selected."""
    options, _ = random_rich.OPERATORS[name]
    bpy.ops.object.mode_set(mode=mode)
    try:
        call = getattr(bpy.ops.uv, f"flipfree_{name.partition(',')[0]}")
        return call(**options) == {"FINISHED"}
    except RuntimeError:
        return False
    finally:
        bpy.ops.object.mode_set(mode="OBJECT")


def through_edit_mode():
    """What Blender itself makes of the mesh there is no change of ours."""
    bpy.ops.object.mode_set(mode="EDIT")
    bpy.ops.object.mode_set(mode="OBJECT")


@pytest.mark.parametrize("name", random_rich.OPERATORS)
@pytest.mark.parametrize("seed", range(FIRST, FIRST + MANY))
def test_nothing_that_was_not_asked_for_is_changed(seed, name):
    print(f"seed {seed}, {name}")
    objects = random_rich.scene(seed)
    mode = ("OBJECT", "EDIT")[seed % 2]
    if mode == "EDIT":
        through_edit_mode()
    before = [random_rich.everything(ob) for ob in objects]
    maps = [random_rich.certificates(ob) for ob in objects]
    places = [corner_values(ob) for ob in objects]
    ended = run(objects, name, mode)
    for ob, old, old_maps, old_places in zip(objects, before, maps, places, strict=True):
        new = random_rich.everything(ob)
        allowed = random_rich.OPERATORS[name][1] if ended else set()
        if len(new["polygons"]) == len(old["polygons"]):
            found = random_rich.changed(old, new, allowed | ({"the map"} if ended else set()))
            assert not found, (seed, name, ob.name, found)
        else:
            print(f"refined: {ob.name}")
            kept_where_it_was(old, new, (seed, name, ob.name))
            one_value_on_both_sides(ob, old_places, (seed, name, ob.name))
        assert random_rich.certificates(ob) == old_maps, (seed, name, ob.name)


LAYERS = ("CORNER FLOAT", "CORNER FLOAT_VECTOR", "CORNER FLOAT_COLOR", "CORNER INT", "Other0")


def corner_values(ob):
    """{layer: {vertex: bytes of its corners' values}}"""
    mesh = ob.data
    found = {}
    for name in LAYERS:
        values = rich.values(mesh.attributes[name])
        of = found[name] = {}
        for loop in mesh.loops:
            of.setdefault(loop.vertex_index, set()).add(values[loop.index].tobytes())
    return found


def kept_where_it_was(old, new, where):
    """A mesh with new vertices: what the old ones carry."""
    for name, value in old.items():
        if not (isinstance(value, tuple) and value[0] == "POINT") or "select" in name:
            continue
        assert name in new, (where, name)
        assert new[name][1][: len(value[1])] == value[1], (where, name)
    for name in old:
        if name.startswith("group ") and "Cone" not in name:
            last = max((v for v, _ in old[name]), default=-1)
            assert [w for w in new[name] if w[0] <= last] == old[name], (where, name)
        if name.startswith("shape "):
            assert new[name][: len(old[name])] == old[name], (where, name)
    assert new["materials"] == old["materials"] and new["maps"] == old["maps"], where


def one_value_on_both_sides(ob, before, where):
    """Where the corners of old vertices had one value, new corners between such have one, too."""
    after = corner_values(ob)
    count = len(before[LAYERS[0]])
    for name in LAYERS:
        for vertex, values in before[name].items():
            assert after[name][vertex] <= values, (where, name, vertex)
        if all(len(values) == 1 for values in before[name].values()):
            several = [v for v in after[name] if v >= count and len(after[name][v]) > 1]
            assert not several, (where, name, several)


def test_an_operator_that_spoils_a_layer_is_seen():
    """The judge itself: a last bit of another map, a weight, a hidden face."""
    (ob, *_) = random_rich.scene(3)
    before = random_rich.everything(ob)
    uv = shapes.uv_of(ob, "Other0")
    uv[0, 0] = np.nextafter(uv[0, 0], np.float32(9.0))
    rich.set_values(ob.data.attributes["Other0"], uv)
    assert random_rich.changed(before, random_rich.everything(ob), {"the map"}) == ["Other0"]
    ob.data.polygons[0].hide = not ob.data.polygons[0].hide
    ob.vertex_groups["Weight"].add([0], 0.123, "REPLACE")
    found = random_rich.changed(before, random_rich.everything(ob), {"the map"})
    assert {"Other0", ".hide_poly", "group Weight"} <= set(found)
