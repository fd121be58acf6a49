"""ff.seamless from arrays to certified arrays: engines, exact seams, many handles, prescriptions at random, growth.

    seamless.py models [--engine penner]        fields/ and the shared g-tori with the cones beside them
    seamless.py suggested                       the closed models of general/ and embedding/ with suggested cones
    seamless.py engines                         both, by each engine and beside the conformal map with the same cones
    seamless.py exact                           the engine "penner" alone, then optimised and made exact
    seamless.py tori                            plates with up to 150 holes, suggested cones
    seamless.py random [--count 10]             50 cones of 3 and 5 quarter turns anywhere, genus 0 to 5; a row per surface
    seamless.py wild [--count 10]               the same with 4 to 12 cones of 1 to 12 quarter turns
    seamless.py growth                          eight and elephant with every triangle in four, up to 800 000

Energies: symmetric Dirichlet, 1 is isometric. `turn error` and `angle error` of exact: the second judge's (judges/holonomy.py) on a
homology basis that the solver has not seen, before the seams are made exact. Exit status 1 unless every map by "auto" and "penner"
is certified with its cones and all seam edges exact, and no energy by "auto" is 5 % above the better engine's.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
from conformal import plate
from runner import Options, Row, data, main, table, timed

import flipfree as ff

from judges import holonomy
from mesh_files import read_mesh

ENGINES = ("penner", "padding", "auto")
MOST_OVER = 5.0  # per cent
TORI = (1, 2, 5, 10, 20, 40, 80, 100, 120, 150)
RANDOM_MODELS = (
    "conformal/sphere1k_random.obj",
    "fields/rocker-arm2500.obj",
    "fields/eight766.obj",
    "fields/holes3_libigl.obj",
    "fields/fertility_input.obj",
)


@dataclass
class Case:
    name: str
    vertices: npt.NDArray[np.float64]
    faces: npt.NDArray[np.int32]
    cones: dict[int, int]  # quarter turns

    @property
    def genus(self) -> int:
        """Of a closed connected surface."""
        return 1 - (len(np.unique(self.faces)) - len(self.faces) // 2) // 2

    def head(self) -> list[Any]:
        return [self.name, len(self.faces), self.genus, len(self.cones)]


def cones_of(angles: Any) -> dict[int, int]:
    turns = np.rint(np.asarray(angles) / (np.pi / 2)).astype(int)
    return {int(v): int(turns[v]) for v in np.flatnonzero(turns != 4)}


def prescribed() -> Iterator[Case]:
    folder = data()
    paths = sorted(folder.glob("fields/*_Th_hat"))
    for angles in [*paths, *sorted(folder.glob("conformal/gtorus*_quartercones_Th_hat"))]:
        name = angles.name.removesuffix("_Th_hat").removesuffix("_quartercones")
        mesh = read_mesh(angles.with_name(name + ".obj"))
        yield Case(name, mesh.vertices, mesh.faces, cones_of(np.loadtxt(angles)))


def with_cones(name: str, vertices: Any, faces: Any, most: int = 200) -> Case:
    angles = ff.suggest_cones(vertices, faces, quarter_turns=True, max_cones=most)
    return Case(name, vertices, faces, cones_of(angles))


def closed_models() -> Iterator[Case]:
    for path in sorted([*data().glob("general/*.o??"), *data().glob("embedding/*.obj")]):
        mesh = read_mesh(path)
        if (holonomy.opposite_halfedges(mesh.faces) < 0).any():
            continue
        try:
            yield with_cones(path.stem, mesh.vertices, mesh.faces)
        except (ff.InvalidInput, ff.NotConverged) as error:
            print(f"{path.stem}: no cones: {error}", file=sys.stderr)


def plates() -> Iterator[Case]:
    for genus in TORI:
        yield with_cones(f"{genus} holes", *plate(genus), max(200, 8 * genus))


def surfaces_for_random() -> Iterator[Case]:
    for path in RANDOM_MODELS:
        mesh = read_mesh(data() / path)
        yield Case(Path(path).stem, mesh.vertices, mesh.faces, {})
    yield Case("5 holes", *plate(5), {})


def sharp_and_blunt(case: Case, seed: int) -> Case:
    chance = np.random.default_rng(1000 * case.genus + seed)
    places = chance.permutation(len(case.vertices))[:50]
    sharp = (58 - 8 * case.genus) // 2
    cones = {int(v): 3 if i < sharp else 5 for i, v in enumerate(places)}
    return Case(f"{case.name} #{seed}", case.vertices, case.faces, cones)


def of_any_size(case: Case, seed: int) -> Case:
    """The last one is what Gauss-Bonnet asks for."""
    chance = np.random.default_rng([case.genus, seed])
    last = 0
    while not 1 <= last <= 12:
        sizes = chance.integers(1, 13, int(chance.integers(3, 12)))
        last = int(4 - (8 - 8 * case.genus - (4 - sizes).sum()))
    sizes = np.append(sizes, last)
    places = chance.permutation(len(case.vertices))[: len(sizes)]
    cones = {int(v): int(k) for v, k in zip(places, sizes, strict=True) if k != 4}
    return Case(f"{case.name} wild #{seed}", case.vertices, case.faces, cones)


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
    return Case(case.name, vertices, faces.astype(np.int32), case.cones)


def complaint(case: Case, c: ff.Certificate) -> str:
    if not c.ok:
        return "not certified"
    if not c.seams_exact64 == c.seams_exact32 == c.seam_edges:
        return f"{c.seam_edges} seam edges, exact {c.seams_exact64} / {c.seams_exact32}"
    return "" if dict(c.quarter_cones) == case.cones else "other cones"


def made(
    case: Case, engine: str, options: Options
) -> tuple[ff.Parametrization | None, float, float, str]:
    """The map, seconds (of the clock, of processors), and why there is none."""
    with timed() as cost:
        try:
            result = ff.seamless(
                case.vertices, case.faces, case.cones, engine=engine, max_seconds=options.seconds
            )
            wrong = complaint(case, result.certificate)
        except ff.FlipfreeError as error:
            result, wrong = None, error.code
    if wrong and engine != "padding":
        options.fail(f"{case.name}, {engine}: {wrong}")
    return None if wrong else result, cost.wall, cost.cpu, wrong


COLUMNS = (
    "model | F | genus | cones | engine | added V | seam edges, all exact | energy | wall s | CPU s"
)


def rows(cases: Iterable[Case], options: Options) -> Iterator[Row]:
    for case in options.cases(cases, lambda case: case.name):
        result, wall, cpu, wrong = made(case, options.engine, options)
        figures: list[Any] = [wrong, "", "", ""]
        if result is not None:
            c, added = result.certificate, len(result.vertices) - len(case.vertices)
            figures = [result.stats["engine"], added, c.seam_edges, c.energy]
        yield *case.head(), *figures, f"{wall:.2f}", f"{cpu:.2f}"


@table(COLUMNS)
def models(options: Options) -> Iterator[Row]:
    yield from rows(prescribed(), options)


@table(COLUMNS)
def suggested(options: Options) -> Iterator[Row]:
    yield from rows(closed_models(), options)


@table(COLUMNS)
def tori(options: Options) -> Iterator[Row]:
    yield from rows(plates(), options)


@table(COLUMNS)
def growth(options: Options) -> Iterator[Row]:
    def growing() -> Iterator[Case]:
        for case in prescribed():
            while case.name in ("eight", "elephant") and len(case.faces) <= 800_000:
                yield case
                case = subdivided(case)

    yield from rows(growing(), options)


def conformal_energy(case: Case, seconds: float) -> float | str:
    angles = np.full(len(case.vertices), 2 * np.pi)
    for v, k in case.cones.items():
        angles[v] = k * np.pi / 2
    try:
        found = ff.conformal(case.vertices, case.faces, angles, max_seconds=seconds)
    except ff.FlipfreeError as error:
        return error.code
    return found.certificate.energy


@table(
    "model | F | genus | cones | "
    + " | ".join(f"{engine}: energy | added | CPU s" for engine in ENGINES)
    + " | over, % | conformal"
)
def engines(options: Options) -> Iterator[Row]:
    cases = [*prescribed(), *closed_models()]
    for case in options.cases(cases, lambda case: case.name):
        cells: list[Any] = []
        energies = {}
        for engine in ENGINES:
            result, _, cpu, wrong = made(case, engine, options)
            if result is None:
                cells += [wrong, "", f"{cpu:.2f}"]
                continue
            energies[engine] = result.certificate.energy
            added = len(result.vertices) - len(case.vertices)
            cells += [energies[engine], added, f"{cpu:.2f}"]
        over = 100.0 * (energies.get("auto", np.inf) / min(energies.values(), default=1.0) - 1.0)
        if over > MOST_OVER:
            options.fail(f"{case.name}: auto is {over:.1f} % above the better engine")
        yield *case.head(), *cells, f"{over:.1f}", conformal_energy(case, options.seconds)


@table(
    "model | F | genus | cones | turn error | angle error | seam edges | exact 64 / 32"
    " | energy before | after | steps | engine CPU s | exact CPU s"
)
def exact(options: Options) -> Iterator[Row]:
    for case in options.cases(prescribed(), lambda case: case.name):
        with timed() as cost:
            how = {"engine": "penner", "max_seconds": options.seconds}
            mesh = case.vertices, case.faces, case.cones
            given = ff.seamless(*mesh, **how, optimise=False, exact=False)
        basis = holonomy.random_homology_basis(given.faces, 1)
        judged = holonomy.judge(given.faces, given.uv64, case.cones, basis)
        with timed() as second:
            found = ff.seamless(*mesh, **how)
        c = found.certificate
        if complaint(case, c):
            options.fail(f"{case.name}: {complaint(case, c)}")
        errors = f"{judged.loop_error:.1e}", f"{judged.vertex_error:.1e}"
        seams = c.seam_edges, f"{c.seams_exact64} / {c.seams_exact32}"
        energies = given.certificate.energy, c.energy, found.stats["distortion.iterations"]
        yield (
            *case.head(),
            *errors,
            *seams,
            *energies,
            f"{cost.cpu:.2f}",
            f"{second.cpu - cost.cpu:.2f}",
        )


SUMMARY = "surface | F | genus | prescriptions | certified | seam edges, all exact | energy: median, most | CPU s: all, most"


def summaries(make: Any, options: Options) -> Iterator[Row]:
    for surface in options.cases(surfaces_for_random(), lambda case: case.name):
        cases = [make(surface, seed) for seed in range(options.count)]
        found = [made(case, options.engine, options) for case in cases]
        maps = [result.certificate for result, *_ in found if result is not None]
        energies, seconds = [c.energy for c in maps] or [np.nan], [cpu for _, _, cpu, _ in found]
        yield (
            *surface.head()[:3],
            len(found),
            len(maps),
            sum(c.seam_edges for c in maps),
            f"{np.median(energies):.3g}, {max(energies):.3g}",
            f"{sum(seconds):.1f}, {max(seconds):.1f}",
        )


@table(SUMMARY)
def random(options: Options) -> Iterator[Row]:
    yield from summaries(sharp_and_blunt, options)


@table(SUMMARY)
def wild(options: Options) -> Iterator[Row]:
    yield from summaries(of_any_size, options)


def more(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("--engine", choices=ENGINES, default="auto")
    parser.add_argument("--count", type=int, default=10, help="of random and wild, per surface")


if __name__ == "__main__":
    sys.exit(main(__doc__, more))
