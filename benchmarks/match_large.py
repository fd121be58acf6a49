"""Issue 5, case 5: ten random pins on a surface of 100k triangles.

    PYTHONPATH=build/python python3 benchmarks/match_large.py [--triangles 100000] [--pins 10] [--seeds 3] [--outline]

A bumpy square; random vertices to random points of the unit square. The boundary is free, or with --outline held on the
square. One line per seed.
"""

from __future__ import annotations

import argparse

import numpy as np
from embedding_meshes import boundary_loop

import flipfree as ff

from cost import timed
from random_pins import pins_in_square
from surfaces import bumpy_grid


def bumpy_square(triangles: int) -> tuple[np.ndarray, np.ndarray]:
    n = round((triangles / 2) ** 0.5)
    vertices, faces = bumpy_grid(n, n)
    x, y = vertices[:, 0], vertices[:, 1]
    vertices[:, 2] = 0.1 * np.sin(7 * np.pi * x) * np.sin(5 * np.pi * y)
    return vertices, faces


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
        loop = boundary_loop(faces).tolist()
        inner = np.setdiff1d(inner, loop)
        request = {"boundary_loop": loop, "boundary_uv": vertices[loop, :2]}
    for seed in range(options.seeds):
        points = pins_in_square(inner, options.pins, np.random.default_rng(seed))
        with timed() as cost:
            result = ff.match(vertices, faces, points=points, **request)
        print(
            f"{len(faces)} faces {options.pins} pins seed {seed}: ok {result.certificate.ok}  "
            f"added {result.stats['added_vertices']}  energy {result.certificate.energy:.3f}  "
            f"{result.stats['engine']}  {cost.user:.2f} s user, {cost.wall:.2f} s wall",
            flush=True,
        )


if __name__ == "__main__":
    main()
