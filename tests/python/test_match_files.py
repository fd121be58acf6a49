"""python -m flipfree match: outlines, paths and movable boundaries of the file with the pins."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from embedding_meshes import boundary_loop, wavy_grid

import flipfree as ff

N = 8


def run(folder: Path, pins: dict[str, Any], *words: str) -> dict[str, Any]:
    disk = wavy_grid(N, N)
    model = folder / "disk.obj"
    ff.write(model, (disk.vertices, disk.faces))
    Path(f"{model}.pins.json").write_text(json.dumps(pins))
    results = folder / "r.jsonl"
    results.unlink(missing_ok=True)
    command = [sys.executable, "-m", "flipfree", "match", str(model), "--out", str(folder / "uv")]
    subprocess.run([*command, "--json", str(results), *words], capture_output=True, check=True)
    (record,) = map(json.loads, results.read_text().splitlines())
    return dict(record)


def stretched() -> tuple[list[int], np.ndarray]:
    """The grid's boundary, and places twice as wide as high."""
    disk = wavy_grid(N, N)
    loop = list(map(int, boundary_loop(disk.faces)))
    return loop, disk.vertices[loop, :2] * [2.0, 1.0]


def places(folder: Path) -> np.ndarray:
    mesh = ff.read(folder / "uv" / "disk.obj")
    assert mesh.uv is not None
    uv = np.empty((len(mesh.vertices), 2))
    uv[mesh.faces] = mesh.uv
    return uv


def test_whole_outlines_are_met_and_parts_of_them_may_move(tmp_path: Path) -> None:
    loop, uv = stretched()
    outline = {"vertices": loop, "uv": uv.tolist()}
    record = run(tmp_path, {"outline": outline})
    assert record["status"] in ("certified", "warned") and record["certificate"]["ok"]
    assert np.array_equal(places(tmp_path)[loop], uv.astype(np.float32))
    movable = loop[1:4]
    record = run(tmp_path, {"outline": outline, "movable": movable})
    assert record["certificate"]["ok"], record["message"]
    moved = np.abs(places(tmp_path)[loop] - uv.astype(np.float32)).max(axis=1)
    assert moved[1:4].max() > 1e-6 and moved[[0, *range(4, len(loop))]].max() == 0.0


def test_paths_and_lines_are_met_within_an_outline(tmp_path: Path) -> None:
    loop, uv = stretched()
    disk = wavy_grid(N, N)
    inner = next(v for v in range(len(disk.vertices)) if v not in loop and v - 1 in loop)
    target = disk.vertices[inner, :2] * [2.0, 1.0]
    pins = {
        "outline": {"vertices": loop, "uv": uv.tolist()},
        "points": {str(inner): target.tolist()},
        "paths": {str(inner): [inner, inner - 1]},
    }
    record = run(tmp_path, pins)
    assert record["status"] in ("certified", "warned"), record["message"]
    assert np.array_equal(places(tmp_path)[inner], target.astype(np.float32))


@pytest.mark.parametrize(
    "pins",
    [
        {"outline": {"vertices": [0, 1, 2], "uv": [[0, 0]]}},
        {"outline": [1, 2]},
        {"points": {"0": [0, 0]}, "movable": 3},
        {"points": {"0": [0, 0]}, "paths": {"0": "x"}},
        {"points": {"0": [0, 0]}, "movable": [999]},
    ],
)
def test_files_that_make_no_sense_are_refused(tmp_path: Path, pins: dict[str, Any]) -> None:
    record = run(tmp_path, pins)
    assert record["status"] == "refused" and "orrect" in record["message"]


def test_new_vertices_may_be_refused(tmp_path: Path) -> None:
    loop, uv = stretched()
    middle = (N + 1) * (N // 2) + N // 2
    near = [middle - 1, middle + 1]
    at = wavy_grid(N, N).vertices[near[::-1], :2] * [2.0, 1.0]
    swapped = dict(zip(map(str, near), at.tolist(), strict=True))
    pins = {"outline": {"vertices": loop, "uv": uv.tolist()}, "points": swapped}
    record = run(tmp_path, pins)
    assert record["status"] in ("certified", "warned"), record["message"]
    refused = run(tmp_path, pins, "--no-new-vertices")
    assert (refused["status"] == "refused") == (record["vertices_added"] > 0)
