"""What of a map is not on whole tiles, a second time: in fractions, face by face."""

from __future__ import annotations

from collections import Counter
from fractions import Fraction
from typing import Any

from .rational import Point, minus, turned


def _whole(p: Point) -> bool:
    return p[0].denominator == 1 == p[1].denominator


def _quadrant(p: Point) -> int:
    """Of a direction: 0 for [0, 90) degrees, and so on."""
    x, y = p
    if y >= 0 and x > 0:
        return 0
    if x <= 0 and y > 0:
        return 1
    return 2 if x < 0 else 3


def off_tiles(faces: Any, uv: Any, features: Any = ()) -> Counter[str]:
    """Of a map without flips whose seams are exact, (m, 3, 2): how many seam edges, cones, corners of the border and edges of
    features are not on whole numbers."""
    places = [[(Fraction(float(x)), Fraction(float(y))) for x, y in face] for face in uv]
    side = {(int(f[k]), int(f[(k + 1) % 3])): (i, k) for i, f in enumerate(faces) for k in range(3)}
    found: Counter[str] = Counter()
    rim: set[int] = set()
    oblique: set[int] = set()
    wanted = {frozenset(map(int, edge)) for edge in features}
    missed = set()
    for (a, b), (i, k) in side.items():
        p, q = places[i][k], places[i][(k + 1) % 3]
        along = [c for c in (0, 1) if p[c] == q[c]]
        if frozenset((a, b)) in wanted and along and p[along[0]].denominator != 1:
            missed.add(frozenset((a, b)))
        other = side.get((b, a))
        if other is None:
            rim |= {a, b}
            oblique |= set() if along else {a, b}
            continue
        r, s = places[other[0]][(other[1] + 1) % 3], places[other[0]][other[1]]
        (turn,) = (t for t in range(4) if turned(minus(q, p), t) == minus(s, r))
        if a < b and not _whole(minus(r, turned(p, turn))):
            found["seam edge"] += 1
    angle: Counter[int] = Counter()
    stands: dict[int, bool] = {}
    for i, face in enumerate(faces):
        for k in range(3):
            v = int(face[k])
            out = minus(places[i][(k + 1) % 3], places[i][k])
            back = minus(places[i][(k + 2) % 3], places[i][k])
            # Less than half a turn: directions are counted where they enter a quadrant.
            angle[v] += (_quadrant(back) - _quadrant(out)) % 4
            stands[v] = stands.get(v, True) and _whole(places[i][k])
    for v, quarters in angle.items():
        if v in rim:
            if v not in oblique and quarters != 2 and not stands[v]:
                found["corner of the border"] += 1
        elif quarters != 4 and not stands[v]:
            found["cone"] += 1
    found["feature"] = len(missed)
    return +found
