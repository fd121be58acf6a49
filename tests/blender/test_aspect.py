# SPDX-License-Identifier: GPL-3.0-or-later
"""Correct Aspect: islands keep their shape on textures that are no squares."""

import bpy
import numpy as np
import pytest
import shapes
from layouts import assert_usable, cube_with_seams

import flipfree as ff


def with_image(ob, width, height):
    """A material with that texture, as an artist has it: through a node that is the active one."""
    image = bpy.data.images.new("Texture", width, height)
    material = bpy.data.materials.new("Material")
    compat = __import__("importlib").import_module("bl_ext.user_default.flipfree_uv.compat")
    compat.use_nodes(material)
    node = material.node_tree.nodes.new("ShaderNodeTexImage")
    node.image = image
    material.node_tree.nodes.active = node
    ob.data.materials.append(material)
    return ob


def shape_of(ob):
    """(width / height of the texture that makes each face of a cube a square: one per face)."""
    mesh, uv = ob.data, shapes.uv_of(ob).astype(np.float64)
    found = []
    for face in mesh.polygons:
        corners = uv[face.loop_start : face.loop_start + 4]
        sides = np.roll(corners, -1, axis=0) - corners
        # |(a x, y)| is the same for two sides in turn.
        (x, y), (z, w) = sides[0], sides[1]
        if abs(x * x - z * z) < 1e-9:  # it stands on a corner: any shape
            continue
        found.append(np.sqrt((w * w - y * y) / (x * x - z * z)))
    return np.array(found)


@pytest.mark.parametrize(("width", "height"), [(2048, 1024), (512, 1024), (1920, 1080)])
def test_unwrap_makes_squares_of_a_cube_on_the_texture_of_its_material(width, height, capfd):
    ob = with_image(cube_with_seams(), width, height)
    assert bpy.ops.uv.flipfree_unwrap() == {"FINISHED"}
    found = shape_of(ob)
    assert len(found) and np.allclose(found, width / height, rtol=1e-3)
    assert_usable(ob, of=6)
    said = capfd.readouterr().out
    assert f"for a texture {width / height:.4g} times as wide as high" in said
    assert "distortion mean 1.000" in said


def test_without_an_image_or_with_it_off_the_texture_is_a_square():
    plain = cube_with_seams("Plain")
    assert bpy.ops.uv.flipfree_unwrap() == {"FINISHED"}
    other = with_image(cube_with_seams("Other"), 2048, 1024)
    shapes.activate(other)
    assert bpy.ops.uv.flipfree_unwrap(correct_aspect=False) == {"FINISHED"}
    assert np.array_equal(shapes.uv_of(plain), shapes.uv_of(other))
    assert np.allclose(shape_of(plain), 1.0, rtol=1e-3)


def test_pack_keeps_what_is_right_on_the_texture_and_measures_gaps_in_its_pixels():
    ob = with_image(cube_with_seams(), 2048, 512)
    assert bpy.ops.uv.flipfree_unwrap() == {"FINISHED"}
    assert bpy.ops.uv.flipfree_pack(margin_pixels=16.0, texture_size=2048) == {"FINISHED"}
    assert np.allclose(shape_of(ob), 4.0, rtol=1e-3)
    islands = [island * [2048, 512] for island in assert_usable(ob, of=6)]
    for i, one in enumerate(islands):
        assert one.min() >= 7.9
        assert all(
            np.linalg.norm(one.reshape(-1, 1, 2) - other.reshape(1, -1, 2), axis=2).min() >= 16.0
            for other in islands[:i]
        )


def test_several_tiles_are_squares():
    ob = with_image(cube_with_seams(), 2048, 1024)
    assert bpy.ops.uv.flipfree_unwrap(correct_aspect=False) == {"FINISHED"}
    assert bpy.ops.uv.flipfree_pack(tiles=2) == {"FINISHED"}
    assert np.allclose(shape_of(ob), 1.0, rtol=1e-3)


def test_the_active_node_decides_and_images_without_pixels_do_not(part):
    active = part("aspect").active
    ob = with_image(cube_with_seams(), 2048, 1024)
    assert active(bpy.context) == 2.0
    nodes = ob.active_material.node_tree.nodes
    second = nodes.new("ShaderNodeTexImage")
    second.image = bpy.data.images.new("Second", 100, 400)
    nodes.active = second
    assert active(bpy.context) == 0.25
    second.image.display_aspect = (1.0, 2.0)
    assert active(bpy.context) == 0.125
    second.image = bpy.data.images.new("Strip", 4000, 10)
    assert active(bpy.context) == 1.0
    for node in (second, nodes.active):
        node.image = None
    assert active(bpy.context) == 2.0
    ob.data.materials.clear()
    assert active(bpy.context) == 1.0


def energy_on(ob, aspect):
    """(on that texture, in the unit square)."""
    ob.data.calc_loop_triangles()
    loops = np.array([t.loops[:] for t in ob.data.loop_triangles])
    corners = shapes.corners(ob)[loops]
    vertices = np.array([v.co for v in ob.data.vertices], np.float64)
    uv = shapes.uv_of(ob).astype(np.float64)[loops]
    return [
        ff.certify(vertices, corners.astype(np.int32), uv, aspect=a).energy for a in (aspect, 1.0)
    ]


@pytest.mark.parametrize(("width", "height"), [(2048, 1024), (1080, 1920)])
def test_improve_and_check_are_for_the_texture(width, height, capfd):
    ob = with_image(shapes.grid(8, uv=True), width, height)
    assert bpy.ops.uv.flipfree_unwrap(correct_aspect=False) == {"FINISHED"}
    _, square = energy_on(ob, 1.0)
    assert bpy.ops.uv.flipfree_improve() == {"FINISHED"}
    seen, stretched = energy_on(ob, width / height)
    assert seen == pytest.approx(square, rel=2e-3) and stretched > 1.02 * seen
    capfd.readouterr()
    assert bpy.ops.uv.flipfree_check() == {"FINISHED"}
    said = capfd.readouterr().out
    assert f"distortion mean {seen:.3f}" in said and "times as wide as high" in said
    assert bpy.ops.uv.flipfree_check(correct_aspect=False) == {"FINISHED"}
    said = capfd.readouterr().out
    assert f"distortion mean {stretched:.3f}" in said and "times as wide" not in said


def test_repair_leaves_what_is_right_on_the_texture():
    ob = with_image(shapes.grid(6, uv=True), 2048, 1024)
    assert bpy.ops.uv.flipfree_unwrap() == {"FINISHED"}
    before = shapes.uv_of(ob)
    broken = before.copy()
    broken[:8] = broken[:8][::-1]
    energies = []
    for correct in (False, True):
        shapes.set_uv(ob, broken)
        assert bpy.ops.uv.flipfree_repair(correct_aspect=correct) == {"FINISHED"}
        assert shapes.exact_flips(ob) == 0
        assert np.count_nonzero((shapes.uv_of(ob) == before).all(axis=1)) > len(before) // 2
        energies.append(energy_on(ob, 2.0)[0])
    assert energies[1] < min(energies[0], 1.5)


def test_what_lies_between_pins_has_its_shape_on_the_texture():
    ob = with_image(shapes.grid(8, uv=True), 2048, 1024)
    assert bpy.ops.uv.flipfree_unwrap() == {"FINISHED"}
    before = shapes.uv_of(ob)
    pins = np.array([0, 60, 140])
    shapes.set_pins(ob, pins)
    for call, options in (("match", {}), ("unwrap", {})):
        results = []
        for correct in (False, True):
            shapes.set_uv(ob, before)
            assert getattr(bpy.ops.uv, f"flipfree_{call}")(correct_aspect=correct, **options) == {
                "FINISHED"
            }
            assert np.array_equal(shapes.uv_of(ob)[pins], before[pins]), call
            assert shapes.exact_flips(ob) == 0
            results.append(energy_on(ob, 2.0)[0])
        assert results[1] < results[0], call


def test_the_command_line_takes_the_shape_of_a_texture(part, tmp_path):
    ob = with_image(cube_with_seams(), 2048, 1024)
    line = part("command_line")
    for shape in ("2:1", "image"):
        given = line._parser().parse_args(["unwrap", "in.blend", "out.blend", "--aspect", shape])
        solve = part("command_line.solving").solve
        (ended,) = solve([ob], part("command_line.commands").COMMANDS["unwrap"], given)
        assert ended.failure is None and "times as wide as high" in ended.text
        assert np.allclose(shape_of(ob), 2.0, rtol=1e-3)


def measured(part, ob, what):
    """(values, weights) of what is drawn over an object."""
    state, refresh = part("views.state"), part("views.refresh")
    state.switch(what, True)
    try:
        drawing = refresh._read(ob, ()).drawing
        return drawing.values, drawing.weights
    finally:
        state.switch_all_off()


def test_what_is_drawn_over_an_object_is_what_its_certificate_says(part):
    ob = with_image(cube_with_seams(), 2048, 1024)
    assert bpy.ops.uv.flipfree_unwrap() == {"FINISHED"}
    looks = part("views.refresh")._looks
    for what in ("distortion", "angle"):
        values, weights = measured(part, ob, what)
        assert np.average(values, weights=weights) == pytest.approx(1.0, abs=1e-3)
    # Of 2048 x 1024 pixels on a cube of 24 units of area.
    density, weights = measured(part, ob, "density")
    uv = shapes.uv_of(ob).astype(float)
    x, y = (uv[[list(face.loop_indices) for face in ob.data.polygons]] * [1024, 512]).T
    pixels = abs((x * np.roll(y, -1, axis=0) - y * np.roll(x, -1, axis=0)).sum()) / 2
    assert density == pytest.approx(np.sqrt(pixels / 24), rel=1e-3)
    part("views.state").switch("distortion", True)
    before = looks(ob)
    ob.active_material.node_tree.nodes.active.image.scale(1024, 1024)
    assert looks(ob) != before
    part("views.state").switch_all_off()


def test_faces_are_selected_by_their_distortion_on_the_texture():
    right = with_image(cube_with_seams(), 2048, 1024)
    assert bpy.ops.uv.flipfree_unwrap() == {"FINISHED"}
    uv = shapes.uv_of(right)
    face = right.data.polygons[3]
    loops = slice(face.loop_start, face.loop_start + 4)
    uv[loops, 0] = uv[loops, 0].mean() + (uv[loops, 0] - uv[loops, 0].mean()) * 0.5
    shapes.set_uv(right, uv)
    assert bpy.ops.uv.flipfree_select_faces(what="sheared", share=10.0) == {"FINISHED"}
    bpy.ops.object.mode_set(mode="OBJECT")
    assert [face.index for face in right.data.polygons if face.select] == [3]


def test_islands_keep_their_shape_while_they_are_oriented():
    ob = with_image(cube_with_seams(), 2048, 1024)
    assert bpy.ops.uv.flipfree_unwrap() == {"FINISHED"}
    c, s = np.cos(0.4), np.sin(0.4)
    seen = (shapes.uv_of(ob) * [2.0, 1.0]) @ np.array([[c, s], [-s, c]])
    shapes.set_uv(ob, seen / [2.0, 1.0] * 0.5)
    before = shape_of(ob)
    assert np.allclose(before, 2.0, rtol=1e-3)
    assert bpy.ops.uv.flipfree_orient() == {"FINISHED"}
    seen = shapes.uv_of(ob).astype(float) * [2.0, 1.0]
    for face in ob.data.polygons:  # squares, and level ones
        sides = np.diff(seen[[*face.loop_indices, face.loop_start]], axis=0)
        lengths = np.linalg.norm(sides, axis=1)
        assert np.allclose(lengths, lengths[0], rtol=1e-3)
        assert np.allclose(abs(sides).min(axis=1), 0.0, atol=1e-4 * lengths[0])


def test_densities_are_in_pixels_of_the_texture(part, capfd):
    ob = with_image(cube_with_seams(), 2048, 1024)
    assert bpy.ops.uv.flipfree_unwrap() == {"FINISHED"}
    assert bpy.ops.uv.flipfree_set_density(density=100.0, texture_size=2048) == {"FINISHED"}
    for face in ob.data.polygons:  # of 2 x 2 units: 200 pixels to a side
        pixels = shapes.uv_of(ob)[list(face.loop_indices)].astype(float) * [2048, 1024]
        sides = np.linalg.norm(pixels - np.roll(pixels, 1, axis=0), axis=1)
        assert np.allclose(sides, 200.0, rtol=1e-3)
    assert bpy.ops.uv.flipfree_get_density(texture_size=2048) == {"FINISHED"}
    assert "100 px per unit" in capfd.readouterr().out
