# SPDX-License-Identifier: GPL-3.0-or-later
"""Seamless Map through its operator: seams in rational numbers, cones, what is marked, what is refused."""

import math

import bmesh
import bpy
import numpy as np
import pytest
import shapes

import flipfree as ff

from judges.seams import seam_count
from surfaces import of_cubes, plate


def holed(genus=2, cuts=1):
    """A bar of cubes with holes, its quads divided."""
    vertices, faces = of_cubes(plate(genus))
    faces = faces.reshape(-1, 6)[:, [0, 1, 2, 5]].tolist()
    ob = shapes.add("Holed", vertices, faces)
    if cuts:
        bm = bmesh.new()
        bm.from_mesh(ob.data)
        bmesh.ops.subdivide_edges(bm, edges=bm.edges[:], cuts=cuts, use_grid_fill=True)
        bm.to_mesh(ob.data)
        bm.free()
    return ob


def judged(ob):
    """Seams and cones of the map as stored, in rational numbers."""
    return seam_count(*shapes.triangles_of(ob))


def turns_of(ob):
    attribute = ob.data.attributes["seam_turns"]
    assert (attribute.domain, attribute.data_type) == ("EDGE", "INT")
    values = np.zeros(len(ob.data.edges), np.int32)
    attribute.data.foreach_get("value", values)
    return values


def marks(ob):
    """{vertex: quarter turns of the cone that its group says}"""
    return {
        v.index: 4 - int(ob.vertex_groups[g.group].name.split()[1])
        for v in ob.data.vertices
        for g in v.groups
    }


def exact(ob):
    found = judged(ob)
    assert found.flipped == found.torn == 0 and found.exact == found.edges
    return found


def check(ob, genus):
    """Whatever the operator wrote: no flip, every seam exact, marked, with its turns; cones that sum up; in the unit square."""
    found = exact(ob)
    assert sum(4 - k for k in found.cones.values()) == 8 - 8 * genus
    corners, uv = shapes.triangles_of(ob)
    points = np.array([v.co for v in ob.data.vertices], float)
    certificate = ff.certify(points, corners, uv, seamless=True)
    across = zip(
        certificate.seam_vertices.tolist(),
        certificate.seam_transitions.quarter_turns.tolist(),
        strict=True,
    )
    turns = {(v, w): k for (v, w), k in across}
    turns |= {(w, v): -k % 4 for (v, w), k in turns.items()}
    stored = turns_of(ob)
    assert found.edges == sum(tuple(edge.vertices) in turns for edge in ob.data.edges)
    for edge in ob.data.edges:
        if tuple(edge.vertices) in turns:
            assert edge.use_seam and stored[edge.index] == (turns[tuple(edge.vertices)] or 4)
        else:
            assert stored[edge.index] in (0, 4), "a cut that happens to join"
    uv = shapes.uv_of(ob)
    assert uv.min() >= 0.0 and 0.5 < uv.max() <= 1.0


def box_corners(ob):
    box = np.array([v.co for v in ob.data.vertices])
    ends = (np.abs(box - box.min(0)) < 1e-6) | (np.abs(box - box.max(0)) < 1e-6)
    return np.flatnonzero(ends.all(1)).tolist()


@pytest.mark.parametrize("mode", ["OBJECT", "EDIT"])
@pytest.mark.parametrize("genus", [0, 1, 2])
def test_a_closed_mesh_of_any_genus_is_mapped_with_the_defaults(genus, mode, capfd):
    ob = holed(genus, 2)
    shapes.enter(mode)
    assert bpy.ops.uv.flipfree_seamless() == {"FINISHED"}
    line = capfd.readouterr().out
    bpy.ops.object.mode_set(mode="OBJECT")
    check(ob, genus)
    edges = judged(ob).edges
    assert f"{edges} of {edges} seam edges exact, 0 flips" in line
    assert "suggested" in line


@pytest.mark.parametrize("engine", ["penner", "padding"])
def test_every_engine_maps_a_mesh_with_a_handle(engine):
    ob = holed(1, 1)
    assert bpy.ops.uv.flipfree_seamless(engine=engine) == {"FINISHED"}
    check(ob, 1)


def test_a_cube_unfolds_without_any_distortion(capfd):
    ob = shapes.cube()
    assert bpy.ops.uv.flipfree_seamless() == {"FINISHED"}
    check(ob, 0)
    assert judged(ob).cones == dict.fromkeys(range(8), 3)
    assert "8 cones (8 suggested), 7 of 7 seam edges exact" in capfd.readouterr().out
    assert [len(p.vertices) for p in ob.data.polygons] == [4] * 6


def test_suggested_cones_are_marked_and_taken_again(capfd):
    ob = holed(1, 2)
    assert bpy.ops.uv.flipfree_seamless() == {"FINISHED"}
    first = shapes.uv_of(ob).tobytes()
    assert marks(ob) == judged(ob).cones
    capfd.readouterr()
    assert bpy.ops.uv.flipfree_seamless() == {"FINISHED"}
    assert "suggested" not in capfd.readouterr().out
    assert shapes.uv_of(ob).tobytes() == first


def test_marked_cones_are_met_and_nothing_is_marked_on_request():
    ob = holed(0, 2)
    corners = box_corners(ob)
    assert len(corners) == 8
    ob.vertex_groups.new(name="Cone +2").add(corners[:4], 1.0, "REPLACE")
    assert bpy.ops.uv.flipfree_seamless(mark_cuts=False) == {"FINISHED"}
    assert judged(ob).cones == dict.fromkeys(corners[:4], 2)
    assert not any(e.use_seam for e in ob.data.edges)
    assert "seam_turns" not in ob.data.attributes
    assert bpy.ops.uv.flipfree_seamless(cones_from="suggested", mark_cones=False) == {"FINISHED"}
    assert len(ob.vertex_groups) == 1
    check(ob, 0)


def test_angles_of_the_attribute_are_cones_too():
    ob = holed(1, 1)
    a, b = 0, len(ob.data.vertices) - 1
    values = np.zeros(len(ob.data.vertices), np.float32)
    values[a], values[b] = math.pi, 3 * math.pi
    ob.data.attributes.new("cone_angle", "FLOAT", "POINT").data.foreach_set("value", values)
    assert bpy.ops.uv.flipfree_seamless() == {"FINISHED"}
    assert judged(ob).cones == {a: 2, b: 6}
    check(ob, 1)


@pytest.mark.parametrize("operator", ["seamless", "field_aligned"])
@pytest.mark.parametrize("group", [False, True])
def test_pins_inside_are_met_and_cuts_stay(operator, group, capfd):
    bpy.ops.mesh.primitive_torus_add(major_segments=32, minor_segments=16)
    ob, run = bpy.context.object, getattr(bpy.ops.uv, f"flipfree_{operator}")
    assert run() == {"FINISHED"}
    free, at = shapes.uv_of(ob), shapes.corners(ob)
    cut = {v for edge in ob.data.edges if edge.use_seam for v in edge.vertices}
    first, second = [v for v in range(len(ob.data.vertices)) if v not in cut][40:42]
    near = [v for p in ob.data.polygons if first in p.vertices for v in p.vertices]
    beside = next(v for v in near if v not in cut and v not in (first, second))
    moved = free.copy()
    moved[at == first] = 0.5 * free[at == first][0] + 0.5 * free[at == beside][0]
    shapes.set_uv(ob, moved)
    if group:
        ob.vertex_groups.new(name="Pins").add([first, second], 1.0, "REPLACE")
    else:
        shapes.set_pins(ob, np.isin(at, [first, second]))
    assert run(meet_pins=True) == {"FINISHED"}
    uv = shapes.uv_of(ob)[: len(at)]
    assert shapes.exact_flips(ob) == 0 and judged(ob).exact == judged(ob).edges
    for vertex in (first, second):
        assert (uv[at == vertex] == moved[at == vertex]).all()
    assert np.array_equal(uv[np.isin(at, list(cut))], free[np.isin(at, list(cut))])
    assert not np.array_equal(uv, free)


def test_pins_on_a_cut_that_would_move_are_refused_by_name(capfd):
    ob = shapes.primitive("torus")
    assert bpy.ops.uv.flipfree_seamless() == {"FINISHED"}
    with pytest.raises(RuntimeError, match="no UV is pinned"):
        bpy.ops.uv.flipfree_seamless(meet_pins=True)
    before, at = shapes.uv_of(ob), shapes.corners(ob)
    on_cut = next(edge.vertices[0] for edge in ob.data.edges if edge.use_seam)
    moved = before + 0.01
    shapes.set_uv(ob, moved)
    shapes.set_pins(ob, np.flatnonzero(at == on_cut)[:1])
    with pytest.raises(RuntimeError, match=f"vertex {on_cut} .*Pin vertices inside"):
        bpy.ops.uv.flipfree_seamless(meet_pins=True)
    assert np.array_equal(shapes.uv_of(ob), moved)


def test_a_speck_beside_a_large_part_is_enlarged_and_said(capfd):
    bpy.ops.mesh.primitive_ico_sphere_add(subdivisions=2, radius=1e-7)
    speck = bpy.context.object
    bpy.ops.mesh.primitive_ico_sphere_add(subdivisions=3, radius=2.0, location=(6, 0, 0))
    ball = bpy.context.object
    speck.select_set(True)
    bpy.context.view_layer.objects.active = ball
    bpy.ops.object.join()
    assert bpy.ops.uv.flipfree_seamless() == {"FINISHED"}
    assert shapes.exact_flips(bpy.context.object) == 0
    assert (
        "1 part was too small beside the others for 32 bits, and is larger"
        in capfd.readouterr().out
    )


def test_quads_stay_where_the_cut_can_go_around_them():
    ob = holed(2, 1)
    polygons = [tuple(p.vertices) for p in ob.data.polygons]
    assert bpy.ops.uv.flipfree_seamless() == {"FINISHED"}
    assert [tuple(p.vertices) for p in ob.data.polygons] == polygons


def refined_case():
    """Few large triangles and cones that none of them can bear: the mesh has to be refined."""
    ob = shapes.primitive("torus", major_segments=8, minor_segments=6)
    ob.vertex_groups.new(name="Weight").add([5], 0.5, "REPLACE")
    ob.vertex_groups.new(name="Cone +2").add([0, 21], 1.0, "REPLACE")
    ob.vertex_groups.new(name="Cone -4").add([30], 1.0, "REPLACE")
    return ob


@pytest.mark.parametrize("mode", ["OBJECT", "EDIT"])
def test_a_refined_mesh_keeps_what_it_carries(mode):
    ob = refined_case()
    before = len(ob.data.vertices)
    area = sum(p.area for p in ob.data.polygons)
    shapes.enter(mode)
    assert bpy.ops.uv.flipfree_seamless() == {"FINISHED"}
    bpy.ops.object.mode_set(mode="OBJECT")
    assert len(ob.data.vertices) > before, "this case is meant to need new vertices"
    assert sum(p.area for p in ob.data.polygons) == pytest.approx(area, rel=1e-2)
    assert judged(ob).cones == {0: 2, 21: 2, 30: 8}
    check(ob, 1)
    marked = [v.index for v in ob.data.vertices for g in v.groups if g.group > 0]
    assert sorted(marked) == [0, 21, 30], "new vertices are no cones"


def test_the_scale_of_the_surface_on_request():
    ob = shapes.cube()
    assert bpy.ops.uv.flipfree_seamless(fit=False) == {"FINISHED"}
    uv = shapes.uv_of(ob).astype(float)
    p = uv.reshape(-1, 4, 2)
    ac, bd = p[:, 2] - p[:, 0], p[:, 3] - p[:, 1]
    area = (ac[:, 0] * bd[:, 1] - ac[:, 1] * bd[:, 0]) / 2
    assert area == pytest.approx([4.0] * 6, rel=1e-4)


def refused(ob, words, operator="seamless", **options):
    shapes.refused(ob, words, getattr(bpy.ops.uv, f"flipfree_{operator}"), **options)
    assert not {"seam_turns", "flipfree_field"} & set(ob.data.attributes.keys())


@pytest.mark.parametrize(
    ("operator", "options"), [("seamless", {}), ("field_aligned", {"field_from": "cones"})]
)
def test_cones_that_do_not_sum_up_are_refused_with_the_part(operator, options):
    ob = holed(2, 0)
    ob.vertex_groups.new(name="Cone +1").add([0], 1.0, "REPLACE")
    refused(ob, r"Still missing:\n.*-9 quarter turns", operator, **options)
    assert shapes.shown("face")


def test_angles_that_are_no_quarter_turns_are_refused_by_vertex():
    ob = shapes.cube()
    values = np.zeros(8, np.float32)
    values[3] = 1.0
    ob.data.attributes.new("cone_angle", "FLOAT", "POINT").data.foreach_set("value", values)
    refused(ob, "vertex 3 has a cone angle of 57.29.. degrees.*multiples of 90")
    assert shapes.shown("vertex") == [3]


def test_what_no_torus_has_is_refused():
    ob = shapes.primitive("torus")
    ob.vertex_groups.new(name="Cone +1").add([0], 1.0, "REPLACE")
    ob.vertex_groups.new(name="Cone -1").add([9], 1.0, "REPLACE")
    refused(ob, "vertex 0 .*3 and 5")
    assert shapes.shown("vertex") == [0, 9]


def test_what_the_solver_gives_up_on_is_cured_by_cones_not_by_seams(part):
    import flipfree

    errors = part("errors")
    snapshot = part("meshes.mesh_io").read(shapes.cube(), only_selected=False)
    task = part("operators.seamless").make_task(snapshot)
    error = flipfree.NotConverged("words", code="rounding to 32 bits flips triangles")
    assert "more seams" in str(errors.from_solver(snapshot, error))
    assert "lower Scale Bound" in str(errors.from_solver(snapshot, error, task.cures))


def test_an_open_sheet_becomes_a_rectangle():
    ob = shapes.grid(8, bump=0.3)
    assert bpy.ops.uv.flipfree_seamless() == {"FINISHED"}
    assert exact(ob).slanted == 0


def test_corners_are_the_marked_boundary_vertices():
    ob = shapes.primitive("circle", vertices=24, fill_type="TRIFAN")
    uses = np.bincount([v for e in ob.data.edges for v in e.vertices])
    rim = [v.index for v in ob.data.vertices if uses[v.index] == 3]
    rim.sort(key=lambda v: math.atan2(ob.data.vertices[v].co.y, ob.data.vertices[v].co.x))
    corners = rim[::6]
    ob.vertex_groups.new(name="Cone +1").add(corners, 1.0, "REPLACE")
    assert bpy.ops.uv.flipfree_seamless(cones_from="marked") == {"FINISHED"}
    assert exact(ob).slanted == 0
    uv = shapes.uv_of(ob)
    where = {loop.vertex_index: uv[loop.index] for loop in ob.data.loops}
    box = np.array([where[v] for v in corners])
    assert sorted(map(tuple, (box > box.mean(0)).tolist())) == [
        (False, False),
        (False, True),
        (True, False),
        (True, True),
    ]


def test_the_monkey_is_mapped_with_the_defaults():
    ob = shapes.monkey(1)
    for edge in ob.data.edges:
        edge.use_seam = False
    assert bpy.ops.uv.flipfree_seamless() == {"FINISHED"}
    assert exact(ob).slanted == 0


def test_flat_text_has_its_borders_along_the_axes(capfd):
    energies = []
    for text in (
        "ABeO8",  # holes
        "Flipfree",  # dots whose triangles have their tips on the border
        "S@&gQ%",
        "WVMNAvwxyz",  # pointed
        '.:;!?"*#{}[]',
        "CDGJPRUbdfhjmnpqu",
    ):
        bpy.ops.object.text_add()
        bpy.context.object.data.body = text
        bpy.ops.object.convert(target="MESH")
        ob = bpy.context.object
        assert bpy.ops.uv.flipfree_seamless(boundary="aligned") == {"FINISHED"}
        assert exact(ob).slanted == 0
        out = capfd.readouterr().out
        energies.append(float(out.split("mean ")[1].split()[0]))
        assert "Badly distorted" not in out
        bpy.data.objects.remove(ob)
    assert max(energies) < 1.5 and np.mean(energies) < 1.3


@pytest.mark.parametrize("seed", range(4))
def test_needles_of_text_that_is_turned_in_space_do_not_shear_when_they_are_stored(seed, capfd):
    bpy.ops.object.text_add(rotation=np.random.default_rng(seed).uniform(-3, 3, 3))
    bpy.context.object.data.body = "Flipfree"
    bpy.ops.object.convert(target="MESH")
    bpy.ops.object.transform_apply()
    assert bpy.ops.uv.flipfree_seamless(boundary="aligned") == {"FINISHED"}
    assert exact(bpy.context.object).slanted == 0
    assert float(capfd.readouterr().out.split("mean ")[1].split()[0]) < 1.4


@pytest.mark.parametrize(
    ("operator", "said"), [("seamless", "1 part has"), ("field_aligned", "2 parts have")]
)
def test_a_part_without_room_for_corners_is_free_and_the_report_says_so(operator, said, capfd):
    triangle = [(9, 0, 0), (10, 0, 0), (9, 1, 0)]
    square = [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0)]
    ob = shapes.add("Parts", square + triangle, [(0, 1, 2, 3), (4, 5, 6)])
    run = getattr(bpy.ops.uv, f"flipfree_{operator}")
    assert run() == {"FINISHED"}
    assert exact(ob).slanted > 0
    assert f"{said} a free boundary" in capfd.readouterr().out
    shapes.refused(ob, "Free", run, boundary="aligned")


def test_some_faces_of_a_closed_mesh_are_a_surface_with_boundary():
    ob = holed(0, 2)
    bpy.ops.object.mode_set(mode="EDIT")
    shapes.select_faces(ob, range(9))
    assert bpy.ops.uv.flipfree_seamless() == {"FINISHED"}
    bpy.ops.object.mode_set(mode="OBJECT")
    uv = shapes.uv_of(ob)
    assert np.unique(uv[:36], axis=0).shape[0] >= 16
