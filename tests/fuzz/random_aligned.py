"""Random field-aligned maps, in processes that may crash, judged in rational numbers and by other loops than the solver's.

    random_aligned.py, and what driver.py says

The surfaces of random_seamless.py, along the smoothest field or one that follows
curvature, with cones merged or not, sizes or none, by all engines, with aligned and with free boundaries. A map that comes back
has no flip, no seam edge that is not exact and, where the boundary is aligned, no edge of it that is off its axis, in 64 and in
32 bits (tests/judges/seams.py). Its inner cones are the field's, and the corners of every curve of its boundary turn together as
the field does along it. Along random strips of faces it turns as the field does (judges/fields.py, judges/holonomy.py). It
subdivides the input.
"""

from __future__ import annotations

import sys
from collections import defaultdict
from typing import Any

import numpy as np
from driver import main, timed_call
from random_seamless import Case, closed, judged_maps, opened, polygon, random_surface, sheet, tube

import flipfree as ff

from judges import fields, holonomy
from judges.disjoint_sets import DisjointSets
from judges.seams import SeamCount
from surfaces import open_edges
from verdict import Finding, check_error

NAME = "field_aligned"
LOOPS = 6
Random = np.random.Generator


def random_case(random: Random) -> Case:
    parts = 1 if random.random() < 0.8 else int(random.integers(2, 4))
    boundary = str(random.choice(["aligned", "free"], p=[0.8, 0.2]))
    return random_surface((sheet, polygon, opened, tube, closed), parts, boundary, random)


def random_options(case: Case, random: Random) -> dict[str, Any]:
    options: dict[str, Any] = {}
    if random.random() < 0.2:
        options["optimise"] = False
    if random.random() < 0.1:
        options["exact"] = False
    if random.random() < 0.2:
        options["engine"] = str(random.choice(["penner", "padding"]))
    if random.random() < 0.3:
        options["max_seconds"] = float(10.0 ** random.uniform(-4, 1))
    if random.random() < 0.3:
        options["uncuttable"] = case.mesh.faces[random.integers(len(case.mesh.faces), size=5)][
            :, :2
        ]
    if random.random() < 0.2:
        options["sizing"] = np.exp(random.normal(size=len(case.mesh.vertices)) * 0.5)
    if random.random() < 0.3:
        options["threads"] = int(random.integers(1, 4))
    if options.get("optimise", True) and random.random() < 0.3:
        count = int(random.integers(1, 30))
        options["features"] = case.mesh.faces[random.integers(len(case.mesh.faces), size=count)][
            :, :2
        ]
    return options


def random_field(case: Case, features: Any, random: Random) -> ff.CrossField:
    return ff.cross_field(
        case.mesh.vertices,
        case.mesh.faces,
        alignment=float(random.choice([0.0, 0.0, 0.3, 0.9])),
        simplify=bool(random.random() < 0.3),
        boundary=case.boundary == "aligned" or random.random() < 0.3,
        sharp_edges=features if features is not None and random.random() < 0.8 else None,
        max_seconds=20.0,
    )


def random_loops(faces: Any, random: Random) -> list[list[int]]:
    """Closed strips of faces through a random tree of these: loops around any vertices, holes and handles."""
    opposite = holonomy.opposite_halfedges(faces)
    edges = np.flatnonzero(np.arange(len(opposite)) < opposite)
    random.shuffle(edges)
    trees = DisjointSets(len(faces))
    neighbours: dict[int, list[int]] = defaultdict(list)
    rest = []
    for h in edges.tolist():
        o = int(opposite[h])
        if trees.join(h // 3, o // 3):
            neighbours[h // 3].append(h)
            neighbours[o // 3].append(o)
        else:
            rest.append(h)
    loops = []
    for h in rest[:LOOPS]:
        first, last = int(opposite[h]) // 3, h // 3
        came, queue = {first: -1}, [first]
        for f in queue:
            for g in neighbours[f]:
                beyond = int(opposite[g]) // 3
                if beyond not in came:
                    came[beyond] = g
                    queue.append(beyond)
        loop = [h]
        f = last
        while f != first:
            loop.append(came[f])
            f = came[f] // 3
        loops.append(loop[::-1])
    return loops


def curves_of(faces: Any) -> list[list[int]]:
    """The vertices of each curve of the boundary."""
    after = dict(open_edges(faces).tolist())
    curves = []
    while after:
        start = next(iter(after))
        curve = [start]
        while (v := after.pop(curve[-1])) != start:
            curve.append(v)
        curves.append(curve)
    return curves


def shares_two_sides(faces: Any) -> bool:
    opposite = holonomy.opposite_halfedges(faces)
    own = np.arange(len(opposite)) // 3
    pairs = np.stack([own, opposite // 3], 1)[opposite >= 0]
    return len(np.unique(pairs, axis=0)) < len(pairs)


def check_turns(map: ff.Parametrization, case: Case, field: ff.CrossField, random: Random) -> None:
    faces = case.mesh.faces
    if shares_two_sides(faces):
        return
    loops = random_loops(map.faces, random)
    strips = [fields.projected(faces, map.faces, map.parent_face, loop) for loop in loops]
    wanted = fields.judge(case.mesh.vertices, faces, field.rotation, [s for s in strips if s])
    if not case.sound and wanted.error > 1e-6:
        return  # the second judge adds up angles of the triangles as they are
    for bits, uv in ((64, map.uv64), (32, map.uv32())):
        opposite, corner = holonomy.opposite_halfedges(map.faces), holonomy.corner_angles(uv)
        turns = [
            float(holonomy.loop_angle(opposite, corner, loop) / holonomy.QUARTER)
            for loop, strip in zip(loops, strips, strict=True)
            if strip
        ]
        for turn, right in zip(turns, wanted.turns, strict=True):
            if abs(turn - right) > 1e-3:
                raise Finding(
                    f"in {bits} bits a loop turns by {turn} quarters, the field by {right}"
                )


def check_cones(judged: SeamCount, case: Case, field: ff.CrossField, bits: int) -> None:
    of_field = ff.signature(case.mesh.vertices, case.mesh.faces, field).cones
    curves = curves_of(case.mesh.faces)
    rim = {v for curve in curves for v in curve}
    inner = {v: k for v, k in of_field.items() if v not in rim and k != 4}
    if judged.cones != inner:
        raise Finding(f"in {bits} bits the cones are {judged.cones}, not {inner}")
    if case.boundary != "aligned":
        return
    for curve in curves:
        turned = sum(2 - judged.corners[v] for v in curve)
        wanted = sum(2 - of_field.get(v, 2) for v in curve)
        if turned != wanted:
            raise Finding(f"in {bits} bits a curve turns by {turned} quarters, not {wanted}")


def check_features(map: ff.Parametrization, features: Any) -> None:
    """Those that are whole edges of the map, by the values on either side."""
    missed = {tuple(sorted(e)) for e in map.certificate.features_missed.tolist()}
    wanted = {tuple(sorted(e)) for e in np.asarray(features).tolist()}
    sides: dict[tuple[int, int], list[tuple[int, int]]] = defaultdict(list)
    for f, face in enumerate(map.faces.tolist()):
        for k in range(3):
            sides[tuple(sorted((face[k], face[(k + 1) % 3])))].append((f, k))
    for edge in wanted & sides.keys():
        met = all(
            (uv[f, k] == uv[f, (k + 1) % 3]).any()
            for f, k in sides[edge]
            for uv in (map.uv64, map.uv32())
        )
        if met == (edge in missed):
            raise Finding(f"feature {edge} is {'met' if met else 'missed'}, and named otherwise")


def check_map(
    map: ff.Parametrization,
    case: Case,
    field: ff.CrossField,
    options: dict[str, Any],
    random: Random,
) -> None:
    exact, aligned = options.get("exact", True), case.boundary == "aligned"
    for bits, judged in judged_maps(map, case.mesh, exact=exact, aligned=aligned):
        check_cones(judged, case, field, bits)
    if exact:
        check_turns(map, case, field, random)
    if "features" in options:
        check_features(map, options["features"])


def case(seed: int, slack: float, said: list[str]) -> str:
    random = np.random.default_rng(seed)
    given = random_case(random)
    options = random_options(given, random)
    said += [*given.mesh.what, str(options)]
    arguments = {
        "vertices": given.mesh.vertices,
        "faces": given.mesh.faces,
        "boundary": given.boundary,
        **options,
    }
    try:
        field = random_field(given, options.get("features"), random)
        map = timed_call(NAME, {**arguments, "field": field}, random, slack)
        check_map(map, given, field, options, random)
        happened = "map, divided" if map.stats.get("divided_chords") else "map"
    except ff.FlipfreeError as error:
        check_error(error, given.mesh, arguments)
        happened = f"{type(error).__name__}: {error.code}"
    return f"{'sound' if given.sound else 'degenerate'}, {given.boundary}: {happened}"


if __name__ == "__main__":
    sys.exit(main(__doc__, case))
