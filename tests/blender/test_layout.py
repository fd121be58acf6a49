# SPDX-License-Identifier: GPL-3.0-or-later
"""Where the islands go: one scale and one layout for a run, clear of what stays; judged by code that shares nothing with it."""

import re

import bpy
import numpy as np
import pytest
import shapes

pytestmark = pytest.mark.halved


def unwrap(**options):
    """Along marked seams, and no others that are not needed."""
    assert bpy.ops.uv.flipfree_unwrap(**{"seams": "given"} | options) == {"FINISHED"}


def triangles_of(ob):
    """(loops (m, 3), UVs (m, 3, 2) float64) of the object's triangles."""
    mesh = ob.data
    mesh.calc_loop_triangles()
    loops = np.array([t.loops for t in mesh.loop_triangles])
    return loops, shapes.uv_of(ob).astype(np.float64)[loops]


def islands_of(ob):
    """UV triangles (k, 3, 2) of each island: triangles that share an edge and its two UVs."""
    loops, uv = triangles_of(ob)
    vertex = np.array([loop.vertex_index for loop in ob.data.loops])
    parent = list(range(len(loops)))

    def find(i):
        while parent[i] != i:
            i = parent[i]
        return i

    seen = {}
    for t in range(len(loops)):
        for k in range(3):
            ends = [(int(vertex[loops[t, e]]), uv[t, e].tobytes()) for e in (k, (k + 1) % 3)]
            other = seen.setdefault(frozenset(ends), t)
            parent[find(t)] = find(other)
    roots = np.array([find(t) for t in range(len(loops))])
    return [np.flatnonzero(roots == root) for root in np.unique(roots)]


def area(uv):
    a, b = uv[:, 1] - uv[:, 0], uv[:, 2] - uv[:, 0]
    return float(np.abs(a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]).sum() / 2)


def density(ob, triangles, size=1.0):
    """Length in UV space per length of the surface."""
    loops, uv = triangles_of(ob)
    mesh = ob.data
    at = np.array([mesh.vertices[mesh.loops[i].vertex_index].co for i in loops[triangles].ravel()])
    at = at.reshape(-1, 3, 3) * size
    surface = np.linalg.norm(np.cross(at[:, 1] - at[:, 0], at[:, 2] - at[:, 0]), axis=1).sum() / 2
    return float(np.sqrt(area(uv[triangles]) / surface))


def overlapping(first, second):
    """Whether two sets of UV triangles share a point: some pair is separated by none of its six sides."""

    def sides(uv):
        ahead = np.roll(uv, -1, axis=1) - uv
        return np.stack([-ahead[..., 1], ahead[..., 0]], -1)

    for t in first:
        box = (second.min(1) <= t.max(0)).all(1) & (second.max(1) >= t.min(0)).all(1)
        for s in second[box]:
            normals = np.concatenate([sides(t[None])[0], sides(s[None])[0]])
            a, b = normals @ t.T, normals @ s.T
            if not ((a.max(1) < b.min(1)) | (b.max(1) < a.min(1))).any():
                return True
    return False


def everything(*objects):
    """All islands of these objects, as UV triangles."""
    return [triangles_of(ob)[1][island] for ob in objects for island in islands_of(ob)]


def assert_usable(*objects):
    """Nothing outside the unit square, nothing on top of anything."""
    found = everything(*objects)
    for i, one in enumerate(found):
        assert one.min() >= 0.0 and one.max() <= 1.0
        assert not any(overlapping(one, other) for other in found[:i])
    return found


def cylinder_with_seams():
    """A cylinder with caps, cut along both rims and one line down its side; its UVs are Blender's own."""
    bpy.ops.mesh.primitive_cylinder_add(vertices=32, radius=1.0, depth=2.0)
    ob = bpy.context.object
    mesh = ob.data
    z = [v.co.z for v in mesh.vertices]
    upright = [e for e in mesh.edges if z[e.vertices[0]] != z[e.vertices[1]]]
    for edge in mesh.edges:
        edge.use_seam = z[edge.vertices[0]] == z[edge.vertices[1]]
    upright[0].use_seam = True
    return ob


def cube_with_seams(name="Cube"):
    bpy.ops.mesh.primitive_cube_add()
    ob = bpy.context.object
    ob.name = name
    for edge in ob.data.edges:
        edge.use_seam = True
    return ob


def test_a_cylinder_with_its_three_seams_is_three_islands_at_one_scale(capfd):
    ob = cylinder_with_seams()
    unwrap()
    assert len(assert_usable(ob)) == 3
    scales = [density(ob, island) for island in islands_of(ob)]
    assert max(scales) / min(scales) < 1.0 + 1e-4
    line = next(text for text in capfd.readouterr().out.splitlines() if "distortion" in text)
    assert float(line.split("distortion mean ")[1].split()[0]) == pytest.approx(1.0, abs=1e-3)


def test_a_cube_with_seams_is_six_squares_of_one_size():
    ob = cube_with_seams()
    unwrap()
    assert len(assert_usable(ob)) == 6
    scales = [density(ob, island) for island in islands_of(ob)]
    assert max(scales) / min(scales) < 1.0 + 1e-5
    assert min(scales) * 2 > 0.3, "six squares fill more than half of the square"


@pytest.mark.parametrize("mode", ["OBJECT", "EDIT"])
def test_objects_of_one_run_share_one_layout(mode):
    first, second = cube_with_seams("First"), cylinder_with_seams()
    third = shapes.grid(6, "Third", uv=True)
    for ob in (first, second, third):
        shapes.activate(ob, only=False)
    if mode == "EDIT":
        bpy.ops.object.mode_set(mode="EDIT")
        bpy.ops.mesh.select_all(action="SELECT")
    unwrap()
    bpy.ops.object.mode_set(mode="OBJECT")
    assert len(assert_usable(first, second, third)) == 6 + 3 + 1
    scales = [density(ob, island) for ob in (first, second, third) for island in islands_of(ob)]
    assert max(scales) / min(scales) < 1.0 + 1e-4
    assert all(shapes.exact_flips(ob) == 0 for ob in (first, second, third))


def test_scaled_objects_count_with_their_size_in_the_scene():
    small, large = cube_with_seams("Small"), cube_with_seams("Large")
    large.scale = (3.0, 3.0, 3.0)
    bpy.context.view_layer.update()
    shapes.activate(small, only=False)
    unwrap()
    assert_usable(small, large)
    assert density(large, islands_of(large)[0]) == pytest.approx(
        3.0 * density(small, islands_of(small)[0]), rel=1e-4
    )


def test_one_object_that_fails_leaves_the_others_in_one_layout():
    first, second = cube_with_seams("First"), cylinder_with_seams()
    bad = shapes.add("Bad", [(0, 0, 0), (1, 0, 0), (1, 1, 0)], [(0, 1, 2)], uv=True)
    bad.data.vertices[2].co.x = float("nan")
    for ob in (first, second, bad):
        shapes.activate(ob, only=False)
    before = shapes.uv_of(bad).tobytes()
    unwrap()
    assert len(assert_usable(first, second)) == 9
    assert shapes.uv_of(bad).tobytes() == before


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
        assert len(assert_usable(ob)) == 1 and shapes.exact_flips(ob) == 0


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
    loops, found = triangles_of(ob)
    sides = found[~loop_caps[loops[:, 0]]]
    assert sides.min() >= 0.0 and sides.max() <= 1.0
    assert not overlapping(sides, found[loop_caps[loops[:, 0]]])


def test_islands_of_edited_meshes_without_a_selected_face_are_avoided():
    first, second = cube_with_seams("First"), cube_with_seams("Second")
    shapes.activate(first, only=False)
    unwrap()
    uv = shapes.uv_of(second)
    shapes.set_uv(second, uv * np.float32(0.5))
    kept = shapes.uv_of(second).tobytes()
    bpy.ops.object.mode_set(mode="EDIT")
    bpy.ops.mesh.select_all(action="DESELECT")
    bpy.context.view_layer.objects.active = first
    shapes.select_faces(first, range(6))
    unwrap()
    bpy.ops.object.mode_set(mode="OBJECT")
    assert shapes.uv_of(second).tobytes() == kept
    assert len(assert_usable(first, second)) == 12


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
    uv = np.array([ob.data.vertices[loop.vertex_index].co[:2] for loop in ob.data.loops])
    uv[:, 0] = (uv[:, 0] + 1) * 3.0 - 3.0  # the unselected half of the sheet fills the square
    uv[:, 1] = (uv[:, 1] + 1) * 0.5
    shapes.set_uv(ob, uv)
    bpy.ops.object.mode_set(mode="EDIT")
    shapes.select_faces(ob, range(18))  # of x < 0
    unwrap()
    bpy.ops.object.mode_set(mode="OBJECT")
    after = shapes.uv_of(ob)[: 18 * 4]
    assert after[:, 0].min() >= 3.0 and after[:, 0].max() <= 4.0
    assert "tile 1004" in capfd.readouterr().out


def test_keep_placement_keeps_what_is_usable_at_one_scale():
    ob = cube_with_seams()
    unwrap()
    before = shapes.uv_of(ob)
    # The same layout upside down, in a corner of the square.
    shapes.set_uv(ob, np.float32(0.9) - before * np.float32(0.4))
    moved = shapes.uv_of(ob)
    unwrap(keep_placement=True)
    assert np.abs(shapes.uv_of(ob) - moved).max() < 1e-3
    assert_usable(ob)
    unwrap()
    assert np.abs(shapes.uv_of(ob) - moved).max() > 0.1, "only on request"
    assert_usable(ob)


@pytest.mark.parametrize("fault", ["overlap", "outside"])
def test_keep_placement_packs_what_is_not_usable(fault, capfd):
    ob = cube_with_seams()
    unwrap()
    uv = shapes.uv_of(ob)
    if fault == "overlap":
        uv[:4] += uv[4:8].mean(axis=0) - uv[:4].mean(axis=0)
    else:
        uv += np.float32(0.5)
    shapes.set_uv(ob, uv)
    unwrap(keep_placement=True)
    assert len(assert_usable(ob)) == 6
    assert "packed, as old places were" in capfd.readouterr().out


def test_keep_placement_looks_at_all_objects_of_the_run():
    first, second = cube_with_seams("First"), cube_with_seams("Second")
    shapes.activate(first, only=False)
    unwrap()
    apart = [shapes.uv_of(first), shapes.uv_of(second)]
    unwrap(keep_placement=True)
    for ob, before in zip((first, second), apart, strict=True):
        assert np.abs(shapes.uv_of(ob) - before).max() < 1e-3
    shapes.set_uv(second, apart[0])  # each by itself is usable, both together are not
    unwrap(keep_placement=True)
    assert len(assert_usable(first, second)) == 12


def test_keep_placement_gives_way_to_unselected_islands():
    ob = cube_with_seams()
    unwrap()
    uv = shapes.uv_of(ob)
    uv[:4] += uv[4:8].mean(axis=0) - uv[:4].mean(axis=0)  # the first face onto the second
    shapes.set_uv(ob, uv)
    bpy.ops.object.mode_set(mode="EDIT")
    shapes.select_faces(ob, [0])
    unwrap(keep_placement=True)
    bpy.ops.object.mode_set(mode="OBJECT")
    assert shapes.uv_of(ob)[4:].tobytes() == uv[4:].tobytes()
    assert len(assert_usable(ob)) == 6


@pytest.mark.parametrize("others", [0, 1])
def test_pinned_islands_stay_and_give_the_scale(others):
    ob = cube_with_seams()
    unwrap()
    uv = shapes.uv_of(ob) * np.float32(0.5)
    shapes.set_uv(ob, uv)
    shapes.set_pins(ob, np.arange(8, 12))
    objects = [ob]
    if others:
        objects.append(cube_with_seams("Other"))
        shapes.activate(ob, only=False)
    unwrap()
    after = shapes.uv_of(ob)
    assert after[8:12].tobytes() == uv[8:12].tobytes()
    assert len(assert_usable(*objects)) == 6 * len(objects)
    scales = [density(each, island) for each in objects for island in islands_of(each)]
    assert max(scales) / min(scales) < 1.0 + 1e-4


def test_improve_packs_the_islands_of_all_objects_on_demand():
    first, second = cube_with_seams("First"), cylinder_with_seams()
    shapes.activate(first, only=False)
    unwrap()
    for ob in (first, second):
        shapes.set_uv(ob, shapes.uv_of(ob) * np.float32(2.0 if ob is first else 1.0))
    assert bpy.ops.uv.flipfree_improve(pack=True) == {"FINISHED"}
    assert len(assert_usable(first, second)) == 9
    scales = [density(ob, island) for ob in (first, second) for island in islands_of(ob)]
    assert max(scales) / min(scales) < 1.0 + 1e-4


def test_improve_names_the_cure_where_islands_come_to_lie_on_each_other(capfd):
    ob = cube_with_seams()
    unwrap()
    uv = shapes.uv_of(ob)
    uv[4:8] = uv[:4]  # the second face's island onto that of the first
    shapes.set_uv(ob, uv)
    assert bpy.ops.uv.flipfree_improve() == {"FINISHED"}
    assert "1 pair of islands overlaps" in (said := capfd.readouterr().out)
    assert "'Pack Islands' keeps islands apart" in said
    assert bpy.ops.uv.flipfree_improve(pack=True) == {"FINISHED"}
    assert "keeps islands apart" not in capfd.readouterr().out


def test_the_judge_of_overlaps_knows_them():
    square = np.array([[[0, 0], [1, 0], [1, 1]], [[0, 0], [1, 1], [0, 1]]], float)
    assert overlapping(square, square + 0.5)
    assert overlapping(square, square * 0.1 + 0.3)
    assert not overlapping(square, square + [1.1, 0.0])
    assert not overlapping(square[:1], square[1:] + [-0.1, 0.1])


def in_scene(ob, triangles):
    """Length in UV space per length of the surface as it stands in the scene, which may be scaled unevenly."""
    loops, uv = triangles_of(ob)
    mesh = ob.data
    at = [
        ob.matrix_world @ mesh.vertices[mesh.loops[i].vertex_index].co
        for i in loops[triangles].ravel()
    ]
    at = np.array(at).reshape(-1, 3, 3)
    surface = np.linalg.norm(np.cross(at[:, 1] - at[:, 0], at[:, 2] - at[:, 0]), axis=1).sum() / 2
    return float(np.sqrt(area(uv[triangles]) / surface))


def scaled_cube(name, scale):
    ob = cube_with_seams(name)
    ob.scale = scale
    bpy.context.view_layer.update()
    return ob


UNEVEN = (10.0, 1.0, 1.0)


def test_islands_of_an_unevenly_scaled_object_have_one_density_in_the_scene():
    ob = scaled_cube("Beam", UNEVEN)
    unwrap()
    found = [in_scene(ob, island) for island in islands_of(ob)]
    assert len(found) == 6
    assert max(found) / min(found) < 1.0 + 1e-4


@pytest.mark.parametrize("scale", [UNEVEN, (1.0, 1.0, 0.01), (-3.0, 2.0, 1.0)])
def test_unevenly_scaled_objects_and_others_have_one_density_in_the_scene(scale):
    cube, beam = scaled_cube("Cube", (1, 1, 1)), scaled_cube("Beam", scale)
    shapes.activate(cube, only=False)
    unwrap()
    found = [in_scene(ob, island) for ob in (cube, beam) for island in islands_of(ob)]
    assert max(found) / min(found) < 1.0 + 1e-4
    assert_usable(cube, beam)
    assert bpy.ops.uv.flipfree_set_density(density=64.0, texture_size=1024) == {"FINISHED"}
    found = [1024 * in_scene(ob, island) for ob in (cube, beam) for island in islands_of(ob)]
    assert found == pytest.approx([64.0] * 12, rel=1e-4)


def test_a_flat_sheet_without_height_in_the_scene_has_a_density():
    ob = shapes.grid(4, bump=0.0)
    ob.scale = (2.0, 2.0, 0.0)
    bpy.context.view_layer.update()
    unwrap()
    assert bpy.ops.uv.flipfree_set_density(density=64.0, texture_size=1024) == {"FINISHED"}
    assert 1024 * in_scene(ob, np.arange(32)) == pytest.approx(64.0, rel=1e-4)


@pytest.mark.parametrize(
    "scale",
    [(0.0, 0.0, 0.0), (0.0, 1.0, 1.0), (-1.0, 1.0, 1.0), (1e-20, 1e-20, 1e-20), (1e20, 1.0, 1.0)],
)
def test_an_object_that_the_scene_scales_away_is_mapped_as_its_mesh_is(scale):
    ob = scaled_cube("Cube", scale)
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


def density_of(ob):
    """Length in the map by length in the scene."""
    _, uv = triangles_of(ob)
    mesh = ob.data
    corner = np.array([[mesh.vertices[v].co for v in t.vertices] for t in mesh.loop_triangles])
    corner = corner @ np.array(ob.matrix_world.to_3x3()).T
    cross = np.cross(corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0])
    sides = uv[:, 1:] - uv[:, :1]
    plane = np.abs(np.linalg.det(sides)).sum()
    return np.sqrt(plane / np.linalg.norm(cross, axis=1).sum())


@pytest.mark.parametrize("name", ["unwrap", "conformal"])
def test_objects_of_a_run_are_one_layout_at_one_density_beside_each_other(name, capfd):
    small, large = sheets_of_two_sizes()
    assert getattr(bpy.ops.uv, f"flipfree_{name}")() == {"FINISHED"}
    assert density_of(small) == pytest.approx(density_of(large), rel=0.01)
    boxes = [shapes.uv_of(ob) for ob in (small, large)]
    (a, b), (c, d) = ((box.min(axis=0), box.max(axis=0)) for box in boxes)
    assert (b <= c).any() or (d <= a).any(), "boxes do not meet"
    assert min(a.min(), c.min()) >= 0.0 and max(b.max(), d.max()) <= 1.0
    assert "different objects" not in capfd.readouterr().out


def test_objects_on_each_other_are_counted_by_check_and_by_maps_that_are_not_packed(capfd):
    for ob in sheets_of_two_sizes():
        ob.select_set(True)
    small, large = bpy.data.objects["Small"], bpy.data.objects["Large"]
    for ob in (small, large):
        ob.data.uv_layers.new(name="UVMap")
        at = np.array([ob.data.vertices[loop.vertex_index].co[:2] for loop in ob.data.loops])
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
