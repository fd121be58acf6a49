"""Cones and turning numbers of a cross field, added up in 80-bit numbers from vectors in space alone.

Nothing is counted here: every number is an angle, and how far it is from a whole number of quarter turns is part of the answer.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from .holonomy import QUARTER, Ints, Wide, loop_angle, opposite_halfedges

Floats = npt.NDArray[np.floating]


def corner_angles(vertices: Floats, faces: Ints) -> Wide:
    """(m, 3) of the triangles in space."""
    p = np.asarray(vertices, np.longdouble)[faces]
    a, b = np.roll(p, -1, 1) - p, np.roll(p, -2, 1) - p
    return np.arctan2(np.sqrt((np.cross(a, b) ** 2).sum(-1)), (a * b).sum(-1))


def angles_from_edges(vertices: Floats, faces: Ints, directions: Floats) -> Wide:
    """(m, 3) angle from half-edge k of each face to its direction, counter-clockwise as seen from outside."""
    p = np.asarray(vertices, np.longdouble)[faces]
    edge = np.roll(p, -1, 1) - p
    normal = np.cross(edge[:, 0], edge[:, 1])
    normal /= np.sqrt((normal**2).sum(-1, keepdims=True))
    d = np.asarray(directions, np.longdouble)[:, None]
    return np.arctan2((np.cross(edge, d) * normal[:, None]).sum(-1), (edge * d).sum(-1))


def nearest_rotation(vertices: Floats, faces: Ints, directions: Floats) -> Wide:
    """(3 m,) how far the field turns across each half-edge into its face if every direction goes with the nearest one."""
    d = angles_from_edges(vertices, faces, directions).ravel()
    opposite = opposite_halfedges(faces)
    turned = d - d[opposite]
    turned -= QUARTER * np.rint(turned / QUARTER)
    return np.where(opposite < 0, np.longdouble(0), turned)


def around_vertex(faces: Ints, vertex: int) -> list[int]:
    """The half-edges that point to an inner vertex, each with its face on the left, counter-clockwise."""
    opposite = opposite_halfedges(faces)
    first = int(np.flatnonzero(np.roll(faces, -1, 1).ravel() == vertex)[0])
    loop = [first]
    while True:
        entered = int(opposite[loop[-1]])
        into = entered + 2 if entered % 3 == 0 else entered - 1
        if into == first:
            return loop
        loop.append(into)


@dataclass(frozen=True)
class FieldTurning:
    cones: npt.NDArray[np.int64]  # quarter turns of every vertex
    turns: list[int]  # of the loops
    error: float  # the largest distance from whole quarters, radians


def judge(
    vertices: Floats, faces: Ints, rotation: npt.ArrayLike, loops: list[list[int]]
) -> FieldTurning:
    """Of a closed mesh with a rotation form (3 m,) and loops of half-edges 3 f + k."""
    turned = np.asarray(rotation, np.longdouble).ravel()
    corner = corner_angles(vertices, faces)
    total = np.zeros(int(faces.max()) + 1, np.longdouble)
    np.add.at(total, faces, corner)
    np.add.at(total, np.roll(faces, -1, 1).ravel(), turned)
    opposite = opposite_halfedges(faces)
    around = [loop_angle(opposite, corner, loop) + turned[loop].sum() for loop in loops]
    quarters = np.concatenate([total, np.asarray(around, np.longdouble)]) / QUARTER
    whole = np.rint(quarters)
    error = float(np.abs(quarters - whole).max() * QUARTER)
    count = len(total)
    return FieldTurning(whole[:count].astype(int), [int(t) for t in whole[count:]], error)


def projected(faces: Ints, refined: Ints, parent_face: Ints, loop: list[int]) -> list[int]:
    """A loop on the faces of a refinement as a strip of the mesh's own faces, without turning back.

    Two faces of the mesh share one edge at most.
    """
    own, fine = opposite_halfedges(faces), opposite_halfedges(refined)
    strip: list[int] = []
    for h in loop:
        here, there = int(parent_face[h // 3]), int(parent_face[fine[h] // 3])
        if here == there:
            continue
        across = next(s for s in range(3 * here, 3 * here + 3) if own[s] // 3 == there)
        if strip and own[strip[-1]] == across:
            strip.pop()
        else:
            strip.append(across)
    while len(strip) > 1 and own[strip[-1]] == strip[0]:
        strip = strip[1:-1]
    return strip
