"""A few of the random calls of tests/fuzz, which makes as many as there is time for."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

import flipfree as ff

TESTS = Path(__file__).resolve().parent.parent
FOLDERS = [Path(ff.__file__).parent.parent, TESTS / "python", TESTS.parent / "benchmarks"]

#: Seeds that found something once.
FOUND = {
    "unwrap": [10652, 11609, 11614, 12798],  # boundaries beyond the range of doubles
    "match": [10350, 11697, 12333, 12463, 12828, 12887],  # an engine without any pin
    "improve": [1485, 11993],
    "pack": [10167, 10725, 10872, 11802, 12198],
    "certify": [13658],
}
NAMES = "unwrap,embed,improve,pack,certify,match"


def run(*arguments: str) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [sys.executable, str(TESTS / "fuzz" / "random_calls.py"), "--slack", "30", *arguments],
        capture_output=True,
        text=True,
        env={**os.environ, "PYTHONPATH": os.pathsep.join(map(str, FOLDERS))},
        check=False,
    )


def test_random_calls_keep_all_promises() -> None:
    done = run("--calls", "300", "--seed", "77000", "--jobs", "1", "--only", NAMES)
    assert done.returncode == 0, done.stdout[-4000:] + done.stderr[-2000:]
    assert "300 calls from seed 77000 on, 0 findings" in done.stdout


@pytest.mark.parametrize("seed", [seed for seeds in FOUND.values() for seed in seeds])
def test_what_was_found_once_is_not_found_again(seed: int) -> None:
    done = run("--repeat", str(seed))
    assert done.returncode == 0, done.stdout[-2000:] + done.stderr[-2000:]
