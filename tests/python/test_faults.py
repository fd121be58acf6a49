"""Calls that are cancelled, accepted or out of time at any moment: our own exception or a valid result, soon,
and the next call as if nothing had been."""

from __future__ import annotations

import time

import numpy as np
import pytest
from small_calls import BALL, CALLS

import flipfree as ff

#: Seconds that a call may come back late on a loaded machine.
LATEST = 5.0


@pytest.mark.parametrize("name", CALLS)
def test_a_call_that_was_cancelled_leaves_nothing_behind(name):
    call = CALLS[name]
    expected = call()
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


def test_accepting_at_any_moment_gives_a_certified_map():
    random = np.random.default_rng(6)
    for delay in random.uniform(0, 0.5, 10):
        job = ff.jobs.unwrap(*BALL, seams="given")
        job.wait(delay)
        job.accept()
        assert job.result().certificate.ok
