# SPDX-License-Identifier: GPL-3.0-or-later
"""Conformal Map with Cones, Suggest Cones, Mark Cone, through their operators."""

import math

import bmesh
import bpy
import numpy as np
import pytest
import shapes


def quad_sphere(levels=3):
    """A cube subdivided to a sphere; its 8 corners keep three neighbours."""
    bpy.ops.mesh.primitive_cube_add(size=2.0)
    ob = bpy.context.object
    modifier = ob.modifiers.new("Subdivision", "SUBSURF")
    modifier.levels = levels
    bpy.ops.object.modifier_apply(modifier=modifier.name)
    return ob


def corners(ob):
    uses = np.bincount([v for e in ob.data.edges for v in e.vertices])
    return np.flatnonzero(uses == 3).tolist()


def uv_angles(ob):
    """Total UV angle at every vertex, from the stored values."""
    mesh = ob.data
    mesh.calc_loop_triangles()
    uv = shapes.uv_of(ob).astype(float)
    total = np.zeros(len(mesh.vertices))
    for triangle in mesh.loop_triangles:
        p = uv[list(triangle.loops)]
        for k in range(3):
            a, b = p[(k + 1) % 3] - p[k], p[(k + 2) % 3] - p[k]
            total[triangle.vertices[k]] += abs(math.atan2(a[0] * b[1] - a[1] * b[0], a @ b))
    return total


def test_a_sheet_is_mapped_with_a_free_boundary():
    ob = shapes.grid(10, bump=0.5, uv=True)
    assert bpy.ops.uv.flipfree_conformal() == {"FINISHED"}
    assert shapes.exact_flips(ob) == 0
    inner = uv_angles(ob)[[60, 48, 72]]
    assert inner == pytest.approx(2 * math.pi, abs=1e-3)


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


def test_cones_of_the_attribute_count(part):
    ob = quad_sphere(2)
    values = np.zeros(len(ob.data.vertices), np.float32)
    values[corners(ob)] = 1.5 * math.pi
    ob.data.attributes.new("cone_angle", "FLOAT", "POINT").data.foreach_set("value", values)
    assert bpy.ops.uv.flipfree_conformal() == {"FINISHED"}
    assert uv_angles(ob)[corners(ob)] == pytest.approx(1.5 * math.pi, abs=1e-3)


def test_cones_that_do_not_sum_up_are_refused():
    ob = quad_sphere(2)
    ob.vertex_groups.new(name="Cone +1").add(corners(ob)[:5], 1.0, "REPLACE")
    before = shapes.everything(ob)
    with pytest.raises(RuntimeError, match="do not sum"):
        bpy.ops.uv.flipfree_conformal()
    assert shapes.everything(ob) == before


def test_a_cone_without_angle_is_refused_by_name():
    ob = quad_sphere(1)
    ob.vertex_groups.new(name="Cone +4").add([corners(ob)[0]], 1.0, "REPLACE")
    with pytest.raises(RuntimeError, match=f"vertex {corners(ob)[0]} has a cone angle"):
        bpy.ops.uv.flipfree_conformal()


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


def test_a_straight_boundary_without_corners_is_refused():
    shapes.grid(4, uv=True)
    with pytest.raises(RuntimeError, match="needs corners"):
        bpy.ops.uv.flipfree_conformal(boundary="straight")


def test_mark_cone_fills_groups_and_says_what_is_missing(capfd):
    ob = quad_sphere(1)
    eight = corners(ob)
    bpy.ops.object.mode_set(mode="EDIT")

    def mark(vertices, turns):
        bpy.ops.mesh.select_all(action="DESELECT")
        bm = bmesh.from_edit_mesh(ob.data)
        bm.verts.ensure_lookup_table()
        for v in vertices:
            bm.verts[v].select_set(True)
        bmesh.update_edit_mesh(ob.data)
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
    bpy.ops.mesh.primitive_ico_sphere_add(subdivisions=3)
    ob = bpy.context.object
    assert bpy.ops.uv.flipfree_suggest_cones(quarter_turns=quarter_turns) == {"FINISHED"}
    assert bpy.ops.uv.flipfree_conformal() == {"FINISHED"}
    assert shapes.exact_flips(ob) == 0


def test_improve_lowers_the_distortion_and_keeps_pins(capfd):
    ob = shapes.grid(8, bump=0.6, uv=True)
    flat = np.array([ob.data.vertices[loop.vertex_index].co[:2] for loop in ob.data.loops])
    shapes.set_uv(ob, flat * [1.0, 0.4])
    assert bpy.ops.uv.flipfree_check() == {"FINISHED"}
    first = float(capfd.readouterr().out.split("mean ")[1].split()[0])
    assert bpy.ops.uv.flipfree_improve() == {"FINISHED"}
    second = float(capfd.readouterr().out.split("mean ")[1].split()[0])
    assert second < first and shapes.exact_flips(ob) == 0
