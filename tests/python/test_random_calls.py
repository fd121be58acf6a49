"""A few of the random calls of tests/fuzz, which makes as many as there is time for; and what these found, made small."""

from __future__ import annotations

import os
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import flipfree as ff

from surfaces import bumpy_grid, octahedron_sphere

TESTS = Path(__file__).resolve().parent.parent
FOLDERS = [
    Path(ff.__file__).parent.parent, TESTS, TESTS / "python", TESTS.parent / "benchmarks",
]  # fmt: skip


def run(*arguments: str) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [sys.executable, str(TESTS / "fuzz" / "random_calls.py"), "--slack", "30", *arguments],
        capture_output=True,
        text=True,
        env={**os.environ, "PYTHONPATH": os.pathsep.join(map(str, FOLDERS))},
        check=False,
    )


def test_random_calls_keep_all_promises() -> None:
    done = run("--calls", "300", "--seed", "77000", "--jobs", "1")
    assert done.returncode == 0, done.stdout[-4000:] + done.stderr[-2000:]
    assert "300 calls from seed 77000 on, 0 findings" in done.stdout


def outcome(function: Callable[..., ff.Parametrization], *args: Any, **options: Any) -> str:
    """In words; what comes back is certified, and comes back in time."""
    end = time.monotonic() + 30.0
    try:
        result = function(*args, **options, progress=lambda _s, _f: time.monotonic() < end)
    except ff.Cancelled:
        raise AssertionError("not back after half a minute") from None
    except ff.FlipfreeError as error:
        return error.code
    assert result.certificate.ok
    return "ok"


@pytest.mark.parametrize("engine", ["auto", "first try", "outline", "arms", "matchmaker"])
def test_no_engine_needs_a_pin(engine: str) -> None:
    assert outcome(ff.match, *bumpy_grid(3, 3), engine=engine) != "internal error"


@pytest.mark.parametrize("exponent", [3, 20, 100, 200, 290])
def test_closed_pieces_beside_a_vertex_that_was_thrown_far(exponent: int) -> None:
    vertices, faces = bumpy_grid(2, 2)
    vertices[4] *= 10.0**exponent
    sphere, shell = octahedron_sphere(0)
    both = np.vstack([vertices, sphere]), np.vstack([faces, shell + len(vertices)])
    for pins in (None, {0: (0.0, 0.0), 8: (1.0, 1.0)}, {9: (0.5, 0.5)}):
        assert outcome(ff.unwrap, *both, pins=pins) != "internal error"


@pytest.mark.parametrize("exponent", [-300, -200, -100, 38, 39, 100, 200, 300])
@pytest.mark.parametrize("flat", [False, True])
def test_maps_of_any_size_are_packed_and_improved_or_refused(exponent: int, flat: bool) -> None:
    vertices, faces = bumpy_grid(4, 3)
    uv = vertices[faces][:, :, :2] * 10.0**exponent
    if flat:
        uv[:, :, 1] *= 1e-12
    for keep in (False, True):
        assert outcome(ff.pack, vertices, faces, uv, keep_bijective=keep) != "internal error"
        assert outcome(ff.improve, (vertices, faces, uv), keep_bijective=keep) != "internal error"


@pytest.mark.parametrize("exponent", [20, 100, 160, 250, 300])
def test_pins_on_a_surface_with_a_vertex_thrown_far(exponent: int) -> None:
    vertices, faces = bumpy_grid(4, 4)
    vertices[12] *= 10.0**exponent
    pins = {0: (-0.5, -1.4), 18: (2.1, 0.3), 24: (1.0, 1.0)}
    for bijective in (False, True):
        assert (
            outcome(ff.unwrap, vertices, faces, pins=pins, bijective=bijective) != "internal error"
        )
