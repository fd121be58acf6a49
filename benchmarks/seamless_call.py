"""ff.seamless from arrays to certified arrays: time, added vertices and distortion, by each engine and beside the conformal map.

    PYTHONPATH=build/python:tests:benchmarks python3 benchmarks/seamless_call.py CASES [--engine auto|penner|padding ...] [--only TEXT]
                                                                      [--seconds 60] [--repeat 1] [--conformal]

CASES: `models` (fields/ and the shared g-tori with the cones beside them), `suggested` (the closed models of general/ and embedding/),
`tori` (own g-tori of genus up to 150, suggested cones), `single` (one cone on such), `random N` (prescriptions of 50 cones of 3 and 5 quarter turns, genus 0 to 5),
`wild N` (cones of 1 to 12 quarter turns), `growth` (subdivided eight and elephant, with the slope on log-log).
A row per case and engine: the fastest of --repeat runs. Energies: symmetric Dirichlet, 1 is isometric. Exit status 1 unless every map
by "auto" is certified.
"""

from __future__ import annotations

import argparse
import sys
import time
from collections.abc import Iterator
from pathlib import Path

import numpy as np
from conformal_metric import g_torus
from seamless_maps import Case, at_random, genus_of, prescribed, suggested

import flipfree as ff

from mesh_files import data_folder

COLUMNS = "case | F | genus | cones | engine | made by | added V | seam edges | exact 64 / 32 | energy | conformal | wall s | CPU s"
TORI = (1, 2, 5, 10, 20, 40, 80, 100, 120, 150)


def with_suggested_cones(name: str, vertices: np.ndarray, faces: np.ndarray) -> Case:
    most = max(200, 8 * genus_of(faces))
    angles = ff.suggest_cones(vertices, faces, quarter_turns=True, max_cones=most)
    turns = np.rint(np.asarray(angles) / (np.pi / 2)).astype(int)
    return Case(name, vertices, faces, {int(v): int(turns[v]) for v in np.flatnonzero(turns != 4)})


def own_tori() -> Iterator[Case]:
    for genus in TORI:
        yield with_suggested_cones(f"own torus {genus}", *g_torus(genus))


def single_cones() -> Iterator[Case]:
    """One vertex takes all curvature."""
    for genus in (2, 3, 4, 5, 6, 8, 10):
        vertices, faces = g_torus(genus)
        for v in (0, len(vertices) // 2):
            yield Case(f"own torus {genus}, vertex {v}", vertices, faces, {v: 8 * genus - 4})


def random_prescriptions(folder: Path, count: int) -> Iterator[Case]:
    yield from at_random(folder, count)
    vertices, faces = g_torus(5)
    for seed in range(count):
        places = np.random.default_rng(5000 + seed).permutation(len(vertices))[:50]
        cones = {int(v): 3 if i < 9 else 5 for i, v in enumerate(places)}  # 9 - 41 = 8 - 8 * 5
        yield Case(f"own torus 5 #{seed}", vertices, faces, cones)


def wild_prescriptions(folder: Path, count: int) -> Iterator[Case]:
    """Any sizes from 1 to 12 at any vertices, the last one what Gauss-Bonnet asks for."""
    for case in at_random(folder, 1):
        genus = genus_of(case.faces)
        for seed in range(count):
            random = np.random.default_rng([genus, seed])
            while True:
                sizes = random.integers(1, 13, int(random.integers(3, 12)))
                last = int(4 - (8 - 8 * genus - (4 - sizes).sum()))
                sizes = np.append(sizes, last)
                if 1 <= last <= 12:
                    break
            places = random.permutation(len(case.vertices))[: len(sizes)]
            cones = {int(v): int(k) for v, k in zip(places, sizes, strict=True) if k != 4}
            yield Case(f"{case.name.split(' #')[0]} wild {seed}", case.vertices, case.faces, cones)


def subdivided(case: Case) -> Case:
    """Every triangle in four by the midpoints of its edges; cones where they were."""
    edges = np.sort(case.faces[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2), axis=1)
    unique, index = np.unique(edges, axis=0, return_inverse=True)
    middle = index.reshape(-1, 3) + len(case.vertices)
    a, b, c = case.faces.T
    ab, bc, ca = middle.T
    faces = np.concatenate(
        [np.column_stack(t) for t in ((a, ab, ca), (ab, b, bc), (ca, bc, c), (ab, bc, ca))]
    )
    vertices = np.vstack([case.vertices, case.vertices[unique].mean(axis=1)])
    return Case(f"{case.name} x 4", vertices, faces.astype(np.int32), case.cones)


def growing(folder: Path) -> Iterator[Case]:
    for case in prescribed(folder):
        if case.name not in ("eight", "elephant"):
            continue
        while len(case.faces) <= 800_000:
            yield case
            case = subdivided(case)


def conformal_energy(case: Case, seconds: float) -> str:
    angles = np.full(len(case.vertices), 2 * np.pi)
    for v, k in case.cones.items():
        angles[v] = k * np.pi / 2
    try:
        return f"{ff.conformal(case.vertices, case.faces, angles, max_seconds=seconds).certificate.energy:.4g}"
    except ff.FlipfreeError as error:
        return error.code


def row(case: Case, engine: str, options: argparse.Namespace) -> tuple[str, bool, float]:
    head = f"| {case.name} | {len(case.faces)} | {genus_of(case.faces)} | {len(case.cones)} | {engine} "
    best: tuple[float, float] = (np.inf, np.inf)
    for _ in range(options.repeat):
        wall, cpu = time.perf_counter(), time.process_time()
        try:
            result = ff.seamless(
                case.vertices, case.faces, case.cones, engine=engine, max_seconds=options.seconds
            )
        except ff.FlipfreeError as error:
            seconds = time.perf_counter() - wall
            return (
                f"{head}| {type(error).__name__}: {error.code} after {seconds:.1f} s |",
                False,
                0.0,
            )
        best = min(best, (time.perf_counter() - wall, time.process_time() - cpu))
    c = result.certificate
    good = c.ok and c.seams_exact64 == c.seams_exact32 == c.seam_edges
    good &= dict(c.quarter_cones) == {v: k for v, k in case.cones.items() if k != 4}
    conformal = conformal_energy(case, options.seconds) if options.conformal else ""
    text = (
        f"{head}| {result.stats['engine']} | {len(result.vertices) - len(case.vertices)} | {c.seam_edges} "
        f"| {c.seams_exact64} / {c.seams_exact32} | {c.energy:.4g} | {conformal} | {best[0]:.2f} | {best[1]:.2f} |"
    )
    return text, good, best[0]


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument(
        "cases", choices=("models", "suggested", "tori", "single", "random", "wild", "growth")
    )
    parser.add_argument(
        "count", type=int, nargs="?", default=10, help="of random and wild, per genus"
    )
    parser.add_argument(
        "--engine", nargs="+", default=["auto"], choices=("auto", "penner", "padding")
    )
    parser.add_argument("--only", default="", help="cases whose name contains this")
    parser.add_argument("--seconds", type=float, default=60.0, help="most of each call")
    parser.add_argument("--repeat", type=int, default=1)
    parser.add_argument("--conformal", action="store_true", help="energy of the conformal map too")
    options = parser.parse_args()
    folder = data_folder()
    if folder is None:
        sys.exit("The shared data folder is not here (FLIPFREE_DATA).")
    cases = {
        "models": lambda: prescribed(folder),
        "suggested": lambda: suggested(folder),
        "tori": own_tori,
        "single": single_cones,
        "random": lambda: random_prescriptions(folder, options.count),
        "wild": lambda: wild_prescriptions(folder, options.count),
        "growth": lambda: growing(folder),
    }[options.cases]
    print(f"| {COLUMNS} |")
    print("|" + "---|" * (COLUMNS.count("|") + 1))
    tried = dict.fromkeys(options.engine, 0)
    certified = dict.fromkeys(options.engine, 0)
    times: dict[tuple[str, str], list[tuple[float, float]]] = {}
    for case in cases():
        if options.only not in case.name:
            continue
        for engine in options.engine:
            text, good, seconds = row(case, engine, options)
            print(text, flush=True)
            tried[engine] += 1
            certified[engine] += good
            if good:
                key = (case.name.split(" ")[0], engine)
                times.setdefault(key, []).append((len(case.faces), seconds))
    for engine in options.engine:
        print(f"\n{engine}: {certified[engine]} of {tried[engine]} certified, all seams exact.")
    if options.cases == "growth":
        for (name, engine), points in times.items():
            faces, seconds = np.log(np.array(points).T)
            print(f"{name}, {engine}: slope {np.polyfit(faces, seconds, 1)[0]:.2f} on log-log")
    return int(certified.get("auto", 0) < tried.get("auto", 0))


if __name__ == "__main__":
    sys.exit(main())
