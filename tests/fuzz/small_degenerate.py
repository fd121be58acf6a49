"""Degenerate meshes of up to 12 faces: every call without a limit of time ends in seconds, with a result or a reason.

    export PYTHONPATH=build/python:tests:tests/fuzz:benchmarks
    small_degenerate.py [--calls 10000] [--seed 0] [--jobs 1] [--seconds 5] [--only NAME]
    small_degenerate.py --repeat SEED

Call number i uses the seed `seed + i` and nothing else. One that has spent more than --seconds CPU seconds is cancelled; it is
a finding, as is any exception that is not the package's own. Exit status 1 if there are any.
"""

from __future__ import annotations

import argparse
import multiprocessing
import sys
import time
from collections import Counter
from collections.abc import Callable
from typing import Any

import numpy as np
from degenerate_meshes import degenerate_mesh, open_edges, some_angles

import flipfree as ff

from surfaces import Mesh

MOST_FACES = 12

#: Name -> arguments of the job, for a mesh and a generator.
Arguments = Callable[[Mesh, np.random.Generator], dict[str, Any]]


def small_mesh(random: np.random.Generator) -> Mesh:
    while True:
        vertices, faces = degenerate_mesh(random)
        if len(faces) <= MOST_FACES:
            return vertices, faces


def some_uv(mesh: Mesh, random: np.random.Generator) -> Any:
    """Two of the mesh's own coordinates, or any."""
    if random.integers(2):
        return mesh[0][mesh[1]][:, :, random.permutation(3)[:2]]
    return random.normal(size=(len(mesh[1]), 3, 2)) * 10.0 ** random.uniform(-20, 20)


def few_pins(mesh: Mesh, random: np.random.Generator) -> Any:
    count = min(len(mesh[0]), int(random.integers(1, 4)))
    vertices = random.choice(len(mesh[0]), count, replace=False)
    return {int(v): tuple(random.uniform(size=2)) for v in vertices}


def corners(mesh: Mesh, random: np.random.Generator) -> Any:
    rim = np.unique(open_edges(mesh[1]))
    return random.choice(rim, min(len(rim), 4), replace=False) if len(rim) else []


def some_cones(mesh: Mesh, random: np.random.Generator) -> Any:
    """Eight of index 3, or fewer of less, for a closed mesh of genus 0."""
    order = random.permutation(len(mesh[0]))
    if len(order) >= 8 and random.integers(2):
        return {int(v): 3 for v in order[:8]}
    return {int(v): 2 for v in order[:4]}


CALLS: dict[str, Arguments] = {
    "unwrap": lambda m, r: {},
    "unwrap given": lambda m, r: {"seams": "given"},
    "auto_seams": lambda m, r: {},
    "conformal_metric": lambda m, r: {"target_angles": some_angles(m[1], len(m[0]), r)},
    "conformal": lambda m, r: {"target_angles": some_angles(m[1], len(m[0]), r)},
    "boundary_angles free": lambda m, r: {"boundary": "free"},
    "boundary_angles straight": lambda m, r: {"boundary": "straight", "corners": corners(m, r)},
    "boundary_angles circle": lambda m, r: {"boundary": "circle"},
    "suggest_cones": lambda m, r: {"quarter_turns": bool(r.integers(2))},
    "cross_field": lambda m, r: {},
    "field_aligned": lambda m, r: {},
    "quads": lambda m, r: {"target": int(r.integers(1, 60))},
    "seamless": lambda m, r: {"cones": some_cones(m, r)},
    "admissible_cut": lambda m, r: {"cones": some_cones(m, r)},
    "match": lambda m, r: {"points": few_pins(m, r)},
    "embed": lambda m, r: {"optimise": bool(r.integers(2))},
    "pack": lambda m, r: {"uv": some_uv(m, r)},
    "certify": lambda m, r: {"uv": some_uv(m, r)},
    "rectify": lambda m, r: {"polygons": np.arange(len(m[1])) // 2},
    "repair": lambda m, r: {"uv": some_uv(m, r)},
    "improve": lambda m, r: {"uv": some_uv(m, r)},
}


def outcome(seed: int, seconds: float, only: str = "") -> tuple[str, str, float]:
    """(call, what came of it, CPU seconds). What came of it begins with BAD if it should not."""
    random = np.random.default_rng(seed)
    names = [name for name in CALLS if only in name]
    name = names[random.integers(len(names))]
    mesh = small_mesh(random)
    own = CALLS[name](mesh, random)
    start = time.process_time()

    def spent() -> float:
        return time.process_time() - start

    late = False
    try:
        if name == "improve":
            job = ff.jobs.improve((*mesh, own["uv"]))
        else:
            job = getattr(ff.jobs, name.split()[0])(*mesh, **own)
        while not job.wait(0.05):
            if spent() > seconds:
                late = True
                job.cancel()
                break
        job.result()
        return name, "result", spent()
    except ff.Cancelled:
        return name, "BAD late" if late else "BAD cancelled", spent()
    except ff.FlipfreeError as error:
        foreign = error.code == "internal error" or len(str(error)) < 20
        return name, f"{'BAD ' if foreign else ''}{type(error).__name__}: {error.code}", spent()
    except Exception as error:
        return name, f"BAD {type(error).__name__}: {error}", spent()


def work(task: tuple[int, float, str]) -> tuple[int, str, str, float]:
    name, what, spent = outcome(*task)
    if what.startswith("BAD"):
        print(f"seed {task[0]}: {name}: {what}", flush=True)
    return task[0], name, what, spent


def run(
    first: int, last: int, seconds: float, only: str = "", jobs: int = 1
) -> list[tuple[int, str, str, float]]:
    """(seed, call, what came of it, CPU seconds)."""
    tasks = [(seed, seconds, only) for seed in range(first, last)]
    if jobs == 1:
        return [work(task) for task in tasks]
    with multiprocessing.get_context("spawn").Pool(jobs) as pool:
        return pool.map(work, tasks, chunksize=20)


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--calls", type=int, default=10_000)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--jobs", type=int, default=1)
    parser.add_argument("--seconds", type=float, default=5.0)
    parser.add_argument("--only", default="", help="part of a call's name")
    parser.add_argument("--repeat", type=int)
    args = parser.parse_args()
    if args.repeat is not None:
        print(*outcome(args.repeat, args.seconds, args.only))
        return 0
    rows = run(args.seed, args.seed + args.calls, args.seconds, args.only, args.jobs)
    for (name, what), count in sorted(Counter((row[1], row[2]) for row in rows).items()):
        print(f"{count:6d}  {name}: {what}")
    for seed, name, what, spent in sorted(rows, key=lambda row: -row[3])[:5]:
        print(f"{spent:7.3f} s  seed {seed}: {name}: {what}")
    return any(row[2].startswith("BAD") for row in rows)


if __name__ == "__main__":
    sys.exit(main())
