"""Seamless maps by the engine "penner" of the shared data folder's closed models, with the cones that lie beside them.

    PYTHONPATH=build/python:tests python3 benchmarks/seamless_maps.py [--only TEXT] [--random N] [--suggested] [--markdown]
                                                                      [--repeat N] [--seconds 60]

Cases: fields/ with its cones, gtorusNNN with quartercones; `--suggested`: also the closed models of general/ and embedding/ with
the quarter-turn cones of ff.suggest_cones; `--random N`: instead of all these, N prescriptions of 50 cones of 3 and 5 quarter turns per genus.
`turn error` and `angle error` are those of the second judge (judges/holonomy.py): the largest distance of a loop's angle,
on a homology basis that the solver has not seen, from whole quarter turns, and of a vertex' angle from its own; both on the UVs. CPU seconds are
those of all threads. The exit status is 1 if a case is neither certified in 64 bits nor refused as Infeasible.
"""

from __future__ import annotations

import argparse
import sys
import time
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

import flipfree as ff
from flipfree.calls.seamless import SeamlessMap, start_penner
from flipfree.job import run

from judges import holonomy
from mesh_files import data_folder, read_mesh

RANDOM_MODELS = {
    0: "conformal/sphere1k_random.obj",
    1: "fields/rocker-arm2500.obj",
    2: "fields/eight766.obj",
    3: "fields/holes3_libigl.obj",
    4: "fields/fertility_input.obj",
}
COLUMNS = (
    "case | F | genus | cones | steps | bits | flips 64 / 32 | added V | energy | turn error | angle error | seam error | "
    "conformal s | Newton s | map s | wall s | CPU s"
)


@dataclass
class Case:
    name: str
    vertices: npt.NDArray[np.float64]
    faces: npt.NDArray[np.int32]
    cones: dict[int, int]


def genus_of(faces: npt.NDArray[np.int32]) -> int:
    """Of a closed connected surface."""
    return 1 - (len(np.unique(faces)) - len(faces) // 2) // 2


def read_cones(path: Path) -> dict[int, int]:
    turns = np.rint(np.loadtxt(path) / (np.pi / 2)).astype(int)
    return {int(v): int(turns[v]) for v in np.flatnonzero(turns != 4)}


def prescribed(folder: Path) -> Iterator[Case]:
    for angles in sorted((folder / "fields").glob("*_Th_hat")):
        mesh = read_mesh(angles.with_name(angles.name.removesuffix("_Th_hat") + ".obj"))
        yield Case(
            angles.name.removesuffix("_Th_hat"), mesh.vertices, mesh.faces, read_cones(angles)
        )
    for angles in sorted((folder / "conformal").glob("gtorus*_quartercones_Th_hat")):
        name = angles.name.removesuffix("_quartercones_Th_hat")
        mesh = read_mesh(angles.with_name(name + ".obj"))
        yield Case(name, mesh.vertices, mesh.faces, read_cones(angles))


def suggested(folder: Path) -> Iterator[Case]:
    for path in sorted([*folder.glob("general/*.o??"), *folder.glob("embedding/*.obj")]):
        mesh = read_mesh(path)
        if (holonomy.opposite_halfedges(mesh.faces) < 0).any():
            continue
        try:
            angles = ff.suggest_cones(mesh.vertices, mesh.faces, quarter_turns=True)
        except (ff.InvalidInput, ff.NotConverged) as error:
            print(f"| {path.stem} | no cones: {error} |", flush=True)
            continue
        turns = np.rint(np.asarray(angles) / (np.pi / 2)).astype(int)
        cones = {int(v): int(turns[v]) for v in np.flatnonzero(turns != 4)}
        yield Case(path.stem, mesh.vertices, mesh.faces, cones)


def at_random(folder: Path, count: int) -> Iterator[Case]:
    for genus, path in RANDOM_MODELS.items():
        mesh = read_mesh(folder / path)
        for seed in range(count):
            places = np.random.default_rng(1000 * genus + seed).permutation(len(mesh.vertices))[:50]
            sharp = (50 + 8 - 8 * genus) // 2
            cones = {int(v): 3 if i < sharp else 5 for i, v in enumerate(places)}
            yield Case(f"{Path(path).stem} #{seed}", mesh.vertices, mesh.faces, cones)


def solve(case: Case, seconds: float) -> tuple[SeamlessMap, float, float]:
    wall, cpu = time.perf_counter(), time.process_time()
    result = run(start_penner(case.vertices, case.faces, case.cones, max_seconds=seconds), None)
    return result, time.perf_counter() - wall, time.process_time() - cpu


def row(case: Case, result: SeamlessMap, wall: float, cpu: float) -> str:
    s: dict[str, Any] = result.map.stats
    c = result.map.certificate
    basis = holonomy.random_homology_basis(result.map.faces, 1)
    judged = holonomy.judge(result.map.faces, result.map.uv64, case.cones, basis)
    return (
        f"| {case.name} | {len(case.faces)} | {genus_of(case.faces)} | {len(case.cones)} | {s['iterations']} | {s['bits']} | "
        f"{c.flips64} / {c.flips32} | {s['added_vertices']} | {c.energy:.4g} | {judged.loop_error:.1e} | "
        f"{judged.vertex_error:.1e} | {result.seam_error:.1e} | {s['seconds_conformal']:.3f} | {s['seconds_newton']:.3f} | "
        f"{s['seconds_map']:.3f} | {wall:.3f} | {cpu:.3f} |"
    )


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--only", default="", help="cases whose name contains this")
    parser.add_argument("--random", type=int, default=0, help="prescriptions per genus")
    parser.add_argument(
        "--suggested", action="store_true", help="also models without cones of their own"
    )
    parser.add_argument("--markdown", action="store_true")
    parser.add_argument(
        "--repeat", type=int, default=1, help="runs of each case; the fastest is shown"
    )
    parser.add_argument("--seconds", type=float, default=60.0, help="give a case up after so long")
    arguments = parser.parse_args()
    folder = data_folder()
    if folder is None:
        sys.exit("The shared data folder is not here (FLIPFREE_DATA).")
    print(f"| {COLUMNS} |")
    if arguments.markdown:
        print("|" + "---|" * (COLUMNS.count("|") + 1))

    def cases() -> Iterator[Case]:
        if arguments.random > 0:
            yield from at_random(folder, arguments.random)
            return
        yield from prescribed(folder)
        if arguments.suggested:
            yield from suggested(folder)

    done = failed = stored = 0
    for case in cases():
        if arguments.only not in case.name:
            continue
        done += 1
        try:
            result, wall, cpu = min(
                (solve(case, arguments.seconds) for _ in range(arguments.repeat)),
                key=lambda r: r[2],
            )
        except ff.Infeasible as error:
            print(f"| {case.name} | refused: {error} |", flush=True)
            continue
        except ff.NotConverged as error:
            failed += 1
            print(f"| {case.name} | **failed**: {error} |", flush=True)
            continue
        stored += result.map.certificate.ok
        print(row(case, result, wall, cpu), flush=True)
    print(f"{done} cases, {failed} failed, {stored} certified as stored in 32 bits as well")
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
