# SPDX-License-Identifier: GPL-3.0-or-later
"""Solving in a process of its own, which may crash or be killed without harm to Blender.

    Run --of(tasks)--> SolverProcess or None; within(process): the calls of `jobs` go there

The process is Blender's own Python with the solver package, nothing of Blender in it. It ends with the run, and with Blender
however that ends.
"""

import contextlib
import sys
from contextvars import ContextVar

import flipfree
from flipfree.process import client

from .. import preferences

_current: ContextVar[client.SolverProcess | None] = ContextVar("process", default=None)


class _Jobs:
    """As flipfree.jobs: each function starts its job, in the process that `within` has said, or else in this one."""

    def __getattr__(self, name: str):
        process = _current.get()
        if process is None:
            return getattr(flipfree.jobs, name)
        return lambda *arguments, **options: process.start(name, *arguments, **options)


jobs = _Jobs()


def of(tasks) -> client.SolverProcess | None:
    """The process for a run of these tasks, as the preferences want it; None: they are solved in Blender's own."""
    least = preferences.separate_from()
    if least is None or sum(len(task.snapshot.triangles) for task in tasks) < least:
        return None
    # Where nobody has asked for a process, having none is no reason to refuse.
    return client.SolverProcess(command(), or_here=least > 0)


@contextlib.contextmanager
def within(process: client.SolverProcess | None):
    """Jobs are started in this process meanwhile; None: in Blender's own."""
    token = _current.set(process)
    try:
        yield
    finally:
        _current.reset(token)


def command() -> list[str]:
    """What starts Blender's own Python."""
    return [sys.executable]
