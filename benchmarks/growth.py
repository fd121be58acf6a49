"""How the cost of every public call grows on shapes that are anything but round.

    growth.py calls [--faces 2000] [--only TEXT] [--seconds 120]

Long ribbons, flat spirals, combs, fans around one vertex, thousands of parts, and a bumpy sheet for comparison: CPU
seconds at n, 2n and 4n faces, and the exponent between the first and the last (1: linear). Exit status 1 if one is above 1.2. A
call that ends in an error is timed as well; its code stands beside. Costs below 0.05 s at 4n are those of the call itself: no
exponent. A row whose call came close to --seconds is not measured further.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from typing import Any

import numpy as np
import numpy.typing as npt
from runner import Options, Row, main, table, timed

import flipfree as ff

from surfaces import Mesh, bumpy_grid, torus

#: The most that is wanted of any call.
WANTED = 1.2
#: CPU seconds at 4n below which nothing is said of growth.
TOO_SHORT = 0.05

#: Vertices, faces, and their plan (n, 2), which lies flat without overlap.
Shape = tuple[npt.NDArray[np.float64], npt.NDArray[np.int32], npt.NDArray[np.float64]]


def lattice(columns: int, rows: int) -> npt.NDArray[np.int32]:
    return bumpy_grid(columns, rows)[1]


def plane(points: Any, faces: npt.NDArray[np.int32]) -> Shape:
    points = np.asarray(points, np.float64)
    return np.column_stack([points, np.zeros(len(points))]), faces, points


def ribbon(faces: int) -> Shape:
    """One quad wide, around a cylinder, 160 faces a turn."""
    count = faces // 2
    t = np.arange(count + 1) / 80
    step = 2 * np.sin(np.pi / 80)
    angle = 2 * np.pi * t
    low = np.stack([np.cos(angle), np.sin(angle), 0.3 * t], -1)
    plan = np.column_stack([step * np.arange(count + 1), np.zeros(count + 1)])
    return (
        np.vstack([low, low + [0, 0, 0.2]]),
        lattice(count, 1),
        np.vstack([plan, plan + [0, 0.2]]),
    )


def spiral(faces: int) -> Shape:
    """One quad wide, in the plane, 160 faces a turn."""
    t = np.arange(faces // 2 + 1) / 80
    angle, radius = 2 * np.pi * t, 1 + t
    way = np.stack([np.cos(angle), np.sin(angle)], -1)
    return plane(
        np.vstack([way * (radius + 0.5)[:, None], way * radius[:, None]]), lattice(faces // 2, 1)
    )


def comb(faces: int) -> Shape:
    """A back of two triangles per tooth and gap, teeth of 20 cells."""
    columns = faces // 22
    index = lattice(columns, 1)
    points = [(x, y) for y in (-1.0, 0.0) for x in range(columns + 1)]
    every = [index]
    for c in range(0, columns, 2):
        a, b = columns + 1 + c, columns + 2 + c
        for y in range(1, 21):
            d, e = len(points), len(points) + 1
            points += [(c, y), (c + 1, y)]
            every.append(np.array([(a, b, e), (a, e, d)], np.int32))
            a, b = d, e
    return plane(points, np.vstack(every))


def fan(faces: int) -> Shape:
    """All around one vertex, not quite flat."""
    angle = 2 * np.pi * np.arange(faces) / faces
    plan = np.vstack([np.stack([np.cos(angle), np.sin(angle)], -1), [[0.0, 0.0]]])
    a = np.arange(faces)
    height = np.append(0.1 * np.sin(5 * angle), 0.0)
    return (
        np.column_stack([plan, height]),
        np.stack([a, np.roll(a, -1), np.full(faces, faces)], -1).astype(np.int32),
        plan,
    )


def parts(faces: int) -> Shape:
    """Four triangles each, beside each other, all of different size."""
    count = faces // 4
    side = math.isqrt(count - 1) + 1
    random = np.random.default_rng(1)
    cell = np.array([(0, 0), (1, 0), (1, 1), (0, 1), (0.5, 0.4)]) * 0.8
    place = np.stack([np.arange(count) % side, np.arange(count) // side], -1)
    points = (place[:, None] + cell * random.uniform(0.5, 1.0, (count, 1, 2))).reshape(-1, 2)
    one = np.array([(0, 1, 4), (1, 2, 4), (2, 3, 4), (3, 0, 4)])
    return plane(
        points, (one + 5 * np.arange(count)[:, None, None]).reshape(-1, 3).astype(np.int32)
    )


def sheet(faces: int) -> Shape:
    side = math.isqrt(faces // 2)
    vertices, triangles = bumpy_grid(side, side)
    return vertices, triangles, vertices[:, :2].copy()


def rod(faces: int) -> Mesh:
    """Closed, genus 1, long and thin."""
    return torus(faces // 8, 4, 0.05)


SHAPES: dict[str, Callable[[int], Shape]] = {
    "ribbon": ribbon,
    "spiral": spiral,
    "comb": comb,
    "fan": fan,
    "parts": parts,
    "sheet": sheet,
}


def corners(shape: Shape) -> npt.NDArray[np.float64]:
    return np.asarray(shape[2][shape[1]], np.float64)


def sheared(shape: Shape) -> npt.NDArray[np.float64]:
    return corners(shape) @ np.array([[1.0, 0.0], [0.4, 1.0]])


def folded(shape: Shape) -> npt.NDArray[np.float64]:
    """The plan, with every 50th triangle turned over."""
    uv = corners(shape)
    uv[::50] = uv[::50, ::-1].copy()
    return uv


def few(shape: Shape) -> dict[int, tuple[float, float]]:
    """Three pins, moved by little."""
    vertices = [0, len(shape[0]) // 3, 2 * len(shape[0]) // 3]
    return {v: (shape[2][v, 0] * 1.01 + 0.1, shape[2][v, 1] * 1.02) for v in vertices}


CALLS: dict[str, Callable[..., Any]] = {
    "unwrap": lambda s, **o: ff.unwrap(s[0], s[1], **o),
    "unwrap given": lambda s, **o: ff.unwrap(s[0], s[1], seams="given", **o),
    "auto_seams": lambda s, **o: ff.auto_seams(s[0], s[1], **o),
    "conformal_metric": lambda s, **o: ff.conformal_metric(s[0], s[1], angles(s), **o),
    "conformal": lambda s, **o: ff.conformal(s[0], s[1], angles(s), **o),
    "angles free": lambda s, **o: ff.boundary_angles(s[0], s[1], "free", **o),
    "angles circle": lambda s, **o: ff.boundary_angles(s[0], s[1], "circle", **o),
    "suggest_cones": lambda s, **o: ff.suggest_cones(s[0], s[1], **o),
    "cross_field": lambda s, **o: ff.cross_field(s[0], s[1], **o),
    "field_aligned": lambda s, **o: ff.field_aligned(s[0], s[1], **o),
    "match": lambda s, **o: ff.match(s[0], s[1], points=few(s), **o),
    "embed": lambda s, **o: ff.embed(s[0], s[1], **o),
    "pack": lambda s, **o: ff.pack(s[0], s[1], corners(s), **o),
    "certify": lambda s, **o: ff.certify(s[0], s[1], corners(s), **o),
    "repair": lambda s, **o: ff.repair(s[0], s[1], folded(s), **o),
    "improve": lambda s, **o: ff.improve((s[0], s[1], sheared(s)), **o),
}


def angles(shape: Shape) -> npt.NDArray[np.float64]:
    """Those that the plan has: nothing is to be bent, but the fan's and the sheet's middle."""
    uv = shape[2][shape[1]]
    total = np.zeros(len(shape[0]))
    for k in range(3):
        a, b = uv[:, (k + 1) % 3] - uv[:, k], uv[:, (k + 2) % 3] - uv[:, k]
        angle = np.arctan2(a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0], (a * b).sum(-1))
        np.add.at(total, shape[1][:, k], angle)
    return total


@table("call, shape | n | 2 n | 4 n | exponent | ends")
def calls(options: Options) -> Iterator[Row]:
    cases: list[tuple[str, Callable[[int], Any], Callable[..., Any]]] = [
        (f"{name}, {shape}", make, call)
        for name, call in CALLS.items()
        for shape, make in SHAPES.items()
    ]
    for name in ("unwrap", "auto_seams", "field_aligned"):
        cases.append((f"{name}, rod", rod, CALLS[name]))
    cases.append(("seamless, rod", rod, lambda s, **o: ff.seamless(s[0], s[1], {}, **o)))
    for name, make, call in options.cases(cases, lambda case: case[0]):
        costs: list[float] = []
        ends: set[str] = set()
        for factor in (1, 2, 4):
            shape = make(factor * options.faces)
            with timed() as cost:
                try:
                    call(shape, max_seconds=options.seconds)
                except ff.FlipfreeError as error:
                    ends.add(error.code)
            costs.append(cost.cpu)
            if "time limit reached" in ends or cost.cpu > options.seconds / 4:
                break
        growth = ""
        if costs[-1] >= TOO_SHORT:
            exponent = math.log2(costs[-1] / costs[0]) / max(1, len(costs) - 1)
            growth = f"{exponent:.2f}" if len(costs) > 1 else "too long"
            if len(costs) == 1 or exponent > WANTED:
                options.fail(f"{name}: {growth}")
        cells = [f"{seconds:.3f}" for seconds in costs] + [""] * (3 - len(costs))
        yield name, *cells, growth, "; ".join(sorted(ends))


if __name__ == "__main__":
    main(__doc__, faces=(2000, ""))
