"""ff.repair: maps spoilt in many ways, and maps of Blender, repaired and judged by other code (tests/judges).

    repair.py spoilt [--maps 150] [--seed 0]      maps of our own unwrap, spoilt once or twice (tests/map_damage.py)
    repair.py broken                              the same of meshes that are no clean surface
    repair.py blender --blender PROGRAM           maps of Blender's own unwrap after pins of it were moved, by how many faces that folded

Each map is repaired twice, stretched islands kept and improved, with random options and pins (tests/fuzz/random_repairs.py); both are
judged in 64 and in 32 bits. With the data folder set a third of the surfaces are its models. Pins missed: no map that meets them was
found, and the call says so. Kept: corners, bit for bit. Energy above: maps without pins above 1.1 times the larger of the energy of
an unwrap along the same cuts and of that of the faces that the spoilt map had open; then above 1.1 times the unwrap's alone; islands:
each at its own best scale. Exit status 1 where the repair fails without pins, or the judge finds what the options exclude.
"""

from __future__ import annotations

import multiprocessing
import tempfile
from collections import defaultdict
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
from map_damage import map_of
from random_repairs import LIMIT, Outcome, Task, open_faces, random_cuts, random_mesh, repaired
from runner import Options, Row, in_blender, main, table

import flipfree as ff

FOLDS = {"no fold": 1, "1 to 9 folds": 10, "10 to 99": 100, "100 to 1023": 1024, "more": 10**9}
COLUMNS = (
    "damage | maps | repaired | judged wrong | pins missed | faces open before | kept | energy above"
    " | worst | above the unwrap's | worst | CPU s | improved: kept | above the unwrap's | worst"
    " | islands above | with pins | CPU s"
)


def above(ratios: list[float]) -> list[str]:
    compared = [ratio for ratio in ratios if ratio > 0]
    most = f"{max(compared, default=0):.2f}"
    return [f"{sum(ratio > 1.1 for ratio in compared)} of {len(compared)}", most]


def row(name: str, outcomes: list[Outcome]) -> Row:
    done = [o for o in outcomes if o.stats and not o.said]
    better = [o.improved for o in done if o.improved is not None]

    def mean(shares: list[float]) -> str:
        return f"{np.mean(shares or [0]):.2f}"

    yield from (name, len(outcomes), len(done), sum(bool(o.said) for o in outcomes))
    yield sum(o.missed for o in outcomes)
    yield mean([o.sound for o in done])
    yield mean([o.kept for o in done])
    yield from above([o.energy for o in done])
    yield from above([o.beside_unwrap for o in done])
    yield f"{sum(o.seconds for o in done):.1f}"
    yield mean([o.kept for o in better])
    yield from above([o.beside_unwrap for o in better])
    for pinned in (False, True):
        compared = [o for o in better if o.pinned == pinned]
        yield f"{sum(o.islands_above for o in compared)} of {sum(o.islands for o in compared)}"
    yield f"{sum(o.seconds for o in better):.1f}"


def rows(tasks: list[Task], options: Options) -> Iterator[Row]:
    by_damage: dict[str, list[Outcome]] = defaultdict(list)
    with multiprocessing.Pool(2) as pool:
        for outcome in pool.imap(repaired, tasks, chunksize=2):
            by_damage[outcome.damage].append(outcome)
            if outcome.said:
                options.fail(f"seed {outcome.seed} ({outcome.damage}): {outcome.said}")
    for name, outcomes in sorted(by_damage.items()):
        yield row(name, outcomes)
    yield row("all", [outcome for outcomes in by_damage.values() for outcome in outcomes])


def seeds(options: Options) -> list[int]:
    return list(options.cases(range(options.seed, options.seed + options.maps)))


@table(COLUMNS)
def spoilt(options: Options) -> Iterator[Row]:
    yield from rows([Task(seed) for seed in seeds(options)], options)


@table(COLUMNS)
def broken(options: Options) -> Iterator[Row]:
    yield from rows([Task(seed, "broken") for seed in seeds(options)], options)


def folds(faces: Any, uv: npt.NDArray[np.float64]) -> int:
    """Faces turned over, of the islands that are not turned over as a whole."""
    island = map_of(faces, uv).island
    right = np.bincount(island, open_faces(uv))
    return int(np.minimum(right, np.bincount(island) - right).sum())


@table(COLUMNS)
def blender(options: Options) -> Iterator[Row]:
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        for seed in seeds(options):
            chance = np.random.default_rng(seed)
            vertices, faces = random_mesh(chance)
            seams = random_cuts((vertices, faces), chance)
            if seams is None:
                # A closed surface without seams is none that Blender unwraps: those of an unwrap.
                how = {"threads": 1, "max_seconds": LIMIT, "seams": "given"}
                seams = ff.unwrap(vertices, faces, **how).cut_edges
            np.savez(folder / f"{seed}.mesh.npz", vertices=vertices, faces=faces, seams=seams)
        in_blender(options.blender, "pins", folder)
        tasks = []
        for seed in seeds(options):
            found = np.load(folder / f"{seed}.npz")
            count = folds(found["faces"], found["uv"].astype(np.float64))
            kind = next(kind for kind, end in FOLDS.items() if count < end)
            tasks.append(Task(seed, "peer", map=folder / f"{seed}.npz", name=kind))
        yield from rows(tasks, options)


if __name__ == "__main__":
    main(__doc__, maps=(150, ""), seed=(0, ""))
