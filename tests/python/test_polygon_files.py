"""Polygons of files: mapped where they lie, written with the corners and vertex numbers they came with."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from flipfree.__main__ import main

U = [(0, 0), (3, 0), (3, 3), (2, 3), (2, 1), (1, 1), (1, 3), (0, 3)]
WALL = [(0, 0), (4, 0), (4, 4), (0, 4), (1, 1), (1, 3), (3, 3), (3, 1)]
BRIDGE = [0, 1, 2, 3, 0, 4, 5, 6, 7, 4]
KINDS = {
    "u": (U, [list(range(8))]),
    "u from corner 3": (U, [[3, 4, 5, 6, 7, 0, 1, 2]]),
    "window": (WALL, [BRIDGE]),
    "window with a pane": (WALL, [BRIDGE, [4, 7, 6, 5]]),
    "window, twins": ([*WALL, (0, 0), (1, 1)], [[0, 1, 2, 3, 8, 9, 5, 6, 7, 4]]),
    "spike": ([*U[:3], (0, 3), (1, 1)], [[0, 4, 0, 1, 2, 3]]),
    "corner twice": (WALL[:4], [[0, 1, 1, 2, 3]]),
}


def doubled(places: np.ndarray) -> float:
    """Twice the area of an outline, with its sign."""
    x, y = places[:, 0] - places[0, 0], places[:, 1] - places[0, 1]
    return float((x * np.roll(y, -1) - y * np.roll(x, -1)).sum())


@pytest.mark.parametrize("kind", KINDS)
def test_planar_polygons_of_files_come_back_whole_and_congruent(kind: str, tmp_path: Path) -> None:
    corners, polygons = KINDS[kind]
    rows = [f"{x} {y} {x + y}" for x, y in corners]
    rows += [" ".join(map(str, [len(polygon), *polygon])) for polygon in polygons]
    (tmp_path / "in.off").write_text("\n".join([f"OFF {len(corners)} {len(polygons)} 0", *rows]))
    assert main(["unwrap", str(tmp_path / "in.off"), str(tmp_path / "out.obj")]) == 0
    lines = [line.split() for line in (tmp_path / "out.obj").read_text().splitlines()]
    assert len([1 for line in lines if line[0] == "v"]) == len(corners)
    uv = np.array([line[1:] for line in lines if line[0] == "vt"], float)
    written = [[c.split("/") for c in line[1:]] for line in lines if line[0] == "f"]
    assert [[int(v) - 1 for v, _ in face] for face in written] == polygons
    scales = [
        doubled(uv[[int(t) - 1 for _, t in face]]) / doubled(np.array(corners, float)[polygon])
        for face, polygon in zip(written, polygons, strict=True)
    ]
    assert np.ptp(scales) < 1e-6 * np.mean(scales)
    if kind not in ("spike", "corner twice"):  # corners without area have a shape of their own
        for face, polygon in zip(written, polygons, strict=True):
            flat = np.array(corners, float)[polygon]
            solid = np.c_[flat, flat.sum(axis=1)]
            found = uv[[int(t) - 1 for _, t in face]]
            apart = np.linalg.norm(solid[:, None] - solid, axis=2)
            mapped = np.linalg.norm(found[:, None] - found, axis=2)
            scale = mapped.sum() / apart.sum()
            assert np.abs(mapped - scale * apart).max() < 1e-5 * mapped.max()
