"""How late `match` comes back with a limit of time: random cases and limits.

    PYTHONPATH=build/python python3 benchmarks/match_deadline.py [--data FOLDER] [--cases 80] [--first 0]

3 to 50 random pins on disks of the shared data folder, with a free boundary, in a circle or in a star; limits between
0.05 and 12 seconds of the clock, evenly in their logarithm. A line per case: limit, how much later it came back, what
with. Every map is certified and has its pins bit for bit, or the case fails.
"""

from __future__ import annotations

import argparse
import os
from collections import Counter
from pathlib import Path

import numpy as np
from embedding_meshes import boundary_loop

import flipfree as ff

from cost import timed
from mesh_files import cut_pieces, read_mesh
from random_pins import pinned

FILES = (
    "constraints/camel_b_uv.obj",
    "constraints/cow_uv.obj",
    "conformal/fertility_tri.obj",
    "embedding/nested_tri_200.obj",
    "general/bimba1.obj",
    "general/hand_lowres.obj",
    "general/lucy_o_f24136.obj",
    "general/snail.obj",
    "general/torusOnPlane.obj",
)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--data", default=os.environ.get("FLIPFREE_DATA", "../shared/data"))
    parser.add_argument("--cases", type=int, default=80)
    parser.add_argument("--first", type=int, default=0)
    options = parser.parse_args()
    late = []
    outcomes: Counter[str] = Counter()
    for case in range(options.first, options.first + options.cases):
        random = np.random.default_rng(case)
        file = FILES[random.integers(len(FILES))]
        vertices, faces = max(
            cut_pieces(read_mesh(Path(options.data) / file)), key=lambda piece: len(piece[1])
        )
        boundary = ("free", "circle", "star")[random.integers(3)]
        ids = random.choice(np.unique(faces), random.choice([3, 10, 20, 30, 50]), replace=False)
        arguments = {}
        low, size = 0.0, 1.0
        if boundary != "free":
            loop = boundary_loop(faces)
            angle = 2 * np.pi * np.arange(len(loop)) / len(loop)
            radius = 1 + (0.5 * np.sin(4 * angle) if boundary == "star" else 0)
            arguments["boundary_loop"] = loop
            arguments["boundary_uv"] = np.column_stack(
                [radius * np.cos(angle), radius * np.sin(angle)]
            )
            ids = np.setdiff1d(ids, loop)
            low, size = -0.3, 0.6
        points = pinned(ids, low + size * random.random((len(ids), 2)))
        limit = float(np.exp(random.uniform(np.log(0.05), np.log(12))))
        with timed() as cost:
            try:
                result = ff.match(
                    vertices, faces, points=points, max_seconds=limit, threads=1, **arguments
                )
            except ff.NotConverged as error:
                result, outcome = None, error.code
        late.append(cost.wall - limit)
        if result is not None:
            met = all((result.uv[result.faces == v] == p).all() for v, p in points.items())
            assert result.certificate.ok and met, f"case {case}"
            outcome = "map, could be better" if result.stats["time_limit_reached"] else "map"
        outcomes[outcome] += 1
        print(
            f"{case:4d} {Path(file).stem:16s} {len(points):2d} pins {boundary:6s} limit {limit:6.2f} s "
            f"{late[-1]:+.2f} s  {outcome}",
            flush=True,
        )
    over = np.array([seconds for seconds in late if seconds > 0] or [0.0])
    print(dict(outcomes))
    print(
        f"late: {len(over)} of {len(late)}, median {np.median(over):.2f} s, 95 % {np.quantile(over, 0.95):.2f} s, "
        f"longest {over.max():.2f} s"
    )


if __name__ == "__main__":
    main()
