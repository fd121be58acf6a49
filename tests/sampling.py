# SPDX-License-Identifier: GPL-3.0-or-later
"""Long protocols: a run takes a sample of their cases, by a seed that it prints; `scripts/test.sh --long` takes all.

FLIPFREE_SEED chooses the sample (scripts/test.sh sets it from the commit), FLIPFREE_LONG=1 takes everything. Native tests read
the same variables (tests/native/faults/samples.h, tests/fuzz/replay.cpp).
"""

from __future__ import annotations

import os
import random
import sys
from collections import defaultdict
from collections.abc import Sequence
from typing import Any, TypeVar

T = TypeVar("T")

SEED = int(os.environ.get("FLIPFREE_SEED", "1"))
LONG = os.environ.get("FLIPFREE_LONG", "") not in ("", "0")


def sampled(values: Sequence[T], keep: int, name: str = "") -> list[T]:
    """`keep` of the values in their order, all of them in a long run; `name` makes samples independent of each other."""
    if LONG or keep >= len(values):
        return list(values)
    chosen = random.Random(f"{SEED} {name} {sys.version_info.minor}").sample(
        range(len(values)), keep
    )
    return [values[i] for i in sorted(chosen)]


def halved(values: Sequence[T], name: str = "") -> list[T]:
    """One half of the values in their order, the other in Pythons that are one version apart, as those of the two Blenders
    are; all of them in a long run."""
    if LONG:
        return list(values)
    order = random.Random(f"{SEED} {name}").sample(range(len(values)), len(values))
    return [values[i] for i in sorted(order[sys.version_info.minor % 2 :: 2])]


def pytest_configure(config: Any) -> None:
    config.addinivalue_line(
        "markers",
        "sample(keep): a run takes so many of the marked tests of a file, a long run takes all",
    )
    config.addinivalue_line(
        "markers",
        "halved: each of the marked tests runs in one of two Blenders, in a long run in both",
    )


def pytest_report_header() -> str:
    if LONG:
        return "all cases of long protocols (FLIPFREE_LONG)"
    return f"long protocols: a sample by FLIPFREE_SEED={SEED}; all by FLIPFREE_LONG=1"


def pytest_collection_modifyitems(config: Any, items: list[Any]) -> None:
    """Tests of one file under marks of the same number are one group."""
    groups: dict[tuple[str, int], list[Any]] = defaultdict(list)
    for item in items:
        for mark in item.iter_markers("sample"):
            groups[item.nodeid.split("::")[0], mark.args[0]].append(item)
            break
    left = {
        id(item)
        for (file, keep), group in groups.items()
        for item in set(group) - set(sampled(group, keep, file))
    }
    marked = [item for item in items if item.get_closest_marker("halved")]
    left |= {id(item) for item in set(marked) - set(halved(marked, "tests"))}
    if left:
        config.hook.pytest_deselected(items=[item for item in items if id(item) in left])
        items[:] = [item for item in items if id(item) not in left]
