"""The package's functions as jobs: same arguments, but they return at once with a :class:`flipfree.job.Job`.

For user interfaces: poll ``job.wait(0.0)`` and ``job.progress()``, offer ``job.cancel()``, collect ``job.result()``.
"""

from collections.abc import Callable
from typing import Any

from .job import JOBS
from .job import Job as Job


def __getattr__(name: str) -> Callable[..., Job[Any]]:
    """What starts the job of the call of that name."""
    if name in JOBS:
        return JOBS[name]
    raise AttributeError(f"no call of a solver has the name {name}")
