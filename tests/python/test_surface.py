"""The package's own order: what imports what, and every option declared in one place."""

from __future__ import annotations

import inspect
import re

import deadlines
import pytest

import flipfree as ff

from hostile_values import FUNCTIONS
from random_options import PARAMETERS

#: Given to every function by the callers of PARAMETERS, or refused by all of them.
OTHERS = {"vertices", "faces", "boundary", "progress", "signature"}


@pytest.mark.parametrize("name", FUNCTIONS)
def test_a_job_has_the_arguments_of_its_function(name: str) -> None:
    blocking, start = inspect.signature(FUNCTIONS[name]), inspect.signature(getattr(ff.jobs, name))
    assert list(start.parameters.values()) == [
        p for p in blocking.parameters.values() if p.name != "progress"
    ]
    assert start.return_annotation == f"Job[{blocking.return_annotation}]"
    assert f"flipfree.{name}" in (getattr(ff.jobs, name).__doc__ or "")
    with pytest.raises(TypeError):
        getattr(ff.jobs, name)(progress=None)
    with pytest.raises(TypeError):
        FUNCTIONS[name]()
    with pytest.raises(TypeError):
        FUNCTIONS[name]([], [], unheard_of=1)


@pytest.mark.parametrize("name", FUNCTIONS)
def test_every_option_is_described_and_called_at_random(name: str) -> None:
    text = inspect.getdoc(FUNCTIONS[name]) or ""
    for parameter in inspect.signature(FUNCTIONS[name]).parameters:
        assert re.search(rf"\b{parameter}(, \w+)*:", text), f"{parameter} is not described"
        assert parameter in PARAMETERS or parameter in OTHERS


def test_options_of_the_random_calls_exist() -> None:
    known = {p for f in FUNCTIONS.values() for p in inspect.signature(f).parameters}
    assert set(PARAMETERS) <= known


def test_lateness_is_measured_of_every_call_with_a_limit() -> None:
    assert deadlines.without_a_row() == set()
