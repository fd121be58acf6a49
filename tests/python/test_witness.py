"""Infeasible is a proof: every raise carries a witness, checked here by other code than that which found it."""

from __future__ import annotations

from collections.abc import Callable
from fractions import Fraction
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import flipfree as ff

from surfaces import bumpy_grid, octahedron_sphere, torus

NATIVE = Path(__file__).resolve().parent.parent.parent / "native" / "flipfree"

Point = tuple[Fraction, Fraction]


def points(numbers: Any) -> list[Point]:
    values = [Fraction(x) for x in numbers]
    return list(zip(values[::2], values[1::2], strict=True))


def side(a: Point, b: Point, c: Point) -> Fraction:
    return (b[0] - a[0]) * (c[1] - a[1]) - (c[0] - a[0]) * (b[1] - a[1])


def on_segment(a: Point, b: Point, p: Point) -> bool:
    inside = all(min(a[i], b[i]) <= p[i] <= max(a[i], b[i]) for i in range(2))
    return side(a, b, p) == 0 and inside


def segments_meet(a: Point, b: Point, c: Point, d: Point) -> bool:
    touching = (
        on_segment(a, b, c) or on_segment(a, b, d) or on_segment(c, d, a) or on_segment(c, d, b)
    )
    return touching or (side(a, b, c) * side(a, b, d) < 0 and side(c, d, a) * side(c, d, b) < 0)


def winding_number(polygon: list[Point], p: Point) -> int:
    """Crossings of the ray to the right of p, with their signs. Precondition: p is not on the polygon."""
    turns = 0
    for a, b in zip(polygon, polygon[1:] + polygon[:1], strict=True):
        if (a[1] <= p[1]) != (b[1] <= p[1]) and (side(a, b, p) > 0) == (b[1] > a[1]):
            turns += 1 if b[1] > a[1] else -1
    return turns


def turning_number(polygon: list[Point]) -> int:
    """Sum of the outer angles over 2 pi."""
    corners = np.array(polygon, float)
    steps = (np.roll(corners, -1, axis=0) - corners) @ [1, 1j]
    return round(float(np.angle(np.roll(steps, -1) / steps).sum() / (2 * np.pi)))


def is_immersed(polygon: list[Point]) -> bool:
    """Can positive triangles fill it? By trying all triangles (Shor and Van Wyk 1992), without any of their shortcuts;
    inner angles of corners may exceed 2 pi. Precondition: no two corners at one place."""
    n = len(polygon)

    @cache
    def fills(i: int, length: int) -> bool:
        """The part from corner i along `length` edges, closed by a diagonal."""
        if length < 2:
            return True
        j = (i + length) % n
        for middle in range(1, length):
            k = (i + middle) % n
            if side(polygon[i], polygon[k], polygon[j]) <= 0:
                continue
            if fills(i, middle) and fills(k, length - middle):
                return True
        return False

    return any(fills(i, n - 1) for i in range(n))


def grid_points(polygon: list[Point], kind: type[np.floating[Any]]) -> int:
    """How many pairs of floats lie strictly inside, one by one."""

    def between(low: Fraction, high: Fraction) -> list[Fraction]:
        value, found = kind(float(low)), []
        while Fraction(float(value)) <= high:
            found.append(Fraction(float(value)))
            value = np.nextafter(value, kind(np.inf))
        return found

    rows = between(min(p[1] for p in polygon), max(p[1] for p in polygon))
    assert len(rows) < 100, "a polygon whose rows can be counted"
    edges = list(zip(polygon, polygon[1:] + polygon[:1], strict=True))
    count = 0
    for y in rows:
        # Where the row is inside every edge, bounds on x: only whether there is room is asked here.
        low, high = min(p[0] for p in polygon), max(p[0] for p in polygon)
        inside = True
        for a, b in edges:
            slope, offset = b[1] - a[1], (b[0] - a[0]) * (y - a[1]) + (b[1] - a[1]) * a[0]
            if slope > 0:
                high = min(high, offset / slope)
            elif slope < 0:
                low = max(low, offset / slope)
            else:
                inside = inside and (b[0] - a[0]) * (y - a[1]) > 0
        count += inside and low < high
    return count


def check_witness(error: ff.Infeasible) -> str:
    """Raises AssertionError unless the witness proves what the error says; returns its rule."""
    witness = error.witness
    rule = witness["rule"]
    if rule in ("angle sum", "curvature sum"):
        missing = witness["missing"][0] if "missing" in witness else None
        if missing is None:
            missing = witness["needed"][0] - witness["sum"][0]
        assert abs(missing) > 1e-12
    elif rule == "empty stratum":
        # What is known not to exist whatever the loops do: Bainbridge et al. 2019, genus 1.
        assert (witness["genus"], sorted(witness["cones"])) == ([1], [3, 5])
    elif rule == "corner turning":
        assert witness["turning"][0] / witness["corners"][0] >= np.pi
    elif rule == "same place":
        assert len(set(error.elements)) == 2
    elif rule == "two places":
        assert len(set(points(witness["places"]))) == 2
    elif rule == "pinned and movable":
        assert len(error.elements) == 1
    elif rule == "turning number":
        assert turning_number(points(witness["polygon"])) < 1
    elif rule == "closed line":
        turns = turning_number(points(witness["polygon"]))
        assert abs(turns) == 1 and (turns == 1) != (witness["encloses"][0] == 1.0)
    elif rule == "segments meet":
        assert segments_meet(*points(witness["segments"]))
    elif rule == "outside":
        polygon, (place,) = points(witness["polygon"]), points(witness["place"])
        edges = zip(polygon, polygon[1:] + polygon[:1], strict=True)
        assert any(on_segment(a, b, place) for a, b in edges) or winding_number(polygon, place) <= 0
    elif rule == "no immersion":
        assert not is_immersed(points(witness["polygon"]))
    elif rule == "fixed triangle":
        given = points(witness["triangle"])
        stored = points(np.float64(np.float32(witness["triangle"])))
        assert side(*given) <= 0 or side(*stored) <= 0
    elif rule == "too few points":
        assert witness["points"][0] < witness["needed"][0]
        if witness["points"][0] == 0:
            kind = np.float32 if witness["bits"][0] == 32 else np.float64
            assert grid_points(points(witness["polygon"]), kind) == 0
    else:
        raise AssertionError(f"unknown rule {rule!r}")
    return rule


def disk() -> tuple[np.ndarray, np.ndarray, list[int]]:
    """A fan of eight: vertex 0 inside, its boundary 1 to 8."""
    angle = np.arange(8) * np.pi / 4
    rim = np.stack([np.cos(angle), np.sin(angle), 0 * angle], -1)
    faces = np.array([[0, 1 + i, 1 + (i + 1) % 8] for i in range(8)])
    return np.vstack([np.zeros(3), rim]), faces, list(range(1, 9))


def match(**constraints: Any) -> Any:
    vertices, faces, loop = disk()
    if "boundary_uv" in constraints:
        constraints["boundary_loop"] = loop
    else:
        constraints["bijective"] = True
    return ff.match(vertices, faces, **constraints)


ROUND = disk()[0][1:, :2]
EIGHT = [(0, 0), (2, 2), (3, 2), (3, 0), (2, 0), (0, 2), (-1, 2), (-1, 0)]
FLAT = [[-0.5, 1], [0.5, 1], [0, 1 + 2.0**-52]]


def embed_flat(polygon: Any) -> Any:
    vertices = [[0, 0, 0], [1, 0, 0], [0, 1, 0], [0.3, 0.3, 0.2]]
    faces = [[0, 1, 3], [1, 2, 3], [2, 0, 3]]
    return ff.embed(vertices, faces, boundary=polygon, boundary_loop=[0, 1, 2])


def octahedron_angles() -> Any:
    vertices, faces = octahedron_sphere(0)
    return ff.conformal_metric(vertices, faces, np.full(6, 3.0))


CASES: dict[str, Callable[[], Any]] = {
    "empty stratum": lambda: ff.seamless(*torus(8, 6), {3: 3, 20: 5}),
    "angle sum, seamless": lambda: ff.seamless(*torus(8, 6), {3: 3}),
    "angle sum": octahedron_angles,
    "curvature sum": lambda: ff.boundary_angles(*octahedron_sphere(0), cones={0: 1.0}),
    "corner turning": lambda: ff.boundary_angles(*bumpy_grid(2, 2), "straight", corners=[0, 2]),
    "same place": lambda: ff.unwrap(*bumpy_grid(2, 2), pins={0: (0.5, 0.5), 8: (0.5, 0.5)}),
    "same place, match": lambda: match(points={0: (0.0, 0.0), 3: (0.0, 0.0)}),
    "same place, boundary": lambda: match(boundary_uv=ROUND[[0, 0, 2, 3, 4, 5, 6, 7]]),
    "two places": lambda: match(points={1: (5.0, 5.0)}, boundary_uv=ROUND),
    "pinned and movable": lambda: match(
        points={1: tuple(ROUND[0])}, movable=[1], boundary_uv=ROUND
    ),
    "turning number": lambda: match(boundary_uv=ROUND[::-1]),
    "turning number, eight": lambda: match(boundary_uv=EIGHT),
    "closed line": lambda: match(lines=[([*range(1, 9), 1], np.vstack([ROUND[::-1], ROUND[-1:]]))]),
    "segments meet": lambda: match(lines=[([1, 2], [[0, 0], [1, 1]]), ([4, 5], [[0, 1], [1, 0]])]),
    "segments meet, pin": lambda: match(points={0: (0.5, 0.5)}, lines=[([1, 2], [[0, 0], [1, 1]])]),
    "outside": lambda: match(points={0: (3.0, 0.0)}, boundary_uv=ROUND),
    "too few points": lambda: embed_flat(FLAT),
    "fixed triangle": lambda: ff.embed(
        [[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2]], boundary=FLAT, boundary_loop=[0, 1, 2]
    ),
}


@pytest.mark.parametrize("name", CASES)
def test_the_witness_proves_it(name: str) -> None:
    with pytest.raises(ff.Infeasible) as caught:
        CASES[name]()
    assert check_witness(caught.value) == name.split(",")[0]


def test_random_outlines_without_an_immersion_have_none() -> None:
    random = np.random.default_rng(0)
    refused = met = 0
    for _ in range(300):
        outline = random.integers(-4, 5, (8, 2)) + random.uniform(-0.3, 0.3, (8, 2))
        try:
            match(boundary_uv=outline, optimise=False)
            met += 1
            assert is_immersed(points(outline.ravel()))
        except ff.Infeasible as error:
            refused += check_witness(error) == "no immersion"
        except ff.NotConverged:
            pass
    assert refused > 5 and met > 5


def test_random_constraints_are_refused_with_a_proof_only() -> None:
    random = np.random.default_rng(1)
    rules: set[str] = set()
    for _ in range(300):
        vertices = random.integers(0, 9 if random.random() < 0.5 else 1, 3)
        pins = {int(v): tuple(random.integers(-2, 3, 2) / 2.0) for v in vertices}
        outline = ROUND * random.choice([-1.0, 1.0, 2.0]) if random.random() < 0.5 else None
        try:
            match(
                points=pins, boundary_uv=outline, optimise=False
            ) if outline is not None else match(points=pins, optimise=False)
        except ff.Infeasible as error:
            rules.add(check_witness(error))
        except (ff.NotConverged, ff.InvalidInput):
            pass
    assert len(rules) > 2


def test_every_rule_in_the_solver_is_documented() -> None:
    documented = (NATIVE.parent.parent / "docs" / "errors.md").read_text()
    for rule in {name.split(",")[0] for name in CASES} | {"no immersion", "line leaves"}:
        assert f"| `{rule}` |" in documented
