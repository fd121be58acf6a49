"""The slow judge's own judge, for small maps: intersections of triangles clipped in rationals, and counts at points."""

from __future__ import annotations

from fractions import Fraction
from itertools import combinations

import numpy as np
import numpy.typing as npt

Point = tuple[Fraction, Fraction]


def triangles_of(uv: npt.ArrayLike) -> list[list[Point]]:
    """Corner UVs (m, 3, 2) as they are, nothing rounded."""
    return [
        [(Fraction(float(x)), Fraction(float(y))) for x, y in triangle]
        for triangle in np.asarray(uv)
    ]


def turned(p: Point, quarters: int) -> Point:
    x, y = p
    return [(x, y), (-y, x), (-x, -y), (y, -x)][quarters % 4]


def minus(p: Point, q: Point) -> Point:
    return p[0] - q[0], p[1] - q[1]


def cross(p: Point, q: Point) -> Fraction:
    return p[0] * q[1] - p[1] * q[0]


def turn(a: Point, b: Point, c: Point) -> Fraction:
    """Twice the signed area."""
    return (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])


def area_twice(polygon: list[Point]) -> Fraction:
    """Twice the area of a polygon, positive if counter-clockwise."""
    return sum(
        (turn(polygon[0], b, c) for b, c in zip(polygon[1:], polygon[2:], strict=False)),
        Fraction(0),
    )


def common(s: list[Point], t: list[Point]) -> list[Point]:
    """The polygon that two counter-clockwise triangles share (Sutherland and Hodgman 1974), maybe without area."""
    polygon = s
    for k in range(3):
        a, b = t[k], t[(k + 1) % 3]
        clipped: list[Point] = []
        for p, q in zip(polygon, polygon[1:] + polygon[:1], strict=True):
            at_p, at_q = turn(a, b, p), turn(a, b, q)
            if at_p >= 0:
                clipped.append(p)
            if at_p * at_q < 0:
                w = at_p / (at_p - at_q)
                clipped.append((p[0] + w * (q[0] - p[0]), p[1] + w * (q[1] - p[1])))
        polygon = clipped
        if not polygon:
            break
    return polygon


def overlapping_pairs(uv: npt.ArrayLike) -> list[tuple[int, int]]:
    """All pairs of positive triangles (m, 3, 2) whose interiors meet, tried one by one."""
    triangles = triangles_of(uv)
    return [
        (i, j)
        for i, j in combinations(range(len(triangles)), 2)
        if len(shared := common(triangles[i], triangles[j])) > 2 and area_twice(shared) > 0
    ]
