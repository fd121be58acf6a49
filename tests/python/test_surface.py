"""The package's own order: what imports what, and every option declared in one place."""

from __future__ import annotations

import ast
import graphlib
import inspect
import re
from collections import Counter
from pathlib import Path

import deadlines
import pytest

import flipfree as ff
from flipfree.job import Job

from hostile_values import FUNCTIONS
from random_options import PARAMETERS

PACKAGE = Path(__file__).resolve().parents[2] / "native" / "python" / "flipfree"
TREES = {
    path.stem if path.stem != "__init__" else path.parent.name: ast.parse(path.read_text())
    for path in sorted(PACKAGE.rglob("*.py"))
}

#: Given to every function by the callers of PARAMETERS, or refused by all of them.
OTHERS = {"vertices", "faces", "boundary", "progress", "signature"}


def imported(tree: ast.Module) -> set[str]:
    """Modules of the package that a module imports anywhere, also for its types only."""
    found: set[str] = set()
    for node in ast.walk(tree):
        if isinstance(node, ast.ImportFrom) and node.level > 0:
            names = {alias.name for alias in node.names}
            found |= {node.module.split(".")[-1]} if node.module else names
    return found & set(TREES)


def test_no_module_imports_itself_in_a_circle() -> None:
    assert len(TREES) > 15
    graphlib.TopologicalSorter({name: imported(tree) for name, tree in TREES.items()}).prepare()


def test_no_two_functions_declare_the_same_options() -> None:
    declared: Counter[tuple[str, ...]] = Counter()
    for tree in TREES.values():
        for node in ast.walk(tree):
            if isinstance(node, ast.FunctionDef):
                options = tuple(sorted(a.arg for a in node.args.kwonlyargs if a.arg != "progress"))
                declared[options] += len(options) > 3
    assert sum(declared.values()) > 5
    assert max(declared.values()) == 1, declared.most_common(1)


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


def test_one_idea_has_one_name() -> None:
    for name, others in {
        "iterations": {"max_iterations", "steps"},
        "max_seconds": {"timeout"},
    }.items():
        # The limit of seamless maps is of an engine and an optimiser, and was given its name from outside.
        functions = {k: f for k, f in FUNCTIONS.items() if k != "seamless"}
        known = {p for f in functions.values() for p in inspect.signature(f).parameters}
        assert name in known
        assert not known & others


def test_jobs_are_jobs() -> None:
    vertices, faces = [[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2]]
    job = ff.jobs.unwrap(vertices, faces, seams="given")
    assert isinstance(job, Job)
    assert job.result().certificate.ok
