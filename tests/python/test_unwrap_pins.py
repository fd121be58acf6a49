"""Pins of ff.unwrap: met bit for bit, or refused by name; never by a fold."""

from __future__ import annotations

import numpy as np
import pytest

import flipfree as ff

from surfaces import bumpy_grid


def free_map() -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    vertices, faces = bumpy_grid(16, 12)
    result = ff.unwrap(vertices, faces, seams="given")
    uv = np.zeros((len(vertices), 2))
    uv[faces] = result.uv
    return vertices, faces, uv


def test_one_pin_moves_the_chart_and_nothing_else() -> None:
    vertices, faces, uv = free_map()
    energy = ff.unwrap(vertices, faces, seams="given").certificate.energy
    result = ff.unwrap(vertices, faces, pins={40: (0.1, 0.9)})
    assert result.certificate.pin_failures == 0
    assert (result.uv[faces == 40] == (0.1, 0.9)).all()
    assert (result.uv32()[faces == 40] == np.array((0.1, 0.9), np.float32)).all()
    assert result.certificate.energy == pytest.approx(energy, rel=1e-3)


@pytest.mark.parametrize("distance", [0.02, 0.1])
@pytest.mark.parametrize("seed", range(3))
def test_six_moved_pins_are_met_bit_for_bit(seed: int, distance: float) -> None:
    vertices, faces, uv = free_map()
    random = np.random.default_rng(seed)
    chosen = random.choice(len(vertices), 6, replace=False)
    direction = random.normal(size=(6, 2))
    direction /= np.linalg.norm(direction, axis=1)[:, None]
    pins = {int(v): tuple(uv[v] + distance * d) for v, d in zip(chosen, direction, strict=True)}
    try:
        result = ff.unwrap(vertices, faces, pins=pins)
    except ff.NotConverged as error:
        # Allowed: this triangulation may not do it. Then the pin is named.
        assert error.kind == "vertex" and set(error.elements) <= set(pins)
        assert "Match Pins" in str(error)
        assert distance > 0.05, "small moves must be reached"
        return
    assert result.certificate.ok
    assert result.certificate.pin_failures == 0
    for v, target in pins.items():
        assert (result.uv[faces == v] == target).all()


def test_a_pin_on_one_corner_pins_the_vertex_of_its_chart() -> None:
    vertices, faces, uv = free_map()
    result = ff.unwrap(vertices, faces, pins={(0, 1): (0.25, 0.5)})
    assert (result.uv[faces == faces[0, 1]] == (0.25, 0.5)).all()


def test_pins_that_turn_the_chart_inside_out_are_refused_by_name() -> None:
    vertices, faces, uv = free_map()
    corners = [0, 16, 12 * 17 + 16, 12 * 17]
    mirrored = {v: (1.0 - uv[v, 0], uv[v, 1]) for v in corners}
    with pytest.raises((ff.NotConverged, ff.Infeasible)) as caught:
        ff.unwrap(vertices, faces, pins=mirrored)
    assert caught.value.elements


def test_many_pins_at_one_point_are_refused_only_where_an_edge_joins_two() -> None:
    vertices, faces = bumpy_grid(12, 12)
    side = round(len(vertices) ** 0.5)
    apart = [3 * i * side + 3 * j for i in range(4) for j in range(4)]
    pins = {v: (0.5, 0.5) for v in apart}
    with pytest.raises(ff.NotConverged) as failed:  # a surface drawn together into a point
        ff.unwrap(vertices, faces, pins=pins, bijective=False)
    assert "same point" not in str(failed.value)
    with pytest.raises(ff.Infeasible, match="same point") as error:
        ff.unwrap(vertices, faces, pins={**pins, apart[5] + 1: (0.5, 0.5)}, bijective=False)
    assert sorted(error.value.elements) == [apart[5], apart[5] + 1]
