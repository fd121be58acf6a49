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
