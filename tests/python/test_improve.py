"""Properties of ff.improve."""

from __future__ import annotations

import numpy as np
import pytest

import flipfree as ff

from surfaces import bumpy_grid


def planar_map(vertices: np.ndarray, faces: np.ndarray) -> np.ndarray:
    """The projection to the xy plane: flip-free for height fields."""
    return vertices[faces][:, :, :2].copy()


def two_charts() -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """A height field whose right half was moved away in the map."""
    vertices, faces = bumpy_grid()
    uv = planar_map(vertices, faces)
    uv[vertices[faces][:, :, 0].mean(axis=1) > 0.5] += (3.0, 0.5)
    return vertices, faces, uv


def test_energy_falls_and_the_map_stays_valid() -> None:
    vertices, faces = bumpy_grid(height=0.4)
    uv = planar_map(vertices, faces)
    before = ff.certify(vertices, faces, uv).energy
    result = ff.improve((vertices, faces, uv))
    assert result.certificate.ok
    assert result.certificate.energy < before
    assert result.stats["energy_before"] == pytest.approx(before)
    assert len(result.cut_edges) == 0


def test_charts_are_found_and_keep_their_places() -> None:
    vertices, faces, uv = two_charts()
    result = ff.improve((vertices, faces, uv))
    assert result.stats["charts"] == 2
    assert result.certificate.ok
    right = uv[:, 0, 0] > 2.0
    for part in (right, ~right):
        assert np.allclose(result.uv[part].mean(axis=(0, 1)), uv[part].mean(axis=(0, 1)), atol=0.05)


def test_an_optimal_map_comes_back_no_worse() -> None:
    vertices, faces = bumpy_grid()
    once = ff.improve((vertices, faces, planar_map(vertices, faces)), tolerance=1e-12)
    twice = ff.improve(once)
    assert twice.certificate.energy <= once.certificate.energy * (1 + 1e-12)


def test_pins_are_met_bit_for_bit() -> None:
    vertices, faces = bumpy_grid()
    uv = planar_map(vertices, faces)
    pins = {30: (1 / 3, 0.1), 200: (0.7, 2 / 3)}
    result = ff.improve((vertices, faces, uv), pins=pins)
    assert result.certificate.ok
    assert result.certificate.pin_failures == 0
    for vertex, target in pins.items():
        assert np.all(result.uv[faces == vertex] == target)
        assert np.all(result.uv32()[faces == vertex] == np.asarray(target, np.float32))


def test_maps_with_flips_are_repaired_first() -> None:
    vertices, faces = bumpy_grid()
    uv = planar_map(vertices, faces)
    uv[faces == 100] = (5.0, 5.0)
    uv[17, 1] = np.nan
    result = ff.improve((vertices, faces, uv))
    assert result.certificate.ok and result.certificate.flips32 == 0
    assert result.stats["flips_before"] > 1
    assert result.stats["energy_before"] == np.inf
    best = ff.improve((vertices, faces, planar_map(vertices, faces)))
    assert result.certificate.energy == pytest.approx(best.certificate.energy, rel=1e-2)


def test_out_of_time_what_was_gained_is_kept() -> None:
    vertices, faces = bumpy_grid(60, 60)
    start = ff.embed(vertices, faces)
    result = ff.improve(start, max_seconds=1e-3)
    assert result.certificate.ok
    assert result.stats["time_limit_reached"] == 1
    assert (
        result.stats["energy_before"]
        >= result.certificate.energy
        > ff.improve(start).certificate.energy
    )


def test_pins_that_are_not_reached_in_time_are_an_error() -> None:
    vertices, faces = bumpy_grid(60, 60)
    start = ff.embed(vertices, faces)
    with pytest.raises(ff.NotConverged, match=r"max_seconds = 1e-05.*Allow more time") as error:
        ff.improve(start, pins={1800: (0.3, 0.3), 900: (0.1, 0.1)}, max_seconds=1e-5)
    assert error.value.code == "time limit reached"


def test_pins_that_fold_two_islands_together_are_refused() -> None:
    """Both faces go around the edge in the same direction, so the mesh is no clean surface, and each is an island. Pins at the
    ends of the edge lay them onto each other: as stored they are one island, folded."""
    vertices = np.array([[0, 0, 0], [1, 0, 0], [0.5, 1, 0], [0.5, -1, 0]], np.float64)
    faces = np.array([[0, 1, 2], [0, 1, 3]], np.int32)
    uv = np.array([[[0, 0], [1, 0], [0.5, 1]], [[3, 0], [4, 0], [3.5, 1]]], np.float64)
    apart = ff.improve((vertices, faces, uv), pins={2: (0.5, 1.0)})
    assert ff.certify(apart.vertices, apart.faces, apart.uv32()).ok
    with pytest.raises(ff.NotConverged, match="unpin one of its ends") as refused:
        ff.improve((vertices, faces, uv), pins={0: (0.0, 0.0), 1: (1.0, 0.0)})
    assert refused.value.kind == "face" and set(refused.value.elements) <= {0, 1}
