# SPDX-License-Identifier: GPL-3.0-or-later
"""Fit Tiles: seams, cones and corners on whole numbers as stored, tiles of the size asked for, what is refused."""

import math
import re

import bpy
import numpy as np
import pytest
import shapes
from mathutils import Vector
from test_field_aligned import triangles
from test_seamless import holed

run = bpy.ops.uv.flipfree_fit_tiles


def seams(ob, most=0.0):
    """(turn, translation) per edge where UVs differ, in floats that hold them."""
    corners, uv = shapes.triangles_of(ob)
    z = uv.astype(float) @ [1, 1j]
    side = {}
    for t, face in enumerate(np.asarray(corners).tolist()):
        for k in range(3):
            side[face[k], face[(k + 1) % 3]] = z[t, k], z[t, (k + 1) % 3]
    for (a, b), (p, q) in side.items():
        if a < b and (b, a) in side:
            s, r = side[b, a]
            turn = min(range(4), key=lambda k: abs((q - p) * 1j**k - (s - r)))
            assert abs((q - p) * 1j**turn - (s - r)) <= most
            if (turn, p) != (0, r):
                yield turn, r - p * 1j**turn


def tears(ob):
    """Coordinates by which the first ends of edges differ on their two sides, after the nearest quarter turn."""
    for turn, shift in seams(ob, 1e-4):
        assert turn in range(4)
        yield from (shift.real, shift.imag)


def check(ob):
    found = list(seams(ob))
    for _, shift in found:
        assert shift == complex(round(shift.real), round(shift.imag))
    return found


def tile_size(ob):
    points, uv, _ = triangles(ob)
    place = np.array([ob.matrix_world.to_3x3() @ Vector(p) for p in points.reshape(-1, 3)])
    points = place.reshape(points.shape)
    a, b = points[:, 1] - points[:, 0], points[:, 2] - points[:, 0]
    p, q = uv[:, 1] - uv[:, 0], uv[:, 2] - uv[:, 0]
    flat = p[:, 0] * q[:, 1] - p[:, 1] * q[:, 0]
    assert (flat > 0).all()
    return math.sqrt(np.linalg.norm(np.cross(a, b), axis=1).sum() / flat.sum())


@pytest.mark.parametrize("field", ["curvature", "smooth", "edges", "flow"])
@pytest.mark.parametrize("genus", [0, 1, 2])
def test_a_closed_mesh_of_any_genus_is_fitted(genus, field, capfd):
    ob = holed(genus, 2)
    ob.scale = 2, 2, 2
    bpy.context.view_layer.update()
    assert run(tile_size=0.25, field_from=field) == {"FINISHED"}
    line = capfd.readouterr().out
    found = check(ob)
    assert 0.2 < tile_size(ob) < 0.3
    assert re.search(r"\d+ tiles of 0\.2\d+, any texture runs through \d+ % of the seams", line)
    assert any(edge.use_seam for edge in ob.data.edges) == bool(found)


def test_the_active_map_is_fitted_again():
    ob = holed(1, 2)
    assert bpy.ops.uv.flipfree_field_aligned() == {"FINISHED"}
    points = len(ob.data.vertices)
    for tiles in (2000, 150):
        assert run(tile_count=tiles, field_from="map") == {"FINISHED"}
        check(ob)
        _, uv, _ = triangles(ob)
        p, q = uv[:, 1] - uv[:, 0], uv[:, 2] - uv[:, 0]
        assert 0.7 * tiles < (p[:, 0] * q[:, 1] - p[:, 1] * q[:, 0]).sum() / 2 < 1.4 * tiles
    assert len(ob.data.vertices) == points


def test_open_surfaces_have_whole_borders():
    ob = shapes.grid(9, bump=0.2)
    assert run(tile_count=30) == {"FINISHED"}
    check(ob)
    for edge, (p, q) in shapes_border(ob).items():
        assert p.real == q.real == round(p.real) or p.imag == q.imag == round(p.imag), edge


def shapes_border(ob):
    corners, uv = shapes.triangles_of(ob)
    z = uv.astype(float) @ [1, 1j]
    side = {}
    for t, face in enumerate(np.asarray(corners).tolist()):
        for k in range(3):
            side[face[k], face[(k + 1) % 3]] = z[t, k], z[t, (k + 1) % 3]
    return {edge: ends for edge, ends in side.items() if edge[::-1] not in side}


def test_a_map_that_is_not_seamless_is_refused():
    ob = shapes.cube()
    ob.data.uv_layers.active.data[0].uv = 0.3, 0.3
    before = shapes.everything(ob)
    with pytest.raises(
        RuntimeError, match="not seamless as it is stored: .* Let Along make a new map"
    ):
        run(field_from="map")
    assert shapes.everything(ob) == before


def test_undo_brings_the_map_back():
    before = shapes.everything(holed(1, 2))
    bpy.ops.ed.undo_push(message="before")
    assert run(tile_count=100) == {"FINISHED"}
    bpy.ops.ed.undo_push(message="after")
    bpy.ops.ed.undo()
    assert shapes.everything(bpy.context.object) == before


def test_the_command_writes_tiles(part, tmp_path):
    holed(1, 2)
    source, target = tmp_path / "torus.obj", tmp_path / "tiles.obj"
    bpy.ops.wm.obj_export(filepath=str(source))
    words = ["tiles", str(source), str(target), "--tile-count", "200", "--field", "smooth"]
    assert part("command_line").main(words) == 0
    bpy.ops.wm.obj_import(filepath=str(target))
    # Six digits, as Blender writes this format.
    assert all(abs(shift - round(shift)) < 1e-4 for shift in tears(bpy.context.object))
