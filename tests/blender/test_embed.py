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


def test_undo_brings_the_old_map_back():
    ob = shapes.grid(6, bump=0.3, uv=True)
    before = shapes.uv_of(ob)
    bpy.ops.ed.undo_push(message="before")
    assert embed(boundary="triangle") == {"FINISHED"}
    bpy.ops.ed.undo_push(message="after")
    bpy.ops.ed.undo()
    assert np.array_equal(shapes.uv_of(bpy.data.objects[0]), before)


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
