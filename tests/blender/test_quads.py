# SPDX-License-Identifier: GPL-3.0-or-later
"""Quad Remesh: a new object or another mesh, what is carried over, what is refused and leaves everything alone."""

import bpy
import numpy as np
import pytest
import shapes
from mathutils import Matrix


def quads(**options):
    return bpy.ops.uv.flipfree_quads(**options)


def points_of(ob):
    return np.array([ob.matrix_world @ v.co for v in ob.data.vertices])


def assert_quads(ob, count=None):
    assert all(len(face.vertices) == 4 for face in ob.data.polygons)
    assert count is None or len(ob.data.polygons) == count
    assert not ob.data.validate()


def names():
    return sorted(ob.name for ob in bpy.data.objects)


@pytest.mark.parametrize("n", [2, 5])
def test_a_cube_becomes_a_grid_on_each_side_in_an_object_of_its_own(n):
    ob = shapes.cube()
    ob.matrix_world = Matrix(((0, -2, 0, 5), (2, 0, 0, 6), (0, 0, 2, 7), (0, 0, 0, 1)))
    bpy.context.view_layer.update()
    before = shapes.everything(ob)
    assert quads(target=6 * n * n) == {"FINISHED"}
    made = bpy.context.object
    bpy.context.view_layer.update()
    assert made is not ob and made.select_get() and made.matrix_world == ob.matrix_world
    assert ob.hide_get() and shapes.everything(ob) == before
    assert_quads(made, 6 * n * n)
    points = points_of(made) - [5, 6, 7]
    assert len(points) == 6 * n * n + 2
    assert np.allclose(np.abs(points).max(axis=1), 2, atol=1e-5)


def test_sharp_edges_are_rows_of_quad_edges(capfd):
    ob = shapes.cube()
    bpy.ops.object.mode_set(mode="EDIT")
    bpy.ops.mesh.subdivide(number_cuts=3)
    bpy.ops.object.mode_set(mode="OBJECT")
    ob.scale = 1, 2, 3
    bpy.context.view_layer.update()
    assert quads(target=600, field_from="edges", replace=True) == {"FINISHED"}
    assert "48 of 48 sharp edges kept" in capfd.readouterr().out
    mesh = bpy.context.object.data
    points = np.array([v.co for v in mesh.vertices])
    assert np.allclose(np.abs(points).max(axis=1), 1, atol=1e-5)
    on_two = (np.abs(np.abs(points) - 1) < 1e-5).sum(axis=1) >= 2
    rows = [e for e in mesh.edges if on_two[list(e.vertices)].all()]
    assert len(rows) == on_two.sum() + 4  # twelve rows between eight corners


@pytest.mark.parametrize("axis", ["x", "y", "z"])
def test_halves_mirror_each_other(axis):
    bpy.ops.mesh.primitive_monkey_add()
    ob = bpy.context.object
    ob.scale = 2, 2, 2
    ob.rotation_euler = 0.3, 0.2, 0.1
    bpy.context.view_layer.update()
    if axis != "x":  # it is alike on its left and right alone
        bpy.ops.mesh.primitive_torus_add(rotation=(0.4, 0.1, 0.7))
        ob = bpy.context.object
    assert quads(target=800, symmetry=axis, replace=True) == {"FINISHED"}
    assert_quads(ob)
    k = "xyz".index(axis)
    points = {tuple(v.co) for v in ob.data.vertices}
    for point in points:
        assert tuple(-x if i == k else x for i, x in enumerate(point)) in points
    assert any(point[k] == 0 for point in points)


def test_painted_quads_are_denser():
    bpy.ops.mesh.primitive_uv_sphere_add(segments=48, ring_count=24)
    ob = bpy.context.object
    top = [v.index for v in ob.data.vertices if v.co.z > 0]
    ob.vertex_groups.new(name="Dense").add(top, 1.0, "REPLACE")
    options = dict(density="painted", density_name="Dense", density_ratio=2.5)
    assert quads(target=1500, replace=True, **options) == {"FINISHED"}
    assert_quads(ob)
    above = np.mean([face.center.z > 0 for face in ob.data.polygons])
    assert above > 0.6 and abs(len(ob.data.polygons) - 1500) < 75
    refused(ob, "no vertex group|has no", replace=True, density="painted", density_name="None")
    bpy.ops.mesh.primitive_uv_sphere_add(segments=48, ring_count=24)
    ob = bpy.context.object
    ob.scale.z = 4
    bpy.context.view_layer.update()
    assert quads(target=1500, replace=True, adaptive=100.0) == {"FINISHED"}
    assert np.mean([abs(v.co.z) > 0.87 for v in ob.data.vertices]) > 0.16  # 0.13 of the area


def test_edge_lengths_are_those_of_the_scene():
    ob = shapes.cube()
    ob.scale = 3, 3, 3
    bpy.context.view_layer.update()
    assert quads(edge_length=1.0, replace=True) == {"FINISHED"}
    assert_quads(ob, 6 * 36)


def test_scales_that_differ_are_seen_as_in_the_scene():
    ob = shapes.cube()
    ob.scale = 1, 1, 4
    bpy.context.view_layer.update()
    assert quads(target=18 * 16, replace=True) == {"FINISHED"}
    points = points_of(ob)
    sides = [np.linalg.norm(np.subtract(*points[list(e.vertices)])) for e in ob.data.edges]
    assert max(sides) < 2 * min(sides)


def test_replacing_keeps_the_object_and_what_the_mesh_carries():
    ob = shapes.cube()
    other = ob.copy()
    bpy.context.collection.objects.link(other)
    name = ob.data.name
    for slot in ("Side", "Top"):
        ob.data.materials.append(bpy.data.materials.new(slot))
    for face in ob.data.polygons:
        face.material_index = int(face.normal.z > 0.9)
        face.use_smooth = True
    top = [v.index for v in ob.data.vertices if v.co.z > 0]
    ob.vertex_groups.new(name="Other")
    ob.vertex_groups.new(name="Height").add(top, 1.0, "REPLACE")
    colours = ob.data.color_attributes.new("Colour", "FLOAT_COLOR", "CORNER")
    for loop in ob.data.loops:
        z = ob.data.vertices[loop.vertex_index].co.z
        colours.data[loop.index].color = (z / 2 + 0.5, 0.0, 0.0, 1.0)
    assert quads(target=96, replace=True) == {"FINISHED"}
    mesh = ob.data
    assert names() == ["Cube", "Cube.001"] and mesh.name == name and other.data == mesh
    assert len(bpy.data.meshes) == 1
    assert_quads(ob, 96)
    assert [m.name for m in mesh.materials] == ["Side", "Top"]
    assert [f.material_index for f in mesh.polygons] == [
        int(f.normal.z > 0.9) for f in mesh.polygons
    ]
    assert all(f.use_smooth for f in mesh.polygons)
    assert [group.name for group in ob.vertex_groups] == ["Other", "Height"]
    for vertex in mesh.vertices:
        weights = {element.group: element.weight for element in vertex.groups}
        assert weights.get(1, 0.0) == pytest.approx(vertex.co.z / 2 + 0.5, abs=1e-5)
    for loop in mesh.loops:
        red = mesh.color_attributes["Colour"].data[loop.index].color[0]
        assert red == pytest.approx(mesh.vertices[loop.vertex_index].co.z / 2 + 0.5, abs=1e-5)


def uv_of(mesh, name):
    found = np.empty((len(mesh.loops), 2), np.float32)
    mesh.attributes[name].data.foreach_get("vector", found.ravel())
    return found


def marked_cube():
    """Each side an island of its own, from which places can be told; its edges seams, sharp, creased; a shape key."""
    ob = shapes.cube()
    mesh = ob.data
    for name in ("First", "Second"):
        layer = mesh.attributes.get(name) or mesh.attributes.new(name, "FLOAT2", "CORNER")
        for face in mesh.polygons:
            for loop in face.loop_indices:
                layer.data[loop].vector = side_uv(
                    mesh.vertices[mesh.loops[loop].vertex_index].co, face
                )
    mesh.uv_layers.active_index = mesh.uv_layers.find("Second")
    mesh.uv_layers["First"].active_render = True
    for edge in mesh.edges:
        edge.use_seam = edge.use_edge_sharp = True
    crease = mesh.attributes.new("crease_edge", "FLOAT", "EDGE")
    crease.data.foreach_set("value", [0.5] * len(mesh.edges))
    ob.shape_key_add(name="Basis")
    key = ob.shape_key_add(name="Wide")
    key.value, key.slider_max = 0.25, 2.0
    for point in key.data:
        point.co.x *= 3.0
    return ob


def side_uv(co, face):
    axis = max(range(3), key=lambda k: abs(face.normal[k]))
    number = 2 * axis + (face.normal[axis] > 0)
    a, b = ((axis + 1) % 3, (axis + 2) % 3)
    return co[a] / 4 + 3 * number, co[b] / 4 + 0.5


@pytest.mark.parametrize("replace", [False, True])
def test_uv_maps_shape_keys_and_marks_of_edges_are_carried(replace):
    ob = marked_cube()
    assert quads(target=96, replace=replace) == {"FINISHED"}
    ob = bpy.context.object
    mesh = ob.data
    assert_quads(ob, 96)
    for name in ("First", "Second"):
        uv = uv_of(mesh, name)
        for face in mesh.polygons:
            for loop in face.loop_indices:
                place = mesh.vertices[mesh.loops[loop].vertex_index].co
                assert np.allclose(uv[loop], side_uv(place, face), atol=1e-5)
    assert mesh.uv_layers.active.name == "Second" and mesh.uv_layers["First"].active_render
    on_two = {v.index for v in mesh.vertices if sum(abs(abs(x) - 1) < 1e-5 for x in v.co) > 1}
    crease = mesh.attributes["crease_edge"].data
    for edge in mesh.edges:
        along = set(edge.vertices) <= on_two
        assert edge.use_seam == along and edge.use_edge_sharp == along
        assert crease[edge.index].value == (0.5 if along else 0.0)
    basis, wide = mesh.shape_keys.key_blocks
    assert (wide.name, wide.value, wide.slider_max, wide.relative_key) == ("Wide", 0.25, 2.0, basis)
    for vertex, a, b in zip(mesh.vertices, basis.data, wide.data, strict=True):
        assert np.allclose(a.co, vertex.co) and np.allclose(
            b.co, [3 * vertex.co.x, *vertex.co.yz], atol=1e-6
        )


def test_uv_maps_go_on_beyond_seams():
    bpy.ops.mesh.primitive_cylinder_add(vertices=32, end_fill_type="NOTHING")
    ob = bpy.context.object
    assert quads(target=60, replace=True) == {"FINISHED"}
    uv = uv_of(ob.data, "UVMap")
    # As wide as high everywhere, but for the turn of the surface.
    for face in ob.data.polygons:
        box = np.ptp(uv[list(face.loop_indices)], axis=0)
        places = np.array([ob.data.vertices[v].co for v in face.vertices])
        assert box[1] == pytest.approx(np.ptp(places[:, 2]) / 2, abs=1e-3)
        wide = np.linalg.norm(places[:, :2].max(axis=0) - places[:, :2].min(axis=0))
        assert box[0] == pytest.approx(wide / (2 * np.pi), rel=0.1)


@pytest.mark.parametrize("replace", [False, True])
def test_undo_brings_the_scene_back(replace):
    before = shapes.everything(shapes.cube())
    bpy.ops.ed.undo_push(message="before")
    assert quads(target=54, replace=replace) == {"FINISHED"}
    bpy.ops.ed.undo_push(message="after")
    bpy.ops.ed.undo()
    assert names() == ["Cube"]
    ob = bpy.data.objects["Cube"]
    assert shapes.everything(ob) == before and not ob.hide_get() and ob.select_get()


@pytest.mark.parametrize("field", ["automatic", "curvature", "smooth", "edges", "flow"])
def test_every_field_and_all_selected_objects(field):
    torus = bpy.ops.mesh.primitive_torus_add
    torus()
    torus(location=(5, 0, 0))
    for ob in bpy.data.objects:
        ob.select_set(True)
    assert quads(target=300, field_from=field) == {"FINISHED"}
    made = [ob for ob in bpy.data.objects if "Quads" in ob.name]
    assert len(made) == 2 and set(bpy.context.selected_objects) == set(made)
    for ob in made:
        assert_quads(ob)
        assert abs(len(ob.data.polygons) - 300) <= 15
        assert len(ob.data.vertices) == len(ob.data.polygons)  # a torus still


def test_open_surfaces_and_broken_ones_become_quads():
    ob = shapes.grid(9, bump=0.4)
    assert quads(target=64, replace=True) == {"FINISHED"}
    assert_quads(ob)
    points = [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (0, 0, 1), (0, 0, -1)]
    ob = shapes.add("Book", points, [(0, 1, 2, 3), (0, 1, 4), (0, 1, 5)])
    assert quads(target=50, replace=True) == {"FINISHED"}
    assert_quads(ob)


def refused(ob, words, **options):
    before, objects = shapes.everything(ob), names()
    with pytest.raises(RuntimeError, match=words):
        quads(**options)
    assert shapes.everything(ob) == before and names() == objects
    assert len(bpy.data.meshes) == 1 and not ob.hide_get() and ob.select_get()


BAD = {
    "no faces": [],
    "no number": [(0, 0, 0), (1, 0, 0), (float("nan"), 1, 0)],
}


@pytest.mark.parametrize("replace", [False, True])
@pytest.mark.parametrize("words", BAD)
def test_what_is_refused_is_left_as_it_was(words, replace):
    points = BAD[words]
    ob = shapes.add("Bad", points, [(0, 1, 2)] if points else [])
    refused(ob, words, replace=replace)


def test_objects_that_fail_leave_the_others_their_quads():
    bad = shapes.add("Bad", BAD["no number"], [(0, 1, 2)])
    shapes.grid(6)
    bad.select_set(True)
    assert quads(target=40) == {"FINISHED"}
    assert names() == ["Bad", "Grid", "Grid Quads"] and not bad.hide_get()


def test_esc_leaves_the_scene_as_it_was(part):
    ob = shapes.slow()
    before = shapes.everything(ob)
    task = part("operators.quads").make_task(part("meshes.mesh_io").read(ob, only_selected=False))
    run = part("modal").Run([task])
    assert not run.advance(0.05)
    run.cancel()
    while not run.advance(0.05):
        pass
    run.finish()
    assert run.cancelled and not run.done
    assert names() == ["Grid"] and shapes.everything(ob) == before


def test_hidden_faces_are_not_lost():
    ob = shapes.grid(6)
    ob.data.polygons[0].hide = True
    refused(ob, "some faces are hidden", replace=True)
    assert quads(target=40) == {"FINISHED"}
    assert_quads(bpy.context.object)


def test_it_works_in_object_mode_only():
    shapes.cube()
    shapes.enter("EDIT")
    assert not bpy.ops.uv.flipfree_quads.poll()


def test_the_command_writes_quads(part, tmp_path):
    shapes.cube()
    source, target = tmp_path / "cube.obj", tmp_path / "quads.obj"
    bpy.ops.wm.obj_export(filepath=str(source))
    words = ["quads", str(source), str(target), "--target", "96"]
    assert part("command_line").main(words) == 0
    faces = [line.split()[1:] for line in target.read_text().splitlines() if line[:2] == "f "]
    assert len(faces) == 96 and all(len(face) == 4 for face in faces)
