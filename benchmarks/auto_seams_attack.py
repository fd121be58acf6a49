"""Rough surfaces made at random: does every automatic seam lead to certified islands within the bound?

    PYTHONPATH=build/python:tests:tests/python python3 benchmarks/auto_seams_attack.py [--meshes 300] [--large 12] [--seed 0]
        [--seconds-per-10k 60]

Spheres, tori, open grids and tubes with noise of all sizes: --meshes of 20 to 3000 triangles, --large of 20 000 to 100 000. Each is
unwrapped with seams="auto" at a stretch of 1.1, 1.25 or 1.5, and its islands are measured by benchmarks/auto_seams.py, which shares
nothing with the search. Printed: every map that is not certified, overlaps, or has an island above either bound, with its seed.
Exit status 1 if there is one.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Callable
from typing import Any

import numpy as np
from auto_seams import Array, judge, most_ratio
from numpy.random import Generator

import flipfree as ff

from cost import timed
from surfaces import bumpy_grid, cylinder, torus

STRETCHES = (1.1, 1.25, 1.5)


def ball(sectors: int, rings: int) -> tuple[Array, Any]:
    """Closed, two poles."""
    height, turn = np.meshgrid(
        np.pi * np.arange(1, rings) / rings, 2 * np.pi * np.arange(sectors) / sectors, indexing="ij"
    )
    around = np.stack([np.cos(turn), np.sin(turn)], -1) * np.sin(height)[..., None]
    points = np.concatenate([around, np.cos(height)[..., None]], -1).reshape(-1, 3)
    low, high = len(points), len(points) + 1
    row = np.arange(sectors)
    following = (row + 1) % sectors
    faces = [np.stack([np.full(sectors, low), row, following], 1)]
    for r in range(rings - 2):
        a, b = r * sectors + row, r * sectors + following
        faces += [np.stack([a, a + sectors, b + sectors], 1), np.stack([a, b + sectors, b], 1)]
    last = (rings - 2) * sectors
    faces.append(np.stack([last + following, last + row, np.full(sectors, high)], 1))
    return np.vstack([points, [0, 0, 1], [0, 0, -1]]), np.concatenate(faces).astype(np.int32)


def rough(random: Generator, triangles: int) -> tuple[str, Array, Any]:
    """What it is, vertices, faces."""
    aspect = float(np.exp(random.uniform(-1.2, 1.2)))
    columns = max(int(np.sqrt(triangles / 2 * aspect)), 4)
    rows = max(triangles // 2 // columns, 4)
    kind = str(random.choice(["ball", "torus", "grid", "tube"]))
    makers: dict[str, Callable[[int, int], tuple[Array, Any]]] = {
        "ball": ball,
        "torus": torus,
        "grid": lambda c, r: bumpy_grid(c, r, float(random.uniform(0, 2))),
        "tube": cylinder,
    }
    vertices, faces = makers[kind](columns, rows)
    vertices = vertices.copy()
    lengths = np.linalg.norm(vertices[faces[:, 0]] - vertices[faces[:, 1]], axis=1)
    # Waves of a few lengths, then noise of a share of the edges' length.
    for _ in range(int(random.integers(0, 5))):
        direction = random.normal(size=3) * float(np.exp(random.uniform(0.0, 2.5)))
        push = random.normal(size=3) * random.uniform(0.0, 0.3)
        vertices += np.sin(vertices @ direction + random.uniform(0, 6))[:, None] * push
    noise = float(random.choice([0.0, 0.05, 0.2, 0.5]))
    vertices += noise * np.median(lengths) * random.normal(size=vertices.shape)
    return f"{kind} {columns} x {rows}, noise {noise:g}", vertices, faces


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--meshes", type=int, default=300)
    parser.add_argument("--large", type=int, default=12)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--seconds-per-10k", type=float, default=60.0)
    arguments = parser.parse_args()
    sizes = [(20, 3000)] * arguments.meshes + [(20_000, 100_000)] * arguments.large
    wrong, islands, slowest = 0, 0, 0.0
    for i, (low, high) in enumerate(sizes):
        random = np.random.default_rng([arguments.seed, i])
        triangles = int(np.exp(random.uniform(np.log(low), np.log(high))))
        what, vertices, faces = rough(random, triangles)
        stretch = float(random.choice(STRETCHES))
        name = f"seed {arguments.seed}, {i}: {what}, stretch {stretch:g}"
        try:
            with timed() as cost:
                result = ff.unwrap(vertices, faces, seams="auto", stretch=stretch)
        except ff.FlipfreeError as error:
            wrong += 1
            print(f"{name}: {error}", flush=True)
            continue
        f = judge(vertices, faces, result.uv32(), cost.cpu)
        islands += f.islands
        pace = cost.cpu / max(len(faces), 1000) * 1e4
        slowest = max(slowest, pace)
        faults = []
        if not f.valid:
            faults.append("not certified")
        if f.worst > 0.5 * (stretch + 1.0 / stretch) + 1e-5:
            faults.append(f"energy {f.worst:.4f}")
        if f.worst99 > most_ratio(stretch) + 1e-4:
            faults.append(f"ratio {f.worst99:.3f}")
        if pace > arguments.seconds_per_10k:
            faults.append("slow")
        if faults or len(faces) >= 20_000:
            print(
                f"{name}: {len(faces)} triangles, {f.islands} islands, seam {f.seam:.2f}, {cost.cpu:.1f} CPU s"
                f"{': ' if faults else ''}{', '.join(faults)}",
                flush=True,
            )
        wrong += bool(faults)
    print(
        f"{len(sizes)} meshes, {islands} islands, {wrong} wrong; at most {slowest:.1f} CPU s for 10 000 triangles"
    )
    return int(wrong > 0)


if __name__ == "__main__":
    sys.exit(main())
