"""Issue 5, cases 2 and 5: the protocol of thesis 3.4.2 on disks of the shared data folder.

    PYTHONPATH=build/python python3 benchmarks/match_protocol.py [--data FOLDER] [--seeds 20] [--pins 3 10 50] [FILE ...]

Random vertices pinned to random points of the unit square. Per mesh and number of pins: how many seeds pass their
certificate, median and largest share of added vertices, how many need none, median user seconds.
"""

from __future__ import annotations

import argparse
import os
import resource
from pathlib import Path

import numpy as np

import flipfree as ff

from mesh_files import read_mesh

FILES = (
    "constraints/camel_b_uv.obj",
    "constraints/cow_uv.obj",
    "conformal/disk5k.obj",
    "conformal/eight766_cut.obj",
    "conformal/1146164_cut.obj",
    "conformal/holes3_libigl_cut.obj",
    "conformal/fertility_input_cut.obj",
    "conformal/cup_input_simple_10000_cut.obj",
)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--data", default=os.environ.get("FLIPFREE_DATA", "../shared/data"))
    parser.add_argument("--seeds", type=int, default=20)
    parser.add_argument("--pins", type=int, nargs="+", default=[3, 10, 50])
    parser.add_argument("files", nargs="*", default=FILES)
    options = parser.parse_args()
    for file in options.files:
        mesh = read_mesh(Path(options.data) / file)
        vertices, faces = mesh.vertices, mesh.faces
        for count in options.pins:
            shares, seconds, failures = [], [], []
            for seed in range(options.seeds):
                random = np.random.default_rng(1000 * count + seed)
                used = np.unique(faces)
                ids = random.choice(used, count, replace=False)
                points = {int(v): (float(u), float(w)) for v, (u, w) in zip(ids, random.random((count, 2)), strict=True)}
                before = resource.getrusage(resource.RUSAGE_SELF).ru_utime
                try:
                    result = ff.match(vertices, faces, points=points)
                    shares.append(result.stats["added_vertices"] / len(vertices))
                except ff.FlipfreeError as error:
                    failures.append(f"seed {seed}: {type(error).__name__}: {error}")
                seconds.append(resource.getrusage(resource.RUSAGE_SELF).ru_utime - before)
            added = np.array(shares or [np.nan])
            print(
                f"{Path(file).stem:32s} {len(faces):7d} faces {count:3d} pins  ok {len(shares)}/{options.seeds}  "
                f"added median {np.median(added):.2%} max {added.max():.2%} none {np.sum(added == 0)}  "
                f"{np.median(seconds):.2f} s",
                flush=True,
            )
            for failure in failures:
                print("    " + failure, flush=True)


if __name__ == "__main__":
    main()
