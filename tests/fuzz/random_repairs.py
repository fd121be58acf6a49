"""Maps spoilt in many ways, repaired, and judged by other code (tests/judges).

Each is the map of an unwrap, cut into random islands or as it comes, spoilt once or twice (tests/map_damage.py) and repaired
with random options and pins, twice: stretched islands kept and improved. Or of a mesh that is no clean surface, or a peer's.
benchmarks/repair.py runs them by the thousand.

Energy: of the stored map, beside that of an unwrap along the same cuts, and beside the larger of that and the energy of the
faces that the spoilt map had open, which stay as they are; islands that were upside down as a whole count as turned over. Only
without pins, and of surfaces that are clean. Islands: each at its own best scale beside what the unwrap makes of its faces, with
pins as well (the unwrap has the same ones, or none if it cannot hold them).
"""

from __future__ import annotations

import os
import time
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
import numpy.typing as npt
from broken_meshes import broken_mesh
from map_damage import DAMAGES, Map, map_of

import flipfree as ff

from judges.any_triangles import judge_any
from judges.coverage import coverage
from surfaces import areas_of, bumpy_grid, cylinder, octahedron_sphere, torus

MODELS = ["bimba1.obj", "cow.obj", "hand_lowres.obj", "octopus.obj", "horse_quad.obj", "snail.obj"]
LIMIT = 120.0
Random = np.random.Generator
Floats = npt.NDArray[np.float64]
Mesh = tuple[npt.NDArray[np.float64], npt.NDArray[np.int64]]


@dataclass
class Outcome:
    seed: int
    damage: str
    said: str = ""  # what must not be
    missed: bool = False  # pins that were not reached
    kept: float = 0.0  # share of the corners
    sound: float = 0.0  # of the corners of faces that were open
    changed: int = 0  # corners of sound faces whose bits changed
    energy: float = 0.0  # over the larger of the unwrap's and that of the faces that were open
    beside_unwrap: float = 0.0  # over the unwrap's
    islands_above: int = 0  # of all those that were compared, above 1.1 times the unwrap's
    islands: int = 0
    pinned: bool = False
    forced: int = 0  # islands that are said to be stretched by their pins
    seconds: float = 0.0
    stats: dict[str, object] = field(default_factory=dict)
    improved: Outcome | None = None  # the same map, with stretched islands improved


def random_mesh(random: Random) -> Mesh:
    folder = Path(os.environ.get("FLIPFREE_DATA", "")) / "general"
    if folder.is_dir() and random.random() < 0.3:
        model = ff.read(folder / MODELS[random.integers(len(MODELS))])
        return model.vertices, np.asarray(model.faces, np.int64)
    kind = random.integers(4)
    if kind == 0:
        size = random.integers(2, 25, size=2)
        return bumpy_grid(int(size[0]), int(size[1]), float(random.random()))
    if kind == 1:
        return octahedron_sphere(int(random.integers(1, 4)))
    if kind == 2:
        return torus(int(random.integers(5, 25)), int(random.integers(4, 13)))
    return cylinder(int(random.integers(3, 20)), int(random.integers(1, 8)))


def random_cuts(mesh: Mesh, random: Random) -> npt.NDArray[np.int64] | None:
    """Between the faces nearest to some points."""
    vertices, faces = mesh
    if random.random() < 0.4:
        return None
    middles = vertices[faces].mean(axis=1)
    centres = middles[random.integers(len(faces), size=random.integers(2, 12))]
    label = np.linalg.norm(middles[:, None] - centres, axis=2).argmin(axis=1)
    sides = np.sort(np.concatenate([faces[:, [k, (k + 1) % 3]] for k in range(3)]), axis=1)
    labels = np.tile(label, 3)
    order = np.lexsort(sides.T)
    sides, labels = sides[order], labels[order]
    same = (sides[1:] == sides[:-1]).all(axis=1) & (labels[1:] != labels[:-1])
    return np.unique(sides[1:][same], axis=0)


def random_pins(given: Map, random: Random) -> dict[tuple[int, int], tuple[float, float]] | None:
    if random.random() < 0.7:
        return None
    pins = {}
    for point in random.choice(given.points, int(random.integers(1, 4))):
        corners = np.argwhere(given.point == point)
        place = given.uv[tuple(corners[0])].astype(np.float32)
        if not np.isfinite(place).all():
            continue
        for f, k in corners.tolist():
            pins[f, k] = (float(place[0]), float(place[1]))
    return pins


def open_faces(uv: npt.NDArray[np.float64]) -> npt.NDArray[np.bool_]:
    with np.errstate(invalid="ignore", over="ignore"):
        e, d = uv[:, 1] - uv[:, 0], uv[:, 2] - uv[:, 0]
        positive: npt.NDArray[np.bool_] = e[:, 0] * d[:, 1] - e[:, 1] * d[:, 0] > 0
    return positive & np.isfinite(uv).all((1, 2))


def found(result: ff.Parametrization, options: dict[str, object], clean: bool) -> str:
    """What the judge finds."""
    apart = bool(options["disjoint"]) and not options["pins"] and options["overlaps"] != "keep"
    for uv in (result.uv64, result.uv, result.uv32()):
        if not clean:
            wrong = judge_any(result.faces, uv, disjoint=apart)
            if wrong:
                return "; ".join(wrong)
            continue
        judged = coverage(result.faces, uv)
        if len(judged.flipped):
            return f"{len(judged.flipped)} flips"
        if len(judged.overwound):
            return f"{len(judged.overwound)} vertices overwound"
        if options["overlaps"] != "keep" and (len(judged.within) or len(judged.touching)):
            return f"{len(judged.within)} overlaps, {len(judged.touching)} contacts"
        if options["disjoint"] and not options["pins"] and len(judged.between):
            return f"{len(judged.islands)} islands on others"
    return ""


def turned_over(
    faces: npt.NDArray[np.int64], uv: npt.NDArray[np.float64]
) -> npt.NDArray[np.float64]:
    """The map with the islands mirrored that are upside down as a whole."""
    if not np.isfinite(uv).all():
        return uv
    island = map_of(faces, uv).island
    upside_down = np.bincount(island, open_faces(uv))[island] == 0
    return np.where(upside_down[:, None, None], uv * [-1.0, 1.0], uv)


@dataclass
class Task:
    seed: int
    source: str = "unwrap"  # or "broken", "peer"
    damage: str = ""
    map: Path | None = (
        None  # a peer's: vertices, faces, uv and seams; not spoilt any further if there is a name for it
    )
    name: str = ""


def damaged(
    task: Task, random: Random, given: Map, seams: npt.NDArray[np.int64] | None
) -> tuple[Map, npt.NDArray[np.int64] | None, str]:
    names = list(DAMAGES)
    damage = task.damage or names[random.integers(len(names))]
    DAMAGES[damage](given, random)
    if random.random() < 0.2:
        if np.isfinite(given.uv).all():
            given = map_of(given.faces, given.uv)
        DAMAGES[names[random.integers(len(names))]](given, random)
    return given, seams, damage


def spoilt(task: Task, random: Random) -> tuple[Mesh, Map, npt.NDArray[np.int64] | None, str]:
    """Mesh, map, seams that are known, and what was done to it."""
    if task.map is not None:
        given = np.load(task.map)
        vertices, faces, seams = given["vertices"], given["faces"], given["seams"]
        given_map = map_of(faces, given["uv"].astype(np.float64))
        if task.name:
            return (vertices, faces), given_map, seams, task.name
        return (vertices, faces), *damaged(task, random, given_map, None)
    broken = task.source == "broken"
    mesh = broken_mesh(task.seed)[1] if broken else random_mesh(random)
    vertices, faces = np.asarray(mesh[0]), np.asarray(mesh[1], np.int64)
    cuts = None if broken else random_cuts((vertices, faces), random)
    base = ff.unwrap(vertices, faces, cuts=cuts, threads=1, max_seconds=LIMIT, seams="given")
    given_map = map_of(faces, base.uv32().astype(np.float64))
    return (vertices, faces), *damaged(task, random, given_map, base.cut_edges)


def repaired(task: Task) -> Outcome:
    seed, broken = task.seed, task.source == "broken"
    random = np.random.default_rng(seed)
    try:
        (vertices, faces), given, seams, damage = spoilt(task, random)
    except ff.FlipfreeError as error:
        return Outcome(seed, "unwrap", f"unwrap: {error}")
    options: dict[str, object] = {
        "overlaps": ["cut", "cut", "open", "keep"][random.integers(4)],
        "disjoint": bool(random.random() < 0.4),
        "cuts": seams if random.random() < 0.5 else None,
        "pins": random_pins(given, random),
    }
    reference: list[ff.Parametrization] = []
    outcome = repaired_once(seed, damage, (vertices, faces), given, options, broken, reference)
    if outcome.stats and not outcome.said:
        options["stretched"] = "improve"
        outcome.improved = repaired_once(
            seed, damage, (vertices, faces), given, options, broken, reference
        )
        outcome.said = outcome.improved.said
        if outcome.improved.missed:
            outcome.said = "pins are missed only when islands are improved"
    return outcome


def repaired_once(
    seed: int,
    damage: str,
    mesh: Mesh,
    given: Map,
    options: dict[str, object],
    broken: bool,
    reference: list[ff.Parametrization],
) -> Outcome:
    """reference: an unwrap to compare with, kept for the next time."""
    vertices, faces = mesh
    outcome = Outcome(seed, damage, pinned=bool(options["pins"]))
    start = time.process_time()
    try:
        result = ff.repair(
            vertices,
            faces,
            given.uv,
            **options,
            threads=1,
            max_seconds=LIMIT,  # type: ignore[arg-type]
        )
    except ff.FlipfreeError as error:
        outcome.missed = bool(options["pins"]) and not isinstance(error, ff.InvalidInput)
        outcome.said = "" if outcome.missed else f"{type(error).__name__}: {error}"
        return outcome
    outcome.seconds = time.process_time() - start
    outcome.stats = dict(result.stats)
    outcome.forced = int(result.stats["stretched_charts"])
    outcome.said = found(result, options, not broken)
    for (f, k), place in (options["pins"] or {}).items():  # type: ignore[attr-defined]
        if tuple(result.uv32()[f, k].tolist()) != place or tuple(result.uv[f, k]) != place:
            outcome.said = f"pin {f}, {k} is missed"
    kept = (result.uv == given.uv).all(axis=2)
    sound = open_faces(given.uv)
    outcome.kept = float(kept.mean())
    outcome.sound = float(sound.mean())
    outcome.changed = int((sound & ~kept.all(axis=1)).sum())
    if not broken:
        compare(outcome, mesh, given, result, options, reference)
    return outcome


def compare(
    outcome: Outcome,
    mesh: Mesh,
    given: Map,
    result: ff.Parametrization,
    options: dict[str, object],
    reference: list[ff.Parametrization],
) -> None:
    """Energies beside those of an unwrap."""
    vertices, faces = mesh
    for pins in (options["pins"], None):
        if reference:
            break
        try:
            reference.append(
                ff.unwrap(
                    vertices,
                    faces,
                    cuts=result.cut_edges,
                    seams="given",
                    pins=pins,  # type: ignore[arg-type]
                    may_add_cuts=options["overlaps"] != "open",
                    threads=1,
                    max_seconds=LIMIT,
                )
            )
        except ff.FlipfreeError:  # pins that it does not hold, or nothing to compare with
            continue
    if not reference:
        return
    anew = reference[0]
    ratios = beside_by_island(vertices, faces, result.uv32(), anew.uv32())
    outcome.islands = len(ratios)
    outcome.islands_above = int((ratios > 1.1).sum())
    if options["pins"]:
        return
    before = 0.0
    drawn = turned_over(faces, given.uv)
    healthy = open_faces(drawn)
    if healthy.any():
        before = ff.certify(vertices, faces[healthy], drawn[healthy], threads=1).energy
    now = ff.certify(vertices, faces, result.uv32(), threads=1).energy
    outcome.beside_unwrap = now / anew.certificate.energy
    outcome.energy = now / max(before, anew.certificate.energy)


def island_energies(
    vertices: Floats, faces: npt.NDArray[np.int64], uv: Floats
) -> tuple[npt.NDArray[np.int64], Floats]:
    """Island of every face, and its energy at its own best scale, both per face."""
    p, q = (
        vertices[faces[:, 1]] - vertices[faces[:, 0]],
        vertices[faces[:, 2]] - vertices[faces[:, 0]],
    )
    length = np.linalg.norm(p, axis=1)
    area = np.linalg.norm(np.cross(p, q), axis=1)
    rest = np.zeros((len(faces), 2, 2))
    rest[:, 0, 0], rest[:, 0, 1] = length, (p * q).sum(1) / length
    rest[:, 1, 1] = area / length
    sides = np.stack([uv[:, 1] - uv[:, 0], uv[:, 2] - uv[:, 0]], axis=2).astype(np.float64)
    jacobian = sides @ np.linalg.inv(rest)
    island = map_of(faces, uv.astype(np.float64)).island
    total = np.bincount(island, area)
    stretched = np.bincount(island, area * (jacobian**2).sum((1, 2)))
    shrunk = np.bincount(island, area * (np.linalg.inv(jacobian) ** 2).sum((1, 2)))
    return island, (np.sqrt(stretched * shrunk) / (2 * total))[island]


def beside_by_island(
    vertices: Floats, faces: npt.NDArray[np.int64], uv: Floats, reference: Floats
) -> Floats:
    """Per island of a map its energy over that of its faces in another map, whose islands may be smaller."""
    island, energy = island_energies(vertices, faces, uv)
    _, other = island_energies(vertices, faces, reference)
    area = areas_of(vertices, faces)
    ratio: Floats = np.bincount(island, area * energy) / np.bincount(island, area * other)
    return ratio
