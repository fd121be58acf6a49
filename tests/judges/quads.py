"""The quads of an integer map, extracted a second time: in fractions, on the map's own triangles, by developing the lattice
from one cone."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator
from fractions import Fraction
from math import ceil, floor
from typing import Any

from .rational import Point, cross, minus, turned

HALF = Fraction(1, 2)


def _plus(p: Point, q: Point) -> Point:
    return p[0] + q[0], p[1] + q[1]


class Extraction:
    """faces (m, 3), uv (m, 3, 2) exact in floats; `start`: a vertex on the lattice."""

    def __init__(self, faces: Any, uv: Any, start: int) -> None:
        self.faces = [tuple(int(v) for v in face) for face in faces]
        self.uv = [[(Fraction(float(x)), Fraction(float(y))) for x, y in face] for face in uv]
        sides = {(f[k], f[(k + 1) % 3]): (i, k) for i, f in enumerate(self.faces) for k in range(3)}
        self.across = [[sides.get((f[(k + 1) % 3], f[k])) for k in range(3)] for f in self.faces]
        self.origin = self._developed(start)

    def _carried(self, f: int, k: int, p: Point) -> tuple[int, Point]:
        """p of f's chart in that of the neighbour across side k."""
        other = self.across[f][k]
        assert other is not None, "a cell leaves the surface"
        g, j = other
        edge = minus(self.uv[f][(k + 1) % 3], self.uv[f][k])
        back = minus(self.uv[g][j], self.uv[g][(j + 1) % 3])
        (turn,) = (t for t in range(4) if turned(edge, t) == back)
        return g, _plus(self.uv[g][(j + 1) % 3], turned(minus(p, self.uv[f][k]), turn))

    def _developed(self, start: int) -> list[Point]:
        """Of every face a lattice point of its chart."""
        first = next(i for i, f in enumerate(self.faces) if start in f)
        origin = {first: self.uv[first][self.faces[first].index(start)]}
        queue = [first]
        for f in queue:
            for k in range(3):
                if self.across[f][k] is None:
                    continue
                g, p = self._carried(f, k, origin[f])
                if g not in origin:
                    origin[g] = p
                    queue.append(g)
        return [origin[f] for f in range(len(self.faces))]

    def _side(self, f: int, k: int, p: Point) -> Fraction:
        a, b = self.uv[f][k], self.uv[f][(k + 1) % 3]
        return cross(minus(b, a), minus(p, a))

    def _centres(self, f: int) -> Iterator[Point]:
        ox, oy = self.origin[f]
        xs, ys = [p[0] - ox - HALF for p in self.uv[f]], [p[1] - oy - HALF for p in self.uv[f]]
        for i in range(ceil(min(xs)), floor(max(xs)) + 1):
            for j in range(ceil(min(ys)), floor(max(ys)) + 1):
                p = (ox + i + HALF, oy + j + HALF)
                sides = [self._side(f, k, p) for k in range(3)]
                if min(sides) < 0:
                    continue
                # On sides and vertices: the smallest of all faces that hold it.
                if all(s > 0 for s in sides) or f == min(g for g, _ in self._everywhere(f, p)):
                    yield p

    def _everywhere(self, f: int, p: Point) -> set[tuple[int, Point]]:
        """The point in the charts of all faces that hold it."""
        found, stack = {(f, p)}, [(f, p)]
        while stack:
            g, q = stack.pop()
            for k in range(3):
                if self._side(g, k, q) == 0 and self.across[g][k] is not None:
                    place = self._carried(g, k, q)
                    if place not in found:
                        found.add(place)
                        stack.append(place)
        return found

    def _reached(self, f: int, p: Point, end: Point) -> tuple[int, Point]:
        """The end of a straight way, which may begin and pass where faces meet: by faces that hold more and more of it."""
        begun = Fraction(0)
        for _ in range(10000):
            inside = self._held_until(f, p, end)
            if inside == 1:
                return f, end
            at = (p[0] + inside * (end[0] - p[0]), p[1] + inside * (end[1] - p[1]))
            best = (begun, f, p, end)
            for g, q in self._everywhere(f, at):
                move = self._motion(f, at, g, q)
                start, stop = move(p), move(end)
                if self._holds(g, q):
                    until = self._held_until(g, start, stop)
                    best = max(best, (until, g, start, stop), key=lambda b: b[0])
            assert best[0] > inside, "the way is blocked"
            begun, f, p, end = best
        raise AssertionError("the way does not end")

    def _holds(self, f: int, p: Point) -> bool:
        return all(self._side(f, k, p) >= 0 for k in range(3))

    def _motion(self, f: int, at: Point, g: int, q: Point) -> Any:
        """From f's chart to g's, where `at` and `q` are the same point: round it, face by face."""
        stack: list[tuple[int, Point, int]] = [(f, at, 0)]
        seen = {(f, at)}
        while stack:
            h, r, turn = stack.pop()
            if (h, r) == (g, q):
                return lambda p: _plus(q, turned(minus(p, at), turn))
            for k in range(3):
                other = self.across[h][k]
                if self._side(h, k, r) != 0 or other is None:
                    continue
                place = self._carried(h, k, r)
                if place in seen:
                    continue
                seen.add(place)
                shifted = self._carried(h, k, _plus(r, (Fraction(1), Fraction(0))))[1]
                step = minus(shifted, place[1])
                more = next(t for t in range(4) if turned((Fraction(1), Fraction(0)), t) == step)
                stack.append((*place, turn + more))
        raise AssertionError

    def _held_until(self, f: int, p: Point, end: Point) -> Fraction:
        """The largest share of the way from p that the face holds; -1 if none."""
        low, high = Fraction(-1000), Fraction(1)
        for k in range(3):
            a, b = self._side(f, k, p), self._side(f, k, end)
            if a == b:
                if a < 0:
                    return Fraction(-1)
            elif b < a:
                high = min(high, a / (a - b))
            else:
                low = max(low, a / (a - b))
        return high if low <= high else Fraction(-1)

    def quads(self) -> list[tuple[Any, ...]]:
        """Quads of names of corners: the first of all places of each."""
        corners = [(-HALF, -HALF), (HALF, -HALF), (HALF, HALF), (-HALF, HALF)]
        result = []
        for f in range(len(self.faces)):
            for p in self._centres(f):
                ends = [self._reached(f, p, _plus(p, c)) for c in corners]
                result.append(tuple(min(self._everywhere(*end)) for end in ends))
        return result


def fingerprint(quads: Any, rounds: int = 12) -> Counter[int]:
    """Alike for meshes that hang together alike: colours of corners, refined by those around (Weisfeiler and Leman)."""
    around: dict[Any, list[Any]] = {}
    for quad in quads:
        for k in range(4):
            around.setdefault(quad[k], []).append(
                (quad[(k + 1) % 4], quad[(k + 2) % 4], quad[k - 1])
            )
    colour = {v: len(fans) for v, fans in around.items()}
    for _ in range(rounds):
        colour = {
            v: hash(
                (colour[v], tuple(sorted((colour[a], colour[b], colour[c]) for a, b, c in fans)))
            )
            for v, fans in around.items()
        }
    return Counter(colour.values())
