"""Broken meshes by the thousand: is every face mapped, and what does a judge say that shares no code with ours?

    export PYTHONPATH=build/python:tests:tests/python:benchmarks
    separated_meshes.py [--meshes 10000] [--seed 0] [--jobs 2] [--auto-seams]

Exit status 1 at a face that is not mapped, a flip, a point covered twice, or an error.
"""

from __future__ import annotations

import argparse
import collections
import multiprocessing
import time
from functools import partial

import numpy as np
from broken_meshes import broken_mesh

import flipfree as ff

from judges.any_triangles import judge_any

#: Seconds that one mesh may take.
LIMIT = 60.0


def outcome(seed: int, auto: bool) -> tuple[str, str, float, int]:
    """Kind, what is wrong, seconds of the clock, faces. auto: with automatic seams."""
    kind, (vertices, faces) = broken_mesh(seed)
    begin = time.perf_counter()
    try:
        seams = "auto" if auto else "given"
        result = ff.unwrap(vertices, faces, max_seconds=LIMIT, threads=1, seams=seams)
    except ff.FlipfreeError as error:
        return kind, f"{type(error).__name__}: {error}", time.perf_counter() - begin, len(faces)
    seconds = time.perf_counter() - begin
    solid = sum(len(set(face)) == 3 for face in np.asarray(faces).tolist())
    wrong = [] if result.certificate.triangles == solid else ["not every face is mapped"]
    wrong += judge_any(faces, result.uv32()) + judge_any(faces, result.uv)
    again = ff.certify(vertices, faces, result.uv)
    wrong += [] if again.ok else [f"asked again: {again.failures}"]
    return kind, "; ".join(wrong), seconds, len(faces)


def main() -> int:
    parser = argparse.ArgumentParser()
    parser.add_argument("--meshes", type=int, default=10_000)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--jobs", type=int, default=2)
    parser.add_argument("--auto-seams", action="store_true")
    options = parser.parse_args()
    count: collections.Counter[str] = collections.Counter()
    bad: collections.Counter[str] = collections.Counter()
    longest: dict[str, float] = collections.defaultdict(float)
    sizes: dict[str, int] = collections.defaultdict(int)
    seeds = range(options.seed, options.seed + options.meshes)
    with multiprocessing.Pool(options.jobs) as pool:
        for seed, (kind, wrong, seconds, faces) in zip(
            seeds,
            pool.imap(partial(outcome, auto=options.auto_seams), seeds, chunksize=16),
            strict=True,
        ):
            count[kind] += 1
            sizes[kind] = max(sizes[kind], faces)
            longest[kind] = max(longest[kind], seconds)
            if wrong:
                bad[kind] += 1
                print(f"seed {seed} ({kind}): {wrong}", flush=True)
    print(
        "| kind | meshes | most faces | all faces mapped, nothing flipped or covered twice | longest, s |"
    )
    print("|---|---|---|---|---|")
    for kind in sorted(count):
        print(
            f"| {kind} | {count[kind]} | {sizes[kind]} | {count[kind] - bad[kind]} | {longest[kind]:.2f} |"
        )
    return 1 if bad else 0


if __name__ == "__main__":
    raise SystemExit(main())
