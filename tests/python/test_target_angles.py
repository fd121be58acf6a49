"""Properties of ff.suggest_cones and ff.boundary_angles."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from test_conformal_map import boundary_vertices, uv_angles

import flipfree as ff

from surfaces import bumpy_grid, cylinder, euler, octahedron_sphere, torus

CLOSED = {"sphere": octahedron_sphere, "torus": torus}
OPEN = {"disk": lambda: bumpy_grid(30, 30, 0.4), "annulus": cylinder}


def turning(faces: np.ndarray, angles: np.ndarray) -> float:
    """Total curvature of the angles in units of 2 pi: must be the Euler characteristic."""
    flat = np.full(len(angles), 2 * np.pi)
    flat[boundary_vertices(faces)] = np.pi
    return float((flat - angles).sum() / (2 * np.pi))


@pytest.mark.parametrize("bound", [8.0, 2.0])
@pytest.mark.parametrize("name", CLOSED | OPEN)
def test_suggested_cones_keep_the_scale_within_the_bound(name: str, bound: float) -> None:
    vertices, faces = (CLOSED | OPEN)[name]()
    angles = ff.suggest_cones(vertices, faces, bound=bound)
    assert angles.bound_holds and angles.scale_ratio <= bound
    assert turning(faces, angles) == pytest.approx(euler(faces), abs=1e-9)
    result = ff.conformal(vertices, faces, angles)
    assert result.certificate.ok
    assert np.exp(result.stats["scale_range"]) <= bound * (1 + 1e-6)
    # Nowhere else is there curvature inside.
    inside = np.setdiff1d(np.arange(len(vertices)), np.r_[boundary_vertices(faces), angles.cones])
    np.testing.assert_allclose(np.asarray(angles)[inside], 2 * np.pi, atol=1e-9)


def test_a_tighter_bound_takes_more_cones() -> None:
    vertices, faces = octahedron_sphere(3)
    counts = [len(ff.suggest_cones(vertices, faces, bound=b).cones) for b in (8.0, 3.0, 1.7)]
    assert counts == sorted(counts) and counts[0] < counts[-1]


def bumpy_ball() -> tuple[np.ndarray, np.ndarray]:
    vertices, faces = octahedron_sphere(4)
    return vertices * (1 + 0.25 * np.sin(5 * vertices[:, :1]) * np.cos(4 * vertices[:, 1:2])), faces


@pytest.mark.parametrize("make", [bumpy_ball, lambda: bumpy_grid(30, 30, 0.4)])
@pytest.mark.parametrize("bound", [4.0, 3.0])
def test_quarter_turns_keep_the_bound(make: Callable[[], Any], bound: float) -> None:
    vertices, faces = make()
    angles = ff.suggest_cones(vertices, faces, bound=bound, quarter_turns=True)
    assert angles.bound_holds and angles.scale_ratio <= bound
    quarters = np.asarray(angles)[angles.cones] / (np.pi / 2)
    np.testing.assert_allclose(quarters, np.round(quarters), atol=1e-9)
    assert (quarters > 0.5).all() and len(quarters)
    result = ff.conformal(vertices, faces, angles)
    assert result.certificate.ok
    assert np.exp(result.stats["scale_range"]) <= bound * (1 + 1e-6)


def test_quarter_turns_that_miss_the_bound_say_so() -> None:
    vertices, faces = octahedron_sphere(3)
    angles = ff.suggest_cones(vertices, faces, bound=1.05, quarter_turns=True)
    assert not angles.bound_holds and angles.scale_ratio > 1.05
    assert len(angles.cones) <= 200


def test_a_flat_surface_needs_no_cone() -> None:
    angles = ff.suggest_cones(*cylinder(), bound=1.01)
    assert len(angles.cones) == 0 and angles.scale_ratio == pytest.approx(1.0)


def test_too_few_cones_are_reported() -> None:
    vertices, faces = octahedron_sphere(3)
    with pytest.raises(ff.NotConverged, match="max_cones"):
        ff.suggest_cones(vertices, faces, max_cones=1)
    few = ff.suggest_cones(vertices, faces, bound=1.2, max_cones=6)
    assert not few.bound_holds and few.scale_ratio > 1.2


def test_a_free_boundary_is_not_scaled() -> None:
    vertices, faces = bumpy_grid(20, 15)
    result = ff.conformal(vertices, faces, ff.boundary_angles(vertices, faces, "free"))
    # Boundary edges keep their lengths up to the one global scale.
    uv = {int(v): result.uv[f, k] for f, row in enumerate(result.faces) for k, v in enumerate(row)}
    edges = {(a, b) for f in faces.tolist() for a, b in zip(f, f[1:] + f[:1], strict=True)}
    ratio = [
        np.linalg.norm(uv[a] - uv[b]) / np.linalg.norm(vertices[a] - vertices[b])
        for a, b in edges
        if (b, a) not in edges
    ]
    np.testing.assert_allclose(ratio, ratio[0], rtol=1e-8)


def test_a_round_boundary_is_round() -> None:
    vertices, faces = bumpy_grid(20, 15)
    result = ff.conformal(vertices, faces, ff.boundary_angles(vertices, faces, "circle"))
    assert result.certificate.ok
    boundary = boundary_vertices(faces)
    points = np.array([result.uv[result.faces == v][0] for v in boundary])
    # Equal curvature per length is a circle up to the size of the edges.
    a = np.c_[2 * points, np.ones(len(points))]
    x, y, c = np.linalg.lstsq(a, (points**2).sum(1), rcond=None)[0]
    radius = np.sqrt(c + x * x + y * y)
    np.testing.assert_allclose(np.hypot(points[:, 0] - x, points[:, 1] - y), radius, rtol=0.02)


def test_straight_boundaries_take_corners_and_cones() -> None:
    vertices, faces = bumpy_grid(20, 15)
    angles = ff.boundary_angles(vertices, faces, "straight", corners=[0, 20, 315, 335])
    np.testing.assert_allclose(angles[[0, 20, 315, 335]], np.pi / 2)
    with pytest.raises(ff.Infeasible, match="Gauss-Bonnet"):
        ff.boundary_angles(vertices, faces, "straight")
    cones = {100: np.pi, 200: np.pi}
    angles = ff.boundary_angles(vertices, faces, "straight", cones=cones)
    result = ff.conformal(vertices, faces, angles)
    assert result.certificate.ok
    np.testing.assert_allclose(uv_angles(result, len(vertices))[[100, 200]], np.pi, atol=1e-7)


@pytest.mark.parametrize("arguments", [{"corners": [997]}, {"cones": {997: 1.0}}])
def test_vertices_that_do_not_exist_are_said_but_not_listed(arguments: dict[str, object]) -> None:
    with pytest.raises(ff.InvalidInput, match="997") as refused:
        ff.boundary_angles(*bumpy_grid(20, 15), "straight", **arguments)
    assert (refused.value.kind, list(refused.value.elements)) == ("none", [])
