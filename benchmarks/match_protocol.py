"""Issue 5, cases 2 and 5: the protocol of thesis 3.4.2 on disks of the shared data folder.

    PYTHONPATH=build/python python3 benchmarks/match_protocol.py [--data FOLDER] [--seeds 20] [--first 0]
        [--pins 3 10 50] [--limit SECONDS] [--pictures FOLDER] [FILE[:PIECE] ...]

Random vertices pinned to random points of the unit square. Per mesh and number of pins: how many seeds pass their
certificate, median and largest share of added vertices, how many need none, median and longest user seconds, median
energy, engines. Last, the same over all. Without FILEs: every mesh of the shared data folder that is a disk, and every
disk that the seams of a file's texture coordinates cut out (FILE:PIECE, by size, those with more vertices than pins).
`--cases` prints every case. A case that takes longer than the limit, in seconds of the clock, is cancelled and counts
as failed.
"""

from __future__ import annotations

import argparse
import os
import time
from collections import Counter
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
import numpy.typing as npt
from match_pictures import draw

import flipfree as ff

from cost import timed
from mesh_files import cut_pieces, read_mesh
from random_pins import pins_in_square

FOLDERS = ("constraints", "conformal", "embedding", "general")


def piece_of(data: Path, name: str) -> tuple[npt.NDArray[np.float64], npt.NDArray[np.int32]]:
    file, _, piece = name.partition(":")
    pieces = sorted(cut_pieces(read_mesh(data / file)), key=lambda p: -len(p[1]))
    return pieces[int(piece or 0)]


def is_disk(vertices: npt.NDArray[np.float64], faces: npt.NDArray[np.int32]) -> bool:
    """One piece, one boundary loop, no handle, nothing to be cured: `match` takes it as it is."""
    edges = np.sort(np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]]), axis=1)
    _, uses = np.unique(edges, axis=0, return_counts=True)
    euler = len(np.unique(faces)) - len(uses) + len(faces)
    if euler != 1 or uses.max() != 2 or not (uses == 1).any():
        return False
    try:
        ff.match(vertices, faces, points={int(faces[0, 0]): (0.0, 0.0)}, optimise=False)
    except ff.FlipfreeError:
        return False
    return True


def disks(data: Path) -> list[str]:
    found = []
    for path in sorted(p for folder in FOLDERS for p in (data / folder).glob("*.obj")):
        name = str(path.relative_to(data))
        count = len(cut_pieces(read_mesh(path)))
        names = [name] if count == 1 else [f"{name}:{i}" for i in range(count)]
        found += [n for n in names if is_disk(*piece_of(data, n))]
    return found


@dataclass
class Runs:
    """What came of the seeds of one mesh and number of pins."""

    shares: list[float] = field(default_factory=list)  # added vertices, of those that passed
    energies: list[float] = field(default_factory=list)
    passed: list[float] = field(default_factory=list)  # user seconds
    wall: list[float] = field(default_factory=list)  # of those
    seconds: list[float] = field(default_factory=list)  # of all
    engines: Counter[str] = field(default_factory=Counter)
    failures: list[str] = field(default_factory=list)

    def summary(self) -> str:
        added = np.array(self.shares or [np.nan])
        return (
            f"ok {len(self.shares)}/{len(self.seconds)}  "
            f"added median {np.median(added):.2%} max {added.max():.2%} none {np.sum(added == 0)}  "
            f"energy {np.median(self.energies or [np.nan]):.3g}  {np.median(self.seconds or [0]):.2f} s, "
            f"longest {max(self.seconds, default=0):.2f} s user, {max(self.wall, default=0):.2f} s wall  {dict(self.engines)}"
        )


def run_seed(
    vertices: npt.NDArray[np.float64],
    faces: npt.NDArray[np.int32],
    count: int,
    seed: int,
    options: argparse.Namespace,
    runs: Runs,
    file: str,
) -> None:
    random = np.random.default_rng(1000 * count + seed)
    points = pins_in_square(np.unique(faces), count, random)
    end = time.monotonic() + options.limit
    try:
        with timed() as cost:
            result = ff.match(
                vertices, faces, points=points, progress=lambda *_: time.monotonic() < end
            )
    except ff.FlipfreeError as error:
        runs.failures.append(f"seed {seed}: {type(error).__name__}: {error}")
    else:
        share, energy = result.stats["added_vertices"] / len(vertices), result.certificate.energy
        engine = str(result.stats["engine"])
        if options.pictures is not None:
            name = f"match_{Path(file).stem}_{count}_{seed}.png"
            draw(options.pictures / name, result.uv, result.faces, points)
        runs.shares.append(share)
        runs.energies.append(energy)
        runs.passed.append(cost.user)
        runs.wall.append(cost.wall)
        runs.engines[engine] += 1
        if options.cases:
            print(
                f"    seed {seed}: added {share:.2%}  energy {energy:.3f}  {engine}  {cost.user:.2f} s user  {cost.wall:.2f} s wall",
                flush=True,
            )
    runs.seconds.append(cost.user)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--data", default=os.environ.get("FLIPFREE_DATA", "../shared/data"))
    parser.add_argument("--seeds", type=int, default=20)
    parser.add_argument("--pins", type=int, nargs="+", default=[3, 10, 50])
    parser.add_argument("--first", type=int, default=0, help="first seed")
    parser.add_argument("--limit", type=float, default=600.0)
    parser.add_argument("--pictures", type=Path, default=None)
    parser.add_argument("--cases", action="store_true")
    parser.add_argument("files", nargs="*")
    options = parser.parse_args()
    data = Path(options.data)
    everything = []
    for file in options.files or disks(data):
        vertices, faces = piece_of(data, file)
        name = Path(file).name.replace(".obj", "")
        for count in options.pins:
            runs = Runs()
            if count < len(np.unique(faces)):
                for seed in range(options.first, options.first + options.seeds):
                    run_seed(vertices, faces, count, seed, options, runs, file)
            print(f"{name:32s} {len(faces):7d} faces {count:3d} pins  {runs.summary()}", flush=True)
            for failure in runs.failures:
                print("    " + failure, flush=True)
            everything.append(runs)
    shares = np.array([s for runs in everything for s in runs.shares] or [np.nan])
    quick = [s <= 10 for runs in everything for s in runs.wall]
    print(
        f"all: ok {len(quick)}/{sum(len(runs.seconds) for runs in everything)}  "
        f"added median {np.median(shares):.2%}  none {np.mean(shares == 0):.0%}  "
        f"within 10 s of the clock {np.mean(quick or [0]):.0%}"
    )


if __name__ == "__main__":
    main()
