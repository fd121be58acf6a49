"""Surfaces of cubes, unfolded along random trees of their squares, turned, scaled and bent: maps that are seamless up
to rounding, of any genus."""

from __future__ import annotations

import random
from collections import defaultdict
from dataclasses import dataclass
from itertools import product

import numpy as np
import numpy.typing as npt

from surfaces import Cell, of_cubes, plate

SHAPES: dict[str, list[Cell]] = {
    "cube": [(0, 0, 0)],
    "bar": [(0, 0, 0), (1, 0, 0), (1, 1, 0), (1, 1, 1)],
    "ring": plate(1),
    "two holes": plate(2),
}


@dataclass(frozen=True)
class Unfolding:
    vertices: npt.NDArray[np.float64]
    faces: npt.NDArray[np.int32]
    uv: npt.NDArray[np.float64]  # (m, 3, 2)
    cut_edges: npt.NDArray[np.int32]  # (s, 2)


def unfolding(cells: list[Cell], n: int, seed: int) -> Unfolding:
    """Every square is divided into n x n; no two cells touch in an edge or a corner only."""
    draw = random.Random(seed)
    vertices, triangles = of_cubes(cells, n)
    faces = triangles.tolist()
    squares = len(faces) // (2 * n * n)
    corners = ([(0, 0), (1, 0), (1, 1)], [(0, 0), (1, 1), (0, 1)])
    local = [
        [complex(x + dx, y + dy) for dx, dy in corner]
        for x, y, corner in product(range(n), range(n), corners)
    ] * squares
    square = [f // (2 * n * n) for f in range(len(faces))]
    side = {(t[k], t[(k + 1) % 3]): (f, k) for f, t in enumerate(faces) for k in range(3)}
    place: dict[int, tuple[complex, complex]] = {0: (1, 0)}

    def at(f: int, k: int) -> complex:
        turn, shift = place[square[f]]
        return turn * local[f][k % 3] + shift

    joined = {frozenset((0, 0))}
    while len(place) < squares:
        front = [
            (e, g)
            for e, (f, _) in side.items()
            for g in [side[e[1], e[0]][0]]
            if square[f] in place and square[g] not in place
        ]
        edge, g = draw.choice(front)
        f, k = side[edge]
        m = side[edge[1], edge[0]][1]
        wanted = at(f, k + 1) - at(f, k)
        given = local[g][m] - local[g][(m + 1) % 3]
        turn = wanted / given
        place[square[g]] = (turn, at(f, k) - turn * local[g][(m + 1) % 3])
        joined.add(frozenset((square[f], square[g])))
    uv = np.array([[at(f, k) for k in range(3)] for f in range(len(faces))])
    cut: list[tuple[int, int]] = []
    turns: dict[tuple[int, int], complex] = {}
    for (v, w), (f, k) in side.items():
        g, m = side[w, v]
        matched = uv[f, k] == uv[g, (m + 1) % 3] and uv[f, (k + 1) % 3] == uv[g, m]
        whole = square[f] == square[g] or (frozenset((square[f], square[g])) in joined and matched)
        turns[v, w] = (uv[g, m] - uv[g, (m + 1) % 3]) / (uv[f, (k + 1) % 3] - uv[f, k])
        if v < w and not whole:
            cut.append((v, w))
    bend(uv, faces, side, turns, draw)
    # Any similarity keeps a map seamless; nothing about it is exact any more.
    uv *= 10 ** draw.uniform(-6, 6) * np.exp(1j * draw.uniform(0, 2 * np.pi))
    uv += complex(draw.uniform(-9, 9), draw.uniform(-9, 9)) * np.abs(uv).max()
    return Unfolding(
        vertices,
        triangles,
        np.stack([uv.real, uv.imag], axis=2),
        np.array(cut, dtype=np.int32).reshape(-1, 2),
    )


def bend(
    uv: npt.NDArray[np.complex128],
    faces: list[list[int]],
    side: dict,
    turns: dict,
    draw: random.Random,
) -> None:  # type: ignore[type-arg]
    """Moves vertices that are no cones, all their copies alike, as far as no triangle folds (heights are 0.7)."""
    around: dict[int, list[tuple[int, int]]] = defaultdict(list)
    for f, t in enumerate(faces):
        for k in range(3):
            around[t[k]].append((f, k))
    for v, corners in around.items():
        move = complex(draw.uniform(-0.1, 0.1), draw.uniform(-0.1, 0.1))
        moves = {}
        f, k = start = corners[0]
        turn: complex = 1
        while True:
            moves[f, k] = turn * move
            w = faces[f][(k + 2) % 3]
            turn *= turns[w, v]
            f, k = side[v, w]
            if (f, k) == start:
                break
        if turn != 1:
            continue
        for (f, k), by in moves.items():
            uv[f, k] += by
