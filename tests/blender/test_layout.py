# SPDX-License-Identifier: GPL-3.0-or-later
"""Where the islands go: one scale and one layout for a run, clear of what stays; judged by code that shares nothing with it."""

import re

import bpy
import numpy as np
import pytest
import shapes
from layouts import (
    assert_usable,
    both,
    cube_with_seams,
    cylinder_with_seams,
    densities,
    islands,
)

from judges.gaps import narrowest

pytestmark = pytest.mark.halved


def unwrap(**options):
    """Along marked seams, and no others that are not needed."""
    assert bpy.ops.uv.flipfree_unwrap(**{"seams": "given"} | options) == {"FINISHED"}


def spread(*objects):
    """Of the densities of their islands."""
    found = densities(*objects)
    return found.max() / found.min()


def two_cubes():
    return both(cube_with_seams("First"), cube_with_seams("Second"))


def mapped_cube():
    ob = cube_with_seams()
    unwrap()
    return ob, shapes.uv_of(ob)


@pytest.mark.parametrize("mode", ["OBJECT", "EDIT"])
def test_objects_of_one_run_share_one_layout(mode):
    first, second = cube_with_seams("First"), cylinder_with_seams()
    third = shapes.grid(6, "Third", uv=True)
    for ob in (first, second, third):
        shapes.activate(ob, only=False)
    shapes.enter(mode)
    unwrap()
    bpy.ops.object.mode_set(mode="OBJECT")
    assert_usable(first, second, third, of=6 + 3 + 1)
    assert spread(first, second, third) < 1.0 + 1e-4
    assert all(shapes.exact_flips(ob) == 0 for ob in (first, second, third))


def test_one_object_that_fails_leaves_the_others_in_one_layout(capfd):
    first, second = cube_with_seams("First"), cylinder_with_seams()
    bad = shapes.add("Bad", [(0, 0, 0), (1, 0, 0), (1, 1, 0)], [(0, 1, 2)], uv=True)
    bad.data.vertices[2].co.x = float("nan")
    for ob in (first, second, bad):
        shapes.activate(ob, only=False)
    before = shapes.everything(bad)
    unwrap()
    assert "Bad: vertex 2 has a coordinate that is no number" in capfd.readouterr().out
    assert_usable(first, second, of=9)
    assert shapes.everything(bad) == before


def test_an_object_too_small_beside_the_others_is_enlarged(capfd):
    """Beside a sheet 30 million times as wide 32 bits would hold a dense one as a point."""
    wide = shapes.grid(1, "Wide", bump=0.0, uv=True)
    wide.scale = (3e7, 3e7, 3e7)
    dense = shapes.grid(60, "Dense", bump=0.5, uv=True)
    bpy.context.view_layer.update()
    shapes.activate(wide, only=False)
    unwrap()
    assert "1 too small for 32 bits enlarged" in capfd.readouterr().out
    for ob in (wide, dense):
        assert_usable(ob, of=1)
        assert shapes.exact_flips(ob) == 0


def test_unselected_islands_are_avoided():
    ob = cylinder_with_seams()
    unwrap()
    uv = shapes.uv_of(ob)
    caps = np.array([len(p.vertices) > 4 for p in ob.data.polygons])
    loop_caps = np.repeat(caps, [len(p.vertices) for p in ob.data.polygons])
    uv[loop_caps] = uv[loop_caps] * np.float32(0.7) + np.float32(0.2)  # somewhere in the middle
    shapes.set_uv(ob, uv)
    kept = shapes.uv_of(ob)[loop_caps].tobytes()
    bpy.ops.object.mode_set(mode="EDIT")
    shapes.select_faces(ob, np.flatnonzero(~caps).tolist())
    unwrap()
    bpy.ops.object.mode_set(mode="OBJECT")
    assert shapes.uv_of(ob)[loop_caps].tobytes() == kept
    found = shapes.triangles_of(ob)[1].astype(float)
    above = caps[shapes.face_of_triangles(ob)]
    assert found[~above].min() >= 0.0 and found[~above].max() <= 1.0
    assert narrowest([found[~above], found[above]], 1e-3).distance > 0.0


def test_islands_of_edited_meshes_without_a_selected_face_are_avoided():
    first, second = two_cubes()
    unwrap()
    shapes.set_uv(second, shapes.uv_of(second) * np.float32(0.5))
    kept = shapes.uv_of(second).tobytes()
    bpy.ops.object.mode_set(mode="EDIT")
    bpy.ops.mesh.select_all(action="DESELECT")
    bpy.context.view_layer.objects.active = first
    shapes.select_faces(first, range(6))
    unwrap()
    bpy.ops.object.mode_set(mode="OBJECT")
    assert shapes.uv_of(second).tobytes() == kept
    assert_usable(first, second, of=12)


def test_faces_that_were_never_laid_out_are_no_obstacle():
    """A new UV map has every face fill the whole square."""
    ob = shapes.grid(6, uv=True)
    square = np.array([[0, 0], [1, 0], [1, 1], [0, 1]], np.float32)
    shapes.set_uv(ob, np.tile(square, (36, 1)))
    bpy.ops.object.mode_set(mode="EDIT")
    shapes.select_faces(ob, range(18))
    unwrap()
    bpy.ops.object.mode_set(mode="OBJECT")
    chosen = shapes.uv_of(ob)[: 18 * 4]
    assert chosen.min() >= 0.0 and chosen.max() <= 1.0


def test_without_room_beside_the_others_the_next_tile_is_taken(capfd):
    ob = shapes.grid(6, uv=True)
    # The unselected half of the sheet fills the square.
    shapes.set_uv(ob, (shapes.plane(ob) + 1) * [3.0, 0.5] - [3.0, 0.0])
    bpy.ops.object.mode_set(mode="EDIT")
    shapes.select_faces(ob, range(18))  # of x < 0
    unwrap()
    bpy.ops.object.mode_set(mode="OBJECT")
    after = shapes.uv_of(ob)[: 18 * 4]
    assert after[:, 0].min() >= 3.0 and after[:, 0].max() <= 4.0
    assert "tile 1004" in capfd.readouterr().out


def test_keep_placement_keeps_what_is_usable_at_one_scale():
    ob, before = mapped_cube()
    # The same layout upside down, in a corner of the square.
    shapes.set_uv(ob, np.float32(0.9) - before * np.float32(0.4))
    moved = shapes.uv_of(ob)
    unwrap(keep_placement=True)
    assert np.abs(shapes.uv_of(ob) - moved).max() < 1e-3
    assert_usable(ob, of=6)
    unwrap()
    assert np.abs(shapes.uv_of(ob) - moved).max() > 0.1, "only on request"
    assert_usable(ob, of=6)


def onto_the_second(uv):
    uv[:4] += uv[4:8].mean(axis=0) - uv[:4].mean(axis=0)
    return uv


@pytest.mark.parametrize("spoil", [onto_the_second, lambda uv: uv + np.float32(0.5)])
def test_keep_placement_packs_what_is_not_usable(spoil, capfd):
    ob, uv = mapped_cube()
    shapes.set_uv(ob, spoil(uv))
    unwrap(keep_placement=True)
    assert_usable(ob, of=6)
    assert "packed, as old places were" in capfd.readouterr().out


def test_keep_placement_looks_at_all_objects_of_the_run():
    first, second = two_cubes()
    unwrap()
    apart = [shapes.uv_of(first), shapes.uv_of(second)]
    unwrap(keep_placement=True)
    for ob, before in zip((first, second), apart, strict=True):
        assert np.abs(shapes.uv_of(ob) - before).max() < 1e-3
    shapes.set_uv(second, apart[0])  # each by itself is usable, both together are not
    unwrap(keep_placement=True)
    assert_usable(first, second, of=12)


def test_keep_placement_gives_way_to_unselected_islands():
    ob, uv = mapped_cube()
    shapes.set_uv(ob, onto_the_second(uv))
    bpy.ops.object.mode_set(mode="EDIT")
    shapes.select_faces(ob, [0])
    unwrap(keep_placement=True)
    bpy.ops.object.mode_set(mode="OBJECT")
    assert shapes.uv_of(ob)[4:].tobytes() == uv[4:].tobytes()
    assert_usable(ob, of=6)


@pytest.mark.parametrize("others", [0, 1])
def test_pinned_islands_stay_and_give_the_scale(others):
    ob, uv = mapped_cube()
    uv *= np.float32(0.5)
    shapes.set_uv(ob, uv)
    shapes.set_pins(ob, np.arange(8, 12))
    objects = both(ob, cube_with_seams("Other")) if others else (ob,)
    unwrap()
    assert shapes.uv_of(ob)[8:12].tobytes() == uv[8:12].tobytes()
    assert_usable(*objects, of=6 * len(objects))
    assert spread(*objects) < 1.0 + 1e-4


def test_improve_names_the_cure_where_islands_come_to_lie_on_each_other(capfd):
    ob, uv = mapped_cube()
    uv[4:8] = uv[:4]  # the second face's island onto that of the first
    shapes.set_uv(ob, uv)
    assert bpy.ops.uv.flipfree_improve() == {"FINISHED"}
    assert "1 pair of islands overlaps" in (said := capfd.readouterr().out)
    assert "'Pack Islands' keeps islands apart" in said
    assert bpy.ops.uv.flipfree_improve(pack=True) == {"FINISHED"}
    assert "keeps islands apart" not in capfd.readouterr().out


UNEVEN = (10.0, 1.0, 1.0)


@pytest.mark.parametrize("scale", [(3.0,) * 3, UNEVEN, (1.0, 1.0, 0.01), (-3.0, 2.0, 1.0)])
def test_scaled_objects_and_others_have_one_density_in_the_scene(scale):
    cube, beam = both(cube_with_seams("Cube"), cube_with_seams("Beam", scale))
    unwrap()
    assert spread(cube, beam) < 1.0 + 1e-4
    assert_usable(cube, beam, of=12)
    assert bpy.ops.uv.flipfree_set_density(density=64.0, texture_size=1024) == {"FINISHED"}
    assert 1024 * densities(cube, beam) == pytest.approx([64.0] * 12, rel=1e-4)


def test_a_flat_sheet_without_height_in_the_scene_has_a_density():
    ob = shapes.grid(4, bump=0.0)
    ob.scale = (2.0, 2.0, 0.0)
    bpy.context.view_layer.update()
    unwrap()
    assert bpy.ops.uv.flipfree_set_density(density=64.0, texture_size=1024) == {"FINISHED"}
    assert 1024 * densities(ob) == pytest.approx([64.0], rel=1e-4)


@pytest.mark.parametrize(
    "scale",
    [(0.0, 0.0, 0.0), (0.0, 1.0, 1.0), (-1.0, 1.0, 1.0), (1e-20, 1e-20, 1e-20), (1e20, 1.0, 1.0)],
)
def test_an_object_that_the_scene_scales_away_is_mapped_as_its_mesh_is(scale):
    ob = cube_with_seams("Cube", scale)
    unwrap()
    for operator in ("check", "pack", "improve", "orient", "get_density"):
        assert getattr(bpy.ops.uv, f"flipfree_{operator}")() == {"FINISHED"}, operator
    assert shapes.exact_flips(ob) == 0


def test_with_eight_uv_maps_the_active_one_is_written_and_no_other():
    ob = shapes.grid(4, uv=True)
    layers = ob.data.uv_layers
    while len(layers) < 8:
        layers.new(name=f"Map {len(layers)}")
    layers.active = layers[5]
    before = {name: shapes.uv_of(ob, name).tobytes() for name in layers.keys()}
    unwrap()
    bpy.ops.uv.flipfree_pack()
    after = {name: shapes.uv_of(ob, name).tobytes() for name in ob.data.uv_layers.keys()}
    assert [name for name in before if before[name] != after[name]] == [ob.data.uv_layers[5].name]
    assert shapes.exact_flips(ob) == 0


@pytest.mark.parametrize("scale, warned", [(UNEVEN, True), ((2.0, 2.0, 2.0), False)])
@pytest.mark.parametrize("operator", ["unwrap", "conformal", "seamless"])
def test_an_uneven_scale_is_warned_of(capfd, operator, scale, warned):
    ob = shapes.grid(4, "Sheet")
    ob.scale, ob.rotation_euler = scale, (0.3, 0.2, 0.1)
    bpy.context.view_layer.update()
    assert getattr(bpy.ops.uv, f"flipfree_{operator}")() == {"FINISHED"}
    line = "Warning: .*Sheet has a non-uniform scale: apply it"
    assert bool(re.search(line, capfd.readouterr().out)) == warned


def sheets_of_two_sizes():
    """A sheet, and one of twice its size, each an object."""
    small = shapes.grid(4, "Small", bump=0.2)
    large = shapes.grid(4, "Large", bump=0.2, x=4.0)
    large.scale = (2.0, 2.0, 2.0)
    bpy.context.view_layer.update()
    small.select_set(True)
    return small, large


@pytest.mark.parametrize("name", ["unwrap", "conformal"])
def test_objects_of_a_run_are_one_layout_at_one_density_beside_each_other(name, capfd):
    objects = sheets_of_two_sizes()
    assert getattr(bpy.ops.uv, f"flipfree_{name}")() == {"FINISHED"}
    assert spread(*objects) < 1.01
    (a, b), (c, d) = ((uv.min((0, 1)), uv.max((0, 1))) for uv in islands(*objects))
    assert (b <= c).any() or (d <= a).any(), "boxes do not meet"
    assert min(a.min(), c.min()) >= 0.0 and max(b.max(), d.max()) <= 1.0
    assert "different objects" not in capfd.readouterr().out


def test_objects_on_each_other_are_counted_by_check_and_by_maps_that_are_not_packed(capfd):
    objects = sheets_of_two_sizes()
    for ob in objects:
        ob.data.uv_layers.new(name="UVMap")
        at = shapes.plane(ob)
        shapes.set_uv(ob, (at - at.min(axis=0)) / 4)
    text = "1 pair of islands of different objects on each other"
    for call in (
        bpy.ops.uv.flipfree_check,
        lambda: bpy.ops.uv.flipfree_conformal(pack=False),
        bpy.ops.uv.flipfree_improve,
        bpy.ops.uv.flipfree_repair,
    ):
        assert call() == {"FINISHED"}
        assert text in capfd.readouterr().out
    large = objects[1]
    shapes.set_uv(large, shapes.uv_of(large) + np.float32(5.0))
    assert bpy.ops.uv.flipfree_check() == {"FINISHED"}
    assert "different objects" not in capfd.readouterr().out


def test_islands_of_several_objects_are_packed_once(part, monkeypatch):
    """A search for a dense layout of each object's own took most of the time of a scene of many small ones."""
    solver = part("solver")
    efforts, unwrapped = [], solver.unwrap

    def unwrap_and_tell(*arguments, **options):
        efforts.append(options["effort"])
        return unwrapped(*arguments, **options)

    monkeypatch.setattr(solver, "unwrap", unwrap_and_tell)
    objects = [shapes.grid(2, f"Sheet{i}", x=3.0 * i) for i in range(3)]
    unwrap()
    assert efforts.pop() == solver.QUICK_PACKING and not efforts, "one object packs for itself"
    for ob in objects:
        ob.select_set(True)
    unwrap()
    assert efforts == [0.0] * 3
