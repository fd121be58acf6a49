"""Taking a map as it is, before the solver is content with it."""

from __future__ import annotations

import time

import numpy as np
import pytest

import flipfree as ff
from flipfree import jobs

from surfaces import bumpy_grid


def energy_of(n: int) -> float:
    vertices, faces = bumpy_grid(n, n)
    return ff.unwrap(vertices, faces, seams="given").certificate.energy


def test_a_long_unwrap_that_is_accepted_ends_soon_with_a_certified_map() -> None:
    vertices, faces = bumpy_grid(250, 250)
    job = jobs.unwrap(vertices, faces, seams="given")
    assert not job.wait(0.3), "too small a mesh for this test"
    job.accept()
    result = job.result()
    assert result.certificate.ok and result.stats["time_limit_reached"] == 1
    again = ff.certify(vertices, result.faces, result.uv32(), bijective=True)
    assert again.ok


def test_a_search_for_seams_that_is_accepted_lays_flat_what_is_cut_by_then() -> None:
    vertices, faces = bumpy_grid(70, 70)
    x, y = 9.0 * vertices[:, :2].T
    hills = np.column_stack([x, y, 2.0 * np.sin(3.0 * x) * np.cos(2.0 * y + x)])
    job = jobs.unwrap(hills, faces)
    assert not job.wait(0.3), "too easy a mesh for this test"
    job.accept()
    early = job.result()
    assert early.certificate.ok and early.certificate.overlaps == 0
    assert early.stats["time_limit_reached"] == 1
    assert early.certificate.energy < 3.0, "and not the first map that there is"


@pytest.mark.parametrize("bijective", [True, False])
def test_accepting_before_there_is_a_map_waits_for_the_first_one(bijective: bool) -> None:
    vertices, faces = bumpy_grid(40, 40)
    job = jobs.unwrap(vertices, faces, bijective=bijective, seams="given")
    job.accept()
    early = job.result()
    assert early.certificate.ok
    assert early.certificate.energy >= energy_of(40)


def test_accepting_an_improvement_keeps_at_least_the_old_map() -> None:
    vertices, faces = bumpy_grid(60, 60)
    start = ff.embed(vertices, faces, optimise=False)
    job = jobs.improve((vertices, faces, start.uv))
    job.accept()
    result = job.result()
    assert result.certificate.ok
    assert result.certificate.energy <= start.certificate.energy


def test_accepting_calls_without_a_map_on_the_way_changes_nothing() -> None:
    vertices, faces = bumpy_grid(20, 20)
    uv = ff.unwrap(vertices, faces, seams="given").uv
    job = jobs.certify(vertices, faces, uv)
    job.accept()
    assert job.result().ok
    packed = jobs.pack(vertices, faces, uv)
    packed.accept()
    assert packed.result().certificate.ok


def test_accepting_after_the_end_is_allowed() -> None:
    vertices, faces = bumpy_grid(10, 10)
    job = jobs.unwrap(vertices, faces, seams="given")
    deadline = time.monotonic() + 60
    while not job.wait(0.05):
        assert time.monotonic() < deadline
    job.accept()
    result = job.result()
    assert result.stats["time_limit_reached"] == 0
    assert np.isfinite(result.uv).all()
