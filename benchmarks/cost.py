"""What a piece of work cost."""

from __future__ import annotations

import resource
import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass


@dataclass
class Cost:
    """Seconds; those of processors are of all threads. Known when the block has ended, however it ended."""

    wall: float = 0.0
    user: float = 0.0
    cpu: float = 0.0  # user and system


@contextmanager
def timed() -> Iterator[Cost]:
    cost = Cost()
    wall, before = time.perf_counter(), resource.getrusage(resource.RUSAGE_SELF)
    try:
        yield cost
    finally:
        after = resource.getrusage(resource.RUSAGE_SELF)
        cost.wall = time.perf_counter() - wall
        cost.user = after.ru_utime - before.ru_utime
        cost.cpu = cost.user + after.ru_stime - before.ru_stime


def peak_gigabytes() -> float:
    """The most memory that this process has held."""
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 2**20
