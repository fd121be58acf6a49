"""A map of a file's triangles on the polygons that these are parts of."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import numpy as np
import numpy.typing as npt

from ..results import FloatArray, IntArray

Float32Array = npt.NDArray[np.float32]


@dataclass(frozen=True, eq=False)
class NewMap:
    """Attributes:
    triangles, polygons: (m, 3), (m,) of the file, as it was read.
    faces, uv: (k, 3), (k, 3, 2) of the map, NaN where there is none. Vertices from the file's number on are new.
    parent: (k,) triangle of the file that each face is part of.
    vertices: (a, 3) the new ones. origins, weights: (a, 3) vertices of the file around each, and how much of them it has.
    """

    triangles: IntArray
    polygons: IntArray
    faces: IntArray
    uv: Float32Array
    parent: IntArray
    vertices: FloatArray
    origins: IntArray
    weights: FloatArray

    def interpolated(self, values: npt.NDArray[Any]) -> FloatArray:
        """What each new vertex has of values (n, d) of the file's vertices."""
        found: FloatArray = np.einsum("ak,akd->ad", self.weights, values[self.origins])
        return found


@dataclass(frozen=True, eq=False)
class OnPolygons:
    """What is written instead of the file's polygons.

    Attributes:
        vertices, uv: (c,), (c, 2) of corners, one face after the other; NaN where there is no map. Those of the file's polygons
            come first, then triangles of the map that take the place of one that was refined or is torn by the map.
        faces: of each polygon the corners, from and to, of the faces that it becomes.
        count: how many faces there are then.
    """

    vertices: IntArray
    uv: Float32Array
    faces: list[list[tuple[int, int]]]

    @property
    def count(self) -> int:
        return sum(map(len, self.faces))


def on_polygons(corners: IntArray, begin: IntArray, new: NewMap) -> OnPolygons:
    """corners, begin: vertices of the file's polygons one after the other, and where each polygon begins, (p + 1,)."""
    is_whole = np.ones(len(begin) - 1, bool)
    uv, unchanged = _on_triangles(new)
    is_whole[new.polygons[~unchanged]] = False
    corner_uv = np.full((len(corners), 2), np.nan, np.float32)
    corner, single = _corners_of_triangles(corners, begin, new)
    corner_uv[corner[single]] = uv[single]
    torn = single & (_bits(corner_uv[corner]) != _bits(uv)).any(axis=2)
    is_whole[new.polygons[torn.any(axis=1)]] = False
    for polygon in np.unique(new.polygons[~single.all(axis=1)]).tolist():
        own = slice(begin[polygon], begin[polygon + 1])
        triangles = np.flatnonzero(new.polygons == polygon)
        found = _along_sides(corners[own].tolist(), triangles, new, uv)
        if found is None:
            is_whole[polygon] = False
        else:
            corner_uv[own] = found
    corner_uv[np.repeat(~is_whole, np.diff(begin))] = np.nan
    faces = [[(a, b)] for a, b in pairwise(begin.tolist())]
    of_face = new.polygons[new.parent]
    sides = new.faces != np.roll(new.faces, 1, axis=1)
    rows = np.flatnonzero(~is_whole[of_face] & sides.all(axis=1))
    rows = rows[np.argsort(of_face[rows], kind="stable")]
    for polygon in of_face[rows].tolist():
        faces[polygon] = []
    for at, polygon in enumerate(of_face[rows].tolist()):
        first = len(corners) + 3 * at
        faces[polygon].append((first, first + 3))
    return OnPolygons(
        np.concatenate([corners, new.faces[rows].ravel()]),
        np.concatenate([corner_uv, new.uv[rows].reshape(-1, 2)]),
        faces,
    )


def _on_triangles(new: NewMap) -> tuple[Float32Array, npt.NDArray[np.bool_]]:
    """(m, 3, 2) UVs of the file's triangles, and which of them the map has as they are."""
    count = len(new.triangles)
    row = np.zeros(count, np.int64)
    row[new.parent] = np.arange(len(new.parent))
    faces = new.faces[row]
    there = faces[:, None, :] == new.triangles[:, :, None]
    place = there.argmax(axis=2)
    place[(faces == new.triangles).all(axis=1)] = np.arange(3)
    unchanged = (np.bincount(new.parent, minlength=count) == 1) & there.any(axis=2).all(axis=1)
    return new.uv[row[:, None], place], unchanged


def _corners_of_triangles(
    corners: IntArray, begin: IntArray, new: NewMap
) -> tuple[npt.NDArray[np.int64], npt.NDArray[np.bool_]]:
    """(m, 3) corner of the polygons that each triangle's corner is, and where that is known by its vertex alone: not where
    a polygon has a vertex at several corners."""
    of_corner = np.repeat(np.arange(len(begin) - 1, dtype=np.int64), np.diff(begin))
    keys = of_corner << 32 | corners
    order = np.argsort(keys, kind="stable")
    ordered = keys[order]
    again = np.zeros(len(begin) - 1, bool)
    again[of_corner[order[1:][ordered[1:] == ordered[:-1]]]] = True
    wanted = new.polygons.astype(np.int64)[:, None] << 32 | new.triangles
    at = np.minimum(np.searchsorted(ordered, wanted), len(ordered) - 1)
    single = (ordered[at] == wanted) & ~again[new.polygons][:, None]
    return order[at], single


def _along_sides(
    corners: list[int], triangles: npt.NDArray[np.int64], new: NewMap, uv: Float32Array
) -> Float32Array | None:
    """UVs of the corners of a polygon that has a vertex at several of them: each side of it is one of one triangle. None if
    its triangles differ where they meet."""
    at_side: dict[tuple[int, int], Float32Array] = {}
    for t in triangles.tolist():
        a, b, c = new.triangles[t].tolist()
        for k, side in enumerate(((a, b), (b, c), (c, a))):
            at_side.setdefault(side, uv[t, k])
    found = [at_side.get(side) for side in zip(corners, corners[1:] + corners[:1], strict=True)]
    known = [value for value in found if value is not None]
    if len(known) < len(corners):
        return None
    at_corners = {(v, value.tobytes()) for v, value in zip(corners, known, strict=True)}
    agree = all(
        (int(new.triangles[t, k]), uv[t, k].tobytes()) in at_corners
        for t in triangles.tolist()
        for k in range(3)
    )
    return np.stack(known) if agree else None


def _bits(values: Float32Array) -> npt.NDArray[np.uint32]:
    return np.ascontiguousarray(values).view(np.uint32)
