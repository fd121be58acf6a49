"""The charts of a map, derived from its corner UVs alone: which corners are one point, which faces hang together."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from .disjoint_sets import DisjointSets

Ints = npt.NDArray[np.integer]


@dataclass(frozen=True)
class Charts:
    count: int
    face: Ints  # (m,) the chart of each face, numbered by first face
    corner: (
        Ints  # (m, 3) a point for each corner; one number per fan of joined faces around a vertex
    )
    boundary: Ints  # (b,) corners 3 f + k whose edge, to the next corner of the face, is joined to nothing


def charts_of(faces: npt.ArrayLike, uv: npt.ArrayLike) -> Charts:
    """Faces (m, 3) and corner UVs (m, 3, 2): two faces are joined across an edge if both of its ends have equal UVs on both
    sides. An edge with more than two faces is joined to nothing."""
    corners = np.asarray(faces).reshape(-1)
    points = np.asarray(uv).reshape(-1, 2)
    here = np.arange(len(corners))
    after = 3 * (here // 3) + (here + 1) % 3
    low = np.minimum(corners, corners[after])
    high = np.maximum(corners, corners[after])
    order = np.lexsort((high, low))
    first = np.flatnonzero(
        np.r_[True, (np.diff(low[order]) != 0) | (np.diff(high[order]) != 0)][: len(order)]
    )
    size = np.diff(np.r_[first, len(order)])
    h, o = order[first[size == 2]], order[first[size == 2] + 1]
    opposed = (corners[h] == corners[after[o]]) & (corners[after[h]] == corners[o])
    equal = (points[h] == points[after[o]]).all(1) & (points[after[h]] == points[o]).all(1)
    h, o = h[opposed & equal], o[opposed & equal]

    corner = _classes(len(corners), np.r_[h, after[h]], np.r_[after[o], o]).reshape(-1, 3)
    face = _classes(len(corners) // 3, h // 3, o // 3)
    boundary = np.setdiff1d(here, np.r_[h, o])
    return Charts(int(face.max(initial=-1)) + 1, face, corner, boundary)


def _classes(count: int, a: Ints, b: Ints) -> Ints:
    """Classes of 0 ... count - 1 where a[i] and b[i] are the same, numbered by their least element."""
    sets = DisjointSets(count)
    for i, j in zip(a.tolist(), b.tolist(), strict=True):
        sets.join(i, j)
    roots = np.array([sets.find(i) for i in range(count)], np.int64)
    return np.unique(roots, return_inverse=True)[1].reshape(-1)
