# SPDX-License-Identifier: GPL-3.0-or-later
"""Embed in Polygon: shapes, pinned boundaries, selected corners, and what it refuses."""

import bpy
import numpy as np
import pytest
import shapes


def rim(ob):
    """Vertices of the outer boundary of a grid of n x n cells."""
    n = round(len(ob.data.vertices) ** 0.5) - 1
    return [v for v in range((n + 1) ** 2) if v % (n + 1) in (0, n) or v // (n + 1) in (0, n)]


def embed(**options):
    return bpy.ops.uv.flipfree_embed(**options)


@pytest.mark.parametrize("shape", ["circle", "square", "triangle"])
@pytest.mark.parametrize("editing", [False, True])
def test_islands_get_the_shape_and_are_packed(shape, editing):
    ob = shapes.grid(8, bump=0.5, uv=False)
    other = shapes.grid(5, "Other", bump=0.2, uv=False)
    ob.select_set(True)
    if editing:
        bpy.ops.object.mode_set(mode="EDIT")
        bpy.ops.mesh.select_all(action="SELECT")
    assert embed(boundary=shape) == {"FINISHED"}
    if editing:
        bpy.ops.object.mode_set(mode="OBJECT")
    for one in (ob, other):
        uv = shapes.uv_of(one)
        assert shapes.exact_flips(one) == 0 and uv.min() >= 0.0 and uv.max() <= 1.0
        at = shapes.corners(one)
        border = uv[np.isin(at, rim(one))]
        middle = (border.min(axis=0) + border.max(axis=0)) / 2
        away = np.linalg.norm(border - middle, axis=1)
        assert (away.max() / away.min() < 1.05) == (shape == "circle")


def pinned_square(ob):
    """The corners of the grid at the corners of a square, all else folded."""
    corner = shapes.corners(ob)
    n = round(len(ob.data.vertices) ** 0.5) - 1
    places = {0: (0.1, 0.1), n: (0.1, 0.9), n * (n + 1): (0.9, 0.1), n * (n + 2): (0.9, 0.9)}
    uv = np.zeros((len(corner), 2), np.float32)
    for vertex, place in places.items():
        uv[corner == vertex] = place
    shapes.set_uv(ob, uv)
    return corner, places


def assert_on_the_square(ob, corner, places):
    uv = shapes.uv_of(ob)
    assert shapes.exact_flips(ob) == 0
    for vertex, place in places.items():
        assert (uv[corner == vertex] == np.float32(place)).all()
    border = uv[np.isin(corner, rim(ob))]
    assert (np.isclose(border, 0.1, atol=1e-6) | np.isclose(border, 0.9, atol=1e-6)).any(1).all()


def test_pinned_corners_make_the_polygon():
    ob = shapes.grid(8, bump=0.5, uv=True)
    corner, places = pinned_square(ob)
    shapes.set_pins(ob, np.isin(corner, list(places)))
    assert embed(boundary="pinned", optimise=True) == {"FINISHED"}
    assert_on_the_square(ob, corner, places)


def test_selected_corners_make_the_polygon():
    ob = shapes.grid(8, bump=0.5, uv=True)
    corner, places = pinned_square(ob)
    for vertex in ob.data.vertices:
        vertex.select = vertex.index in places
    assert embed(boundary="selected") == {"FINISHED"}
    assert_on_the_square(ob, corner, places)


def test_edges_that_a_side_flattens_are_split():
    ob = shapes.grid(
        1, bump=0.0, uv=False
    )  # two triangles, whose four corners three corners have to take
    before = len(ob.data.vertices)
    assert embed(boundary="triangle") == {"FINISHED"}
    assert shapes.exact_flips(ob) == 0 and len(ob.data.vertices) >= before


def test_what_is_no_disk_or_no_polygon_is_refused_and_named(part):
    bpy.ops.mesh.primitive_uv_sphere_add()
    with pytest.raises(RuntimeError, match="is closed, and only disks fit into a polygon"):
        embed()
    bpy.ops.mesh.primitive_cylinder_add(end_fill_type="NOTHING")
    with pytest.raises(RuntimeError, match="has 2 boundaries"):
        embed()
    ob = shapes.grid(4, uv=True)
    shapes.activate(ob)
    with pytest.raises(RuntimeError, match="0 corners on its boundary.*Pin more"):
        embed(boundary="pinned")
    shapes.set_pins(ob, np.isin(shapes.corners(ob), rim(ob)))
    uv = shapes.plane(ob)
    uv[shapes.corners(ob) == 2] = 0.25
    shapes.set_uv(ob, uv)
    with pytest.raises(RuntimeError, match="not convex"):
        embed(boundary="pinned")
    assert np.array_equal(shapes.uv_of(ob), uv)


def pair():
    """Two grids of other faces, mapped onto one square by their corners; the active one is higher, and carries something."""
    found = []
    for n, name, bump in ((8, "Low", 0.1), (11, "High", 0.7)):
        ob = shapes.grid(n, name, bump=bump, uv=True)
        corner, places = pinned_square(ob)
        shapes.set_pins(ob, np.isin(corner, list(places)))
        assert embed(boundary="pinned") == {"FINISHED"}
        found.append(ob)
    low, high = found
    group = high.vertex_groups.new(name="Height")
    paint = high.data.attributes.new("paint", "FLOAT_COLOR", "CORNER")
    for vertex in high.data.vertices:
        group.add([vertex.index], vertex.co.x / 2 + 0.5, "REPLACE")
    across = shapes.plane(high)[:, 1]
    paint.data.foreach_set(
        "color", np.column_stack([across, across, 0 * across, 1 + 0 * across]).ravel()
    )
    low.select_set(True)
    return low, high


def test_one_surface_gets_what_the_other_has_at_the_same_places():
    low, high = pair()
    flat, before = shapes.plane(low), [v.co.copy() for v in low.data.vertices]
    assert bpy.ops.uv.flipfree_transfer() == {"FINISHED"}
    key = low.data.shape_keys.key_blocks["High"]
    places = np.array([point.co for point in key.data])
    n = 8
    for vertex in (0, n, n * (n + 1), n * (n + 2)):
        assert np.allclose(places[vertex][:2], before[vertex][:2], atol=1e-6)
    assert 0.5 < places[:, 2].max() <= 0.7001 and np.ptp([v.z for v in before]) < 0.2
    weight = [low.vertex_groups["Height"].weight(v) for v in range(len(before))]
    assert np.allclose(weight, places[:, 0] / 2 + 0.5, atol=1e-5)
    colour = np.empty((len(flat), 4), np.float32)
    low.data.attributes["paint"].data.foreach_get("color", colour.ravel())
    assert np.allclose(colour[:, 0], places[shapes.corners(low), 1], atol=1e-5)
    assert high.data.shape_keys is None and [v.co.copy() for v in low.data.vertices] == before
    assert bpy.ops.uv.flipfree_transfer(shape=False) == {"FINISHED"}
    assert len(low.data.shape_keys.key_blocks) == 2


def test_maps_onto_other_shapes_are_refused():
    low, high = pair()
    shapes.set_uv(high, shapes.uv_of(high) * 0.5)
    with pytest.raises(RuntimeError, match="no maps onto one shape"):
        bpy.ops.uv.flipfree_transfer()
    assert low.data.shape_keys is None and not low.vertex_groups
    low.select_set(False)
    with pytest.raises(RuntimeError, match="shall be like High"):
        bpy.ops.uv.flipfree_transfer()
