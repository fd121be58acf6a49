"""The package's own order: every option declared in one place; every algorithm has its doors, and the page that lists them is
the one the code makes."""

from __future__ import annotations

import inspect
import re
import runpy
from pathlib import Path

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


SCRIPT = Path(__file__).resolve().parents[2] / "scripts" / "doors.py"


def test_all_doors_are_open_and_listed(capsys: pytest.CaptureFixture[str]) -> None:
    assert runpy.run_path(str(SCRIPT))["main"]([]) == 0, capsys.readouterr().out


def test_a_missing_door_is_found() -> None:
    found = runpy.run_path(str(SCRIPT))
    door = found["_door"]("nothing | 1 | embedding/embed_surface no_such | none | none | none none")
    found["missing"].__globals__["DOORS"] = (*found["DOORS"][1:], door)
    told = "\n".join(found["missing"]())
    for word in ("no no_such()", "no none", "no operator", "embed of the package has no row"):
        assert word in told, told
