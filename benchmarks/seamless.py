"""ff.seamless from arrays to certified arrays: engines, exact seams, many handles.

    seamless.py models [--engine penner]        fields/ and the shared g-tori with the cones beside them
    seamless.py engines                         these and closed models with suggested cones, by each engine and beside the conformal map with the same cones
    seamless.py exact                           the engine "penner" alone, then optimised and made exact
    seamless.py tori                            plates with up to 150 holes, suggested cones

Energies: symmetric Dirichlet, 1 is isometric. `turn error` and `angle error` of exact: the second judge's (judges/holonomy.py) on a
homology basis that the solver has not seen, before the seams are made exact. Exit status 1 unless every map by "auto" and "penner"
is certified with its cones and all seam edges exact, and no energy by "auto" is 5 % above the better engine's.
"""

from __future__ import annotations

import sys
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt
from conformal import plate
from runner import Options, Row, data, main, table, timed

import flipfree as ff

from judges import holonomy
from mesh_files import read_mesh
from surfaces import euler, open_edges

ENGINES = ("penner", "padding", "auto")
MOST_OVER = 5.0  # per cent
TORI = (1, 2, 5, 10, 20, 40, 80, 100, 120, 150)


@dataclass
class Case:
    name: str
    vertices: npt.NDArray[np.float64]
    faces: npt.NDArray[np.int32]
    cones: dict[int, int]  # quarter turns

    @property
    def genus(self) -> int:
        """Of a closed connected surface."""
        return 1 - euler(self.faces) // 2

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
        if len(open_edges(mesh.faces)) > 0:
            continue
        try:
            yield with_cones(path.stem, mesh.vertices, mesh.faces)
        except (ff.InvalidInput, ff.NotConverged) as error:
            print(f"{path.stem}: no cones: {error}", file=sys.stderr)


def plates() -> Iterator[Case]:
    for genus in TORI:
        yield with_cones(f"{genus} holes", *plate(genus), max(200, 8 * genus))


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
def tori(options: Options) -> Iterator[Row]:
    yield from rows(plates(), options)


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
        spent = f"{cost.cpu:.2f}", f"{second.cpu - cost.cpu:.2f}"
        yield *case.head(), *errors, *seams, *energies, *spent


if __name__ == "__main__":
    main(__doc__, engine=("auto", "", *ENGINES))
