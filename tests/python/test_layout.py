"""Layouts of ff.pack and ff.unwrap on random islands: nothing on top of anything, by code that shares nothing with the solver."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt
import pytest

import flipfree as ff

from judges import gaps
from judges.gaps import area
from surfaces import bumpy_grid

Array = npt.NDArray[np.float64]


class Scene:
    """Flat sheets of random shape as one mesh, each an island, somewhere in the plane."""

    def __init__(self, seed: int, count: int):
        random = np.random.default_rng(seed)
        vertices: list[Array] = []
        faces: list[Any] = []
        uv: list[Array] = []
        self.island: list[slice] = []
        start = triangles = 0
        for _ in range(count):
            points, grid = bumpy_grid(
                int(random.integers(1, 4)), int(random.integers(1, 4)), height=0.0
            )
            points = points * [*random.uniform(0.2, 2.0, 2), 1.0]
            angle, centre = random.uniform(0, 7), random.uniform(-3, 3, 2)
            turn = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
            vertices.append(points)
            faces.append(grid + start)
            uv.append((points[:, :2] @ turn.T * random.uniform(0.5, 2.0) + centre)[grid])
            self.island.append(slice(triangles, triangles + len(grid)))
            start += len(points)
            triangles += len(grid)
        self.vertices = np.concatenate(vertices)
        self.faces = np.concatenate(faces).astype(np.int32)
        self.uv = np.concatenate(uv)

    def stored(self, result: ff.Parametrization) -> list[Array]:
        uv = result.uv32().astype(np.float64)
        return [uv[own] for own in self.island]

    def density(self, result: ff.Parametrization, i: int) -> float:
        own = self.island[i]
        at = self.vertices[self.faces[own]]
        cross = np.cross(at[:, 1] - at[:, 0], at[:, 2] - at[:, 0])
        return float(np.sqrt(area(result.uv[own]) / (np.linalg.norm(cross, axis=1).sum() / 2)))


def assert_apart(islands: list[Array], obstacles: Array | None = None) -> None:
    assert gaps.narrowest(islands, 1e-3).distance > 0.0
    for still in [] if obstacles is None else obstacles:
        assert all(gaps.between(island, still[None], 1e-3) > 0.0 for island in islands)


@pytest.mark.sample(10)
@pytest.mark.parametrize("margin", [0.0, 0.005, 0.05])
@pytest.mark.parametrize("seed", range(8))
def test_random_islands_are_packed_apart_at_one_scale(seed: int, margin: float) -> None:
    scene = Scene(seed, 1 + 4 * seed)
    packed = ff.pack(scene.vertices, scene.faces, scene.uv, margin=margin, scale_true=True)
    found = scene.stored(packed)
    assert_apart(found)
    assert all(uv.min() >= 0.0 and uv.max() <= 1.0 for uv in found)
    scales = [scene.density(packed, i) for i in range(len(scene.island))]
    assert max(scales) / min(scales) < 1.0 + 1e-9
    assert packed.stats["density"] == pytest.approx(scales[0])
    assert packed.stats["tile"] == packed.stats["kept_places"] == 0


@pytest.mark.parametrize("seed", range(12))
def test_random_obstacles_and_unmoved_islands_are_kept_clear_of(seed: int) -> None:
    scene = Scene(seed, 3 + seed)
    random = np.random.default_rng(seed)
    obstacles = random.uniform(-0.3, 1.3, (1 + seed % 9, 1, 2))
    obstacles = obstacles + random.uniform(-0.2, 0.2, (len(obstacles), 3, 2))
    own = scene.island[1]
    size = np.ptp(scene.uv[own].reshape(-1, 2), axis=0).max()
    scene.uv[own] = scene.uv[own] * 0.3 / size  # stays, in the square
    scene.uv[own] += 0.4 - scene.uv[own].min((0, 1))
    scene.uv[own] = scene.uv[own].astype(np.float32)
    corner = 3 * own.start
    packed = ff.pack(
        scene.vertices,
        scene.faces,
        scene.uv,
        scale_true=True,
        obstacles=obstacles,
        unmoved=[corner],
        effort=0.1,
    )
    assert np.array_equal(packed.uv[own], scene.uv[own])
    assert np.array_equal(packed.uv32()[own], scene.uv[own].astype(np.float32))
    found = scene.stored(packed)
    moved = [uv for i, uv in enumerate(found) if i != 1]
    assert_apart(moved, np.concatenate([obstacles, found[1]]))
    tile = np.array([packed.stats["tile"] % 10, packed.stats["tile"] // 10])
    assert all((uv - tile).min() >= 0.0 and (uv - tile).max() <= 1.0 for uv in moved)
    # As dense as the one that stays, or as dense as there is room for.
    assert packed.stats["density"] <= scene.density(packed, 1) * (1.0 + 1e-9)


def test_moved_islands_take_the_density_of_unmoved_ones_if_there_is_room() -> None:
    scene = Scene(1, 6)
    scene.uv = ff.pack(scene.vertices, scene.faces, scene.uv, scale_true=True).uv * 0.4
    packed = ff.pack(scene.vertices, scene.faces, scene.uv, scale_true=True, unmoved=[0])
    scales = [scene.density(packed, i) for i in range(6)]
    assert max(scales) / min(scales) < 1.0 + 1e-6


def test_a_density_is_met_if_there_is_room_and_never_exceeded() -> None:
    scene = Scene(2, 9)
    mesh = scene.vertices, scene.faces, scene.uv
    largest = ff.pack(*mesh, scale_true=True).stats["density"]
    low = ff.pack(*mesh, scale_true=True, density=0.25 * largest)
    assert low.stats["density"] == pytest.approx(0.25 * largest)
    assert scene.density(low, 3) == pytest.approx(0.25 * largest)
    high = ff.pack(*mesh, scale_true=True, density=4.0 * largest)
    assert high.stats["density"] == pytest.approx(largest)


def test_a_density_is_in_the_users_unit() -> None:
    scene = Scene(2, 4)
    scale = 2.0**300
    packed = ff.pack(scene.vertices * scale, scene.faces, scene.uv, density=0.1 / scale)
    assert packed.stats["density"] == pytest.approx(0.1 / scale)


def test_islands_keep_usable_places_at_one_scale() -> None:
    scene = Scene(5, 7)
    mesh = scene.vertices, scene.faces
    before = ff.pack(*mesh, scene.uv, scale_true=True).uv
    before = 0.9 - 0.8 * before  # turned by half a turn
    kept = ff.pack(*mesh, scene.uv, scale_true=True, place_like=before)
    assert kept.stats["kept_places"] == 1
    assert np.abs(kept.uv - before).max() < 1e-6
    uneven = before.copy()
    own = scene.island[2]
    uneven[own] = 0.5 * (uneven[own] - uneven[own].mean((0, 1))) + uneven[own].mean((0, 1))
    kept = ff.pack(*mesh, scene.uv, scale_true=True, place_like=uneven)
    scales = [scene.density(kept, i) for i in range(7)]
    assert kept.stats["kept_places"] == 1 and max(scales) / min(scales) < 1.0 + 1e-6


@pytest.mark.parametrize("fault", ["overlap", "inside", "outside", "torn", "obstacle", "nan"])
def test_places_that_are_not_usable_are_given_up_for_all(fault: str) -> None:
    scene = Scene(5, 7)
    mesh = scene.vertices, scene.faces
    before = ff.pack(*mesh, scene.uv, scale_true=True, margin=0.01).uv.copy()
    first, second = scene.island[0], scene.island[1]
    obstacles = None
    if fault == "overlap":
        before[first] += before[second].mean((0, 1)) - before[first].mean((0, 1))
    elif fault == "inside":  # a small one in the middle of a large one: no boundary meets
        wide, small = (
            max(scene.island, key=lambda own: area(before[own])),
            min(scene.island, key=lambda own: area(before[own])),
        )
        before = (before - before[wide].mean((0, 1))) * 0.3 + 0.5
        before[small] += before[wide].mean((0, 1)) - before[small].mean((0, 1))
    elif fault == "outside":
        before += 0.1
    elif fault == "torn":
        before[first.start] += 0.001
    elif fault == "obstacle":
        obstacles = before[first].mean((0, 1)) + [[[0, 0], [1e-4, 0], [0, 1e-4]]]
    else:
        before[first.start, 0, 0] = np.nan
    packed = ff.pack(*mesh, scene.uv, scale_true=True, place_like=before, obstacles=obstacles)
    assert packed.stats["kept_places"] == 0
    found = scene.stored(packed)
    assert_apart(found, obstacles)
    assert all(uv.min() >= 0.0 and uv.max() <= 1.0 for uv in found)


def sheets(count: int) -> tuple[Array, npt.NDArray[np.int32]]:
    """Bumpy sheets side by side, each its own component and of another size."""
    vertices, faces = bumpy_grid(6, 5)
    n = len(vertices)
    return (
        np.concatenate([vertices * (1.0 + 0.3 * i) + [9.0 * i, 0, 0] for i in range(count)]),
        np.concatenate([faces + n * i for i in range(count)]).astype(np.int32),
    )


def test_unwrapped_charts_have_one_density_and_keep_clear_of_pinned_ones() -> None:
    vertices, faces = sheets(5)
    m = len(faces) // 5
    free = ff.unwrap(vertices, faces, seams="given")
    pins = {0: (0.5, 0.5)}
    pinned = ff.unwrap(vertices, faces, pins=pins)
    for result, moved in ((free, range(5)), (pinned, range(1, 5))):
        uv = result.uv32().astype(np.float64)
        islands = [uv[m * i : m * (i + 1)] for i in range(5)]
        assert_apart(islands)
        scales = [np.sqrt(area(islands[i])) / (1.0 + 0.3 * i) for i in moved]
        assert max(scales) / min(scales) < 1.0 + 1e-5
    assert pinned.certificate.pin_failures == 0


def test_former_places_of_an_unwrap_are_all_kept_or_none() -> None:
    vertices, faces = sheets(3)
    m = len(faces) // 3
    before = 0.5 * ff.unwrap(vertices, faces, seams="given").uv + 0.3
    kept = ff.unwrap(vertices, faces, place_like=before, seams="given")
    assert kept.stats["kept_places"] == 1 and np.abs(kept.uv - before).max() < 1e-3
    before[:m] += before[m : 2 * m].mean((0, 1)) - before[:m].mean((0, 1))
    packed = ff.unwrap(vertices, faces, place_like=before, seams="given")
    assert packed.stats["kept_places"] == 0
    assert_apart(list(packed.uv32().astype(np.float64).reshape(3, m, 3, 2)))
    assert packed.uv.max() > 0.9
