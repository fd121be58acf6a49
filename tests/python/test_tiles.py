"""Islands stay in their UDIM tiles through improve and repair."""

from __future__ import annotations

import numpy as np
import pytest

import flipfree as ff

from surfaces import bumpy_grid, joined


def two_sheets(tiles, size=0.9):
    """(vertices, faces, uv): a bumpy sheet in each of these tiles (u, v), half as high as wide, near its right side."""
    sheet, its_faces = bumpy_grid(6, 6)
    low, high = sheet.min(axis=0), sheet.max(axis=0)
    flat = ((sheet - low) / (high - low).max())[:, :2] * [size, size / 2] + [1.0 - size, 0.02]
    parts = [(sheet + [20.0 * i, 0.0, 0.0], its_faces) for i in range(len(tiles))]
    uv = [flat[its_faces] + np.array(tile) for tile in tiles]
    return *joined(*parts), np.concatenate(uv)


def boxes(uv, count):
    parts = np.split(uv.reshape(-1, 3, 2), count)
    return [(p.min(axis=(0, 1)), p.max(axis=(0, 1))) for p in parts]


@pytest.mark.parametrize("tiles", [[(0, 0)], [(1, 0), (0, 0)], [(3, 2), (3, 3), (0, 9)]])
@pytest.mark.parametrize("size", [0.5, 0.9, 1.0])
def test_improve_keeps_every_island_in_its_tile(tiles, size):
    vertices, faces, uv = two_sheets(tiles, size)
    found = ff.improve((vertices, faces, uv))
    assert found.stats["left_tiles"] == 0
    for tile, (low, high) in zip(tiles, boxes(found.uv32(), len(tiles)), strict=True):
        assert (low >= tile).all() and (high <= np.array(tile) + 1).all()
    judged = ff.certify(vertices, faces, found.uv32(), bijective=True)
    assert judged.ok and judged.energy < ff.certify(vertices, faces, uv).energy
    assert np.array_equal(found.uv.astype(np.float32), found.uv32())
    assert judged.energy == pytest.approx(found.certificate.energy, rel=1e-4)


def test_improve_leaves_islands_that_lie_across_tiles_where_they_are():
    vertices, faces, uv = two_sheets([(0, 0)], 0.5)
    found = ff.improve((vertices, faces, uv + [0.3, 0.0]))
    ((low, high),) = boxes(found.uv32(), 1)
    assert low[0] < 1 < high[0] and found.stats["left_tiles"] == 0


def test_islands_that_pins_hold_outside_are_counted():
    vertices, faces, uv = two_sheets([(1, 0)], 0.9)
    corner = int(np.argmax(uv[:, :, 0]))
    place = tuple(uv.reshape(-1, 2)[corner])
    other = int(np.argmin(uv[:, :, 0]))
    pins = {
        (corner // 3, corner % 3): place,
        (other // 3, other % 3): (place[0] - 0.01, place[1]),
    }
    found = ff.improve((vertices, faces, uv), pins=pins)
    low, high = boxes(found.uv32(), 1)[0]
    assert found.stats["left_tiles"] == int((low < [1, 0]).any() or (high > [2, 1]).any())


def test_repair_puts_cut_pieces_into_the_tile_of_their_island():
    strip = 24
    angle = np.linspace(0.0, 4.2 * np.pi, strip + 1)
    inner, outer = np.exp(0.0 * angle) * 0.2, 0.48
    ring = np.stack([np.cos(angle), np.sin(angle)], axis=1)
    points = np.concatenate([ring * inner[:, None], ring * outer]) * 1.0 + [1.5, 0.5]
    n = strip + 1
    faces = np.array(
        [t for i in range(strip) for t in ((i, n + i, i + 1), (i + 1, n + i, n + i + 1))]
    )
    vertices = np.c_[points, np.r_[angle, angle] * 0.05]
    uv = points[faces]
    assert ff.certify(vertices, faces, uv, bijective=True).overlaps > 0
    found = ff.repair(vertices, faces, uv)
    judged = ff.certify(vertices, faces, found.uv32(), bijective=True, disjoint=True)
    assert judged.ok and judged.overlaps == 0
    assert found.stats["charts_cut"] == 1
    low, high = found.uv32().min(axis=(0, 1)), found.uv32().max(axis=(0, 1))
    inside = (low >= [1, 0]).all() and (high <= [2, 1]).all()
    assert inside == (found.stats["left_tiles"] == 0) and inside
