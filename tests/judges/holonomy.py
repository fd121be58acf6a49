"""How a map turns: cone angles, and the angles of dual loops, added up in 80-bit numbers from corner UVs alone."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from .disjoint_sets import DisjointSets

Ints = npt.NDArray[np.integer]
Wide = npt.NDArray[np.longdouble]
QUARTER = np.longdouble(2) * np.arctan(np.longdouble(1))


def corner_angles(uv: npt.ArrayLike) -> Wide:
    """(m, 3) the angle at each corner of the UV triangles (m, 3, 2), counter-clockwise."""
    p = np.asarray(uv, np.longdouble)
    a, b = np.roll(p, -1, 1) - p, np.roll(p, -2, 1) - p
    return np.arctan2(a[..., 0] * b[..., 1] - a[..., 1] * b[..., 0], (a * b).sum(-1))


def vertex_angles(faces: Ints, uv: npt.ArrayLike) -> Wide:
    """(n,) sum of the corner angles around every vertex."""
    total = np.zeros(faces.max() + 1, np.longdouble)
    np.add.at(total, faces, corner_angles(uv))
    return total


def opposite_halfedges(faces: Ints) -> Ints:
    """(3 m,) for half-edge 3 f + k, corner k to k + 1, the one of the neighbouring face; -1 on the boundary."""
    start, end = faces.ravel().astype(np.int64), np.roll(faces, -1, 1).ravel().astype(np.int64)
    count = int(faces.max()) + 1
    key, back = start * count + end, end * count + start
    order = np.argsort(key)
    place = np.clip(np.searchsorted(key[order], back), 0, len(key) - 1)
    return np.where(key[order][place] == back, order[place], -1)


def random_homology_basis(faces: Ints, seed: int) -> list[list[int]]:
    """Closed strips of faces, as half-edges 3 f + k by which each face is left, that generate the homology of a closed
    connected surface: a random spanning tree of the faces, one of the vertices over other edges, and what is left."""
    random = np.random.default_rng(seed)
    opposite = opposite_halfedges(faces)
    edges = np.flatnonzero(np.arange(len(opposite)) < opposite)
    random.shuffle(edges)

    def forest(count: int, ends: list[tuple[int, int]]) -> list[bool]:
        trees = DisjointSets(count)
        return [trees.join(a, b) for a, b in ends]

    in_tree = np.array(
        forest(len(faces), [(h // 3, opposite[h] // 3) for h in edges.tolist()]), bool
    )
    rest = edges[~in_tree]
    flat, following = faces.ravel(), np.roll(faces, -1, 1).ravel()
    in_cotree = np.array(
        forest(int(faces.max()) + 1, [(flat[h], following[h]) for h in rest.tolist()]), bool
    )
    neighbours: list[list[tuple[int, int]]] = [[] for _ in range(len(faces))]
    for h in edges[in_tree].tolist():
        o = int(opposite[h])
        neighbours[h // 3].append((h, o // 3))
        neighbours[o // 3].append((o, h // 3))
    entered, depth, queue = [-1] * len(faces), [0] * len(faces), [0]
    for f in queue:
        for h, g in neighbours[f]:
            if g != 0 and entered[g] < 0:
                entered[g], depth[g] = h, depth[f] + 1
                queue.append(g)
    loops = []
    for h in rest[~in_cotree].tolist():
        a, b = h // 3, int(opposite[h]) // 3
        to: list[int] = []
        back: list[int] = []
        while a != b:
            if depth[a] >= depth[b]:
                to.append(entered[a])
                a = entered[a] // 3
            else:
                back.append(int(opposite[entered[b]]))
                b = entered[b] // 3
        loops.append([*reversed(to), h, *back])
    return loops


def loop_angle(opposite: Ints, angles: Wide, loop: list[int]) -> np.longdouble:
    """By how much a closed strip turns to the left: corners on its left hand count, those on its right count negative."""
    total = np.longdouble(0)
    flat = angles.ravel()
    for h, after in zip(loop, [*loop[1:], loop[0]], strict=True):
        entered = int(opposite[h])
        following = entered - 2 if entered % 3 == 2 else entered + 1
        if after == following:
            total -= flat[following]  # the corner where the half-edge that is left starts
        else:
            total += flat[entered]
    return total


@dataclass(frozen=True)
class Turning:
    vertex_error: float  # largest distance of a vertex' angle from the one prescribed, radians
    loop_error: float  # largest distance of a loop's angle from a whole number of quarter turns
    turns: list[int]  # the numbers of the loops


def judge(faces: Ints, uv: npt.ArrayLike, cones: dict[int, int], loops: list[list[int]]) -> Turning:
    """A closed connected surface and its map against cones {vertex: quarter turns}, all others flat."""
    wanted = np.full(int(faces.max()) + 1, 4)
    wanted[list(cones)] = list(cones.values())
    vertex_error = np.abs(vertex_angles(faces, uv) - wanted * QUARTER).max()
    opposite, angles = opposite_halfedges(faces), corner_angles(uv)
    quarters = [loop_angle(opposite, angles, loop) / QUARTER for loop in loops]
    turns = [round(float(q)) for q in quarters]
    error = max(
        (float(abs(q - t) * QUARTER) for q, t in zip(quarters, turns, strict=True)), default=0.0
    )
    return Turning(float(vertex_error), error, turns)
