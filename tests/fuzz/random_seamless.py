"""Random seamless maps, in processes that may crash, judged in rational numbers.

    random_seamless.py, and what driver.py says

Closed surfaces of genus 0 to 5, sheets of squares with holes, polygons without a vertex inside, tubes, and closed surfaces with
patches taken out, up to three at once: tiny, in any unit, flattened, jittered, with vertices all but on each other; cones and
corners that sum up, and such that do not, or none given; all kinds of boundaries; random limits of time and cancels. A map that
comes back has no flip, no seam edge that is not exact and, where the boundary is aligned, no edge of it that is off its axis,
in 64 and in 32 bits; its cones and corners are those that were asked for, and on every part they sum up
(tests/judges/seams.py, which shares no code with the solver); it subdivides the input. What cannot be is refused as
InvalidInput or Infeasible, and of closed surfaces nothing else is.
"""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from driver import main, timed_call

import flipfree as ff

from judges.disjoint_sets import DisjointSets
from judges.seams import SeamCount, seam_count
from random_meshes import Mesh
from surfaces import (
    compact,
    cylinder,
    euler,
    joined,
    octahedron_sphere,
    of_cubes,
    open_edges,
    plate,
    prism,
    torus,
)
from verdict import Finding, check_error

NAME = "seamless"
Random = np.random.Generator
Shape = tuple[Any, Any]


@dataclass
class Part:
    """Of a mesh: vertices from `start` on."""

    start: int
    size: int
    faces: Any  # its own
    rim: list[int]  # its own vertices on the boundary

    @property
    def euler(self) -> int:
        return euler(self.faces)

    def holds(self, vertex: int) -> bool:
        return self.start <= vertex < self.start + self.size


@dataclass
class Case:
    mesh: Mesh
    parts: list[Part]
    sound: bool  # no triangle is nearly degenerate
    boundary: str
    cones: Any = None
    admissible: bool = True

    @property
    def rim(self) -> set[int]:
        return {part.start + v for part in self.parts for v in part.rim}


def closed(random: Random) -> Shape:
    """Of genus 0 to 5."""
    kind = random.integers(5)
    if kind == 0:
        return octahedron_sphere(int(random.integers(0, 4)))
    if kind == 1:
        return torus(int(random.integers(3, 16)), int(random.integers(3, 12)))
    if kind == 2:
        return prism(int(random.integers(3, 30)), 10.0 ** random.uniform(-2, 2))
    genus = int(random.integers(0, 6))
    n = int(random.integers(1, 4 if genus < 3 else 3))
    return of_cubes(plate(genus) if genus else [(0, 0, 0)], n)


def sheet(random: Random) -> Shape:
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


def polygon(random: Random) -> Shape:
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


def opened(random: Random) -> Shape:
    """A closed surface without the faces around some vertices."""
    vertices, faces = closed(random)
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


def tube(random: Random) -> Shape:
    vertices, faces = cylinder(int(random.integers(3, 20)), int(random.integers(1, 6)))
    return np.array(vertices, float), np.array(faces)


def degenerated(vertices: Any, faces: Any, random: Random, what: list[str]) -> bool:
    """Changes the surface in place; whether it is sound still."""
    kind = random.random()
    if kind < 0.4:
        vertices += random.normal(size=vertices.shape) * 10.0 ** random.uniform(-9, -1.5)
        what.append("jitter")
        return True
    if kind < 0.6:
        return True
    if kind < 0.75:
        vertices[:, random.integers(3)] *= 10.0 ** -random.uniform(1, 12)
        what.append("flattened")
    elif kind < 0.85:
        a, b = faces[random.integers(len(faces))][:2]
        vertices[a] = vertices[b] + random.normal(size=3) * 10.0 ** -random.uniform(3, 14)
        what.append("two vertices close")
    elif kind < 0.95:
        vertices[random.integers(len(vertices))] *= 10.0 ** random.uniform(1, 6)
        what.append("thrown")
    else:
        vertices += random.normal(size=vertices.shape) * 0.5
        what.append("crumpled")
    return False


def summed_up(count: int, genus: int, random: Random) -> dict[int, int]:
    """Cones of a closed surface with so many vertices that satisfy Gauss-Bonnet."""
    most = min(count, int(random.choice([2, 4, 8, 16, 50])))
    number = int(random.integers(1, most + 1))
    places = random.permutation(count)[:number]
    turns = random.choice([1, 2, 3, 3, 3, 5, 5, 5, 6, 8, 12], number)
    needed = 4 * number - (8 - 8 * genus)
    if needed < number:
        return {}
    while turns.sum() != needed:
        i = random.integers(number)
        step = int(np.sign(needed - turns.sum()))
        if step > 0 or turns[i] > 1:
            turns[i] += step * (1 if random.random() < 0.7 else min(abs(needed - turns.sum()), 3))
            turns[i] = max(turns[i], 1)
    return {int(v): int(k) for v, k in zip(places, turns, strict=True) if k != 4}


def random_surface(
    shapes: Sequence[Callable[[Random], Shape]], parts: int, boundary: str, random: Random
) -> Case:
    """Some of these shapes side by side, or through each other."""
    made, found, what, sound, start = [], [], [], True, 0
    for _ in range(parts):
        shape = shapes[random.integers(len(shapes))]
        v, f = shape(random)
        v, f = np.array(v, float), np.array(f, np.int64)
        what.append(shape.__name__)
        sound = degenerated(v, f, random, what) and sound
        found.append(Part(start, len(v), f, np.unique(open_edges(f)).tolist()))
        if parts > 1:
            small = random.random() < 0.1
            v = v * 10.0 ** (random.uniform(-250, 100) if small else random.uniform(-3, 3))
            v = v + (0.0 if small or random.random() < 0.5 else 4.0 * start)
        made.append((v, f))
        start += len(v)
    points, faces = joined(*made)
    if random.random() < 0.3:
        points *= 10.0 ** random.uniform(-30, 30)
        what.append("another unit")
    what.append(boundary)
    return Case(Mesh(points, faces, what), found, sound, boundary)


def closed_cones(part: Part, random: Random) -> tuple[dict[int, int], bool]:
    """Cones of a closed part, and whether they sum up and are no empty stratum."""
    cones = summed_up(part.size, 1 - part.euler // 2, random)
    empty = part.euler == 0 and sorted(cones.values()) == [3, 5]
    return cones, sum(4 - k for k in cones.values()) == 4 * part.euler and not empty


def bordered_cones(part: Part, random: Random, corners: bool) -> tuple[dict[int, int], bool]:
    """Cones inside and, if wanted, corners that sum up with them; whether they do."""
    inner = np.setdiff1d(np.unique(part.faces), part.rim)
    inside = random.permutation(inner)[: int(random.choice([0, 0, 1, 2, 4]))].tolist()
    cones = {int(v): int(random.choice([1, 2, 3, 3, 5, 5, 6])) for v in inside}
    if not corners:
        return cones, True
    needed = 4 * part.euler - sum(4 - k for k in cones.values())
    turns = dict.fromkeys(
        random.permutation(part.rim)[: abs(needed) + 2 * int(random.integers(3))].tolist(), 0
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
    parts = 1 if random.random() < 0.7 else int(random.integers(2, 4))
    boundary = str(random.choice(["aligned", "aligned_or_free", "free"], p=[0.4, 0.4, 0.2]))
    shapes = (closed, closed, closed, sheet, polygon, opened, tube)
    case = random_surface(shapes, parts, boundary, random)
    kind = random.random()
    if kind < 0.3:
        return case
    case.cones = {}
    for part in case.parts:
        if part.rim:
            corners = boundary != "free" and random.random() < 0.4
            own, good = bordered_cones(part, random, corners)
        else:
            own, good = closed_cones(part, random)
        case.cones |= {part.start + v: k for v, k in own.items()}
        case.admissible = case.admissible and good
    if kind < 0.4:
        v = int(random.integers(len(case.mesh.vertices)))
        wrong = [0, -1, 3.5, float("nan"), 2**20, "3", None]
        wrong += [] if case.rim else [case.cones.get(v, 4) + 1]
        case.cones[v] = wrong[random.integers(len(wrong))]
        case.admissible = False
        case.mesh.what.append(f"cone {case.cones[v]!r}")
    return case


def random_options(case: Case, random: Random) -> dict[str, Any]:
    options: dict[str, Any] = {}
    if random.random() < 0.3:
        options["optimise"] = bool(random.integers(2))
    if random.random() < 0.1:
        options["exact"] = False
    if random.random() < 0.15:
        options["max_iterations"] = int(random.choice([1, 3, 10, 1000]))
    if random.random() < 0.3:
        options["max_seconds"] = float(10.0 ** random.uniform(-4, 1))
    if random.random() < 0.3:
        edges = case.mesh.faces[random.integers(len(case.mesh.faces), size=5)][:, :2]
        options["uncuttable"] = edges
    if random.random() < 0.3:
        options["threads"] = int(random.integers(1, 4))
    return options


def check_subdivision(map: ff.Parametrization, mesh: Mesh) -> None:
    n = len(mesh.vertices)
    if not np.array_equal(map.vertices[:n], mesh.vertices):
        raise Finding("the first vertices are not those that were given")
    corners = mesh.vertices[mesh.faces[map.vertex_parent[n:]]]
    places = (corners * map.vertex_barycentric[n:, :, None]).sum(1)
    size = np.abs(mesh.vertices).max()
    if len(places) and np.abs(places - map.vertices[n:]).max() > 1e-12 * size:
        raise Finding("a new vertex is not where it lies on the input")
    if set(map.parent_face.tolist()) != set(range(len(mesh.faces))):
        raise Finding("a face of the input is not covered")


def judged_maps(
    map: ff.Parametrization, mesh: Mesh, *, exact: bool, aligned: bool
) -> Iterator[tuple[int, SeamCount]]:
    """(bits, what the judge counts) of a map that is certified, subdivides the mesh, and has neither flips nor wrong seams."""
    if not map.certificate.ok:
        raise Finding(f"a map came back that failed: {map.certificate.failures}")
    check_subdivision(map, mesh)
    for bits, uv in ((64, map.uv64), (32, map.uv32())):
        judged = seam_count(map.faces, uv)
        if judged.flipped:
            raise Finding(f"{judged.flipped} flips in {bits} bits")
        if not exact:
            continue
        if judged.exact < judged.edges or judged.torn:
            wrong = f"{judged.edges - judged.exact} of {judged.edges} seam edges wrong"
            raise Finding(f"{wrong} in {bits} bits, {judged.torn} torn")
        if aligned and judged.slanted:
            raise Finding(f"{judged.slanted} boundary edges are off their axis in {bits} bits")
        if len(map.cut_edges) < judged.edges:
            raise Finding("transitions do not belong to the cut edges")
        yield bits, judged


def check_map(map: ff.Parametrization, case: Case, options: dict[str, Any]) -> None:
    if not case.admissible:
        raise Finding(f"a map with cones that no surface has: {case.cones}")
    freed = bool(map.stats.get("freed_boundaries", 0))
    if freed and case.boundary != "aligned_or_free":
        raise Finding("a boundary was freed that was not to be")
    aligned = case.boundary != "free" and not freed
    exact, rim = options.get("exact", True), case.rim
    if exact and len(map.transitions.quarter_turns) != len(map.cut_edges):
        raise Finding("transitions do not belong to the cut edges")
    for bits, judged in judged_maps(map, case.mesh, exact=exact, aligned=aligned):
        for part in case.parts:
            if part.rim and not aligned:
                continue
            total = sum(4 - k for v, k in judged.cones.items() if part.holds(v))
            total += sum(2 - k for v, k in judged.corners.items() if part.holds(v))
            if total != 4 * part.euler:
                raise Finding(f"cones and corners sum to {total}, not to {4 * part.euler}")
        if case.cones is None:
            continue
        inner = {v: k for v, k in case.cones.items() if v not in rim and k != 4}
        if judged.cones != inner:
            raise Finding(f"in {bits} bits the cones are {judged.cones}, not {inner}")
        for v, k in case.cones.items():
            if aligned and v in rim and judged.corners[v] != k:
                raise Finding(f"in {bits} bits corner {v} has {judged.corners[v]}, not {k}")


def case(seed: int, slack: float, said: list[str]) -> str:
    random = np.random.default_rng(seed)
    given = random_case(random)
    options = random_options(given, random)
    said += [*given.mesh.what, str(options)]
    arguments = {
        "vertices": given.mesh.vertices,
        "faces": given.mesh.faces,
        "cones": given.cones,
        "boundary": given.boundary,
        **options,
    }
    try:
        map = timed_call(NAME, arguments, random, slack)
        check_map(map, given, options)
        happened = "freed" if map.stats.get("freed_boundaries") else "map"
    except ff.FlipfreeError as error:
        check_error(error, given.mesh, arguments)
        happened = f"{type(error).__name__}: {error.code}"
        ours = ff.InvalidInput if given.rim else (ff.InvalidInput, ff.Infeasible)
        if given.sound and given.admissible and isinstance(error, ours):
            raise Finding(f"refused, though it is sound: {error}") from None
    kind = "sound" if given.sound else "degenerate"
    return f"{kind}, {given.boundary}{'' if given.admissible else ', inadmissible'}: {happened}"


if __name__ == "__main__":
    sys.exit(main(__doc__, case))
