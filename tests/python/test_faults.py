"""Calls that are cancelled, accepted or out of time at any moment: our own exception or a valid result, soon,
and the next call as if nothing had been."""

from __future__ import annotations

import time

import numpy as np
import pytest
from small_calls import BALL, CALLS, GRID

import flipfree as ff

from surfaces import bumpy_grid

#: Seconds that a call may come back late on a loaded machine.
LATEST = 5.0


@pytest.mark.parametrize("name", CALLS)
def test_a_call_that_was_cancelled_leaves_nothing_behind(name):
    call = CALLS[name]
    heard = [0.0]
    expected = call(progress=lambda _stage, fraction: heard.append(fraction) is None)
    assert heard == sorted(heard) and len(heard) > 1 and heard[-1] <= 1.0
    cancelled = 0
    for number in (1, 2, 3, 5, 8):
        asked = []

        def progress(_stage, _fraction, number=number, asked=asked):
            asked.append(time.monotonic())
            return len(asked) < number

        try:
            call(progress=progress)
        except ff.Cancelled:
            cancelled += 1
            assert time.monotonic() - asked[-1] < LATEST
            assert len(asked) == number
    assert cancelled > 0
    assert np.array_equal(call(), expected)


@pytest.mark.parametrize("name", CALLS)
def test_no_time_at_all_is_an_error_that_names_the_limit(name):
    with pytest.raises(ff.NotConverged, match="max_seconds = 1e-06.*Allow more time") as error:
        CALLS[name](max_seconds=1e-6)
    assert error.value.code == "time limit reached"


@pytest.mark.parametrize("name", CALLS)
def test_a_limit_of_time_ends_in_a_result_or_says_so(name):
    call = CALLS[name]
    expected = call()
    random = np.random.default_rng(5)
    for limit in 10 ** random.uniform(-3, 1, 5):
        begin = time.monotonic()
        try:
            call(max_seconds=limit)
        except ff.NotConverged as error:
            assert error.code == "time limit reached"
        assert time.monotonic() - begin < limit + LATEST
    assert np.array_equal(call(), expected)


ACCEPTED = {
    "unwrap": lambda: ff.jobs.unwrap(*BALL, seams="given"),
    "unwrap, may overlap": lambda: ff.jobs.unwrap(*GRID, seams="given", bijective=False),
    "auto": lambda: ff.jobs.unwrap(*BALL),
    "improve": lambda: ff.jobs.improve(ff.embed(*GRID)),
    "seamless": lambda: ff.jobs.seamless(*BALL, dict.fromkeys(range(8), 3)),
    "pack": lambda: ff.jobs.pack(*GRID, GRID[0][GRID[1]][..., :2]),
}


@pytest.mark.parametrize("name", ACCEPTED)
def test_accepting_at_any_moment_gives_a_certified_map(name):
    random = np.random.default_rng(6)
    for delay in [0.0, *random.uniform(0, 0.5, 5)]:
        job = ACCEPTED[name]()
        job.wait(delay)
        job.accept()
        result = job.result()
        assert result.certificate.ok
    job = ACCEPTED[name]()
    assert job.wait(60.0)
    job.accept()  # too late
    result = job.result()
    assert result.stats.get("time_limit_reached", 0) == 0 and np.isfinite(result.uv).all()


def test_a_search_for_seams_that_is_accepted_lays_flat_what_is_cut_by_then():
    vertices, faces = bumpy_grid(70, 70)
    x, y = 9.0 * vertices[:, :2].T
    hills = np.column_stack([x, y, 2.0 * np.sin(3.0 * x) * np.cos(2.0 * y + x)])
    job = ff.jobs.unwrap(hills, faces)
    assert not job.wait(0.3), "too easy a mesh for this test"
    job.accept()
    early = job.result()
    assert early.certificate.ok and early.certificate.overlaps == 0
    assert early.stats["time_limit_reached"] == 1
    assert early.certificate.energy < 3.0, "and not the first map that there is"
