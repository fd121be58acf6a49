"""Maps spoilt in many ways, repaired, and judged by other code (tests/judges).

    export PYTHONPATH=build/python:tests:tests/python:benchmarks
    repair_maps.py [--maps 2000] [--seed 0] [--jobs 2] [--broken | --xatlas | --blender PATH] [--only SEED] [--damage NAME]

--xatlas: its maps instead of an unwrap's (the package must be there). --blender: maps of Blender's own unwrap after pins of it
were moved, not spoilt any further; rows say how many faces that folded.

Each is the map of an unwrap, cut into random islands or as it comes, spoilt once or twice (map_damage.py) and repaired with
random options and pins. --broken: of meshes that are no clean surface (tests/python/broken_meshes.py). Exit status 1 where the
repair fails without pins, or the judge finds in 64 or 32 bits what the options exclude.

Each map is repaired twice, stretched islands kept and improved, and both are judged.

Energy: of the stored map, beside that of an unwrap along the same cuts, and beside the larger of that and the energy of the
faces that the spoilt map had open, which stay as they are; islands that were upside down as a whole count as turned over. Only
without pins, and of surfaces that are clean. Islands: each at its own best scale beside what the unwrap makes of its faces, with
pins as well (the unwrap has the same ones, or none if it cannot hold them).
"""

from __future__ import annotations

import argparse
import multiprocessing
import os
import sys
import tempfile
import time
from collections import defaultdict
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
from broken_meshes import broken_mesh
from map_damage import DAMAGES, Map, map_of
from other_maps import blender_maps, xatlas_map

import flipfree as ff

from judges.any_triangles import judge_any
from judges.coverage import coverage
from surfaces import bumpy_grid, cylinder, octahedron_sphere, torus

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
    source: str = "unwrap"  # or "broken", "xatlas", "blender"
    damage: str = ""
    folder: Path = Path()  # of Blender's maps


def folds(faces: npt.NDArray[np.int64], uv: npt.NDArray[np.float64]) -> int:
    """Faces turned over, of the islands that are not turned over as a whole."""
    given = map_of(faces, uv)
    is_open = open_faces(uv)
    number = np.bincount(given.island)
    right = np.bincount(given.island, is_open)
    return int(np.minimum(right, number - right).sum())


def blender_row(faces: npt.NDArray[np.int64], uv: npt.NDArray[np.float64]) -> str:
    count = folds(faces, uv)
    bounds = ("no fold", 1), ("1 to 9 folds", 10), ("10 to 99", 100), ("100 to 1023", 1024)
    return "Blender, " + next((name for name, end in bounds if count < end), "more folds")


def spoilt(
    task: Task, random: Random
) -> tuple[Mesh, Map, npt.NDArray[np.int64] | None, str] | None:
    """Mesh, map, seams that are known, and what was done to it; None: there is no such map."""
    if task.source == "blender":
        given = np.load(task.folder / f"{task.seed}.npz")
        faces, uv = given["faces"], given["uv"].astype(np.float64)
        row = blender_row(faces, uv)
        return (given["vertices"], faces), map_of(faces, uv), given["seams"], row
    broken = task.source == "broken"
    mesh = broken_mesh(task.seed)[1] if broken else random_mesh(random)
    vertices, faces = np.asarray(mesh[0]), np.asarray(mesh[1], np.int64)
    if task.source == "xatlas":
        atlas = xatlas_map(vertices, faces)
        if atlas is None:
            return None
        given_map, seams = map_of(faces, atlas), None
    else:
        cuts = None if broken else random_cuts((vertices, faces), random)
        base = ff.unwrap(vertices, faces, cuts=cuts, threads=1, max_seconds=LIMIT, seams="given")
        given_map, seams = map_of(faces, base.uv32().astype(np.float64)), base.cut_edges
    names = list(DAMAGES)
    damage = task.damage or names[random.integers(len(names))]
    DAMAGES[damage](given_map, random)
    if random.random() < 0.2:
        if np.isfinite(given_map.uv).all():
            given_map = map_of(faces, given_map.uv)
        DAMAGES[names[random.integers(len(names))]](given_map, random)
    return (vertices, faces), given_map, seams, damage


def repaired(task: Task) -> Outcome | None:
    seed, broken = task.seed, task.source == "broken"
    random = np.random.default_rng(seed)
    try:
        found_map = spoilt(task, random)
    except ff.FlipfreeError as error:
        return Outcome(seed, "unwrap", f"unwrap: {error}")
    if found_map is None:
        return None
    (vertices, faces), given, seams, damage = found_map
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
    corners = vertices[faces]
    area = np.linalg.norm(
        np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1
    )
    ratio: Floats = np.bincount(island, area * energy) / np.bincount(island, area * other)
    return ratio


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--maps", type=int, default=2000)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--jobs", type=int, default=2)
    source = parser.add_mutually_exclusive_group()
    source.add_argument("--broken", action="store_true")
    source.add_argument("--xatlas", action="store_true")
    source.add_argument("--blender", type=Path)
    parser.add_argument("--only", type=int)
    parser.add_argument("--damage", default="")
    options = parser.parse_args()
    name = "broken" if options.broken else "xatlas" if options.xatlas else "unwrap"
    name = "blender" if options.blender else name
    seeds = range(options.seed, options.seed + options.maps)
    if options.only is not None:
        seeds = range(options.only, options.only + 1)
    with tempfile.TemporaryDirectory() as folder:
        if options.blender:
            blender_maps(options.blender, Path(folder), {s: mesh_for_blender(s) for s in seeds})
        tasks = [Task(s, name, options.damage, Path(folder)) for s in seeds]
        if options.only is not None:
            print(repaired(tasks[0]))
            return 0
        return int(all_repaired(tasks, options.jobs))


def mesh_for_blender(seed: int) -> dict[str, npt.NDArray[Any]]:
    random = np.random.default_rng(seed)
    vertices, faces = random_mesh(random)
    seams = random_cuts((vertices, faces), random)
    if seams is None:
        # A closed surface without seams is none that Blender unwraps: those of an unwrap.
        seams = ff.unwrap(vertices, faces, threads=1, max_seconds=LIMIT, seams="given").cut_edges
    return {"vertices": vertices, "faces": np.asarray(faces, np.int64), "seams": seams}


def above(ratios: list[float]) -> list[str]:
    compared = [ratio for ratio in ratios if ratio > 0]
    return [
        f"{sum(ratio > 1.1 for ratio in compared)} of {len(compared)}",
        f"{max(compared, default=0):.2f}",
    ]


def row(name: str, all_of: list[Outcome]) -> str:
    done = [o for o in all_of if o.stats and not o.said]
    cells = [len(all_of), len(done), sum(bool(o.said) for o in all_of)]
    cells.append(sum(o.missed for o in all_of))
    text = [name, *map(str, cells)]
    text.append(f"{np.mean([o.sound for o in done] or [0]):.2f}")
    text.append(f"{np.mean([o.kept for o in done] or [0]):.2f}")
    text += above([o.energy for o in done])
    text += above([o.beside_unwrap for o in done])
    text.append(f"{sum(o.seconds for o in done):.1f}")
    improved = [o.improved for o in done if o.improved is not None]
    text.append(f"{np.mean([o.kept for o in improved] or [0]):.2f}")
    text += above([o.beside_unwrap for o in improved])
    for pinned in (False, True):
        compared = [o for o in improved if o.pinned == pinned]
        text.append(
            f"{sum(o.islands_above for o in compared)} of {sum(o.islands for o in compared)}"
        )
    text.append(str(sum(o.forced for o in improved)))
    text.append(f"{sum(o.seconds for o in improved):.1f}")
    return "| " + " | ".join(text) + " |"


def all_repaired(tasks: list[Task], jobs: int) -> bool:
    """Prints the table; whether something failed."""
    rows: dict[str, list[Outcome]] = defaultdict(list)
    failed = False
    with multiprocessing.Pool(jobs) as pool:
        for outcome in pool.imap(repaired, tasks, chunksize=2):
            if outcome is None:
                continue
            rows[outcome.damage].append(outcome)
            if outcome.said:
                failed = True
                print(f"seed {outcome.seed} ({outcome.damage}): {outcome.said}", flush=True)
            better = outcome.improved
            if better is not None and (better.beside_unwrap > 1.1 or better.islands_above > 0):
                print(
                    f"seed {outcome.seed} ({outcome.damage}): improved {better.beside_unwrap:.3f}, islands above "
                    f"{better.islands_above}{', pins' if better.pinned else ''}, said {better.forced}",
                    file=sys.stderr,
                )
            if outcome.energy > 1.1:
                print(
                    f"seed {outcome.seed} ({outcome.damage}): energy {outcome.energy:.3f}, beside the unwrap's {outcome.beside_unwrap:.3f}",
                    file=sys.stderr,
                )
    print(
        "| damage | maps | repaired | judged wrong | pins missed | faces open before | corners kept "
        "| energy above 1.1 | worst | beside the unwrap's: above 1.1 | worst | CPU s "
        "| improved: corners kept | above 1.1 | worst | islands above | with pins | said | CPU s |"
    )
    print("|" + "---|" * 19)
    everything = [outcome for all_of in rows.values() for outcome in all_of]
    for name, all_of in [*sorted(rows.items()), ("all", everything)]:
        print(row(name, all_of))
    return failed


if __name__ == "__main__":
    raise SystemExit(main())
