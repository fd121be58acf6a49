"""Charts with slits and holes, which overlap where distortion alone decides: none of ff.unwrap does, by the slow judge too."""

from __future__ import annotations

from random import Random

import numpy as np
import pytest

import flipfree as ff

from judges.coverage import coverage
from judges.mutations import rough_ring
from surfaces import bumpy_grid, compact

IntArray = np.ndarray


def funnel(turns: float, sectors: int = 240, rings: int = 6) -> tuple[np.ndarray, IntArray]:
    """A developable strip around a slender cone: flat, it winds around a point by `turns`."""
    # A cone whose surface unrolls to a sector of angle 2 pi / wraps, wrapped `turns` times of it.
    wraps = 3
    slope = 1.0 / wraps
    angle, out = np.meshgrid(
        np.linspace(0, 2 * np.pi * turns, sectors + 1), np.linspace(1.0, 2.5, rings + 1)
    )
    around = angle / slope
    lift = np.sqrt(1 - slope**2)
    vertices = np.stack(
        [out * slope * np.cos(around), out * slope * np.sin(around), out * lift], -1
    ).reshape(-1, 3)
    return vertices, bumpy_grid(sectors, rings)[1]


def random_slits(
    vertices: np.ndarray, faces: IntArray, count: int, length: int, random: Random
) -> IntArray:
    """Edges of random walks."""
    neighbours: dict[int, set[int]] = {}
    for a, b, c in faces.tolist():
        for p, q in ((a, b), (b, c), (c, a)):
            neighbours.setdefault(p, set()).add(q)
            neighbours.setdefault(q, set()).add(p)
    edges = set()
    for _ in range(count):
        at = random.randrange(len(vertices))
        for _ in range(length):
            nxt = random.choice(sorted(neighbours[at]))
            edges.add((min(at, nxt), max(at, nxt)))
            at = nxt
    return np.array(sorted(edges), np.int32)


def assert_covers_nothing_twice(result: ff.Parametrization) -> None:
    assert result.certificate.ok
    assert result.certificate.overlaps == result.certificate.island_overlaps == 0
    for uv in (result.uv, result.uv32()):
        seen = coverage(result.faces, uv)
        assert len(seen.flipped) == len(seen.within) == len(seen.between) == 0


@pytest.mark.parametrize("seed", range(12))
def test_a_rough_disk_with_slits_and_holes_covers_no_point_twice(seed: int) -> None:
    random = Random(seed)
    vertices, faces = bumpy_grid(24, 18)
    vertices = np.array(vertices)
    vertices[:, 2] += 0.15 * np.random.default_rng(seed).normal(size=len(vertices))
    if seed % 2:
        keep = np.ones(len(faces), bool)
        keep[300:312] = keep[500:506] = False
        faces = faces[keep]
    vertices, faces = compact(vertices, faces)
    cuts = random_slits(vertices, faces, 6, 8, random)
    result = ff.unwrap(vertices, faces, cuts=cuts, seams="given")
    assert_covers_nothing_twice(result)
    free = ff.unwrap(vertices, faces, cuts=cuts, bijective=False, seams="given")
    assert result.certificate.energy <= 1.2 * free.certificate.energy + 0.05


@pytest.mark.parametrize("seed", [1101, 1154, 1288])
def test_a_rough_ring_covers_no_point_twice(seed: int) -> None:
    assert_covers_nothing_twice(ff.unwrap(*rough_ring(np.random.default_rng(seed)), seams="given"))


def test_a_strip_that_winds_more_than_once_is_cut_instead_of_crushed() -> None:
    vertices, faces = funnel(1.6)
    free = ff.unwrap(vertices, faces, bijective=False, seams="given")
    assert free.certificate.overlaps > 0
    result = ff.unwrap(vertices, faces, seams="given")
    assert_covers_nothing_twice(result)
    assert result.stats["charts"] > 1
    assert result.stats["overlap_cuts"] == result.stats["added_cuts"] == len(result.cut_edges) > 0
    assert result.certificate.energy <= 1.02 * free.certificate.energy
    edges = {tuple(sorted((f[k], f[k - 1]))) for f in faces.tolist() for k in range(3)}
    assert {tuple(sorted(e)) for e in result.cut_edges.tolist()} <= edges


def test_cuts_are_added_only_where_they_may_be() -> None:
    vertices, faces = funnel(1.6)
    result = ff.unwrap(vertices, faces, may_add_cuts=False, seams="given")
    assert_covers_nothing_twice(result)
    assert result.stats["charts"] == 1
    assert len(result.cut_edges) == 0


def test_a_strip_that_winds_less_than_once_is_not_cut() -> None:
    vertices, faces = funnel(0.95)
    result = ff.unwrap(vertices, faces, seams="given")
    assert result.stats["charts"] == 1
    assert result.certificate.energy == pytest.approx(1.0, abs=2e-3)


def test_a_little_overlap_is_held_apart_without_a_cut() -> None:
    vertices, faces = funnel(1.04)
    assert ff.unwrap(vertices, faces, bijective=False, seams="given").certificate.overlaps > 0
    result = ff.unwrap(vertices, faces, seams="given")
    assert_covers_nothing_twice(result)
    assert result.stats["charts"] == 1
    assert result.certificate.energy < 1.05


def test_diagonals_of_polygons_are_not_cut() -> None:
    vertices, faces = funnel(1.6)
    diagonals = np.array(
        [sorted((a, c)) for a, b, c in faces.tolist() for a, b, c in ((a, b, c), (b, c, a), (c, a, b))
         if abs(a - c) == 242], np.int32
    )  # fmt: skip
    assert len(diagonals)
    result = ff.unwrap(vertices, faces, uncuttable=diagonals, seams="given")
    assert_covers_nothing_twice(result)
    cut = {tuple(sorted(e)) for e in result.cut_edges.tolist()}
    assert cut and not cut & {tuple(d) for d in diagonals.tolist()}


def test_pinned_charts_are_never_cut() -> None:
    vertices, faces = funnel(1.04)
    result = ff.unwrap(vertices, faces, pins={0: (0.25, 0.5)})
    assert result.certificate.ok
    assert len(result.cut_edges) == 0


@pytest.mark.parametrize("seed", range(40))
def test_charts_of_a_few_slivers_are_not_refused(seed: int) -> None:
    rng = np.random.default_rng(seed)
    count = int(rng.integers(1, 4))
    x = np.sort(rng.random(count + 3))
    points = np.stack([x, np.arange(count + 3) % 2 * 10.0 ** -rng.integers(1, 9), 0 * x], -1)
    faces = [(i, i + 1, i + 2) if i % 2 else (i, i + 2, i + 1) for i in range(count + 1)]
    assert_covers_nothing_twice(ff.unwrap(points, np.array(faces, np.int32), seams="given"))


def test_threads_do_not_change_a_bit_of_a_map_that_was_cut() -> None:
    vertices, faces = funnel(2.3)
    maps = [ff.unwrap(vertices, faces, threads=threads, seams="given") for threads in (1, 2, 3)]
    assert all(np.array_equal(maps[0].uv, other.uv) for other in maps[1:])
