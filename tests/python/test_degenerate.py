"""Meshes as degenerate as doubles allow: the conformal calls end in a certified result or in an error with a cure."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from degenerate_meshes import degenerate_mesh, outcome, random_call

import flipfree as ff

from surfaces import bumpy_grid

ERRORS = (ff.InvalidInput, ff.Infeasible, ff.NotConverged)


def flat_triangle(height: float) -> tuple[Any, Any, Any]:
    vertices = np.array([(0, 0, 0), (1, 0, 0), (0.5, height, 0)])
    return vertices, [[0, 1, 2]], [np.pi / 3] * 3


@pytest.mark.parametrize("height", [1e-15, 1e-20, 1e-100])
def test_one_triangle_flattened_to_nothing_has_a_metric_and_a_map(height: float) -> None:
    vertices, faces, angles = flat_triangle(height)
    metric = ff.conformal_metric(vertices, faces, angles)
    assert metric.converged and np.allclose(metric.angles, np.pi / 3, atol=1e-10)
    assert np.allclose(metric.log_lengths, metric.log_lengths[0, 0], atol=1e-9)
    result = ff.conformal(vertices, faces, angles)
    assert result.certificate.ok
    # No circle: the long side alone is half of the boundary.
    try:
        assert np.isfinite(ff.boundary_angles(vertices, faces, "circle")).all()
    except ff.NotConverged as error:
        assert "round boundary" in str(error)


@pytest.mark.sample(3)
@pytest.mark.parametrize("size", [1e-16, 1e-17, 1e-40, 1e-200])
@pytest.mark.parametrize("axis", [0, 1])
def test_grids_flattened_to_nothing_have_metrics_or_are_refused(size: float, axis: int) -> None:
    vertices, faces = bumpy_grid(4, 3)
    vertices = vertices.copy()
    vertices[:, axis] *= size
    angles = np.full(len(vertices), np.pi * len(faces) / len(vertices))
    calls = [
        lambda: ff.conformal_metric(vertices, faces, angles, max_seconds=5).angles,
        lambda: ff.conformal(vertices, faces, angles, max_seconds=5).uv,
        lambda: ff.boundary_angles(vertices, faces, "circle", max_seconds=5),
        lambda: ff.suggest_cones(vertices, faces, max_seconds=5),
    ]
    for call in calls:
        try:
            assert np.isfinite(call()).all()
        except ERRORS as error:
            assert len(str(error)) > 40


def test_random_degenerate_calls_raise_no_foreign_errors() -> None:
    ends = {seed: outcome(seed, 0.5)[1] for seed in range(100)}
    assert {seed: end for seed, end in ends.items() if end.startswith("BAD")} == {}
    assert sum(end == "result" for end in ends.values()) > 40


@pytest.mark.parametrize("seed", [23, 27, 112, 200, 322, 335])
def test_needles_without_a_round_boundary_end_with_a_reason(seed: int) -> None:
    vertices, faces = degenerate_mesh(np.random.default_rng(seed))
    try:
        assert np.isfinite(ff.boundary_angles(vertices, faces, "circle", max_seconds=60)).all()
    except ff.NotConverged as error:
        assert error.code != "time limit reached"


#: Seeds of random_call whose call once crashed, came back late or had numbers that were none.
@pytest.mark.parametrize("seed", [18, 23, 260, 30058, 30675])
def test_calls_that_once_failed_do_not(seed: int) -> None:
    assert not outcome(seed, 1.0)[1].startswith("BAD")


def test_the_same_call_ends_the_same_way_twice() -> None:
    name, function, arguments, options = random_call(7, 0.0)
    ends = []
    for _ in range(2):
        try:
            ends.append(function(*arguments, **options))
        except ERRORS as error:
            ends.append(str(error))
    assert str(ends[0]) == str(ends[1])
    assert name
