# SPDX-License-Identifier: GPL-3.0-or-later
"""Texel density, orientation of islands."""

import math

import bpy
import numpy as np
import pytest
import shapes


def flat_grid(n=4, scale=0.2, name="Grid", x=0.0):
    """Mapped by x and y, times scale."""
    ob = shapes.grid(n, name, bump=0.0, uv=True, x=x)
    at = np.array([v.co[:2] for v in ob.data.vertices])
    shapes.set_uv(ob, (at[shapes.corners(ob)] - [x, 0]) * scale + 0.5)
    return ob


def turn(uv, degrees):
    angle = math.radians(degrees)
    c, s = math.cos(angle), math.sin(angle)
    middle = uv.mean(axis=0)
    return (uv - middle) @ np.array([[c, s], [-s, c]]) + middle


def density(ob, pixels=1024):
    """Of each face, px per unit of the scene, by shoelace."""
    uv = shapes.uv_of(ob).astype(float)
    size = abs(ob.matrix_world.to_3x3().determinant()) ** (1 / 3)
    found = []
    for polygon in ob.data.polygons:
        p = uv[list(polygon.loop_indices)]
        q = np.roll(p, -1, axis=0)
        plane = abs((p[:, 0] * q[:, 1] - p[:, 1] * q[:, 0]).sum()) / 2
        found.append(pixels / size * math.sqrt(plane / polygon.area))
    return np.array(found)


@pytest.mark.parametrize("scale", [1.0, 3.0])
@pytest.mark.parametrize("mode", ["OBJECT", "EDIT"])
def test_every_island_meets_the_density(mode, scale):
    ob = shapes.two_sheets(pinned=False)
    uv = shapes.uv_of(ob)
    uv[64:] *= 3.0
    shapes.set_uv(ob, uv)
    ob.scale = (scale,) * 3
    bpy.context.view_layer.update()
    middle = (uv[:64].min(0) + uv[:64].max(0)) / 2
    shapes.enter(mode)
    assert bpy.ops.uv.flipfree_set_density(density=100.0, texture_size=2048) == {"FINISHED"}
    bpy.ops.object.mode_set(mode="OBJECT")
    assert density(ob, 2048) == pytest.approx(100.0, rel=1e-3)
    after = shapes.uv_of(ob)
    assert (after[:64].min(0) + after[:64].max(0)) / 2 == pytest.approx(middle, abs=1e-5)


def test_proportions_can_be_kept():
    ob = shapes.two_sheets(pinned=False)
    uv = shapes.uv_of(ob)
    uv[64:] *= 3.0
    shapes.set_uv(ob, uv)
    before = density(ob)
    assert bpy.ops.uv.flipfree_set_density(density=100.0, together=True) == {"FINISHED"}
    after = density(ob)
    assert after / before == pytest.approx(np.full(32, after[0] / before[0]), rel=1e-3)
    area = np.array([p.area for p in ob.data.polygons])
    assert math.sqrt((area * after**2).sum() / area.sum()) == pytest.approx(100.0, rel=1e-3)


def test_islands_with_pins_stay():
    ob = shapes.two_sheets()
    pins = np.zeros(len(ob.data.loops), bool)
    pins[0] = True
    shapes.set_pins(ob, pins)
    before = shapes.uv_of(ob)
    for call in (
        lambda: bpy.ops.uv.flipfree_set_density(density=10.0),
        lambda: bpy.ops.uv.flipfree_orient(by="up"),
    ):
        assert call() == {"FINISHED"}
        assert np.array_equal(shapes.uv_of(ob)[:64], before[:64])
    assert not np.array_equal(shapes.uv_of(ob)[64:], before[64:])
    assert bpy.ops.uv.flipfree_set_density(density=10.0, use_pins=False) == {"FINISHED"}
    assert density(ob) == pytest.approx(10.0, rel=1e-3)


def test_a_mesh_without_area_has_no_density():
    shapes.add("Flat", np.zeros((3, 3)), [(0, 1, 2)], uv=True)
    with pytest.raises(RuntimeError, match="no face with an area"):
        bpy.ops.uv.flipfree_get_density()


def slanted(degrees, stretch=(2.0, 1.0)):
    """A sheet whose map is a rectangle, turned."""
    ob = flat_grid()
    uv = shapes.uv_of(ob).astype(float)
    uv = turn((uv - uv.mean(0)) * stretch + 0.5, degrees)
    shapes.set_uv(ob, uv)
    return ob


def box(uv):
    return np.ptp(uv, axis=0)


@pytest.mark.parametrize("axis", ["u", "v"])
@pytest.mark.parametrize("degrees", [0, 17, 45, 90, 120, 200])
def test_the_longest_side_lies_along_the_axis(degrees, axis):
    ob = slanted(degrees)
    middle = (shapes.uv_of(ob).min(0) + shapes.uv_of(ob).max(0)) / 2
    assert bpy.ops.uv.flipfree_orient(by="box", axis=axis) == {"FINISHED"}
    after = shapes.uv_of(ob)
    wanted = [0.8, 0.4] if axis == "u" else [0.4, 0.8]
    assert box(after) == pytest.approx(wanted, abs=1e-4)
    assert (after.min(0) + after.max(0)) / 2 == pytest.approx(middle, abs=1e-4)
    assert shapes.exact_flips(ob) == 0


def select_edges(ob, pairs):
    """These edges only, in edit mode."""
    edges = {tuple(sorted(edge.vertices)): edge.index for edge in ob.data.edges}
    bpy.ops.object.mode_set(mode="EDIT")
    shapes.select(ob, "edge", [edges[tuple(sorted(pair))] for pair in pairs])


@pytest.mark.parametrize("degrees", [10, 40, 50, 130, -20])
def test_selected_edges_lie_along_the_nearest_axis(degrees):
    ob = slanted(degrees)
    before = shapes.uv_of(ob)
    select_edges(ob, [(6, 7), (7, 8)])
    assert bpy.ops.uv.flipfree_orient(by="edge") == {"FINISHED"}
    bpy.ops.object.mode_set(mode="OBJECT")
    uv, corner = shapes.uv_of(ob), shapes.corners(ob)
    way = np.abs(uv[corner == 8][0] - uv[corner == 6][0])
    assert min(way) < 1e-5 < max(way)
    was = np.abs(before[corner == 8][0] - before[corner == 6][0])
    assert np.argmax(way) == np.argmax(was)


def test_islands_without_selected_edges_stay():
    ob = shapes.two_sheets(pinned=False)
    uv = shapes.uv_of(ob).astype(float)
    uv[:64], uv[64:] = turn(uv[:64], 20), turn(uv[64:], 20)
    shapes.set_uv(ob, uv)
    before = shapes.uv_of(ob)
    select_edges(ob, [(0, 1)])
    assert bpy.ops.uv.flipfree_orient(by="edge") == {"FINISHED"}
    bpy.ops.object.mode_set(mode="OBJECT")
    assert np.array_equal(shapes.uv_of(ob)[64:], before[64:])
    assert not np.array_equal(shapes.uv_of(ob)[:64], before[:64])


def test_without_a_selected_edge_it_says_so():
    ob = flat_grid()
    select_edges(ob, [])
    with pytest.raises(RuntimeError, match="No edge is selected"):
        bpy.ops.uv.flipfree_orient(by="edge")


@pytest.mark.parametrize("degrees", [0, 30, 100, 250])
def test_what_points_upwards_on_the_model_points_upwards_in_the_map(degrees):
    ob = flat_grid()
    ob.rotation_euler = (math.pi / 2, 0, 0)  # y becomes z
    bpy.context.view_layer.update()
    wanted = shapes.uv_of(ob)
    shapes.set_uv(ob, turn(wanted.astype(float), degrees))
    assert bpy.ops.uv.flipfree_orient(by="up") == {"FINISHED"}
    assert shapes.uv_of(ob) == pytest.approx(wanted, abs=1e-5)


def test_level_islands_have_no_upward_direction():
    ob = flat_grid()
    before = shapes.uv_of(ob)
    assert bpy.ops.uv.flipfree_orient(by="up") == {"FINISHED"}
    assert np.array_equal(shapes.uv_of(ob), before)


def test_scaling_that_would_fold_by_rounding_is_refused(part):
    """Ten million tiles away 32 bits have no room for the small triangles of a shrunk island."""
    ob = flat_grid(16, scale=0.2)
    uv = shapes.uv_of(ob)
    shapes.set_uv(ob, uv * 2048 + [1e7, 0])
    before = shapes.uv_of(ob).tobytes()
    with pytest.raises(RuntimeError, match="too coarse"):
        bpy.ops.uv.flipfree_set_density(density=1.0)
    assert shapes.uv_of(ob).tobytes() == before


def bent(rows=3, columns=12):
    """An arc of quads, mapped as it lies."""
    ring = np.linspace(0.0, 2.0, columns + 1)
    points = [
        (np.cos(a) * (3 + r / 2), np.sin(a) * (3 + r / 2), 0.0)
        for a in ring
        for r in range(rows + 1)
    ]
    wide = rows + 1
    quads = [
        (i * wide + j, i * wide + j + 1, (i + 1) * wide + j + 1, (i + 1) * wide + j)
        for i in range(columns)
        for j in range(rows)
    ]
    ob = shapes.add("Arc", points, quads, uv=True)
    shapes.set_uv(ob, shapes.plane(ob) / 10 + 0.5)
    return ob


@pytest.mark.parametrize("mode", ["OBJECT", "EDIT"])
def test_rectify_makes_an_arc_a_straight_strip(mode, capfd):
    ob = bent()
    shapes.enter(mode)
    assert bpy.ops.uv.flipfree_rectify() == {"FINISHED"}
    bpy.ops.object.mode_set(mode="OBJECT")
    uv = shapes.uv_of(ob)
    assert sorted(len(np.unique(uv[:, k])) for k in (0, 1)) == [4, 13]
    assert "1 island, 0 flips, 0 overlaps" in capfd.readouterr().out
    assert shapes.exact_flips(ob) == 0


def test_rectify_names_what_is_no_grid_and_leaves_islands_with_pins():
    ob = shapes.monkey(0)
    assert bpy.ops.uv.flipfree_unwrap() == {"FINISHED"}
    shapes.refused(ob, r"is no quad\. Rectify takes islands of quads", bpy.ops.uv.flipfree_rectify)
    ob = bent()
    shapes.set_pins(ob, np.arange(len(shapes.uv_of(ob))) == 0)
    shapes.refused(ob, "islands with pins stay", bpy.ops.uv.flipfree_rectify)


def test_rectify_makes_the_side_of_a_cylinder_a_strip_once_seams_part_it_from_its_caps(capfd):
    ob = shapes.primitive("cylinder", vertices=16)
    assert bpy.ops.uv.flipfree_unwrap() == {"FINISHED"}
    caps = [p.index for p in ob.data.polygons if len(p.vertices) > 4]
    for edge in ob.data.edges:
        a, b = (ob.data.vertices[v].co for v in edge.vertices)
        edge.use_seam = bool(abs(a.z - b.z) < 0.1)
    assert bpy.ops.uv.flipfree_rectify() == {"FINISHED"}
    assert "Its island keeps its UVs, the others were mapped" in capfd.readouterr().out
    side = np.repeat(
        [p.index not in caps for p in ob.data.polygons], [len(p.vertices) for p in ob.data.polygons]
    )
    uv = shapes.uv_of(ob)[side]
    assert sorted(len(np.unique(uv[:, k])) for k in (0, 1)) == [2, 17]
