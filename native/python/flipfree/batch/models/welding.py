"""Vertices that a file has twice because it keeps one normal or texture coordinate a vertex, found again."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

IntArray = npt.NDArray[np.int32]


def welded(vertices: npt.NDArray[np.float64], faces: IntArray) -> IntArray:
    """(n,) vertex that each vertex is taken for; see :func:`welded_along`. faces: (m, 3)."""
    if len(faces) == 0 or not (0 <= faces.min() and faces.max() < len(vertices)):
        return np.arange(len(vertices), dtype=np.int32)
    face = np.repeat(np.arange(len(faces), dtype=np.int32), 3)
    return welded_along(vertices, faces.ravel(), np.roll(faces, -1, axis=1).ravel(), face)


def welded_along(
    vertices: npt.NDArray[np.float64], start: IntArray, end: IntArray, face: IntArray
) -> IntArray:
    """(n,) vertex that each vertex is taken for, itself or a smaller number at exactly the same place.

    Two boundary edges that lie on each other with opposite directions were one; where more lie there, none does. So no edge
    gets more than two faces, and parts that touch in points or along whole sheets stay apart. No two corners of a
    face become one. Linear but for sorting.

    Args:
        vertices: (n, 3). start, end: (s,) vertices of every side of every face, in the face's direction. face: (s,).
    """
    same = np.arange(len(vertices), dtype=np.int32)
    _, place = np.unique(vertices + 0.0, axis=0, return_inverse=True)  # + 0.0: -0.0 is 0.0
    place = place.reshape(-1)
    sides = _keys(start, end)
    _, edge, faces_there = np.unique(sides, return_inverse=True, return_counts=True)
    rim = np.flatnonzero(faces_there[edge.reshape(-1)] == 1)
    places = _keys(place[start[rim]], place[end[rim]])
    order = rim[np.argsort(places, kind="stable")]
    _, first, sizes = np.unique(np.sort(places), return_index=True, return_counts=True)
    a, b = order[first[sizes == 2]], order[first[sizes == 2] + 1]
    opposite = (place[start[a]] == place[end[b]]) & (place[start[a]] != place[end[a]])
    a, b = a[opposite], b[opposite]
    label = _joined(same, np.r_[start[a], end[a]], np.r_[end[b], start[b]])
    return _without_pinched(label, start, face)


def _keys(a: npt.NDArray[np.integer], b: npt.NDArray[np.integer]) -> npt.NDArray[np.int64]:
    keys: npt.NDArray[np.int64] = np.minimum(a, b).astype(np.int64) << 32 | np.maximum(a, b)
    return keys


def _without_pinched(label: IntArray, corner: IntArray, face: IntArray) -> IntArray:
    """The same without classes to which two corners of one face belong."""
    rows = np.stack([face, label[corner], corner], axis=1)
    rows = np.unique(rows, axis=0)  # a face's vertices, each once
    twice = (rows[1:, 0] == rows[:-1, 0]) & (rows[1:, 1] == rows[:-1, 1])
    pinched = np.zeros(len(label), bool)
    pinched[rows[1:][twice, 1]] = True
    apart = pinched[label]
    found = label.copy()
    found[apart] = np.flatnonzero(apart)
    return found


def _joined(label: IntArray, a: npt.NDArray[np.int32], b: npt.NDArray[np.int32]) -> IntArray:
    """The smallest vertex of every class that the pairs make; each round halves the longest chain at least."""
    while True:
        low = np.minimum(label[a], label[b])
        if np.array_equal(label[a], label[b]):
            return label
        np.minimum.at(label, label[a], low)
        np.minimum.at(label, label[b], low)
        label = label[label]
