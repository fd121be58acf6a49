"""Random seamless maps, in processes that may crash, judged in rational numbers.

    export PYTHONPATH=build/python:tests/python:benchmarks:tests
    random_seamless.py [--calls 1000] [--seed 0] [--jobs 2] [--slack 2.0] [--report FILE.json]
    random_seamless.py --repeat SEED

Closed surfaces of genus 0 to 5 and several of them at once: tiny, in any unit, flattened, jittered, with vertices all but on
each other; cones that sum up, and such that do not; random limits of time and cancels. A map that comes back has no flip and
no seam edge that is not exact, in 64 and in 32 bits, and the cones that were asked for (tests/judges/seams.py, which shares no
code with the solver); it subdivides the input. What cannot be is refused as InvalidInput or Infeasible, and nothing else is.
"""

from __future__ import annotations

import sys
from dataclasses import dataclass
from multiprocessing.connection import Connection
from typing import Any

import numpy as np
from random_calls import timed_call
from random_maps import main_of, outcome_of, work_through

import flipfree as ff

from judges.seams import seam_count
from judges.unfoldings import unfolding
from random_meshes import Mesh
from surfaces import octahedron_sphere, prism, torus
from verdict import Finding, check_error

NAME = "seamless"
Random = np.random.Generator


@dataclass
class Case:
    mesh: Mesh
    genera: list[int]  # of the parts, in order
    sizes: list[int]  # their vertices
    sound: bool  # no triangle is nearly degenerate
    cones: Any
    admissible: bool


def holed(genus: int, n: int, random: Random) -> tuple[Any, Any]:
    """A bar of cubes with so many holes, every square divided into n x n."""
    cells = [(x, y, 0) for x in range(2 * genus + 1) for y in range(3) if y != 1 or x % 2 == 0]
    shape = unfolding(cells if genus else [(0, 0, 0)], n, int(random.integers(1000)))
    return shape.vertices, shape.faces


def surface(random: Random) -> tuple[Any, Any, int, str]:
    kind = random.integers(5)
    if kind == 0:
        vertices, faces = octahedron_sphere(int(random.integers(0, 4)))
        return vertices, faces, 0, "sphere"
    if kind == 1:
        vertices, faces = torus(int(random.integers(3, 16)), int(random.integers(3, 12)))
        return vertices, faces, 1, "torus"
    if kind == 2:
        vertices, faces = prism(int(random.integers(3, 30)), 10.0 ** random.uniform(-2, 2))
        return vertices, faces, 0, "prism"
    genus = int(random.integers(0, 6))
    n = int(random.integers(1, 4 if genus < 3 else 3))
    return *holed(genus, n, random), genus, f"{genus} holes"


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


def is_empty_stratum(cones: dict[int, int], genus: int) -> bool:
    return genus == 1 and sorted(cones.values()) == [3, 5]


def random_case(random: Random) -> Case:
    parts = 1 if random.random() < 0.8 else int(random.integers(2, 4))
    vertices, faces, genera, sizes, what = [], [], [], [], []
    sound, admissible = True, True
    cones: dict[int, Any] = {}
    start = 0
    for _ in range(parts):
        v, f, genus, name = surface(random)
        v, f = np.array(v, float), np.array(f, np.int64)
        what.append(name)
        sound = degenerated(v, f, random, what) and sound
        own = summed_up(len(v), genus, random)
        admissible = admissible and sum(4 - k for k in own.values()) == 8 - 8 * genus
        admissible = admissible and not is_empty_stratum(own, genus)
        cones |= {start + u: k for u, k in own.items()}
        vertices.append(v * (10.0 ** random.uniform(-3, 3) if parts > 1 else 1.0) + 4.0 * start)
        faces.append(f + start)
        genera.append(genus)
        sizes.append(len(v))
        start += len(v)
    points, triangles = np.concatenate(vertices), np.concatenate(faces)
    if random.random() < 0.3:
        points *= 10.0 ** random.uniform(-30, 30)
        what.append("another unit")
    given: Any = cones
    kind = random.random()
    if kind < 0.12:
        given, admissible = None, True
    elif kind < 0.3:
        given = dict(cones)
        place = int(random.integers(start))
        wrong = [0, -1, 3.5, float("nan"), 2**20, "3", None, given.get(place, 4) + 1]
        given[place] = wrong[random.integers(len(wrong))]
        admissible = False
        what.append(f"cone {given[place]!r}")
    mesh = Mesh(points, triangles.astype(np.int32), what)
    return Case(mesh, genera, sizes, sound, given, admissible)


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


def check_map(map: ff.Parametrization, case: Case, options: dict[str, Any]) -> None:
    if not map.certificate.ok:
        raise Finding(f"a map came back that failed: {map.certificate.failures}")
    if not case.admissible:
        raise Finding(f"a map with cones that no surface has: {case.cones}")
    check_subdivision(map, case.mesh)
    wide, stored = (seam_count(map.faces, uv) for uv in (map.uv64, map.uv32()))
    if wide.flipped or stored.flipped:
        raise Finding(f"flips: {wide.flipped} in 64 bits, {stored.flipped} as stored")
    if not options.get("exact", True):
        return
    for bits, judged in ((64, wide), (32, stored)):
        if judged.exact < judged.edges or judged.torn:
            raise Finding(
                f"{judged.edges - judged.exact} of {judged.edges} seam edges wrong in {bits} bits, {judged.torn} torn"
            )
        if case.cones is not None and judged.cones != {
            k: c for k, c in case.cones.items() if c != 4
        }:
            raise Finding(f"in {bits} bits the cones are {judged.cones}, not {case.cones}")
    if len(map.transitions.quarter_turns) != len(map.cut_edges) or len(map.cut_edges) < wide.edges:
        raise Finding("transitions do not belong to the cut edges")
    start = 0
    for genus, size in zip(case.genera, case.sizes, strict=True):
        own = sum(4 - k for v, k in wide.cones.items() if start <= v < start + size)
        if own != 8 - 8 * genus:
            raise Finding(f"cones sum to {own} on genus {genus}")
        start += size


def one(seed: int, slack: float, bits: bytes) -> tuple[str, str]:
    """(what happened, details of a finding) for the case of this seed."""
    random = np.random.default_rng(seed)
    case = random_case(random)
    options = random_options(case, random)
    arguments = {
        "vertices": case.mesh.vertices,
        "faces": case.mesh.faces,
        "cones": case.cones,
        **options,
    }

    def attempt() -> str:
        try:
            check_map(timed_call(NAME, arguments, random, slack), case, options)
            outcome = "map"
        except ff.FlipfreeError as error:
            check_error(error, case.mesh, arguments)
            outcome = f"{type(error).__name__}: {error.code}"
            if (
                case.sound
                and case.admissible
                and isinstance(error, (ff.InvalidInput, ff.Infeasible))
            ):
                raise Finding(f"refused, though it is sound: {error}") from None
        kind = "sound" if case.sound else "degenerate"
        return f"{kind}, {'' if case.admissible else 'in'}admissible: {outcome}"

    return outcome_of(attempt, random, bits, f"[{', '.join(case.mesh.what)}; {options}]")


def work(pipe: Connection, seeds: range, _names: list[str], slack: float) -> None:
    work_through(pipe, seeds, NAME, one, slack)


if __name__ == "__main__":
    sys.exit(main_of(__doc__.splitlines()[0], NAME, one, work))
