"""A slow judge of seamless maps: cut edges, how many are exact, and cones, all in rationals."""

from __future__ import annotations

from collections import defaultdict
from dataclasses import dataclass
from fractions import Fraction
from typing import Any

import numpy as np
import numpy.typing as npt

from .rational import Point, cross, minus, turned


@dataclass(frozen=True)
class SeamCount:
    edges: int  # with two faces whose UVs differ
    exact: int  # of these: a quarter turn and a translation, with no error
    torn: int  # inner vertices between two cut edges of one branch that have different translations
    flipped: int  # triangles without positive area
    slanted: int  # edges of the boundary that do not lie along an axis
    # Quarter turns of angle, where all seam edges are exact: of inner vertices that do not have 4,
    cones: dict[int, int]
    # and of all boundary vertices, if none of their edges is slanted.
    corners: dict[int, int]


def crossings(direction: Point, end: Point, ray: Point) -> int:
    """1 if turning counter-clockwise from `direction` to `end`, by less than half a turn, reaches `ray`."""
    on_end = cross(ray, end) == 0 and ray[0] * end[0] + ray[1] * end[1] > 0
    inside = cross(direction, ray) > 0 and cross(ray, end) > 0
    return 1 if on_end or inside else 0


def seam_count(faces: npt.ArrayLike, uv: npt.ArrayLike) -> SeamCount:
    """Of corner UVs (m, 3, 2), every one taken for the number that it is."""
    triangles = np.asarray(faces).tolist()
    values = np.asarray(uv).astype(np.float64)  # floats are doubles, exactly
    corners: list[list[Point]] = [
        [(Fraction(x), Fraction(y)) for x, y in triangle] for triangle in values.tolist()
    ]
    sides: dict[tuple[int, int], tuple[int, int]] = {}
    for f, triangle in enumerate(triangles):
        for k in range(3):
            sides[triangle[k], triangle[(k + 1) % 3]] = (f, k)

    edges = exact = 0
    transition: dict[
        tuple[int, int], tuple[int, Point] | None
    ] = {}  # from a directed edge's left to its right
    cut: set[tuple[int, int]] = set()
    for (v, w), (f, k) in sides.items():
        if (w, v) not in sides:
            continue
        g, m = sides[w, v]
        a, b = corners[f][k], corners[f][(k + 1) % 3]
        c, d = corners[g][(m + 1) % 3], corners[g][m]  # the same ends on the other side
        if a != c or b != d:
            cut.add((v, w))
        found = None
        for turns in range(4):
            if turned(minus(b, a), turns) == minus(d, c):
                found = (turns, minus(c, turned(a, turns)))
        transition[v, w] = found
        if v < w and (v, w) in cut:
            edges += 1
            exact += found is not None

    cut_at: dict[int, list[tuple[int, int]]] = defaultdict(list)
    for v, w in cut:
        cut_at[v].append((v, w))
    torn = 0
    rim = {v for edge in sides if edge[::-1] not in sides for v in edge}
    for v, out in cut_at.items():
        if len(out) != 2 or v in rim:
            continue
        # Seen from one side of the chain: one edge leads away from the vertex, the other towards it.
        one, other = transition[out[0]], transition[out[1][1], out[1][0]]
        if one is not None and other is not None and one[0] == other[0] and one[1] != other[1]:
            torn += 1

    flipped = sum(cross(minus(t[1], t[0]), minus(t[2], t[0])) <= 0 for t in corners)
    slanted = 0
    for (v, w), (f, k) in sides.items():
        if (w, v) not in sides:
            along = minus(corners[f][(k + 1) % 3], corners[f][k])
            slanted += along[0] != 0 and along[1] != 0
    angles: dict[int, int] = {}
    if not flipped and exact == edges:
        angles = angles_of(triangles, corners, sides, transition, set() if slanted == 0 else rim)
    return SeamCount(
        edges,
        exact,
        torn,
        int(flipped),
        slanted,
        {v: k for v, k in angles.items() if v not in rim and k != 4},
        {v: k for v, k in angles.items() if v in rim},
    )


def angles_of(
    triangles: Any, corners: Any, sides: Any, transition: Any, without: set[int]
) -> dict[int, int]:
    """The corners around every vertex, developed into the first one's plane: how often they reach the axes that it has there."""
    leaving: dict[int, list[int]] = defaultdict(list)
    for v, w in sides:
        leaving[v].append(w)
    angles = {}
    for v, others in leaving.items():
        if v in without:
            continue
        # On the boundary from the edge that has no face on its right.
        start = next((w for w in others if (w, v) not in sides), others[0])
        w = start
        turns = 0  # from the plane of the face at hand to the first one's
        first: Point | None = None
        angles[v] = 0
        while True:
            f, k = sides[v, w]
            here = corners[f][k]
            direction = turned(minus(corners[f][(k + 1) % 3], here), turns)
            end = turned(minus(corners[f][(k + 2) % 3], here), turns)
            first = first or direction
            angles[v] += sum(crossings(direction, end, turned(first, q)) for q in range(4))
            w = triangles[f][(k + 2) % 3]
            if w == start or (v, w) not in sides:
                break
            turns -= transition[w, v][0]
    return angles
