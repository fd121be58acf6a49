# SPDX-License-Identifier: GPL-3.0-or-later
"""Auto Seams and Unwrap's automatic seams, on the things that artists begin with."""

import math

import bmesh
import bpy
import pytest
import shapes


def primitive(name, **options):
    getattr(bpy.ops.mesh, f"primitive_{name}_add")(**options)
    return shapes.activate(bpy.context.object)


def seam_count(ob):
    return sum(e.use_seam for e in ob.data.edges)


def islands_by_seams(ob):
    """Parts of the mesh between seams, by flooding its faces."""
    bm = bmesh.new()
    bm.from_mesh(ob.data)
    unseen, count = set(bm.faces), 0
    while unseen:
        count += 1
        queue = [unseen.pop()]
        while queue:
            for edge in queue.pop().edges:
                for other in () if edge.seam else edge.link_faces:
                    if other in unseen:
                        unseen.remove(other)
                        queue.append(other)
    bm.free()
    return count


def auto_seams(**options):
    assert bpy.ops.uv.flipfree_auto_seams(**options) == {"FINISHED"}


def test_a_cylinder_becomes_a_side_and_two_caps():
    ob = primitive("cylinder", vertices=24)
    auto_seams()
    assert islands_by_seams(ob) == 3
    assert seam_count(ob) == 2 * 24 + 1


@pytest.mark.parametrize("name", ["uv_sphere", "torus", "monkey", "cone", "cylinder"])
def test_an_unwrap_along_the_marks_needs_no_further_cut(name):
    ob = primitive(name)
    auto_seams()
    marked = seam_count(ob)
    assert bpy.ops.uv.flipfree_unwrap(mark_seams=True) == {"FINISHED"}
    assert seam_count(ob) == marked
    assert shapes.exact_flips(ob) == 0


def test_only_marks_change():
    ob = primitive("uv_sphere")
    before = shapes.uv_of(ob).tobytes()
    auto_seams()
    assert shapes.uv_of(ob).tobytes() == before


@pytest.mark.parametrize("mode", ["OBJECT", "EDIT"])
def test_seams_that_are_there_stay_unless_they_are_cleared(mode):
    ob = primitive("uv_sphere")
    equator = [
        e.index
        for e in ob.data.edges
        if all(abs(ob.data.vertices[v].co.z) < 1e-3 for v in e.vertices)
    ]
    for i in equator:
        ob.data.edges[i].use_seam = True
    shapes.enter(mode)
    auto_seams()
    bpy.ops.object.mode_set(mode="OBJECT")
    assert all(ob.data.edges[i].use_seam for i in equator)
    kept = seam_count(ob)
    bpy.ops.object.mode_set(mode=mode)
    auto_seams(keep_seams=False)
    bpy.ops.object.mode_set(mode="OBJECT")
    assert not all(ob.data.edges[i].use_seam for i in equator)
    assert seam_count(ob) < kept


def test_sharp_edges_are_cut_if_asked():
    ob = primitive("cylinder", vertices=16)
    auto_seams(sharp_edges=True, sharp_angle=math.radians(20.0))
    assert islands_by_seams(ob) == 18
    assert seam_count(ob) == 3 * 16


@pytest.mark.parametrize("option", ["avoid_group", "seek_group"])
@pytest.mark.parametrize("column", [0, 7, 13])
def test_seams_go_where_vertex_groups_want_them(option, column):
    """A tube has one seam along it, any column will do."""
    ob = primitive("cylinder", vertices=24, end_fill_type="NOTHING")
    angle = 2 * math.pi * column / 24
    there = [
        v.index
        for v in ob.data.vertices
        if math.hypot(v.co.x - math.sin(angle), v.co.y - math.cos(angle)) < 1e-3
    ]
    assert len(there) == 2
    painted = there if option == "seek_group" else set(range(len(ob.data.vertices))) - set(there)
    ob.vertex_groups.new(name="Painted").add(list(painted), 1.0, "REPLACE")
    auto_seams(**{option: "Painted"})
    assert [sorted(e.vertices) for e in ob.data.edges if e.use_seam] == [sorted(there)]


def test_a_vertex_group_that_is_not_there_is_named():
    ob = primitive("uv_sphere")
    with pytest.raises(RuntimeError, match="no vertex group 'Nose'"):
        auto_seams(avoid_group="Nose")
    assert seam_count(ob) == 0
