"""python -m flipfree match: outlines, paths and movable boundaries of the file with the pins."""

from __future__ import annotations

from typing import Any

import commands
import numpy as np
import pytest
from embedding_meshes import Disk, boundary_loop, wavy_grid

import flipfree as ff
from flipfree.calls.matching import edges_between_pins

from surfaces import octahedron_sphere

pytestmark = pytest.mark.usefixtures("here")
N = 8


def run(pins: dict[str, Any], *words: str, surface: Any = None) -> dict[str, Any]:
    disk = surface or wavy_grid(N, N)
    commands.put("disk.obj", (disk.vertices, disk.faces), pins=pins)
    return commands.run("match", "disk.obj", "--out", "uv", *words)


def stretched() -> tuple[list[int], np.ndarray]:
    """The grid's boundary, and places twice as wide as high."""
    disk = wavy_grid(N, N)
    loop = list(map(int, boundary_loop(disk.faces)))
    return loop, disk.vertices[loop, :2] * [2.0, 1.0]


def places() -> np.ndarray:
    mesh = ff.read("uv/disk.obj")
    assert mesh.uv is not None
    uv = np.empty((len(mesh.vertices), 2))
    uv[mesh.faces] = mesh.uv
    return uv


def test_whole_outlines_are_met_and_parts_of_them_may_move() -> None:
    loop, uv = stretched()
    outline = {"vertices": loop, "uv": uv.tolist()}
    record = run({"outline": outline})
    assert record["status"] in ("certified", "warned") and record["certificate"]["ok"]
    assert np.array_equal(places()[loop], uv.astype(np.float32))
    movable = loop[1:4]
    record = run({"outline": outline, "movable": movable})
    assert record["certificate"]["ok"], record["message"]
    moved = np.abs(places()[loop] - uv.astype(np.float32)).max(axis=1)
    assert moved[1:4].max() > 1e-6 and moved[[0, *range(4, len(loop))]].max() == 0.0


def test_paths_and_lines_are_met_within_an_outline() -> None:
    loop, uv = stretched()
    disk = wavy_grid(N, N)
    inner = next(v for v in range(len(disk.vertices)) if v not in loop and v - 1 in loop)
    target = disk.vertices[inner, :2] * [2.0, 1.0]
    pins = {
        "outline": {"vertices": loop, "uv": uv.tolist()},
        "points": {str(inner): target.tolist()},
        "paths": {str(inner): [inner, inner - 1]},
    }
    record = run(pins)
    assert record["status"] in ("certified", "warned"), record["message"]
    assert np.array_equal(places()[inner], target.astype(np.float32))


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
def test_files_that_make_no_sense_are_refused(pins: dict[str, Any]) -> None:
    record = run(pins)
    assert record["status"] == "refused" and "orrect" in record["message"]


def test_new_vertices_may_be_refused() -> None:
    loop, uv = stretched()
    middle = (N + 1) * (N // 2) + N // 2
    near = [middle - 1, middle + 1]
    at = wavy_grid(N, N).vertices[near[::-1], :2] * [2.0, 1.0]
    swapped = dict(zip(map(str, near), at.tolist(), strict=True))
    pins = {"outline": {"vertices": loop, "uv": uv.tolist()}, "points": swapped}
    record = run(pins)
    assert record["status"] in ("certified", "warned"), record["message"]
    refused = run(pins, "--no-new-vertices")
    assert (refused["status"] == "refused") == (record["vertices_added"] > 0)


def solved(vertices: Any, faces: Any, points: dict[int, Any], *words: str) -> tuple[Any, Any]:
    """The record, and the file that was written."""
    pins = {"points": {str(v): list(map(float, uv)) for v, uv in points.items()}}
    record = run(pins, *words, surface=Disk("disk", vertices, faces))
    return record, ff.read("uv/disk.obj") if record.get("written") else None


def test_closed_parts_are_cut_open_where_that_is_asked_for() -> None:
    ball = octahedron_sphere(2)
    at = {0: (0.1, 0.2), 5: (0.9, 0.7)}
    record, _ = solved(*ball, at)
    assert record["status"] == "refused", record
    record, file = solved(*ball, at, "--cut-open")
    assert record["certificate"]["ok"] and record["certificate"]["overlaps"] == 0, record
    for v, uv in at.items():
        assert (file.uv[file.faces == v] == np.float32(uv)).all()


def test_parts_without_pins_are_unwrapped_beside_the_others() -> None:
    disk = wavy_grid(N, N)
    vertices = np.concatenate([disk.vertices, disk.vertices + 3.0])
    faces = np.concatenate([disk.faces, disk.faces + len(disk.vertices)])
    at = {0: (0.0, 0.0), N: (0.3, 0.0)}
    record, _ = solved(vertices, faces, at)
    assert record["status"] == "refused" and "--unwrap-rest" in record["message"], record
    record, file = solved(vertices, faces, at, "--unwrap-rest")
    assert record["certificate"]["ok"] and record["certificate"]["island_overlaps"] == 0, record
    assert (file.uv[file.faces == N] == np.float32([0.3, 0.0])).all()


def test_edges_between_pins_stay_straight_unless_they_may_bend() -> None:
    # Two neighbours inside change places while a ring around them stays.
    disk = wavy_grid(N, N)
    a = (N + 1) * (N // 2) + N // 2
    ends = disk.vertices[[a, a + 1]]
    at = {int(v): disk.vertices[v, :2] for v in boundary_loop(disk.faces)}
    at |= {a: ends[1, :2], a + 1: ends[0, :2]}
    for words in ([], ["--bend-lines"]):
        record, file = solved(disk.vertices, disk.faces, at, *words)
        assert record["certificate"]["ok"], record
        if words:
            continue
        way = ends[1] - ends[0]
        share = (file.vertices - ends[0]) @ way / (way @ way)
        off = np.linalg.norm(file.vertices - ends[0] - share[:, None] * way, axis=1)
        uv = np.empty((len(file.vertices), 2))
        uv[file.faces] = file.uv
        d = uv[(off < 1e-6) & (share > 0.0) & (share < 1.0)] - ends[1, :2]
        assert np.abs(d[:, 0] * way[1] - d[:, 1] * way[0]).max(initial=0.0) < 1e-6


def test_which_edges_stay_straight() -> None:
    disk = wavy_grid(N, N)
    middle = (N + 1) * (N // 2) + N // 2
    row = [middle - 1, middle, middle + 1]
    edges = np.sort(np.concatenate([disk.faces[:, :2], disk.faces[:, 1:], disk.faces[:, ::2]]), 1)
    edges = np.unique(edges, axis=0)
    straight = edges_between_pins(disk.faces, edges, row, [])
    assert straight == [row[:2], row[1:]]
    assert edges_between_pins(disk.faces, edges, row, row[:2]) == [row[1:]]
    below = [v + N + 1 for v in row]
    for a, b in edges_between_pins(disk.faces, edges, row + below, []):
        other = disk.faces[(disk.faces == a).any(axis=1) & (disk.faces == b).any(axis=1)]
        assert not np.isin(other, row + below).all(axis=1).any()  # triangles with three pins
