"""Unwraps models cut at their sharp edges, without and with overlaps allowed, and has a slow second judge look at both.

    PYTHONPATH=build/python python3 benchmarks/unwrap_sharp.py [--jobs 2] [--angles 60,40,25] [--folders general] [FILE ...]
    PYTHONPATH=build/python python3 benchmarks/unwrap_sharp.py --no-seams FILE ...

A case is a model with at least 30 edges at which its faces turn by more than the angle; those edges are the seams. Without FILE:
the models in these folders of the shared data folder. Energies are the
certificates', seconds are user CPU seconds of the whole call. "twice" is the share of the chart area that lies on its own chart
by the slow judge (tests/judges), in 32 or 64 bits, whichever is more; "pairs" counts the pairs of triangles.

Exit status 1 if the judge finds an overlap in a map that was certified as free of it, if such a map's energy is above 1.2 times
that of the free map plus 0.05, or if there is no such map where there is a free one.
"""

from __future__ import annotations

import argparse
import multiprocessing
import statistics
import sys
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
import numpy.typing as npt

import flipfree as ff

from cost import timed
from mesh_files import ROOT, MeshFile, data_folder, read_mesh

sys.path.insert(0, str(ROOT / "tests"))
from judges.coverage import Coverage, coverage, share_covered_twice  # noqa: E402

LEAST_SHARP_EDGES = 30
SAMPLES = 20_000


@dataclass
class Map:
    """One unwrapped layout, or why there is none."""

    error: str = ""
    refused: bool = False  # the input, not the task
    seconds: float = 0.0
    energy: float = float("nan")
    worst: float = float("nan")
    charts: int = 0
    added_cuts: int = 0
    overlaps: int = -1
    island_overlaps: int = -1
    pairs: int = 0  # of triangles of one chart, by the judge
    touching: int = 0
    twice: float = 0.0
    islands: int = 0  # pairs of charts, by the judge


@dataclass
class Case:
    path: Path
    angle: float | None  # None: no seams
    triangles: int = 0
    seams: int = 0
    free: Map = field(default_factory=Map)
    bijective: Map = field(default_factory=Map)

    @property
    def certified(self) -> bool:
        return not self.bijective.error

    @property
    def overlaps(self) -> bool:
        return self.certified and self.bijective.pairs > 0

    @property
    def missing(self) -> bool:
        return not self.certified and not self.free.error

    @property
    def crushed(self) -> bool:
        # No free map, no bound.
        return self.certified and self.bijective.energy > 1.2 * self.free.energy + 0.05


def sharp_edges(mesh: MeshFile, degrees: float) -> npt.NDArray[np.int32]:
    """(s, 2) edges between two faces whose normals differ by more than the angle; a face without area has no normal."""
    p = mesh.vertices[mesh.faces]
    normal = np.cross(p[:, 1] - p[:, 0], p[:, 2] - p[:, 0])
    length = np.linalg.norm(normal, axis=1, keepdims=True)
    normal = np.divide(normal, length, out=np.zeros_like(normal), where=length > 0)
    face = np.repeat(np.arange(len(mesh.faces)), 3)
    edge = np.sort(np.stack([mesh.faces, np.roll(mesh.faces, -1, 1)], -1).reshape(-1, 2), axis=1)
    order = np.lexsort((edge[:, 1], edge[:, 0]))
    edge, face = edge[order], face[order]
    twin = np.flatnonzero((edge[1:] == edge[:-1]).all(1))
    s, t = normal[face[twin]], normal[face[twin + 1]]
    cosine = (s * t).sum(1)
    solid = s.any(1) & t.any(1)
    return edge[twin[solid & (cosine < np.cos(np.radians(degrees)))]].astype(np.int32)


def judged(faces: npt.NDArray[np.int32], uv: npt.NDArray[np.float64]) -> list[Coverage]:
    """As solved and as stored."""
    return [coverage(faces, values) for values in (uv, uv.astype(np.float32))]


def unwrapped(
    mesh: MeshFile, seams: npt.NDArray[np.int32], bijective: bool, max_seconds: float | None
) -> Map:
    with timed() as cost:
        try:
            result = ff.unwrap(
                mesh.vertices,
                mesh.faces,
                cuts=seams,
                bijective=bijective,
                max_seconds=max_seconds,
                seams="given",
            )
        except ff.FlipfreeError as error:
            result, failure = None, error
    if result is None:
        text = f"{type(failure).__name__}: {str(failure)[:160]}"
        return Map(text, isinstance(failure, ff.InvalidInput), cost.user)
    certificate = result.certificate
    if certificate.overlaps < 0:
        certificate = ff.certify(result.vertices, result.faces, result.uv)
    views = judged(result.faces, result.uv)
    return Map(
        seconds=cost.user,
        energy=certificate.energy,
        worst=certificate.max_energy,
        charts=int(result.stats["charts"]),
        added_cuts=int(result.stats["added_cuts"]),
        overlaps=certificate.overlaps,
        island_overlaps=getattr(certificate, "island_overlaps", -1),
        pairs=max(len(view.within) for view in views),
        touching=max(len(view.touching) for view in views),
        twice=max(share_covered_twice(result.uv, view.within, SAMPLES) for view in views),
        islands=max(len(view.islands) for view in views),
    )


def run(task: tuple[Path, float | None, float | None]) -> Case:
    path, angle, max_seconds = task
    mesh = read_mesh(path)
    seams = np.zeros((0, 2), np.int32) if angle is None else sharp_edges(mesh, angle)
    case = Case(path, angle, len(mesh.faces), len(seams))
    case.free = unwrapped(mesh, seams, False, max_seconds)
    if not case.free.refused:
        case.bijective = unwrapped(mesh, seams, True, max_seconds)
    return case


HEADER = """\
| model | seams at | triangles | seam edges | charts | added cuts | energy free | energy bijective | s free | s bijective | free: pairs, twice | certificate: overlaps, islands | judge: pairs, twice | judge: islands | |
|---|---|---|---|---|---|---|---|---|---|---|---|---|---|---|"""


def row(case: Case) -> str:
    free, mine = case.free, case.bijective
    seams = "none" if case.angle is None else f"{case.angle:g}°"
    head = f"| {case.path.name} | {seams} | {case.triangles} | {case.seams} "
    if free.refused:
        return head + f"| | | | | | | | | | | refused: {free.error} |"
    verdict = ", ".join(
        word
        for word, holds in (
            ("OVERLAPS", case.overlaps),
            ("CRUSHED", case.crushed),
            ("islands overlap", case.certified and mine.islands > 0),
            (f"free map: {free.error}", bool(free.error)),
            (mine.error, bool(mine.error)),
        )
        if holds
    )
    return head + (
        f"| {mine.charts or free.charts} | {mine.added_cuts} | {free.energy:.4f} | {mine.energy:.4f} "
        f"| {free.seconds:.2f} | {mine.seconds:.2f} | {free.pairs}, {100 * free.twice:.2f} % "
        f"| {mine.overlaps}, {mine.island_overlaps} | {mine.pairs}, {100 * mine.twice:.2f} % "
        f"| {mine.islands} | {verdict} |"
    )


def summary(cases: list[Case]) -> str:
    done = [case for case in cases if not case.free.refused]
    both = [case for case in done if case.certified and not case.free.error]
    clear = [case for case in both if case.free.pairs == 0]
    lines = [
        f"{len(done)} cases, {len(cases) - len(done)} inputs refused; certified {sum(c.certified for c in done)}, "
        f"of these {sum(c.overlaps for c in done)} overlap and {sum(c.crushed for c in done)} are crushed "
        f"({sum(c.crushed and not c.overlaps for c in done)} without overlap); "
        f"{sum(not c.certified for c in done)} not certified."
    ]
    if both:
        ratio = [case.bijective.energy / case.free.energy for case in both]
        seconds = [case.bijective.seconds / max(case.free.seconds, 1e-3) for case in both]
        lines.append(
            f"Bijective over free: energy median {statistics.median(ratio):.3f}, most {max(ratio):.4g}; "
            f"seconds median {statistics.median(seconds):.2f}, most {max(seconds):.3g}."
        )
    if clear:
        ratio = [case.bijective.energy / case.free.energy for case in clear]
        lines.append(
            f"Where the free map happens not to overlap ({len(clear)}): energy at most {max(ratio):.4g} of the free one's."
        )
    return "\n".join(lines)


def default_cases(folders: list[str], angles: list[float]) -> list[tuple[Path, float | None]]:
    data = data_folder()
    if data is None:
        sys.exit("The shared data folder is not here (FLIPFREE_DATA); name files instead.")
    cases: list[tuple[Path, float | None]] = []
    for path in (path for folder in folders for path in sorted((data / folder).iterdir())):
        if path.suffix in (".obj", ".off"):
            mesh = read_mesh(path)
            cases += [(path, a) for a in angles if len(sharp_edges(mesh, a)) >= LEAST_SHARP_EDGES]
    return cases


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("files", nargs="*", type=Path)
    parser.add_argument("--no-seams", action="store_true", help="the files as they are")
    parser.add_argument("--angles", default="60,40,25", help="degrees")
    parser.add_argument("--folders", default="general", help="of the shared data folder")
    parser.add_argument("--jobs", type=int, default=1)
    parser.add_argument("--max-seconds", type=float, default=None, help="per unwrap")
    arguments = parser.parse_args()
    angles = [float(angle) for angle in arguments.angles.split(",")]
    if arguments.no_seams and not arguments.files:
        parser.error("--no-seams needs FILE")
    if arguments.no_seams:
        cases = [(path, None) for path in arguments.files]
    elif arguments.files:
        cases = [(path, angle) for path in arguments.files for angle in angles]
    else:
        cases = default_cases(arguments.folders.split(","), angles)
    print(HEADER, flush=True)
    results = []
    tasks = [(path, angle, arguments.max_seconds) for path, angle in cases]
    with multiprocessing.get_context("spawn").Pool(arguments.jobs) as pool:
        for case in pool.imap(run, tasks):
            results.append(case)
            print(row(case), flush=True)
    print("\n" + summary(results))
    return 1 if any(case.overlaps or case.crushed or case.missing for case in results) else 0


if __name__ == "__main__":
    sys.exit(main())
