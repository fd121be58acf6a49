"""Rectify: strips and grids are straight bit for bit, as wide as on the surface; what is no grid is named."""

from __future__ import annotations

import numpy as np
import pytest

import flipfree as ff


def mesh_of(points, quads):
    """((n, 3), (2 q, 3), (2 q,)) of quads, every other one along its other diagonal."""
    faces, polygons = [], []
    for i, (a, b, c, d) in enumerate(quads):
        faces += [(a, b, c), (a, c, d)] if i % 2 else [(b, c, d), (b, d, a)]
        polygons += [i, i]
    return np.array(points, float), np.array(faces, np.int32), np.array(polygons)


def grid(columns, rows, place, *, ring=False, torus=False):
    """place(i, j) of each vertex; ring: the last column is the first one; torus: so is the last row."""
    wide, high = columns + (not ring), rows + (not torus)
    points = [place(i, j) for j in range(high) for i in range(wide)]

    def at(i, j):
        return i % wide + wide * (j % high)

    quads = [
        (at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1))
        for j in range(rows)
        for i in range(columns)
    ]
    return mesh_of(points, quads)


def lines(found, axis):
    return np.unique(found.uv32()[..., axis])


def test_a_bent_strip_is_straight_and_as_long_as_its_middle():
    vertices, faces, polygons = grid(
        30, 3, lambda i, j: (np.cos(i / 10) * (9 + j), np.sin(i / 10) * (9 + j), np.sin(i / 4))
    )
    uv = np.zeros((len(faces), 3, 2))
    found = ff.rectify(vertices, faces, polygons=polygons)
    assert found.certificate.ok and found.certificate.overlaps == 0
    assert found.stats["charts"] == 1 and found.certificate.energy < 1.02
    counts = sorted((len(lines(found, 0)), len(lines(found, 1))))
    assert counts == [4, 31]
    again = ff.rectify(vertices, faces, uv, polygons=polygons)
    assert np.array_equal(again.uv32(), found.uv32()), "a map without area joins as none does"


def test_triangles_are_quads_in_pairs_across_their_longest_sides():
    vertices, faces, polygons = grid(9, 4, lambda i, j: (i, j + 0.1 * np.sin(i), np.cos(i / 3)))
    found = ff.rectify(vertices, faces)
    same = ff.rectify(vertices, faces, polygons=polygons)
    assert np.array_equal(found.uv32(), same.uv32())


def test_columns_are_as_wide_as_their_edges():
    widths = np.array([1.0, 3.0, 0.5, 2.0])
    x = np.append(0.0, np.cumsum(widths))
    vertices, faces, polygons = grid(4, 2, lambda i, j: (x[i], 1.5 * j, 0.0))
    found = ff.rectify(vertices, faces, polygons=polygons, margin=0.0)
    sides = sorted((lines(found, 0), lines(found, 1)), key=len)
    steps = np.diff(sides[1].astype(float))
    steps = steps if np.allclose(steps / steps[0], widths) else steps[::-1]
    assert steps / steps[0] == pytest.approx(widths, rel=1e-5)
    assert found.certificate.energy == pytest.approx(1.0, abs=1e-6)


def test_the_crooked_seam_of_a_tube_becomes_straight_unless_it_is_marked():
    def place(i, j):
        return (np.cos(i * np.pi / 8), np.sin(i * np.pi / 8), j / 3)

    vertices, faces, polygons = grid(16, 8, place, ring=True)
    crooked = [16 * j + (j > 4) for j in range(9)]
    seam = list(zip(crooked, crooked[1:], strict=False)) + [(16 * 5, 16 * 5 + 1)]
    seam.remove((16 * 4, 16 * 5 + 1))
    seam.append((16 * 4, 16 * 5))
    uv = ff.unwrap(vertices, faces, cuts=seam, seams="given", polygons=polygons).uv
    assert len(lines(ff.rectify(vertices, faces, uv, polygons=polygons), 0)) in (9, 17)
    kept = ff.rectify(vertices, faces, uv, polygons=polygons, cuts=seam)
    counts = sorted((len(lines(kept, 0)), len(lines(kept, 1))))
    assert counts == [9, 18] and kept.certificate.energy == pytest.approx(1.0, abs=1e-3)


def test_a_net_that_is_no_grid_without_its_seams_keeps_them():
    cube = [(x, y, z) for x in (0, 1) for y in (0, 1) for z in (0, 1)]
    sides = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
    vertices, faces, polygons = mesh_of(cube, sides)
    uv = ff.unwrap(vertices, faces, polygons=polygons).uv
    found = ff.rectify(vertices, faces, uv, polygons=polygons)
    assert found.certificate.energy == pytest.approx(1.0, abs=1e-3) and found.stats["charts"] == 1


@pytest.mark.parametrize("torus", [False, True])
def test_what_closes_up_is_cut_straight(torus):
    def place(i, j):
        a, b = 2 * np.pi * i / 16, 2 * np.pi * j / 8
        if torus:
            return (np.cos(a) * (5 + np.cos(b)), np.sin(a) * (5 + np.cos(b)), np.sin(b))
        return (np.cos(a), np.sin(a), j / 3)

    vertices, faces, polygons = grid(16, 8, place, ring=True, torus=torus)
    found = ff.rectify(vertices, faces, polygons=polygons)
    assert found.certificate.ok and found.stats["charts"] == 1
    assert sorted((len(lines(found, 0)), len(lines(found, 1)))) == [9, 17]
    assert len(found.cut_edges) == (24 if torus else 8)


@pytest.mark.parametrize("sides", [4, 8, 16])
def test_auto_unwrap_takes_tubes_as_straight_strips(sides):
    """A bent pipe with ends, by polygons and by geometry."""

    def place(i, j):
        a, b = 2 * np.pi * i / sides, 1.5 * j / 20
        wide = 2 + 0.3 * np.cos(a)
        return (wide * np.cos(b), 0.3 * np.sin(a), wide * np.sin(b))

    vertices, faces, polygons = grid(sides, 20, place, ring=True)
    ends = [(0, k, k + 1) for k in range(1, sides - 1)]
    high = [(20 * sides, 20 * sides + b, 20 * sides + a) for _, a, b in ends]
    closed = np.concatenate([faces, ends, high]).astype(np.int32)
    lids = 1000 + np.repeat([0, 1], sides - 2)
    for numbers in (np.concatenate([polygons, lids]), None):
        found = ff.unwrap(vertices, closed, polygons=numbers)
        assert found.certificate.ok and found.stats["charts"] == 3
        strip = np.sort(found.uv32()[: len(faces)].reshape(-1, 2), axis=0)
        counts = sorted(len(np.unique(strip[:, k])) for k in (0, 1))
        assert counts == [sides + 1, 21] and found.certificate.energy < 1.02
    seams = {frozenset(edge) for edge in found.cut_edges.tolist()}
    inner = sides // 2 + sides * np.arange(21)
    assert {frozenset(e) for e in zip(inner, inner[1:], strict=False)} <= seams, "the shortest line"


def test_what_is_round_is_no_strip():
    def ball(i, j):
        a, b = 2 * np.pi * i / 16, np.pi * (j + 1) / 10 - np.pi / 2
        return (np.cos(a) * np.cos(b), np.sin(a) * np.cos(b), np.sin(b))

    vertices, faces, polygons = grid(16, 8, ball, ring=True)
    found = ff.unwrap(vertices, faces, polygons=polygons)
    assert found.certificate.energy < 1.025 and min(len(lines(found, k)) for k in (0, 1)) > 17


def test_seams_and_a_map_end_islands():
    vertices, faces, polygons = grid(6, 2, lambda i, j: (i, j, 0.0))
    cuts = [(3, 10), (10, 17)]
    assert ff.rectify(vertices, faces, polygons=polygons, cuts=cuts).stats["charts"] == 2
    uv = vertices[faces][:, :, :2].copy()
    uv[uv.mean(axis=1)[:, 0] > 4] += [3.0, 0.0]
    found = ff.rectify(vertices, faces, uv, polygons=polygons, cuts=cuts)
    assert found.stats["charts"] == 3 and found.certificate.island_overlaps == 0


def test_a_cross_of_streets_is_a_grid_and_a_wide_texture_keeps_its_shape():
    cells = [(i, j) for i in range(7) for j in range(7) if 2 < i < 4 or 2 < j < 4]
    ids: dict[tuple[int, int], int] = {}
    quads = [
        [ids.setdefault((i + a, j + b), len(ids)) for a, b in ((0, 0), (1, 0), (1, 1), (0, 1))]
        for i, j in cells
    ]
    vertices, faces, polygons = mesh_of([(i, j, 0.1 * i) for i, j in ids], quads)
    for aspect in (1.0, 2.0):
        found = ff.rectify(vertices, faces, polygons=polygons, aspect=aspect)
        assert found.certificate.ok and found.certificate.energy < 1.001


def refused(mesh, words, faces, code="no grid"):
    with pytest.raises(ff.InvalidInput, match=words) as caught:
        ff.rectify(mesh[0], mesh[1], polygons=mesh[2])
    assert caught.value.code == code and caught.value.kind == "face"
    assert set(caught.value.elements) <= set(faces)


def test_what_is_no_grid_is_named():
    vertices, faces, polygons = grid(4, 4, lambda i, j: (i, j, 0.0))
    alone = np.delete(faces, 7, 0)
    refused((vertices, alone, None), "no quad", [6], "no quad")
    cube = [(x, y, z) for x in (0, 1) for y in (0, 1) for z in (0, 1)]
    sides = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
    refused(mesh_of(cube, sides), "other than four quads", range(12))
    # A ramp of one turn and a quad around a square hole: its ends lie on each other.
    way = [(0, 0), (1, 0), (2, 0), (2, 1), (2, 2), (1, 2), (0, 2), (0, 1), (0, 0)]
    points: list[tuple[float, float, float]] = []
    ramp: list[dict[tuple[int, int], int]] = [{}, {}]
    for n, (x, y) in enumerate(way):
        ids = {}
        for at in ((x, y), (x + 1, y), (x + 1, y + 1), (x, y + 1)):
            ids[at] = ramp[-1].get(at, ramp[-2].get(at, len(points)))
            if ids[at] == len(points):
                points.append((*at, n))
        ramp.append(ids)
    refused(mesh_of(points, [list(ids.values()) for ids in ramp[2:]]), "no grid", range(18))
