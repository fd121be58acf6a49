"""ff.unwrap: a million triangles, Blender beside it, the corpus, sharp edges.

    unwrap.py scale [--triangles 100000,1000000]      one chart: seconds, memory, progress, and how fast it cancels
    unwrap.py blender --blender PROGRAM               every method of Blender's own on subdivided monkeys, in one run
    unwrap.py corpus                                  every mesh of embedding/ and general/
    unwrap.py sharp                                   general/ cut at sharp edges, without and with overlaps allowed

Energy: mean symmetric Dirichlet as stored, 1 is isometric. scale: each size in a process of its own; the longest of six cancels.
sharp: edges at which faces turn by more than the angle, 30 at least; exit status 1 if the judge finds an overlap in a certified
map, or the energy is above 1.2 times that of the map with overlaps plus 0.05.
"""

from __future__ import annotations

import multiprocessing
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
from runner import Options, Row, data, from_blender, main, numbers, peak_gigabytes, table, timed

import flipfree as ff
from flipfree.separated import folds

from judges.coverage import coverage, share_covered_twice
from mesh_files import MeshFile, read_mesh
from surfaces import Mesh, bumpy_grid

METHODS = ("CONFORMAL", "ANGLE_BASED", "MINIMUM_STRETCH")
CANCELS = 6
ANGLES = (60, 40, 25)
LEAST_SHARP_EDGES = 30
SAMPLES = 20_000


def sheet(triangles: int) -> Mesh:
    """Bumpy, with irregular vertices."""
    side = round((triangles / 2) ** 0.5)
    vertices, faces = bumpy_grid(side, side, 0.1, 5.0)
    jitter = np.random.default_rng(1).uniform(-0.3, 0.3, (len(vertices), 2)) / side
    rim = (vertices[:, :2] <= 0).any(1) | (vertices[:, :2] >= 1).any(1)
    vertices[:, :2] += np.where(rim[:, None], 0.0, jitter)
    return vertices, faces


def measured(triangles: int) -> list[Any]:
    vertices, faces = sheet(triangles)
    calls: list[tuple[float, float]] = []

    def watch(_: str, fraction: float) -> bool:
        calls.append((time.perf_counter(), fraction))
        return True

    start = time.perf_counter()
    with timed() as cost:
        result = ff.unwrap(vertices, faces, progress=watch, seams="given")
    peak = peak_gigabytes()
    times, fractions = zip(*calls, strict=True)
    latencies = [0.0]
    for i in range(CANCELS):
        job = ff.jobs.unwrap(vertices, faces, seams="given")
        job.wait(cost.wall * (i + 0.5) / CANCELS)
        asked = time.perf_counter()
        job.cancel()
        try:
            job.result()
        except ff.Cancelled:
            latencies.append(time.perf_counter() - asked)
    c = result.certificate
    gap = f"{max(np.diff([start, *times])):.2f}"
    falls = "" if list(fractions) == sorted(fractions) else ", FALLS"
    cells = [len(faces), f"{cost.wall:.2f}", f"{cost.cpu:.2f}", f"{peak:.2f}"]
    cells += [f"{c.flips64} / {c.flips32}", c.overlaps, f"{c.energy:.4f}"]
    cells += [result.stats["distortion.iterations"], f"{gap}{falls}", f"{max(latencies):.3f}"]
    return cells


@table(
    "triangles | wall s | CPU s | peak GB | flips 64 / 32 | overlaps | energy | iterations"
    " | longest between progress calls, s | longest cancel, s"
)
def scale(options: Options) -> Iterator[Row]:
    context = multiprocessing.get_context("spawn")
    for triangles in numbers(options.triangles):
        with context.Pool(1) as pool:
            yield pool.apply(measured, (int(triangles),))


@table("triangles | method | wall s | CPU s | flips | overlaps | energy | worst triangle")
def blender(options: Options) -> Iterator[Row]:
    for level in options.levels.split(","):
        found = from_blender(options.blender, "unwrap", level, *METHODS)
        vertices, faces = found["vertices"], found["faces"]

        def row(name: str, wall: float, cpu: float, uv: Any, given: Any = (vertices, faces)) -> Row:
            c = ff.certify(*given, uv)
            figures = f"{wall:.2f}", f"{cpu:.2f}", c.flips32, c.overlaps, f"{c.energy:.4f}"
            return len(given[1]), name, *figures, c.max_energy

        for method in METHODS:
            yield row(f"Blender {method}", *found[f"{method}_seconds"], found[f"{method}_uv"])
        with timed() as cost:
            result = ff.unwrap(vertices, faces, cuts=found["seams"], seams="given")
        name = f"Flipfree UV, {result.stats['charts']} charts"
        yield row(name, cost.wall, cost.cpu, result.uv32())


def models(*folders: str) -> list[Path]:
    paths = [path for folder in folders for path in sorted((data() / folder).iterdir())]
    return [path for path in paths if path.suffix in (".obj", ".off")]


@table("mesh | triangles | charts | added cuts | flips 64 / 32 | overlaps | energy | worst | CPU s")
def corpus(options: Options) -> Iterator[Row]:
    for path in options.cases(models("embedding", "general")):
        mesh = read_mesh(path)
        try:
            with timed() as cost:
                result = ff.unwrap(mesh.vertices, mesh.faces, cuts=mesh.seams, seams="given")
        except ff.FlipfreeError as error:
            if not isinstance(error, ff.InvalidInput):
                options.fail(f"{path.name}: {error}")
            yield path.name, len(mesh.faces), f"refused: {error.code}", *[""] * 6
            continue
        c, s = result.certificate, result.stats
        if not c.ok:
            options.fail(f"{path.name}: not certified")
        figures = f"{c.flips64} / {c.flips32}", c.overlaps, f"{c.energy:.4f}", f"{c.max_energy:.3g}"
        yield path.name, c.triangles, s["charts"], s["added_cuts"], *figures, f"{cost.cpu:.2f}"


def judged(mesh: MeshFile, seams: Any, bijective: bool) -> tuple[ff.Parametrization, float, str]:
    """The map, CPU seconds, and what the slow judge finds as solved and as stored: pairs of triangles, share covered twice."""
    with timed() as cost:
        result = ff.unwrap(
            mesh.vertices, mesh.faces, cuts=seams, bijective=bijective, seams="given"
        )
    views = [coverage(result.faces, uv) for uv in (result.uv, result.uv.astype(np.float32))]
    pairs = max(len(view.within) for view in views)
    twice = max(share_covered_twice(result.uv, view.within, SAMPLES) for view in views)
    return result, cost.cpu, f"{pairs}, {100 * twice:.2f} %"


@table(
    "model | seams at | triangles | seam edges | islands | cut edges added | energy free"
    " | energy without overlap | CPU s free | CPU s without overlap"
    " | free map: pairs of triangles on each other, share of the area | ours, by the slow judge"
)
def sharp(options: Options) -> Iterator[Row]:
    for path in options.cases(models("general")):
        mesh = read_mesh(path)
        for angle in ANGLES:
            seams = folds(mesh.vertices, mesh.faces, np.radians(angle))
            if len(seams) < LEAST_SHARP_EDGES:
                continue
            head = path.name, f"{angle}°", len(mesh.faces), len(seams)
            try:
                free, free_seconds, free_twice = judged(mesh, seams, False)
                ours, seconds, twice = judged(mesh, seams, True)
            except ff.FlipfreeError as error:
                if not isinstance(error, ff.InvalidInput):
                    options.fail(f"{path.name}, {angle}: {error}")
                yield *head, f"refused: {error.code}", *[""] * 7
                continue
            energies = free.certificate.energy, ours.certificate.energy
            if not twice.startswith("0,") or energies[1] > 1.2 * energies[0] + 0.05:
                options.fail(f"{path.name}, {angle}: twice {twice}, energies {energies}")
            figures = [f"{e:.4f}" for e in energies] + [f"{free_seconds:.2f}", f"{seconds:.2f}"]
            cuts = ours.stats["charts"], ours.stats["added_cuts"]
            yield *head, *cuts, *figures, free_twice, twice


if __name__ == "__main__":
    main(
        __doc__,
        triangles=("100000,1000000", "of scale"),
        levels=("3,4", "of subdivision: 63k and 252k triangles"),
    )
