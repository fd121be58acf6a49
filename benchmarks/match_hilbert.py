"""Issue 5, case 3: a surface into a space-filling polygon (Hilbert's curve, thickened) with three random inner pins.

PYTHONPATH=build/python python3 benchmarks/match_hilbert.py [--data FOLDER] [--orders 3 4 5] [--seeds 3] [--pins 3] [--pictures FOLDER]
"""

from __future__ import annotations

import argparse
import heapq
import os
from pathlib import Path

import numpy as np
from embedding_meshes import boundary_loop
from match_constraints import report

from mesh_files import read_mesh
from random_pins import pinned

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
    # Every corner gets a point, longer sides the rest.
    extra = count - len(ring)
    share = np.floor(np.cumsum(side) / side.sum() * extra + 1e-9).astype(int)
    more = np.diff(np.concatenate([[0], share]))
    following = np.roll(ring, -1, 0)
    parts = [
        ring[i] + (following[i] - ring[i]) * np.arange(more[i] + 1)[:, None] / (more[i] + 1)
        for i in range(len(ring))
    ]
    return np.concatenate(parts)


def with_boundary(
    vertices: np.ndarray, faces: np.ndarray, count: int
) -> tuple[np.ndarray, np.ndarray, list[int]]:
    """The surface with at least `count` vertices on its boundary: the longest edges there are halved."""
    loop = boundary_loop(faces).tolist()
    corner = {(int(f[k]), int(f[(k + 1) % 3])): i for i, f in enumerate(faces) for k in range(3)}
    points, triangles = list(vertices), [tuple(map(int, f)) for f in faces]
    follows = dict(zip(loop, loop[1:] + loop[:1], strict=True))
    queue = [(-float(np.linalg.norm(points[a] - points[b])), a, b) for a, b in follows.items()]
    heapq.heapify(queue)
    while len(follows) < count:
        length, a, b = heapq.heappop(queue)
        i, m = corner[(a, b)], len(points)
        (c,) = (v for v in triangles[i] if v not in (a, b))
        points.append((points[a] + points[b]) / 2)
        triangles[i] = (a, m, c)
        corner[(a, m)], corner[(m, b)] = i, len(triangles)
        corner[(b, c)] = len(triangles)
        triangles.append((m, b, c))
        follows[a], follows[m] = m, b
        heapq.heappush(queue, (length / 2, a, m))
        heapq.heappush(queue, (length / 2, m, b))
    ordered = [loop[0]]
    while follows[ordered[-1]] != ordered[0]:
        ordered.append(follows[ordered[-1]])
    return np.array(points), np.array(triangles, np.int32), ordered


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
        for order in options.orders:
            name = f"{Path(file).stem} order {order}"
            # Every corner needs a boundary vertex.
            vertices, faces, loop = with_boundary(mesh.vertices, mesh.faces, 2 * 4**order)
            inner = np.setdiff1d(np.unique(faces), loop)
            target = outline(order, len(loop))
            for seed in range(options.seeds):
                random = np.random.default_rng(seed)
                cells = hilbert(order)[random.choice(4**order, options.pins, replace=False)]
                pins = cells + random.uniform(-0.15, 0.15, (options.pins, 2))
                ids = random.choice(inner, options.pins, replace=False)
                report(
                    f"{name} seed {seed}",
                    options.pictures,
                    vertices,
                    faces,
                    boundary_loop=loop,
                    boundary_uv=target,
                    points=pinned(ids, pins),
                )


if __name__ == "__main__":
    main()
