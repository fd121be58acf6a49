"""How the cost of every public call grows on shapes that are anything but round.

    growth.py calls [--faces 2000] [--only TEXT] [--seconds 120]

Long ribbons, flat spirals, combs, fans around one vertex, thousands of parts, thin rods, and a bumpy sheet for comparison: CPU
seconds at n, 2n and 4n faces, and the exponent between the first and the last (1: linear). Calls are those of deadlines.py, with conformal
angles near those of the surface. Exit status 1 if one is above 1.2. A call that ends in an error is timed as well; its code stands beside.
Costs below 0.05 s at 4n are those of the call itself: no exponent. A row whose call came close to --seconds is not measured further.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from typing import Any

import numpy as np
import numpy.typing as npt
from deadlines import Call, Maps, public_calls
from runner import Options, Row, main, table, timed

import flipfree as ff

from surfaces import Mesh, bumpy_grid, torus

#: The most that is wanted of any call.
WANTED = 1.2
#: CPU seconds at 4n below which nothing is said of growth.
TOO_SHORT = 0.05


def plane(points: Any, faces: npt.NDArray[np.int32]) -> Mesh:
    return np.pad(np.asarray(points, np.float64), ((0, 0), (0, 1))), faces


def ribbon(faces: int) -> Mesh:
    """One quad wide, around a cylinder, 160 faces a turn."""
    count = faces // 2
    t = np.arange(count + 1) / 80
    angle = 2 * np.pi * t
    low = np.stack([np.cos(angle), np.sin(angle), 0.3 * t], -1)
    return np.vstack([low, low + [0, 0, 0.2]]), bumpy_grid(count, 1)[1]


def spiral(faces: int) -> Mesh:
    """One quad wide, in the plane, 160 faces a turn."""
    t = np.arange(faces // 2 + 1) / 80
    angle, radius = 2 * np.pi * t, 1 + t
    way = np.stack([np.cos(angle), np.sin(angle)], -1)
    return plane(
        np.vstack([way * (radius + 0.5)[:, None], way * radius[:, None]]),
        bumpy_grid(faces // 2, 1)[1],
    )


def comb(faces: int) -> Mesh:
    """A back of two triangles per tooth and gap, teeth of 20 cells."""
    columns = faces // 22
    index = bumpy_grid(columns, 1)[1]
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


def fan(faces: int) -> Mesh:
    """All around one vertex, not quite flat."""
    angle = 2 * np.pi * np.arange(faces) / faces
    rim = np.stack([np.cos(angle), np.sin(angle), 0.1 * np.sin(5 * angle)], -1)
    a = np.arange(faces)
    around = np.stack([a, np.roll(a, -1), np.full(faces, faces)], -1)
    return np.vstack([rim, np.zeros((1, 3))]), around.astype(np.int32)


def parts(faces: int) -> Mesh:
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


SHAPES: dict[str, Callable[[int], Mesh]] = {
    "ribbon": ribbon,
    "spiral": spiral,
    "comb": comb,
    "fan": fan,
    "parts": parts,
    "rod": lambda faces: torus(faces // 8, 4, 0.05),  # closed, genus 1, long and thin
    "sheet": lambda faces: bumpy_grid(math.isqrt(faces // 2), math.isqrt(faces // 2)),
}


def flattened(name: str) -> Call:
    """To the boundary that is nearest to an isometry: nothing is to be bent that need not be."""
    return lambda c, limit: getattr(ff, name)(
        *c[1:], ff.boundary_angles(*c[1:], "free", max_seconds=limit), max_seconds=limit
    )


@table("call, shape | n | 2 n | 4 n | exponent | ends")
def calls(options: Options) -> Iterator[Row]:
    maps, sizes = Maps(), (1, 2, 4)
    meshes = {
        shape: [(f"{shape} {size}", *make(size * options.faces)) for size in sizes]
        for shape, make in SHAPES.items()
    }
    chosen = {n: c for n, c in public_calls(maps).items() if "4096" not in n}
    chosen |= {n: (flattened(n), lambda _: True) for n in ("conformal", "conformal_metric")}
    cases = [
        (f"{name}, {shape}", call, found)
        for name, (call, takes) in chosen.items()
        for shape, found in meshes.items()
        if all(map(takes, found))
    ]
    for name, call, found in options.cases(cases, lambda case: case[0]):
        costs: list[float] = []
        ends: set[str] = set()
        for case in found:
            with timed() as cost:
                try:
                    call(case, options.seconds)
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
