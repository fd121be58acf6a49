"""Conformal maps by the definition; properties of ff.suggest_cones and ff.boundary_angles."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

import flipfree as ff

from judges.exact import flips
from surfaces import (
    bumpy_grid,
    cylinder,
    euler,
    octahedron_sphere,
    open_edges,
    prism_with_cones,
    torus,
)


def boundary_vertices(faces: np.ndarray) -> np.ndarray:
    return np.unique(open_edges(faces))


def flat_angles(faces: np.ndarray) -> np.ndarray:
    angles = np.full(faces.max() + 1, 2 * np.pi)
    angles[boundary_vertices(faces)] = np.pi
    return angles


def random_sphere_angles(count: int, seed: int) -> np.ndarray:
    """Positive angles that add up for a sphere."""
    random = np.random.default_rng(seed)
    curvature = random.uniform(-0.9 * np.pi, 0.9 * np.pi, count)
    return 2 * np.pi - (curvature + (4 * np.pi - curvature.sum()) / count)


def uv_angles(result: ff.Parametrization, count: int) -> np.ndarray:
    """Total UV angle at each of the first ``count`` vertices."""
    uv, total = result.uv, np.zeros(len(result.vertices))
    for k in range(3):
        a, b = uv[:, (k + 1) % 3] - uv[:, k], uv[:, (k + 2) % 3] - uv[:, k]
        angle = np.arctan2(a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0], (a * b).sum(1))
        np.add.at(total, result.faces[:, k], angle)
    return total[:count]


def octahedral_case() -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Eight cones of angle 3 pi / 2 on a sphere."""
    vertices, faces = octahedron_sphere(3)
    angles = flat_angles(faces)
    directions = np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)], float)
    angles[np.argmax(vertices @ directions.T, 0)] = 1.5 * np.pi
    return vertices, faces, angles


def rectangle_case() -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    vertices, faces = bumpy_grid(20, 15)
    angles = flat_angles(faces)
    angles[[0, 20, 15 * 21, 15 * 21 + 20]] = np.pi / 2
    return vertices, faces, angles


def flat_torus_case() -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    vertices, faces = torus()
    return vertices, faces, flat_angles(faces)


def annulus_case() -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    vertices, faces = cylinder()
    return vertices, faces, flat_angles(faces)


CASES = {
    "sphere": octahedral_case,
    "disk": rectangle_case,
    "torus": flat_torus_case,
    "annulus": annulus_case,
}


@pytest.mark.parametrize("name", CASES)
def test_the_map_has_the_prescribed_angles_and_no_flip(name: str) -> None:
    vertices, faces, angles = CASES[name]()
    result = ff.conformal(vertices, faces, angles)
    assert result.certificate.ok
    assert flips(result.uv) == flips(result.uv32()) == 0
    assert result.certificate.provenance_failures == 0
    np.testing.assert_allclose(uv_angles(result, len(vertices)), angles, atol=1e-7)
    np.testing.assert_array_equal(result.vertices[: len(vertices)], vertices)


@pytest.mark.parametrize("seed", range(4))
def test_random_angles_everywhere_need_refinement_and_get_it(seed: int) -> None:
    vertices, faces = octahedron_sphere(3)
    angles = random_sphere_angles(len(vertices), seed)
    result = ff.conformal(vertices, faces, angles)
    assert result.certificate.ok
    assert result.stats["added_vertices"] > 0
    assert flips(result.uv32()) == 0
    np.testing.assert_allclose(uv_angles(result, len(vertices)), angles, atol=1e-6)
    # Every added vertex lies where its weights say, on an edge of its input face.
    new = slice(len(vertices), None)
    weights = result.vertex_barycentric[new]
    corners = vertices[faces[result.vertex_parent[new]]]
    np.testing.assert_allclose(
        (weights[:, :, None] * corners).sum(1), result.vertices[new], atol=1e-12
    )
    assert (weights.min(1) == 0).all() and (weights.max(1) < 1).all()


def test_the_full_refinement_is_certified_too_and_larger() -> None:
    vertices, faces = octahedron_sphere(3)
    angles = random_sphere_angles(len(vertices), 1)
    few = ff.conformal(vertices, faces, angles)
    all_points = ff.conformal(vertices, faces, angles, original_triangles=False)
    assert all_points.certificate.ok
    assert all_points.stats["added_vertices"] == all_points.stats["overlay_crossings"]
    assert few.stats["added_vertices"] < all_points.stats["added_vertices"]


def test_original_triangles_are_kept_where_possible_and_refused_where_not() -> None:
    kept = ff.conformal(*rectangle_case(), original_triangles=True)
    assert kept.certificate.ok and kept.stats["added_vertices"] == 0
    vertices, faces = octahedron_sphere(3)
    with pytest.raises(ff.NotConverged) as caught:
        ff.conformal(
            vertices, faces, random_sphere_angles(len(vertices), 1), original_triangles=True
        )
    assert caught.value.certificate.flips64 > 0
    assert caught.value.metric.converged


def test_a_map_too_fine_for_32_bits_is_refused_and_the_metric_returned() -> None:
    # All positive curvature at one pole: scale falls along the way to it by more than 32-bit numbers hold.
    vertices, faces = octahedron_sphere(3)
    vertices = vertices * [1, 1, 30]
    angles = np.full(len(vertices), 2 * np.pi)
    near = np.argsort(-vertices[:, 2])[:8]
    angles[near] -= 4 * np.pi / len(near)
    with pytest.raises(ff.NotConverged, match="32-bit") as caught:
        ff.conformal(vertices, faces, angles)
    failure = caught.value
    assert failure.metric.converged and failure.metric.angle_error <= 1e-10
    assert failure.metric.scale_range > np.log(2.0**24)
    assert len(failure.elements) and failure.kind == "face"
    assert failure.certificate is failure.parametrization.certificate
    assert not failure.certificate.ok and failure.certificate.failures


def random_case(seed: int) -> tuple[np.ndarray, np.ndarray, np.ndarray, dict[str, object]]:
    """A noisy surface of any topology here with curvature at few or many vertices, in the boundary too."""
    random = np.random.default_rng(seed)
    vertices, faces = [
        lambda: octahedron_sphere(int(random.integers(0, 4))),
        lambda: torus(int(random.integers(5, 30)), int(random.integers(4, 15))),
        lambda: cylinder(int(random.integers(3, 20)), int(random.integers(1, 8))),
        lambda: bumpy_grid(int(random.integers(1, 20)), int(random.integers(1, 20))),
    ][seed % 4]()
    count = len(vertices)
    noise = random.choice([0, 0.01, 0.1]) * np.linalg.norm(np.ptp(vertices, 0)) / np.sqrt(count)
    vertices = vertices + random.normal(size=vertices.shape) * noise
    flat = flat_angles(faces)
    boundary = len(boundary_vertices(faces))
    edges = (3 * len(faces) + boundary) // 2
    wanted = 2 * np.pi * (count - edges + len(faces))
    for _ in range(100):
        amount = random.choice([0.1, 0.5, 0.9])
        share = random.choice([0.02, 0.3, 1.0])
        curvature = random.uniform(-amount, amount, count) * flat * (random.random(count) < share)
        rest = wanted - curvature.sum()
        some = random.choice(count, min(count, int(abs(rest) / 1.5) + 1), replace=False)
        curvature[some] += rest / len(some)
        if (flat - curvature).min() > 0.05:
            break
    options = {"cuts": faces[random.integers(len(faces), size=3)][:, :2]} if seed % 3 == 0 else {}
    return vertices, faces, flat - curvature, options


@pytest.mark.parametrize("seed", range(40))
def test_random_angles_on_random_surfaces(seed: int) -> None:
    vertices, faces, angles, options = random_case(seed)
    assert angles.min() > 0, "the draw itself is at fault"
    try:
        result = ff.conformal(vertices, faces, angles, **options)
    except (
        ff.NotConverged
    ) as failure:  # refused honestly: too fine for 32 bits, the metric is there
        assert failure.metric.converged and failure.metric.scale_range > 12
        assert not failure.certificate.ok
        return
    assert result.certificate.ok
    assert flips(result.uv) == flips(result.uv32()) == 0
    # No sum is off by a full turn either, where a cone is wider than its faces can show.
    np.testing.assert_allclose(uv_angles(result, len(vertices)), angles, atol=1e-6)


def test_given_cuts_are_part_of_the_cut() -> None:
    vertices, faces, angles = octahedral_case()
    edge = faces[100, :2]
    result = ff.conformal(vertices, faces, angles, cuts=[edge])
    assert result.certificate.ok
    assert sorted(edge.tolist()) in np.sort(result.cut_edges, 1).tolist()


def sheared_grid(shear: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """A flat parallelogram whose rows are shifted so far that hardly an edge between them is Delaunay, and its angles."""
    vertices, faces = bumpy_grid(14, 8, height=0.0)
    vertices[:, :2] += 0.015 * np.random.default_rng(3).normal(size=(len(vertices), 2))
    vertices[:, 0] += shear * vertices[:, 1]
    angles = np.zeros(len(vertices))
    for k in range(3):
        p, a, b = (vertices[faces[:, (k + j) % 3]] for j in range(3))
        cosine = (
            ((a - p) * (b - p)).sum(1)
            / np.linalg.norm(a - p, axis=1)
            / np.linalg.norm(b - p, axis=1)
        )
        np.add.at(angles, faces[:, k], np.arccos(cosine))
    return vertices, faces, angles


@pytest.mark.parametrize("refinement", ["off", "on"])
def test_a_flat_surface_that_is_far_from_delaunay_is_mapped_by_a_similarity(
    refinement: str,
) -> None:
    vertices, faces, angles = sheared_grid(4.0)
    result = ff.conformal(
        vertices, faces, angles, original_triangles=False, intrinsic_refinement=refinement
    )
    assert result.stats["straightened_crossings"] > 300
    assert result.stats["bent_crossings"] == 0
    assert result.stats["added_vertices"] > 100
    # Every point of the map, those on edges that are not Delaunay included: w = a z + b.
    z = result.vertices[result.faces.ravel(), :2] @ [1, 1j]
    w = result.uv.reshape(-1, 2) @ [1, 1j]
    a, b = np.polyfit(z, w, 1)
    assert np.abs(a * z + b - w).max() < 1e-9 * np.abs(a)


def test_a_map_from_a_refined_start_lies_on_the_original_triangles() -> None:
    vertices, faces, angles = prism_with_cones()
    result = ff.conformal(vertices, faces, angles, intrinsic_refinement="on")
    assert result.certificate.ok and flips(result.uv) == 0
    assert result.stats["intrinsic_refinement"] > 100
    # The points that were added to the start are not there, only points on input edges.
    assert (result.vertex_barycentric[len(vertices) :] == 0.0).any(1).all()
    assert result.stats["added_vertices"] < result.stats["intrinsic_refinement"]
    assert np.abs(uv_angles(result, len(vertices)) - angles).max() < 1e-6


def test_needles_are_crossed_less_often_from_a_refined_start() -> None:
    vertices, faces, _ = prism_with_cones(200)
    vertices[:, 2] /= 3.0
    angles = np.full(len(vertices), 2 * np.pi)
    places = np.random.default_rng(0).choice(len(vertices), 12, replace=False)
    angles[places] -= np.pi / 2 * np.array([1] * 10 + [-1] * 2)
    plain, refined = (
        ff.conformal(vertices, faces, angles, intrinsic_refinement=way) for way in ("off", "on")
    )
    for result in (plain, refined):
        assert result.certificate.ok
        assert np.abs(uv_angles(result, len(vertices)) - angles).max() < 2e-5
    assert refined.stats["intrinsic_refinement"] > 100
    assert refined.stats["overlay_crossings"] < plain.stats["overlay_crossings"]


def test_cuts_are_kept_on_a_refined_start() -> None:
    vertices, faces, angles = prism_with_cones()
    cuts = np.array([(k, k + 1) for k in range(3, 9)])
    result = ff.conformal(vertices, faces, angles, cuts=cuts, intrinsic_refinement="on")
    ends = {tuple(sorted(e)) for e in result.cut_edges.tolist()}
    whole = [tuple(e) in ends for e in cuts.tolist()]
    # A cut edge is whole, or in pieces that begin at its ends.
    for (a, b), one in zip(cuts.tolist(), whole, strict=True):
        pieces = [e for e in ends if a in e or b in e]
        assert one or len(pieces) >= 2
    assert result.certificate.ok


@pytest.mark.parametrize("positions", ["nowhere", "on a line", "far away"])
def test_with_lengths_the_map_is_theirs_wherever_the_vertices_are(positions: str) -> None:
    vertices, faces = bumpy_grid(5, 4)
    lengths = np.linalg.norm(vertices[faces] - vertices[np.roll(faces, -1, axis=1)], axis=2)
    angles = ff.boundary_angles(vertices, faces)
    elsewhere = {
        "nowhere": np.zeros_like(vertices),
        "on a line": vertices * [1.0, 0.0, 0.0],
        "far away": np.full_like(vertices, 1e300),
    }[positions]
    result = ff.conformal(elsewhere, faces, angles, lengths=lengths)
    assert result.certificate.ok
    assert np.array_equal(result.uv, ff.conformal(vertices, faces, angles, lengths=lengths).uv)
    # Distortion is measured against positions, and these have no area.
    assert result.certificate.energy == result.certificate.max_energy == -1.0
    assert result.certificate.energy_p99 == -1.0 and not result.certificate.poor
    assert result.certificate.stretched == result.certificate.area == -1.0


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
