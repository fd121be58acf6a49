"""Issue 5, case 5: ten random pins on a surface of 100k triangles.

    PYTHONPATH=build/python python3 benchmarks/match_large.py [--triangles 100000] [--pins 10] [--seeds 3] [--outline]

A bumpy square; random vertices to random points of the unit square. The boundary is free, or with --outline held on the
square. One line per seed.
"""

from __future__ import annotations

import argparse
import resource
import time

import numpy as np
from match_hilbert import boundary_loop

import flipfree as ff


def bumpy_square(triangles: int) -> tuple[np.ndarray, np.ndarray]:
    n = round((triangles / 2) ** 0.5)
    x, y = np.meshgrid(np.linspace(0, 1, n + 1), np.linspace(0, 1, n + 1))
    index = np.arange((n + 1) ** 2).reshape(n + 1, n + 1)
    a, b, c, d = index[:-1, :-1], index[:-1, 1:], index[1:, 1:], index[1:, :-1]
    faces = np.stack([np.stack([a, b, c], -1), np.stack([a, c, d], -1)], 2).reshape(-1, 3)
    z = 0.1 * np.sin(7 * np.pi * x) * np.sin(5 * np.pi * y)
    return np.stack([x, y, z], -1).reshape(-1, 3), faces.astype(np.int32)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--triangles", type=int, default=100_000)
    parser.add_argument("--pins", type=int, default=10)
    parser.add_argument("--seeds", type=int, default=3)
    parser.add_argument("--outline", action="store_true")
    options = parser.parse_args()
    vertices, faces = bumpy_square(options.triangles)
    inner, request = np.arange(len(vertices)), {}
    if options.outline:
        loop = boundary_loop(faces)
        inner = np.setdiff1d(inner, loop)
        request = {"boundary_loop": loop, "boundary_uv": vertices[loop, :2]}
    for seed in range(options.seeds):
        random = np.random.default_rng(seed)
        ids = inner[random.choice(len(inner), options.pins, replace=False)]
        points = {
            int(v): (float(u), float(w))
            for v, (u, w) in zip(ids, random.random((options.pins, 2)), strict=True)
        }
        before = resource.getrusage(resource.RUSAGE_SELF).ru_utime
        start = time.perf_counter()
        result = ff.match(vertices, faces, points=points, **request)
        wall = time.perf_counter() - start
        used = resource.getrusage(resource.RUSAGE_SELF).ru_utime - before
        print(
            f"{len(faces)} faces {options.pins} pins seed {seed}: ok {result.certificate.ok}  "
            f"added {result.stats['added_vertices']}  energy {result.certificate.energy:.3f}  "
            f"{result.stats['engine']}  {used:.2f} s user, {wall:.2f} s wall",
            flush=True,
        )


if __name__ == "__main__":
    main()
