"""Issue 5, cases 2 and 5: the protocol of thesis 3.4.2 on disks of the shared data folder.

    PYTHONPATH=build/python python3 benchmarks/match_protocol.py [--data FOLDER] [--seeds 20] [--pins 3 10 50] [FILE ...]

Random vertices pinned to random points of the unit square. Per mesh and number of pins: how many seeds pass their
certificate, median and largest share of added vertices, how many need none, median and longest user seconds, median
energy, engines. Last, the same over all. Without FILEs: every mesh of the shared data folder that is a disk; `--cases`
prints every case.
"""

from __future__ import annotations

import argparse
import os
import resource
from pathlib import Path

import numpy as np

import flipfree as ff

from mesh_files import read_mesh

FOLDERS = ("constraints", "conformal", "embedding", "general")


def disks(data: Path) -> list[str]:
    """Meshes that `match` takes as they are: one piece, one boundary loop, no handle, nothing to be cured."""
    found = []
    for path in sorted(p for folder in FOLDERS for p in (data / folder).glob("*.obj")):
        mesh = read_mesh(path)
        faces = mesh.faces
        edges = np.sort(
            np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]]), axis=1
        )
        _, uses = np.unique(edges, axis=0, return_counts=True)
        euler = len(np.unique(faces)) - len(uses) + len(faces)
        if euler != 1 or uses.max() != 2 or not (uses == 1).any():
            continue
        try:
            ff.match(mesh.vertices, faces, points={int(faces[0, 0]): (0.0, 0.0)}, optimise=False)
        except ff.FlipfreeError:
            continue
        found.append(str(path.relative_to(data)))
    return found


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--data", default=os.environ.get("FLIPFREE_DATA", "../shared/data"))
    parser.add_argument("--seeds", type=int, default=20)
    parser.add_argument("--pins", type=int, nargs="+", default=[3, 10, 50])
    parser.add_argument("--cases", action="store_true")
    parser.add_argument("files", nargs="*")
    options = parser.parse_args()
    data = Path(options.data)
    everything: list[tuple[float, float]] = []
    asked = 0
    for file in options.files or disks(data):
        mesh = read_mesh(data / file)
        vertices, faces = mesh.vertices, mesh.faces
        for count in options.pins:
            shares, seconds, energies, failures = [], [], [], []
            engines: dict[str, int] = {}
            for seed in range(options.seeds):
                random = np.random.default_rng(1000 * count + seed)
                used = np.unique(faces)
                if count >= len(used):
                    continue
                ids = random.choice(used, count, replace=False)
                points = {
                    int(v): (float(u), float(w))
                    for v, (u, w) in zip(ids, random.random((count, 2)), strict=True)
                }
                asked += 1
                before = resource.getrusage(resource.RUSAGE_SELF).ru_utime
                line = ""
                try:
                    result = ff.match(vertices, faces, points=points)
                    shares.append(result.stats["added_vertices"] / len(vertices))
                    energies.append(result.certificate.energy)
                    engine = str(result.stats["engine"])
                    engines[engine] = engines.get(engine, 0) + 1
                    line = f"added {shares[-1]:.2%}  energy {energies[-1]:.3f}  {engine}"
                except ff.FlipfreeError as error:
                    failures.append(f"seed {seed}: {type(error).__name__}: {error}")
                seconds.append(resource.getrusage(resource.RUSAGE_SELF).ru_utime - before)
                if line:
                    everything.append((shares[-1], seconds[-1]))
                    if options.cases:
                        print(f"    seed {seed}: {line}  {seconds[-1]:.2f} s", flush=True)
            added = np.array(shares or [np.nan])
            print(
                f"{Path(file).stem:32s} {len(faces):7d} faces {count:3d} pins  ok {len(shares)}/{len(seconds)}  "
                f"added median {np.median(added):.2%} max {added.max():.2%} none {np.sum(added == 0)}  "
                f"energy {np.median(energies or [np.nan]):.3g}  {np.median(seconds or [0]):.2f} s, "
                f"longest {max(seconds, default=0):.2f} s  {engines}",
                flush=True,
            )
            for failure in failures:
                print("    " + failure, flush=True)
    shares = np.array([share for share, _ in everything] or [np.nan])
    print(
        f"all: ok {len(everything)}/{asked}  added median {np.median(shares):.2%}  none {np.mean(shares == 0):.0%}  "
        f"within 10 s {np.mean([s <= 10 for _, s in everything] or [0]):.0%}"
    )


if __name__ == "__main__":
    main()
