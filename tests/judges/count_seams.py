"""Makes random maps exactly seamless and counts in rationals: PYTHONPATH=build/python:tests python3 tests/judges/count_seams.py

Prints, per shape, seam edges and how many of them are exact in 64 and in 32 bits; the exit status is 1 unless all are,
and no triangle is flipped.
"""

from __future__ import annotations

import sys

from flipfree import _native

from judges.seams import seam_count
from judges.unfoldings import SHAPES, unfolding


def main() -> int:
    maps = int(sys.argv[1]) if len(sys.argv) > 1 else 1000
    failed = False
    print("| surface | maps | seam edges | exact in 64 bits | in 32 bits | flipped or torn |")
    print("|---|---|---|---|---|---|")
    for name, cells in SHAPES.items():
        edges = exact64 = exact32 = wrong = 0
        for seed in range(maps):
            given = unfolding(cells, 1 + seed % 3, seed)
            job = _native.exact_seams(
                given.vertices,
                given.faces,
                given.uv.reshape(-1, 2),
                given.cut_edges,
                seed % 2 > 0,
                0.0,
                1,
            )
            made = job.result()
            wide = seam_count(given.faces, made["uv64"])
            stored = seam_count(given.faces, made["uv32"])
            edges += wide.edges
            exact64 += wide.exact
            exact32 += stored.exact if stored.edges == wide.edges else 0
            wrong += wide.flipped + stored.flipped + wide.torn + stored.torn
        print(f"| {name} | {maps} | {edges} | {exact64} | {exact32} | {wrong} |", flush=True)
        failed = failed or not edges == exact64 == exact32 or wrong > 0
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
