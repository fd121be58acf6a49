# SPDX-License-Identifier: GPL-3.0-or-later
"""Pack Islands (Nested): gaps in pixels on what is stored, all options, what stays."""

import json

import bpy
import numpy as np
import pytest
import shapes
from layouts import assert_usable, both, cube_with_seams, cylinder_with_seams, islands
from test_cli import command

from judges.gaps import area, narrowest


def pack(**options):
    assert bpy.ops.uv.flipfree_pack(**options) == {"FINISHED"}


def two_objects():
    objects = both(cube_with_seams("First"), cylinder_with_seams())
    assert bpy.ops.uv.flipfree_unwrap() == {"FINISHED"}
    return objects


def mapped_cube():
    ob = cube_with_seams()
    assert bpy.ops.uv.flipfree_unwrap() == {"FINISHED"}
    return ob


@pytest.mark.parametrize(("pixels", "size"), [(2.0, 1024), (8.0, 512)])
def test_islands_of_all_objects_are_so_many_pixels_apart(pixels, size):
    objects = two_objects()
    pack(margin_pixels=pixels, texture_size=size)
    found = assert_usable(*objects, of=9)
    assert narrowest(found, 2 * pixels / size).distance >= pixels / size
    for one in found:
        assert one.min() >= 0.5 * pixels / size and one.max() <= 1.0 - 0.5 * pixels / size


def test_a_larger_effort_is_no_looser_and_the_fill_is_reported(capfd):
    objects = two_objects()
    fills = []
    for effort in (0.0, 1.0):
        pack(effort=effort)
        fills.append(sum(area(island) for island in islands(*objects)))
        lines = [text for text in capfd.readouterr().out.splitlines() if "% filled" in text]
        assert f"{100 * fills[-1]:.0f} % filled" in lines[-1]
    assert fills[1] >= fills[0]


def test_sizes_are_kept_among_objects_on_request():
    first, second = two_objects()
    shapes.set_uv(second, 0.25 * shapes.uv_of(second))
    before = [sum(map(area, islands(ob))) for ob in (first, second)]
    pack(same_density=False)
    after = [sum(map(area, islands(ob))) for ob in (first, second)]
    assert after[1] / after[0] == pytest.approx(before[1] / before[0], rel=1e-4)


def test_islands_are_not_turned_where_they_may_not_be():
    ob = mapped_cube()
    before = shapes.uv_of(ob).astype(float)
    pack(rotation="none")
    after = shapes.uv_of(ob).astype(float)
    for face in ob.data.polygons:
        a, b = face.loop_indices[0], face.loop_indices[1]
        was, now = before[b] - before[a], after[b] - after[a]
        assert np.abs(was / np.linalg.norm(was) - now / np.linalg.norm(now)).max() < 1e-4


def test_similar_islands_are_stacked_on_request():
    ob = mapped_cube()
    pack(stack_similar=True)
    uv = shapes.uv_of(ob).astype(float)
    assert np.ptp(uv, axis=0).min() > 0.9
    sides = [
        np.linalg.norm(uv[p.loop_indices[1]] - uv[p.loop_indices[0]]) for p in ob.data.polygons
    ]
    assert min(sides) > 0.9


def test_mirror_images_are_stacked_on_request(capfd):
    kite = np.float32([[0, 0], [3, 0], [3, 1], [1, 2]]) / 10
    points = [(x + 9 * i, y, 0) for i in range(2) for x, y in 10 * kite * [1 - 2 * i, 1]]
    ob = shapes.add("Kites", points, [(0, 1, 2, 3), (7, 6, 5, 4)], uv=True)
    shapes.flat(ob)
    pack(stack_similar=True)
    assert "stacked" not in capfd.readouterr().out
    for _ in range(2):  # what is mirrored already, too
        pack(stack_similar=True, stack_mirrored=True)
        assert "1 island is mirrored" in capfd.readouterr().out
        uv = shapes.uv_of(ob)
        assert np.abs(uv[:4] - uv[:3:-1]).max() < 1e-5


def test_the_tile_is_the_one_that_is_asked_for():
    ob = mapped_cube()
    pack(tile=1012)
    uv = shapes.uv_of(ob).astype(float) - [1.0, 1.0]
    assert uv.min() > 0.0 and uv.max() < 1.0


def test_islands_are_spread_over_tiles():
    ob = mapped_cube()
    pack(tile=1002, tiles=3)
    islands = shapes.uv_of(ob).astype(float).reshape(-1, 4, 2)
    assert {int(island[0, 0]) for island in islands} == {1, 2, 3}
    assert (np.floor(islands) == np.floor(islands[:, :1])).all()


def tiles_of(ob):
    corners = np.floor(shapes.uv_of(ob).astype(float).reshape(-1, 4, 2))
    assert (corners == corners[:, :1]).all()
    return [int(x + 10 * y) for x, y in corners[:, 0]]


def test_groups_have_a_layout_and_a_tile_of_their_own(capfd, part):
    first, second = both(cube_with_seams("First"), cube_with_seams("Second"))
    for ob, names in ((first, ("Wood", "Steel")), (second, ("Steel", "Brass"))):
        for name in names:
            ob.data.materials.append(bpy.data.materials.get(name) or bpy.data.materials.new(name))
        for face in ob.data.polygons:
            face.material_index = int(face.index < 2)
    assert bpy.ops.uv.flipfree_unwrap() == {"FINISHED"}
    pack(group_by="material", tile=1002)
    assert tiles_of(first) == [2, 2, 3, 3, 3, 3], "Steel, Wood after Brass"
    assert tiles_of(second) == [1, 1, 2, 2, 2, 2]
    assert "in 3 tiles" in capfd.readouterr().out
    assert narrowest(islands(first, second), 0.01).distance >= 4 / 1024
    pack(group_by="object", share_tile=True)
    assert set(tiles_of(first)) == set(tiles_of(second)) == {0}
    for ob in (first, second):
        assert sum(area(island) for island in assert_usable(ob, of=6)) > 0.6
        guide = part("ui.guide")
        bpy.context.view_layer.objects.active = ob
        assert guide.step(bpy.context).colour == "GREEN"
    other = bpy.data.collections.new("A")
    bpy.context.scene.collection.children.link(other)
    for collection in second.users_collection:
        collection.objects.unlink(second)
    other.objects.link(second)
    second.select_set(True)
    pack(group_by="collection", tiles=4)
    assert set(tiles_of(second)) == {0} and set(tiles_of(first)) == {1}


@pytest.fixture
def scene():
    yield bpy.context.scene
    bpy.context.scene.flipfree_texture = "1024"


@pytest.mark.parametrize("call", ["unwrap", "pack", "cut_stretched", "rectify"])
def test_the_scene_says_the_margin_and_the_texture_of_all_operators(call, scene):
    assert scene.flipfree_texture == "1024" and scene.flipfree_margin_pixels == 4.0
    scene.flipfree_texture = "512"
    assert (scene.flipfree_texture_size, scene.flipfree_margin_pixels) == (512, 2.0)
    scene.flipfree_margin_pixels = 16.0
    assert scene.flipfree_texture == "custom"
    ob = mapped_cube() if call != "cut_stretched" else stretched_cube()
    assert getattr(bpy.ops.uv, f"flipfree_{call}")() == {"FINISHED"}
    gap = narrowest(islands(ob), 0.1).distance * 512
    assert 16.0 <= gap < 16.0 + 512 / 384  # a cell of the coarsest grid that islands are packed on
    pack(margin_pixels=4.0)
    assert 4.0 <= narrowest(islands(ob), 0.1).distance * 512 < 5.0


def stretched_cube():
    ob = mapped_cube()
    shapes.set_uv(ob, shapes.uv_of(ob) * np.float32([0.2, 1.0]))
    return ob


def test_what_is_not_selected_stays_and_is_kept_clear_of():
    ob = mapped_cube()
    before = shapes.uv_of(ob).copy()
    bpy.ops.object.mode_set(mode="EDIT")
    shapes.select_faces(ob, [face for face in range(6) if face != 3])
    pack()
    bpy.ops.object.mode_set(mode="OBJECT")
    loops = list(ob.data.polygons[3].loop_indices)
    assert np.array_equal(shapes.uv_of(ob)[loops], before[loops])
    assert narrowest(islands(ob), 4 / 1024).distance >= 2 / 1024


def test_the_command_packs_and_writes_the_fill(tmp_path):
    two_objects()
    source, out, report = (tmp_path / name for name in ("in.blend", "out.blend", "report.json"))
    bpy.ops.wm.save_as_mainfile(filepath=str(source))
    options = ["--margin-pixels", "4", "--texture-size", "512", "--rotation", "quarters"]
    result = command("pack", source, out, *options, "--json", report)
    assert result.returncode == 0, result.stdout + result.stderr
    records = json.loads(report.read_text())
    assert len(records) == 2 and all(r["ok"] and 0.3 < r["fill"] < 1.0 for r in records)
