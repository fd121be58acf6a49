# SPDX-License-Identifier: GPL-3.0-or-later
"""Conformal Map with Cones, Suggest Cones, Mark Cone, through their operators."""

import math

import bpy
import numpy as np
import pytest
import shapes
from layouts import densities, islands

from judges.gaps import narrowest
from judges.holonomy import vertex_angles


def quad_sphere(levels=3):
    """A cube subdivided to a sphere; its 8 corners keep three neighbours."""
    ob = shapes.primitive("cube", size=2.0)
    modifier = ob.modifiers.new("Subdivision", "SUBSURF")
    modifier.levels = levels
    bpy.ops.object.modifier_apply(modifier=modifier.name)
    return ob


def corners(ob):
    uses = np.bincount([v for e in ob.data.edges for v in e.vertices])
    return np.flatnonzero(uses == 3).tolist()


def uv_angles(ob):
    """Total UV angle at every vertex, from the stored values."""
    corners, uv = shapes.triangles_of(ob)
    return vertex_angles(corners, uv).astype(float)


def test_a_sheet_is_mapped_with_a_free_boundary():
    ob = shapes.grid(10, bump=0.5, uv=True)
    assert bpy.ops.uv.flipfree_conformal() == {"FINISHED"}
    assert shapes.exact_flips(ob) == 0
    inner = uv_angles(ob)[[60, 48, 72]]
    assert inner == pytest.approx(2 * math.pi, abs=1e-3)


def test_cuts_run_along_the_edges_of_polygons_and_split_none():
    ob = shapes.primitive("torus")
    polygons = [tuple(p.vertices) for p in ob.data.polygons]
    assert {len(p) for p in polygons} == {4}
    assert bpy.ops.uv.flipfree_conformal() == {"FINISHED"}
    assert [tuple(p.vertices) for p in ob.data.polygons] == polygons
    assert shapes.exact_flips(ob) == 0


def test_cones_of_groups_get_exactly_their_angles(capfd):
    ob = quad_sphere()
    eight = corners(ob)
    assert len(eight) == 8
    ob.vertex_groups.new(name="Cone +1").add(eight, 1.0, "REPLACE")
    assert bpy.ops.uv.flipfree_conformal() == {"FINISHED"}
    assert "0 flips" in capfd.readouterr().out
    assert shapes.exact_flips(ob) == 0
    angles = uv_angles(ob)
    assert angles[eight] == pytest.approx(1.5 * math.pi, abs=1e-3)
    others = np.delete(angles, eight)
    assert others == pytest.approx(2 * math.pi, abs=2e-3)
    assert any(e.use_seam for e in ob.data.edges)


def test_a_refined_start_gives_another_map_with_the_same_angles():
    maps = {}
    for choice in ("off", "on"):
        ob = shapes.primitive("cylinder", vertices=64, radius=1.0, depth=3.0)
        count = len(ob.data.vertices)
        cones = list(range(0, count, count // 8))[:8]
        ob.vertex_groups.new(name="Cone +1").add(cones, 1.0, "REPLACE")
        assert bpy.ops.uv.flipfree_conformal(refined_start=choice) == {"FINISHED"}
        assert shapes.exact_flips(ob) == 0
        assert uv_angles(ob)[cones] == pytest.approx(1.5 * math.pi, abs=2e-3)
        maps[choice] = sum(p.area for p in ob.data.polygons), shapes.uv_of(ob)
    assert maps["off"][0] == pytest.approx(maps["on"][0], rel=1e-5)  # the surface is the same
    assert maps["off"][1].shape != maps["on"][1].shape or (maps["off"][1] != maps["on"][1]).any()


def test_cones_of_the_attribute_count(part):
    ob = quad_sphere(2)
    values = np.zeros(len(ob.data.vertices), np.float32)
    values[corners(ob)] = 1.5 * math.pi
    ob.data.attributes.new("cone_angle", "FLOAT", "POINT").data.foreach_set("value", values)
    assert bpy.ops.uv.flipfree_conformal() == {"FINISHED"}
    assert uv_angles(ob)[corners(ob)] == pytest.approx(1.5 * math.pi, abs=1e-3)


@pytest.mark.parametrize("boundary", ["straight", "circle"])
def test_boundaries_take_their_shape(boundary):
    ob = shapes.grid(8, bump=0.2, uv=True)
    ob.vertex_groups.new(name="Cone +1").add([0, 8, 72, 80], 1.0, "REPLACE")
    assert bpy.ops.uv.flipfree_conformal(boundary=boundary) == {"FINISHED"}
    assert shapes.exact_flips(ob) == 0
    if boundary == "straight":
        angles = uv_angles(ob)
        assert angles[[0, 8, 72, 80]] == pytest.approx(math.pi / 2, abs=1e-3)
        assert angles[[1, 4, 9, 77]] == pytest.approx(math.pi, abs=1e-3)


def test_mark_cone_fills_groups_and_says_what_is_missing(capfd):
    ob = quad_sphere(1)
    eight = corners(ob)
    bpy.ops.object.mode_set(mode="EDIT")

    def mark(vertices, turns):
        shapes.select(ob, "vertex", vertices)
        assert bpy.ops.mesh.flipfree_mark_cone(quarter_turns=turns) == {"FINISHED"}
        return capfd.readouterr().out

    assert "still lack +2 quarter turns" in mark(eight[:6], 1)
    assert "The cones fit the surface" in mark(eight[6:], 1)
    assert "still lack +1" in mark(eight[:1], 0)
    assert "The cones fit the surface" in mark(eight[1:2], 2)
    bpy.ops.object.mode_set(mode="OBJECT")
    members = {
        g.name: [v.index for v in ob.data.vertices if g.index in [e.group for e in v.groups]]
        for g in ob.vertex_groups
    }
    assert members["Cone +1"] == eight[2:] and members["Cone +2"] == eight[1:2]


@pytest.mark.parametrize("quarter_turns", [False, True])
def test_suggested_cones_can_be_mapped_at_once(quarter_turns):
    ob = shapes.primitive("ico_sphere", subdivisions=3)
    assert bpy.ops.uv.flipfree_suggest_cones(quarter_turns=quarter_turns) == {"FINISHED"}
    assert bpy.ops.uv.flipfree_conformal() == {"FINISHED"}
    assert shapes.exact_flips(ob) == 0


def two_spheres(second_cones=8):
    """Two quad spheres in one mesh, the second three times as large, with cones at the corners."""
    first = quad_sphere()
    second = quad_sphere()
    second.scale, second.location = (3.0, 3.0, 3.0), (8.0, 0.0, 0.0)
    first.select_set(True)
    bpy.context.view_layer.objects.active = second
    bpy.ops.object.transform_apply()
    bpy.context.view_layer.objects.active = first
    bpy.ops.object.join()
    ob = bpy.context.object
    marked = corners(ob)
    assert len(marked) == 16
    ob.vertex_groups.new(name="Cone +1").add(marked[: 8 + second_cones], 1.0, "REPLACE")
    return ob


def half(ob, right):
    """(loops,) bool of the sphere at the left or at the right."""
    return np.array([(p.center.x > 4.0) == right for p in ob.data.polygons]).repeat(
        [p.loop_total for p in ob.data.polygons]
    )


@pytest.mark.parametrize("mode", ["OBJECT", "EDIT"])
def test_separate_parts_are_mapped_and_packed_in_one_call(mode):
    ob = two_spheres()
    shapes.enter(mode)
    assert bpy.ops.uv.flipfree_conformal() == {"FINISHED"}
    bpy.ops.object.mode_set(mode="OBJECT")
    assert shapes.exact_flips(ob) == 0
    angles = uv_angles(ob)
    assert angles[corners(ob)[:16]] == pytest.approx(1.5 * math.pi, abs=1e-3)
    uv = shapes.uv_of(ob)
    assert uv.min() > 0.0 and uv.max() < 1.0
    assert narrowest(islands(ob), 1e-3).distance > 0.0  # nested: their boxes may share area
    # True scale: one is three times as large in space.
    scales = densities(ob)
    assert scales[0] == pytest.approx(scales[1], rel=5e-4)


def test_every_part_is_named_with_its_own_remainder():
    ob = two_spheres(second_cones=5)
    shapes.refused(
        ob, r"the part of face \d+ \(384 faces\): \+3 quarter turns", bpy.ops.uv.flipfree_conformal
    )
    chosen = shapes.shown("face")
    assert len(chosen) == 384 and all(ob.data.polygons[f].center.x > 4.0 for f in chosen)


def test_parts_without_packing_keep_the_layout_of_the_metric():
    ob = two_spheres()
    assert bpy.ops.uv.flipfree_conformal(pack=False) == {"FINISHED"}
    uv = shapes.uv_of(ob)
    assert shapes.exact_flips(ob) == 0
    left, right = uv[half(ob, False)], uv[half(ob, True)]
    apart = (left.min(0) > right.max(0)) | (right.min(0) > left.max(0))
    assert not apart.any()


def test_improve_packs_on_demand_and_leaves_pinned_islands():
    ob = shapes.grid(8, bump=0.6, uv=True)
    right = shapes.seam_in_the_middle(ob)
    uv = shapes.plane(ob)
    uv[right] += np.float32([9.0, 0.0])
    shapes.set_uv(ob, uv)
    assert bpy.ops.uv.flipfree_improve() == {"FINISHED"}
    assert shapes.uv_of(ob)[right, 0].min() > 8.0, "without packing islands stay"
    shapes.set_uv(ob, uv)
    assert bpy.ops.uv.flipfree_improve(pack=True) == {"FINISHED"}
    after = shapes.uv_of(ob)
    assert after.min() > 0.0 and after.max() < 1.0 and shapes.exact_flips(ob) == 0
    shapes.set_uv(ob, uv)
    pin = np.flatnonzero(right)[0]
    shapes.set_pins(ob, [pin])
    assert bpy.ops.uv.flipfree_improve(pack=True) == {"FINISHED"}
    after = shapes.uv_of(ob)
    assert after[pin].tobytes() == uv[pin].tobytes()
    assert after[right, 0].min() > 7.0 and after[~right].max() < 1.0


def test_mark_cone_names_the_parts_that_lack_something(part):
    ob = two_spheres(second_cones=5)
    first = min(v.index for v in ob.data.vertices if v.co.x > 4.0)
    words = part("meshes.cones").balance(ob)
    assert words == f"The cones still lack, in the part of vertex {first}: +3 quarter turns"
    ob.vertex_groups["Cone +1"].add(corners(ob), 1.0, "REPLACE")
    assert part("meshes.cones").balance(ob) == "The cones fit all 2 parts"


@pytest.mark.parametrize("mode", ["OBJECT", "EDIT"])
def test_clear_cones_takes_marks_of_both_kinds_away(mode, capfd, part):
    ob = shapes.cube()
    ob.vertex_groups.new(name="Cone +1").add([0, 1], 1.0, "REPLACE")
    ob.vertex_groups.new(name="Other").add([0, 1], 1.0, "REPLACE")
    ob.data.attributes.new("cone_angle", "FLOAT", "POINT").data[2].value = 1.0
    bpy.ops.object.mode_set(mode=mode)
    left = []
    if mode == "EDIT":
        shapes.select(ob, "vertex", (1, 2, 3))
        left = [0]
    assert bpy.ops.uv.flipfree_clear_cones() == {"FINISHED"}
    assert f"{3 - len(left)} cones cleared" in capfd.readouterr().out
    bpy.ops.object.mode_set(mode="OBJECT")
    assert sorted(part("meshes.cones").read(ob, ob.data, np.zeros(8, bool))) == left
    assert all(len([g for g in ob.data.vertices[v].groups if g.group == 1]) == 1 for v in (0, 1))
    bpy.ops.uv.flipfree_clear_cones()
    bpy.ops.uv.flipfree_clear_cones()
    assert "No cone is marked there" in capfd.readouterr().out


def washer(n=24):
    """A flat ring of quads."""
    turn = np.linspace(0, 2 * np.pi, n, endpoint=False)
    circle = np.column_stack([np.cos(turn), np.sin(turn), np.zeros(n)])
    faces = [(j, (j + 1) % n, n + (j + 1) % n, n + j) for j in range(n)]
    return shapes.add("Washer", np.concatenate([circle, circle / 2]), faces)


def test_the_report_judges_the_map_that_is_stored(capfd, part):
    ob = washer()
    assert bpy.ops.uv.flipfree_conformal() == {"FINISHED"}
    line = capfd.readouterr().out
    written = part("certificates").of(ob).figures
    assert bpy.ops.uv.flipfree_check() == {"FINISHED"}
    checked = part("certificates").of(ob).figures
    assert f"{checked['overlaps']} overlap" in line
    for name in ("triangles", "flips32", "overlaps", "island_overlaps"):
        assert written[name] == checked[name]
    for name in ("energy", "energy_p99", "max_energy"):
        assert written[name] == pytest.approx(checked[name], rel=1e-9)
    assert checked["overlaps"] == 0  # two cut sides that meet in 64 bits do not as they are stored
