"""Issue 5: MatchMaker++ by itself, the engine that has to find a map where the others stop.

    PYTHONPATH=build/python python3 benchmarks/match_matchmaker.py [--data FOLDER] [--pins 10 30 50] [--seeds 2]

The pins of the shared data folder (seed "-"), and random ones: inside the circle of the boundary's targets, or in the
unit square with a free boundary. One line per case: what the certificate says, vertices that tracing the paths added,
faces against the input's at the end, energy, user seconds.
"""

from __future__ import annotations

import argparse
import os
from pathlib import Path
from typing import Any

import numpy as np
from match_constraints import read_targets

import flipfree as ff

from cost import timed
from mesh_files import read_mesh
from random_pins import Pins, pinned, pins_in_square


def random_pins(inner: np.ndarray, count: int, seed: int, in_circle: bool) -> Pins:
    random = np.random.default_rng(1000 * count + seed)
    if not in_circle:
        return pins_in_square(inner, count, random)
    ids = random.choice(inner, count, replace=False)
    angle = random.random(count) * 2 * np.pi
    radius = 1.9 * np.sqrt(random.random(count))
    places = np.stack([radius * np.cos(angle), radius * np.sin(angle)], 1)
    return pinned(ids, places)


def run(name: str, vertices: Any, faces: Any, **request: Any) -> None:
    try:
        with timed() as cost:
            result = ff.match(vertices, faces, engine="matchmaker", **request)
    except ff.FlipfreeError as error:
        print(f"{name:26s} {type(error).__name__}: {error} ({cost.user:.2f} s)", flush=True)
        return
    print(
        f"{name:26s} ok {result.certificate.ok}  traced {result.stats['matchmaker.added_vertices']:6d}  "
        f"faces x {len(result.faces) / len(faces):6.3f}  energy {result.certificate.energy:10.3g}  "
        f"{result.stats['engine']:23s} {cost.user:6.2f} s",
        flush=True,
    )


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--data", default=os.environ.get("FLIPFREE_DATA", "../shared/data"))
    parser.add_argument("--pins", type=int, nargs="+", default=[10, 30, 50])
    parser.add_argument("--seeds", type=int, default=2)
    options = parser.parse_args()
    folder = Path(options.data) / "constraints"
    for mesh in ("camel_b", "cow"):
        file = read_mesh(folder / f"{mesh}_uv.obj")
        circle = read_targets(folder / f"{mesh}_uv_bd_circ2.txt")
        inner = np.setdiff1d(np.unique(file.faces), list(circle))
        boundary = {"boundary_loop": list(circle), "boundary_uv": list(circle.values())}
        for kind, request in (("circle", boundary), ("free", {})):
            for count in options.pins:
                given = folder / f"{mesh}_uv_pins{count}.txt"
                if given.exists():
                    run(
                        f"{mesh} {kind} {count} -",
                        file.vertices,
                        file.faces,
                        points=read_targets(given),
                        **request,
                    )
                for seed in range(options.seeds):
                    points = random_pins(inner, count, seed, kind == "circle")
                    run(
                        f"{mesh} {kind} {count} {seed}",
                        file.vertices,
                        file.faces,
                        points=points,
                        **request,
                    )


if __name__ == "__main__":
    main()
