"""ff.conformal_metric: shapes, options, refusals, progress and cancellation, agreement with closed forms."""

from __future__ import annotations

from itertools import product

import numpy as np
import pytest

import flipfree as ff

from mesh_files import shared
from surfaces import bumpy_grid, octahedron_sphere, of_cubes, prism_with_cones, strip_of_needles


def random_targets(count: int, faces: int, seed: int) -> np.ndarray:
    target = np.random.default_rng(seed).uniform(np.pi, 3 * np.pi, count)
    return target * (np.pi * faces / target.sum())


def final_angles(metric: ff.ConformalMetric, count: int) -> np.ndarray:
    """Total angles of a closed result, from its lengths alone."""
    length = np.exp(metric.log_lengths - metric.log_lengths.mean())
    a, b, c = length[:, 0], length[:, 1], length[:, 2]
    corner = np.stack(
        [
            np.arccos((x * x + z * z - y * y) / (2 * x * z))
            for x, y, z in [(a, b, c), (b, c, a), (c, a, b)]
        ],
        axis=1,
    )
    return np.bincount(metric.faces.ravel(), corner.ravel(), minlength=count)


def test_random_angles_are_met_as_measured_from_the_returned_lengths() -> None:
    vertices, faces = octahedron_sphere(3)
    target = random_targets(len(vertices), len(faces), 1)
    metric = ff.conformal_metric(vertices, faces, target)
    assert metric.converged and metric.angle_error <= 1e-10 and metric.bits == 53
    assert metric.scale_factors.shape == (len(vertices),)
    assert abs(metric.scale_factors.mean()) < 1e-12
    assert metric.scale_range == pytest.approx(np.ptp(metric.scale_factors))
    assert metric.flips == sum(metric.flip_counts) > 0
    assert metric.error_history[-1] <= 1e-10
    np.testing.assert_allclose(metric.angles, target, atol=1e-10)
    np.testing.assert_allclose(final_angles(metric, len(vertices)), target, atol=1e-7)


def test_the_error_is_that_of_the_precision_where_the_tolerance_is_not_reached() -> None:
    vertices, faces = octahedron_sphere(1)
    target = random_targets(len(vertices), len(faces), 2)
    metric = ff.conformal_metric(
        vertices, faces, target, precision=200, tolerance=1e-200, require_convergence=False
    )
    assert metric.stats["stopped_by"] == "precision"
    assert 0.0 < metric.angle_error < 1e-50


def test_auto_precision_climbs_for_a_tolerance_that_double_cannot_reach() -> None:
    vertices, faces = octahedron_sphere(1)
    metric = ff.conformal_metric(
        vertices, faces, random_targets(len(vertices), len(faces), 2), tolerance=1e-30
    )
    assert metric.bits > 53 and metric.angle_error <= 1e-30


def test_a_disk_uses_the_symmetric_double_cover() -> None:
    vertices, faces = bumpy_grid(8, 8)
    target = ff.boundary_angles(vertices, faces, "straight", corners=[0, 8, 72, 80])
    metric = ff.conformal_metric(vertices, faces, target)
    assert metric.symmetric and metric.angle_error <= 1e-10
    assert set(np.unique(metric.face_labels)) <= {0, 1, 2, 3}


def test_refusals_name_the_place_and_the_remainder() -> None:
    vertices, faces = octahedron_sphere(0)
    target = np.full(6, 8 * np.pi / 6)
    with pytest.raises(ff.Infeasible, match="quarter turns"):
        ff.conformal_metric(vertices, faces, target + 0.1)
    bad = target.copy()
    bad[3] = -1.0
    with pytest.raises(ff.InvalidInput, match="vertex 3") as caught:
        ff.conformal_metric(vertices, faces, bad)
    assert list(caught.value.elements) == [3]
    two = np.concatenate([vertices, vertices + 5.0]), np.concatenate([faces, faces + 6])
    with pytest.raises(ff.InvalidInput):
        ff.conformal_metric(*two, np.concatenate([target, target]))


def test_not_converged_says_what_was_reached() -> None:
    vertices, faces = octahedron_sphere(2)
    target = random_targets(len(vertices), len(faces), 3)
    with pytest.raises(ff.NotConverged, match="after 1 Newton steps"):
        ff.conformal_metric(vertices, faces, target, iterations=1)
    metric = ff.conformal_metric(vertices, faces, target, iterations=1, require_convergence=False)
    assert not metric.converged and metric.iterations == 1


@pytest.mark.parametrize("refinement", ["off", "on"])
def test_seconds_that_are_over_end_metric_and_map(refinement: str) -> None:
    vertices, faces = octahedron_sphere(6)
    target = random_targets(len(vertices), len(faces), 3)
    limits = {"max_seconds": 1e-3, "intrinsic_refinement": refinement}
    with pytest.raises(ff.NotConverged, match="max_seconds = 0.001"):
        ff.conformal_metric(vertices, faces, target, **limits)
    metric = None
    for k in range(9):
        # The first limit that leaves time for the mesh to be read and the solver to start.
        seconds = 0.05 * 2**k
        try:
            metric = ff.conformal_metric(
                vertices,
                faces,
                target,
                require_convergence=False,
                max_seconds=seconds,
                intrinsic_refinement=refinement,
            )
            break
        except ff.NotConverged as error:
            assert error.code == "time limit reached"
    assert metric is not None
    assert not metric.converged and metric.stats["stopped_by"] == "seconds"
    assert np.isfinite(metric.angle_error) and np.isfinite(metric.scale_factors).all()
    with pytest.raises(ff.NotConverged, match="seconds"):
        ff.conformal(vertices, faces, target, **limits)
    with pytest.raises(ff.InvalidInput, match="max_seconds"):
        ff.conformal(vertices, faces, target, max_seconds=-1.0)


# gtorus050 needs the line search where the energy, known in double only, cannot tell a step any more.
@pytest.mark.parametrize(
    ("name", "angles", "iterations"),
    [
        *(
            (name, "_singlecone", 60)
            for name in ("gtorus006", "gtorus013", "gtorus022", "gtorus050")
        ),
        *((name, "", 40) for name in ("aircraft", "1146164_cut", "eight766_cut")),
        *(("sphere1k_random", kind, 40) for kind in ("_cluster10", "_huge20pi", "_tiny1e-2")),
        ("disk5k", "_bndrand95", 40),
        ("genus2_3bnd", "_flatbnd_quartercones", 40),
    ],
)
def test_pairs_of_the_shared_data_are_met(name: str, angles: str, iterations: int) -> None:
    given = ff.read(shared(f"conformal/{name}.obj"))
    target = np.loadtxt(shared(f"conformal/{name}{angles}_Th_hat"))
    metric = ff.conformal_metric(given.vertices, given.faces, target, iterations=iterations)
    assert metric.angle_error <= 1e-10


def plate_with_holes(columns: int, rows: int) -> tuple[np.ndarray, np.ndarray]:
    """The surface of a plate of voxels, two thick, with square holes 3 wide and walls of 2: genus columns x rows."""
    sides = product(range(5 * columns + 2), range(5 * rows + 2))
    return of_cubes((x, y, z) for x, y in sides if min(x % 5, y % 5) < 2 for z in (0, 1))


@pytest.mark.parametrize(("columns", "rows"), [(6, 6), (10, 8)])
def test_all_curvature_of_many_handles_in_one_cone_is_reached_by_relaxed_steps(
    columns: int, rows: int
) -> None:
    # Of 80 handles it is not in minutes where a relaxed vertex does not take the flips on its way in their order.
    vertices, faces = plate_with_holes(columns, rows)
    target = np.full(len(vertices), 2 * np.pi)
    target[-1] = 2 * np.pi * (2 * columns * rows - 1)
    metric = ff.conformal_metric(vertices, faces, target)
    assert metric.stats["relaxed_iterations"] >= 5
    assert metric.angle_error <= 1e-10
    assert metric.iterations <= 100


def test_couplings_forty_orders_apart_have_a_direction() -> None:
    # Two vertices seen by a third one across 45 orders of magnitude: two doubles per unknown do not hold the
    # difference of their steps, so that no precision of the lengths found a direction.
    vertices, faces = plate_with_holes(20, 2)
    target = np.full(len(vertices), 2 * np.pi)
    target[0] = 2 * np.pi * (2 * 40 - 1)
    metric = ff.conformal_metric(vertices, faces, target, intrinsic_refinement="off")
    assert metric.angle_error <= 1e-10
    assert metric.bits <= 512
    assert metric.iterations <= 150


def test_a_refined_start_says_what_it_added() -> None:
    sectors = 120
    vertices, faces, angles = prism_with_cones(sectors)
    metric = ff.conformal_metric(vertices, faces, angles, intrinsic_refinement="on")
    added = metric.stats["intrinsic_refinement"]
    assert added > 100
    assert metric.scale_factors.shape == metric.angles.shape == (2 * sectors,)
    assert metric.added_scale_factors.shape == metric.added_parent.shape == (added,)
    assert metric.added_barycentric.shape == (added, 3)
    assert (metric.added_barycentric.sum(1) == 1.0).all() and (
        metric.added_barycentric >= 0.0
    ).all()
    assert metric.faces.max() == 2 * sectors + added - 1
    assert np.abs(metric.angles - angles).max() <= 1e-10


def test_the_plain_way_serves_where_a_refined_start_that_was_asked_for_fails() -> None:
    # On a strip the smooth map's scale grows by a factor per width; the refined surface follows it, 500 instead of 37.
    vertices, faces, angles = strip_of_needles(0)
    plain = ff.conformal_metric(vertices, faces, angles, intrinsic_refinement="off")
    metric = ff.conformal_metric(
        vertices, faces, angles, intrinsic_refinement="on", iterations=plain.iterations
    )
    assert metric.stats["intrinsic_refinement"] == 0
    assert metric.stats["refined_start_error"] > 1e-10
    assert np.array_equal(metric.scale_factors, plain.scale_factors)


def test_a_refined_start_takes_given_lengths_and_any_unit() -> None:
    vertices, faces, angles = prism_with_cones()
    lengths = np.linalg.norm(vertices[faces] - vertices[np.roll(faces, -1, 1)], axis=2)
    a = ff.conformal_metric(vertices, faces, angles, intrinsic_refinement="on")
    b = ff.conformal_metric(0 * vertices, faces, angles, lengths=lengths, intrinsic_refinement="on")
    c = ff.conformal_metric(1024.0 * vertices, faces, angles, intrinsic_refinement="on")
    assert np.abs(a.scale_factors - b.scale_factors).max() < 1e-6
    assert (a.scale_factors == c.scale_factors).all()
