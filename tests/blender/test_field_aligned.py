# SPDX-License-Identifier: GPL-3.0-or-later
"""Field-Aligned Seamless Map through its operator: seams in rational numbers, cones, lines along the field, what is refused."""

import math
import re

import bmesh
import bpy
import numpy as np
import pytest
import shapes
from test_broken_meshes import fin
from test_seamless import box_corners, check, exact, holed, judged, marks, refined_case, refused

pytestmark = pytest.mark.halved

run = bpy.ops.uv.flipfree_field_aligned


def field_of(ob, name="flipfree_field"):
    attribute = ob.data.attributes[name]
    assert (attribute.domain, attribute.data_type) == ("FACE", "FLOAT_VECTOR")
    values = np.empty((len(ob.data.polygons), 3), np.float32)
    attribute.data.foreach_get("vector", values.ravel())
    return values.astype(float)


def triangles(ob):
    """(points (m, 3, 3), uv (m, 3, 2), face (m,)) as stored."""
    corners, uv = shapes.triangles_of(ob)
    points = np.array([v.co for v in ob.data.vertices], float)
    return points[corners], uv.astype(float), np.array(shapes.face_of_triangles(ob))


def degrees_off(ob, directions=None):
    """Mean by area of the angle between the map's u lines and the nearest of the field's four directions."""
    points, uv, face = triangles(ob)
    given = field_of(ob) if directions is None else directions
    a, b = points[:, 1] - points[:, 0], points[:, 2] - points[:, 0]
    p, q = uv[:, 1] - uv[:, 0], uv[:, 2] - uv[:, 0]
    # s a + t b with s p + t q along +u.
    line = q[:, 1, None] * a - p[:, 1, None] * b
    normal = np.cross(a, b)
    area = np.linalg.norm(normal, axis=1)
    normal /= area[:, None]
    x = given[face]
    x = x - normal * (x * normal).sum(1)[:, None]
    angle = np.arctan2((line * np.cross(normal, x)).sum(1), (line * x).sum(1))
    off = np.abs((angle + math.pi / 4) % (math.pi / 2) - math.pi / 4)
    return math.degrees((off * area).sum() / area.sum())


def uv_per_area(ob):
    """Length in the map of a length 1, per triangle, and its face."""
    points, uv, face = triangles(ob)
    p, q = uv[:, 1] - uv[:, 0], uv[:, 2] - uv[:, 0]
    flat = p[:, 0] * q[:, 1] - p[:, 1] * q[:, 0]
    a, b = points[:, 1] - points[:, 0], points[:, 2] - points[:, 0]
    return np.sqrt(flat / np.linalg.norm(np.cross(a, b), axis=1)), face


@pytest.mark.parametrize("mode", ["OBJECT", "EDIT"])
@pytest.mark.parametrize("field", ["curvature", "smooth", "edges", "flow"])
@pytest.mark.parametrize("genus", [0, 1, 2])
def test_a_closed_mesh_of_any_genus_follows_its_field(genus, field, mode, capfd):
    ob = holed(genus, 2)
    shapes.enter(mode)
    assert run(field_from=field) == {"FINISHED"}
    line = capfd.readouterr().out
    bpy.ops.object.mode_set(mode="OBJECT")
    check(ob, genus)
    edges = judged(ob).edges
    assert f"{edges} of {edges} seam edges exact, 0 flips" in line
    assert "degrees off the field" in line
    if field == "edges":
        met, asked = re.search(r"(\d+) of (\d+) sharp edges on lines", line).groups()
        assert int(asked) > 0 and int(met) >= 0.9 * int(asked)
    directions = field_of(ob)
    assert np.linalg.norm(directions, axis=1) == pytest.approx(1.0, abs=1e-5)
    assert degrees_off(ob) < 10.0


def test_the_cones_of_the_field_are_marked_in_place_of_the_old_ones():
    ob = holed(0, 2)
    ob.vertex_groups.new(name="Cone -2").add([0, 5], 1.0, "REPLACE")
    assert run() == {"FINISHED"}
    assert marks(ob) == judged(ob).cones and len(judged(ob).cones) == 8
    assert bpy.ops.uv.flipfree_seamless() == {"FINISHED"}
    assert judged(ob).cones == marks(ob)


def test_nothing_beside_the_map_is_written_on_request():
    ob = holed(1, 1)
    assert run(mark_cones=False, write_field=False, mark_cuts=False) == {"FINISHED"}
    assert not ob.vertex_groups and "flipfree_field" not in ob.data.attributes
    assert not any(e.use_seam for e in ob.data.edges) and "seam_turns" not in ob.data.attributes
    assert shapes.exact_flips(ob) == 0


def test_the_flow_of_quads_has_its_cones_where_other_than_four_meet():
    ob = holed(2, 2)
    valence = np.bincount([v for e in ob.data.edges for v in e.vertices])
    assert run(field_from="flow") == {"FINISHED"}
    assert judged(ob).cones == {int(v): int(valence[v]) for v in np.flatnonzero(valence != 4)}
    assert degrees_off(ob) < 1.0


def ring_directions(ob):
    """Around the axis of a torus, per face."""
    centre = np.array([p.center for p in ob.data.polygons])
    return np.cross([0.0, 0.0, 1.0], centre) / np.linalg.norm(centre[:, :2], axis=1)[:, None]


@pytest.mark.parametrize("mode", ["OBJECT", "EDIT"])
def test_a_field_of_the_artist_is_followed(mode, capfd):
    ob = shapes.primitive("torus")
    drawn = ring_directions(ob)
    turned = np.cross([p.normal for p in ob.data.polygons], drawn)
    mixed = np.where((np.arange(len(drawn)) % 3 == 0)[:, None], turned, 2.5 * drawn)
    attribute = ob.data.attributes.new("Drawn", "FLOAT_VECTOR", "FACE")
    attribute.data.foreach_set("vector", mixed.astype(np.float32).ravel())
    shapes.enter(mode)
    assert run(field_from="attribute", attribute="Drawn") == {"FINISHED"}
    bpy.ops.object.mode_set(mode="OBJECT")
    check(ob, 1)
    assert judged(ob).cones == {}
    assert degrees_off(ob, drawn) < 3.0
    assert "0 cones" in capfd.readouterr().out


def test_the_field_of_one_run_is_that_of_the_next():
    ob = holed(2, 2)
    assert run(field_from="smooth") == {"FINISHED"}
    first, found = field_of(ob), judged(ob).cones
    assert run(field_from="attribute") == {"FINISHED"}
    assert np.abs(np.einsum("ij,ij->i", first, field_of(ob))) == pytest.approx(1.0, abs=1e-4)
    assert judged(ob).cones == found
    check(ob, 2)


def test_marked_cones_make_the_field():
    ob = holed(0, 2)
    corners = box_corners(ob)
    ob.vertex_groups.new(name="Cone +2").add(corners[:4], 1.0, "REPLACE")
    assert run(field_from="cones") == {"FINISHED"}
    assert judged(ob).cones == dict.fromkeys(corners[:4], 2) == marks(ob)
    check(ob, 0)


def test_a_refined_mesh_keeps_its_field():
    ob = refined_case()
    assert run(field_from="cones") == {"FINISHED"}
    assert judged(ob).cones == {0: 2, 21: 2, 30: 8}
    check(ob, 1)
    assert np.linalg.norm(field_of(ob), axis=1) == pytest.approx(1.0, abs=1e-5)


def test_marked_edges_are_followed(capfd):
    for mark in (False, True):
        ob = shapes.primitive("ico_sphere", subdivisions=3)
        ob.data.edges[100].use_edge_sharp = mark
        pair = set(ob.data.edges[100].vertices)
        assert run(field_from="edges") == {"FINISHED"}
        check(ob, 0)
        assert ("1 of 1 sharp edges on lines" in capfd.readouterr().out) == mark
        corner, uv = shapes.corners(ob), shapes.uv_of(ob)
        beside = [p for p in ob.data.polygons if pair <= set(p.vertices)]
        assert len(beside) == 2
        for polygon in beside:
            ends = [k for k in polygon.loop_indices if corner[k] in pair]
            assert (np.ptp(uv[ends], axis=0).min() == 0.0) == mark


@pytest.mark.parametrize("source", ["painted", "POINT", "FACE"])
def test_the_map_is_denser_where_a_group_or_an_attribute_says_so(source):
    ob = shapes.primitive("uv_sphere", segments=48, ring_count=24)
    mesh = ob.data
    places = mesh.vertices if source != "FACE" else mesh.polygons
    high = np.array([(p.center if source == "FACE" else p.co).z for p in places]) > 0.0
    options = {"density": "painted", "density_name": "Detail", "density_ratio": 3.0}
    if source == "painted":
        ob.vertex_groups.new(name="Detail").add(np.flatnonzero(high).tolist(), 1.0, "REPLACE")
    else:
        values = np.where(high, 3.0, 1.0).astype(np.float32)
        mesh.attributes.new("Size", "FLOAT", source).data.foreach_set("value", values)
        options = {"density": "attribute", "density_name": "Size"}
    ratios = []
    for given in ({}, options):
        assert run(field_from="smooth", **given) == {"FINISHED"}
        check(ob, 0)
        scale, face = uv_per_area(ob)
        z = np.array([p.center.z for p in mesh.polygons])[face]
        ratios.append(np.median(scale[z > 0.5]) / np.median(scale[z < -0.5]))
    assert ratios[0] == pytest.approx(1.0, rel=0.2)
    assert ratios[1] > 1.3 * ratios[0]


def test_a_field_that_is_not_there_is_refused():
    ob = shapes.cube()
    refused(
        ob,
        "no attribute 'flipfree_field'.*Take another source",
        "field_aligned",
        field_from="attribute",
    )
    ob.data.attributes.new("Drawn", "FLOAT_VECTOR", "FACE")
    refused(
        ob,
        "no attribute 'Dawn'.*It has Drawn",
        "field_aligned",
        field_from="attribute",
        attribute="Dawn",
    )


def test_faces_without_a_direction_are_named():
    ob = shapes.cube()
    values = np.array([(p.normal.y, p.normal.z, p.normal.x) for p in ob.data.polygons], np.float32)
    values[2] = 0.0
    values[4] = ob.data.polygons[4].normal
    ob.data.attributes.new("Drawn", "FLOAT_VECTOR", "FACE").data.foreach_set(
        "vector", values.ravel()
    )
    words = "face 2 .and 1 more. has no direction in its plane"
    refused(ob, words, "field_aligned", field_from="attribute", attribute="Drawn")
    assert shapes.shown("face") == [2, 4]


@pytest.mark.parametrize("bad", [0.0, -1.0, float("nan")])
def test_densities_that_are_no_positive_numbers_are_named(bad):
    ob = shapes.cube()
    values = np.ones(8, np.float32)
    values[6] = bad
    ob.data.attributes.new("Size", "FLOAT", "POINT").data.foreach_set("value", values)
    refused(
        ob,
        "vertex 6 has no positive number",
        "field_aligned",
        density="attribute",
        density_name="Size",
    )
    assert shapes.shown("vertex") == [6]
    refused(ob, "no attribute 'Sizes'", "field_aligned", density="attribute", density_name="Sizes")


@pytest.mark.parametrize("mode", ["OBJECT", "EDIT"])
def test_what_is_drawn_lies_on_the_mesh(mode, part):
    ob = holed(2, 1)
    assert run() == {"FINISHED"}
    bends = {v: 4 - k for v, k in marks(ob).items()}
    corners, saddles = (
        sum(f(t) for t in bends.values()) for f in (lambda t: t > 0, lambda t: t < 0)
    )
    bpy.ops.object.mode_set(mode=mode)
    field, red, green = drawn_over(ob, part)
    assert len(field) == 12 * len(field_of_faces(ob))
    assert len(red) == 24 * corners and len(green) == 24 * saddles
    points = np.concatenate([field, red, green])
    low, high = points.min(0), points.max(0)
    assert np.isfinite(points).all()
    assert low == pytest.approx([0, 0, 0], abs=0.1) and high == pytest.approx([5, 3, 1], abs=0.1)


def drawn_over(ob, part):
    """Vertices of crosses, of octahedra at corners, and at saddles."""
    drawing = part("views.shapes").Drawing()
    with part("views.reading").reading(ob) as read:
        part("views.field").draw(read, drawing)
        part("views.marks").draw_cones(read, drawing)
    colours = (
        part("views.field").COLOUR,
        part("views.marks").CORNER_COLOUR,
        part("views.marks").SADDLE_COLOUR,
    )
    return [
        np.concatenate([np.zeros((0, 3)), *(s.pos for s in drawing.shapes if s.colour == colour)])
        for colour in colours
    ]


def field_of_faces(ob):
    return bmesh.from_edit_mesh(ob.data).faces if ob.mode == "EDIT" else ob.data.polygons


def test_a_mesh_without_field_and_cones_draws_nothing(part):
    ob = shapes.cube()
    assert [len(points) for points in drawn_over(ob, part)] == [0, 0, 0]
    with pytest.raises(RuntimeError, match="Without a window"):
        bpy.ops.view3d.flipfree_show_field()


@pytest.mark.parametrize("field", ["curvature", "flow"])
@pytest.mark.parametrize("boundary", ["aligned", "free"])
def test_the_monkey_follows_its_fields(boundary, field):
    """Several parts, holes for the eyes, quads and triangles."""
    ob = shapes.monkey(1)
    for edge in ob.data.edges:
        edge.use_seam = False
    assert run(field_from=field, boundary=boundary) == {"FINISHED"}
    slanted = exact(ob).slanted
    assert degrees_off(ob) < 10.0
    assert boundary == "free" or slanted == 0


def test_corners_of_an_aligned_boundary_are_marked():
    ob = shapes.grid(8, bump=0.1)
    assert run(field_from="smooth") == {"FINISHED"}
    corners = [v.index for v in ob.data.vertices if abs(v.co.x) > 0.99 and abs(v.co.y) > 0.99]
    found = {v.index: ob.vertex_groups[g.group].name for v in ob.data.vertices for g in v.groups}
    assert {v: name for v, name in found.items() if v in corners} == dict.fromkeys(
        corners, "Cone +1"
    )
    assert exact(ob).slanted == 0


@pytest.mark.parametrize("field_from", ["curvature", "smooth", "flow", "attribute"])
def test_a_mesh_that_is_no_clean_surface_is_mapped(field_from, capfd):
    ob = fin(turned=True)
    if field_from == "attribute":  # that of an earlier run
        assert run(field_from="smooth") == {"FINISHED"}
        capfd.readouterr()
    assert run(field_from=field_from) == {"FINISHED"}
    assert "; separated: " in capfd.readouterr().out
    assert shapes.edges_with_loose_ends(ob) == []
    values = field_of(ob)
    assert np.linalg.norm(values, axis=1) == pytest.approx(1.0, abs=1e-4)
    normals = np.array([p.normal for p in ob.data.polygons])
    assert np.abs((values * normals).sum(axis=1)).max() < 0.3
