"""Issue 5, case 3: a surface into a space-filling polygon (Hilbert's curve, thickened) with three random inner pins.

    PYTHONPATH=build/python python3 benchmarks/match_hilbert.py [--data FOLDER] [--orders 3 4 5] [--seeds 3] [--pins 3] [--pictures FOLDER]
"""

from __future__ import annotations

import argparse
import os
from pathlib import Path

import numpy as np
from match_constraints import report

from mesh_files import read_mesh

FILES = ("constraints/camel_b_uv.obj", "constraints/cow_uv.obj", "conformal/disk5k.obj")


def hilbert(order: int) -> np.ndarray:
    """Centres of the cells in the order in which Hilbert's curve visits them, (4^order, 2)."""
    points = np.zeros((1, 2))
    for level in range(order):
        size = 2**level
        turned = points[:, ::-1]
        points = np.concatenate(
            [
                turned,
                points + [0, size],
                points + [size, size],
                np.array([2 * size - 1, size - 1]) - turned,
            ]
        )
    return points


def outline(order: int, count: int) -> np.ndarray:
    """`count` points, counter-clockwise, on the outline of the curve thickened to half a cell."""
    centres = hilbert(order)
    before = np.vstack([centres[:1] * 2 - centres[1:2], centres[:-1]])
    after = np.vstack([centres[1:], centres[-1:] * 2 - centres[-2:-1]])
    first, second = centres - before, after - centres
    normal = np.stack([-first[:, 1] - second[:, 1], first[:, 0] + second[:, 0]], 1)
    straight = (first == second).all(1)
    offset = np.where(straight[:, None], normal / 2, normal) * 0.25
    ring = np.concatenate([centres - offset, (centres + offset)[::-1]])
    side = np.linalg.norm(np.roll(ring, -1, 0) - ring, axis=1)
    # Every corner gets a point, longer sides the rest; the mesh must have enough boundary vertices.
    extra = count - len(ring)
    if extra < 0:
        raise ValueError(f"{count} boundary vertices are too few for {len(ring)} corners")
    share = np.floor(np.cumsum(side) / side.sum() * extra + 1e-9).astype(int)
    more = np.diff(np.concatenate([[0], share]))
    following = np.roll(ring, -1, 0)
    parts = [
        ring[i] + (following[i] - ring[i]) * np.arange(more[i] + 1)[:, None] / (more[i] + 1)
        for i in range(len(ring))
    ]
    return np.concatenate(parts)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--data", default=os.environ.get("FLIPFREE_DATA", "../shared/data"))
    parser.add_argument("--orders", type=int, nargs="+", default=[3, 4, 5])
    parser.add_argument("--seeds", type=int, default=3)
    parser.add_argument("--pins", type=int, default=3)
    parser.add_argument("--pictures", type=Path, default=None)
    parser.add_argument("files", nargs="*", default=FILES)
    options = parser.parse_args()
    for file in options.files:
        mesh = read_mesh(Path(options.data) / file)
        directed = {(int(f[k]), int(f[(k + 1) % 3])) for f in mesh.faces for k in range(3)}
        follows = {a: b for a, b in directed if (b, a) not in directed}
        loop = [min(follows)]
        while follows[loop[-1]] != loop[0]:
            loop.append(follows[loop[-1]])
        inner = np.setdiff1d(np.unique(mesh.faces), loop)
        for order in options.orders:
            name = f"{Path(file).stem} order {order}"
            try:
                target = outline(order, len(loop))
            except ValueError as error:
                print(f"{name}: skipped, {error}", flush=True)
                continue
            for seed in range(options.seeds):
                random = np.random.default_rng(seed)
                cells = hilbert(order)[random.choice(4**order, options.pins, replace=False)]
                pins = cells + random.uniform(-0.15, 0.15, (options.pins, 2))
                ids = random.choice(inner, options.pins, replace=False)
                points = {int(v): (float(p[0]), float(p[1])) for v, p in zip(ids, pins, strict=True)}
                report(
                    f"{name} seed {seed}",
                    options.pictures,
                    mesh.vertices,
                    mesh.faces,
                    boundary_loop=loop,
                    boundary_uv=target,
                    points=points,
                )


if __name__ == "__main__":
    main()
