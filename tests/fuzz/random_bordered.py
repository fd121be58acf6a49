"""Random seamless maps of surfaces with a boundary, in processes that may crash, judged in rational numbers.

    export PYTHONPATH=build/python:tests/python:benchmarks:tests
    random_bordered.py [--calls 1000] [--seed 0] [--jobs 2] [--slack 2.0] [--report FILE.json]
    random_bordered.py --repeat SEED

Sheets of squares with holes, polygons without a vertex inside, strips, tubes and closed surfaces with patches taken out, up to
three at once, each in any size, ragged and flattened at times; cones inside, corners that sum up and such that do not, or none
given; all kinds of boundaries. A map that comes back has no flip, no seam edge that is not exact and, where the boundary is
aligned, no edge of it that is off its axis, in 64 and in 32 bits; its cones and corners are those that were asked for, and on
every part they sum up (tests/judges/seams.py, which shares no code with the solver).
"""

from __future__ import annotations

import sys
from dataclasses import dataclass
from multiprocessing.connection import Connection
from typing import Any

import numpy as np
from random_calls import timed_call
from random_maps import main_of, outcome_of, work_through
from random_seamless import check_subdivision, degenerated, random_options
from random_seamless import surface as closed_surface

import flipfree as ff

from judges.disjoint_sets import DisjointSets
from judges.seams import SeamCount, seam_count
from random_meshes import Mesh
from surfaces import cylinder
from verdict import Finding, check_error

NAME = "seamless"
Random = np.random.Generator


@dataclass
class Case:
    mesh: Mesh
    sizes: list[int]  # vertices of the parts, in order
    characters: list[int]  # Euler characteristics of the parts
    sound: bool  # no triangle is nearly degenerate
    cones: Any
    boundary: str
    wrong: bool  # corners that do not sum up
    genera: list[int]  # for random_options


def compact(vertices: Any, faces: Any) -> tuple[Any, Any]:
    used, faces = np.unique(faces, return_inverse=True)
    return vertices[used], faces.reshape(-1, 3)


def sheet(random: Random) -> tuple[Any, Any]:
    """Squares of a grid, joined at sides only, with holes."""
    n, m = (int(random.integers(1, 9)) for _ in range(2))
    solid = random.random((n, m)) > random.choice([0.0, 0.1, 0.3])
    # The largest part, without corners at which two squares only touch.
    while True:
        crossed = False
        for i in range(n - 1):
            for j in range(m - 1):
                a, b, c, d = solid[i : i + 2, j : j + 2].ravel()
                if a == d and b == c and a != b:
                    solid[i : i + 2, j : j + 2] = True
                    crossed = True
        if not crossed:
            break
    parts = DisjointSets(n * m)
    for i in range(n):
        for j in range(m):
            if i + 1 < n and solid[i, j] and solid[i + 1, j]:
                parts.join(i * m + j, (i + 1) * m + j)
            if j + 1 < m and solid[i, j] and solid[i, j + 1]:
                parts.join(i * m + j, i * m + j + 1)
    roots = np.array([parts.find(k) if solid.flat[k] else -1 for k in range(n * m)])
    found, counts = np.unique(roots[roots >= 0], return_counts=True)
    if not len(found):
        return sheet(random)
    faces = []
    for k in np.flatnonzero(roots == found[counts.argmax()]):
        i, j = divmod(int(k), m)
        a, b, c, d = ((i + p) * (m + 1) + j + q for p, q in ((0, 0), (1, 0), (1, 1), (0, 1)))
        faces += [[a, b, c], [a, c, d]] if random.random() < 0.5 else [[a, b, d], [b, c, d]]
    x, y = np.meshgrid(np.arange(n + 1.0), np.arange(m + 1.0), indexing="ij")
    height = random.normal(size=x.shape) * random.choice([0.0, 0.1, 0.5])
    return compact(np.stack([x.ravel(), y.ravel(), height.ravel()], 1), np.array(faces))


def polygon(random: Random) -> tuple[Any, Any]:
    """A polygon cut into triangles at random, or a fan of them: no vertex inside."""
    n = int(random.choice([3, 4, 5, 6, 8, 12, 30, 100]))
    angle = (
        np.sort(random.random(n)) * 2 * np.pi
        if random.random() < 0.5
        else np.arange(n) * 2 * np.pi / n
    )
    points = np.stack([np.cos(angle), np.sin(angle), np.zeros(n)], 1)
    if random.random() < 0.3:
        points = np.round(3 * points) / 3 + 1e-3 * points
    ring, faces = list(range(n)), []
    while len(ring) > 2:
        i = int(random.integers(len(ring))) if random.random() < 0.9 else 1
        faces.append([ring[i - 1], ring[i], ring[(i + 1) % len(ring)]])
        del ring[i]
    return points, np.array(faces)


def opened(random: Random) -> tuple[Any, Any]:
    """A closed surface without the faces around some vertices."""
    vertices, faces, _, _ = closed_surface(random)
    faces = np.asarray(faces)
    keep = np.ones(len(faces), bool)
    touched: set[int] = set()
    for v in random.permutation(len(vertices))[: int(random.integers(1, 5))].tolist():
        around = (faces == v).any(1)
        rim = set(faces[around].ravel().tolist())
        if not rim & touched:
            keep &= ~around
            touched |= rim
    return compact(np.array(vertices, float), faces[keep])


def tube(random: Random) -> tuple[Any, Any]:
    vertices, faces = cylinder(int(random.integers(3, 20)), int(random.integers(1, 6)))
    return np.array(vertices, float), np.array(faces)


def euler(faces: Any) -> int:
    edges = np.sort(faces[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2), axis=1)
    return len(np.unique(faces)) - len(np.unique(edges, axis=0)) + len(faces)


def rim_of(faces: Any) -> list[int]:
    sides = {(int(f[k]), int(f[(k + 1) % 3])) for f in faces for k in range(3)}
    return sorted({v for side in sides if side[::-1] not in sides for v in side})


def random_cones(faces: Any, random: Random, corners: bool) -> tuple[dict[int, int], bool]:
    """Cones inside and, if wanted, corners that sum up with them; whether they do."""
    rim = rim_of(faces)
    inner = np.setdiff1d(np.unique(faces), rim)
    inside = random.permutation(inner)[: int(random.choice([0, 0, 1, 2, 4]))].tolist()
    cones = {int(v): int(random.choice([1, 2, 3, 3, 5, 5, 6])) for v in inside}
    if not corners:
        return cones, True
    needed = 4 * euler(faces) - sum(4 - k for k in cones.values())
    turns = dict.fromkeys(
        random.permutation(rim)[: abs(needed) + 2 * int(random.integers(3))].tolist(), 0
    )
    left = needed
    for i, v in enumerate(turns):
        turns[v] = (1 if left > 0 else -1) if left else (1 if i % 2 else -1)
        left -= turns[v]
    for v in list(turns):
        if left < 0:
            turns[v] -= 1
            left += 1
    good = left == 0
    if random.random() < 0.15 and turns:
        turns[next(iter(turns))] -= 1
        good = not good and left == -1
    return cones | {v: 2 - t for v, t in turns.items()}, good


def random_case(random: Random) -> Case:
    parts = 1 if random.random() < 0.6 else int(random.integers(2, 4))
    boundary = str(random.choice(["aligned", "aligned_or_free", "free"], p=[0.4, 0.4, 0.2]))
    given = random.random() < 0.6
    vertices, faces, sizes, characters, what = [], [], [], [], []
    sound, wrong, start = True, False, 0
    cones: dict[int, Any] = {}
    for _ in range(parts):
        shape = [sheet, polygon, opened, tube][random.integers(4)]
        v, f = shape(random)
        what.append(shape.__name__)
        sound = degenerated(v, f, random, what) and sound
        if given:
            own, good = random_cones(f, random, boundary != "free" and random.random() < 0.4)
            cones |= {start + u: k for u, k in own.items()}
            wrong = wrong or not good
        size = 1.0 if parts == 1 else 10.0 ** random.uniform(-3, 3)
        if parts > 1 and random.random() < 0.1:
            vertices.append(v * 10.0 ** random.uniform(-250, 100))
        else:
            vertices.append(v * size + (4.0 * start if random.random() < 0.5 else 0.0))
        faces.append(f + start)
        sizes.append(len(v))
        characters.append(euler(f))
        start += len(v)
    points = np.concatenate(vertices)
    if random.random() < 0.3:
        points *= 10.0 ** random.uniform(-30, 30)
        what.append("another unit")
    mesh = Mesh(points, np.concatenate(faces).astype(np.int32), what)
    what.append(boundary)
    return Case(
        mesh, sizes, characters, sound, cones if given else None, boundary, wrong, [0] * parts
    )


def check_sums(judged: SeamCount, case: Case) -> None:
    """Gauss-Bonnet on every part."""
    start = 0
    for size, character in zip(case.sizes, case.characters, strict=True):
        mine = range(start, start + size)
        total = sum(4 - k for v, k in judged.cones.items() if v in mine)
        total += sum(2 - k for v, k in judged.corners.items() if v in mine)
        if total != 4 * character:
            raise Finding(
                f"cones and corners sum to {total}, the Euler characteristic is {character}"
            )
        start += size


def check_map(map: ff.Parametrization, case: Case, options: dict[str, Any]) -> None:
    if not map.certificate.ok:
        raise Finding(f"a map came back that failed: {map.certificate.failures}")
    if case.wrong and case.boundary != "free":
        raise Finding(f"a map with corners that do not sum up: {case.cones}")
    check_subdivision(map, case.mesh)
    freed = int(map.stats.get("freed_boundaries", 0))
    if freed and case.boundary != "aligned_or_free":
        raise Finding("a boundary was freed that was not to be")
    for bits, uv in ((64, map.uv64), (32, map.uv32())):
        judged = seam_count(map.faces, uv)
        if judged.flipped:
            raise Finding(f"{judged.flipped} flips in {bits} bits")
        if not options.get("exact", True):
            continue
        if judged.exact < judged.edges or judged.torn:
            raise Finding(
                f"{judged.edges - judged.exact} of {judged.edges} seam edges wrong in {bits} bits, {judged.torn} torn"
            )
        aligned = case.boundary != "free" and not freed
        if aligned and judged.slanted:
            raise Finding(
                f"{judged.slanted} edges of the boundary are off their axis in {bits} bits"
            )
        if aligned:
            check_sums(judged, case)
        if case.cones is None:
            continue
        rim = set(rim_of(case.mesh.faces))
        inner = {v: k for v, k in case.cones.items() if v not in rim and k != 4}
        if judged.cones != inner:
            raise Finding(f"in {bits} bits the cones are {judged.cones}, not {inner}")
        for v, k in case.cones.items():
            if aligned and v in rim and judged.corners[v] != k:
                raise Finding(f"in {bits} bits corner {v} has {judged.corners[v]}, not {k}")


def one(seed: int, slack: float, bits: bytes) -> tuple[str, str]:
    """(what happened, details of a finding) for the case of this seed."""
    random = np.random.default_rng(seed)
    case = random_case(random)
    options = random_options(case, random)
    arguments = {
        "vertices": case.mesh.vertices,
        "faces": case.mesh.faces,
        "cones": case.cones,
        "boundary": case.boundary,
        **options,
    }

    def attempt() -> str:
        try:
            map = timed_call(NAME, arguments, random, slack)
            check_map(map, case, options)
            outcome = "freed" if map.stats.get("freed_boundaries") else "map"
        except ff.FlipfreeError as error:
            check_error(error, case.mesh, arguments)
            outcome = f"{type(error).__name__}: {error.code}"
            if case.sound and not case.wrong and isinstance(error, ff.InvalidInput):
                raise Finding(f"refused, though it is sound: {error}") from None
        kind = "sound" if case.sound else "degenerate"
        return f"{kind}, {case.boundary}{', wrong sum' if case.wrong else ''}: {outcome}"

    return outcome_of(attempt, random, bits, f"[{', '.join(case.mesh.what)}; {options}]")


def work(pipe: Connection, seeds: range, _names: list[str], slack: float) -> None:
    work_through(pipe, seeds, NAME, one, slack)


if __name__ == "__main__":
    sys.exit(main_of(__doc__.splitlines()[0], NAME, one, work))
