"""Vertices that a file has twice because it keeps one normal or texture coordinate a vertex, found again."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

IntArray = npt.NDArray[np.int32]


def welded(vertices: npt.NDArray[np.float64], faces: IntArray) -> IntArray:
    """(n,) vertex that each vertex is taken for, itself or a smaller number at exactly the same place.

    Two boundary edges that lie on each other with opposite directions were one; where more lie there, none does. So no edge
    gets more than two faces, and parts that touch in points or along whole sheets stay apart. Linear but for sorting.
    """
    same = np.arange(len(vertices), dtype=np.int32)
    if len(faces) == 0 or not (0 <= faces.min() and faces.max() < len(vertices)):
        return same
    _, place = np.unique(vertices + 0.0, axis=0, return_inverse=True)  # + 0.0: -0.0 is 0.0
    place = place.reshape(-1)
    start, end = faces.ravel(), np.roll(faces, -1, axis=1).ravel()
    keys = np.minimum(start, end).astype(np.int64) << 32 | np.maximum(start, end)
    _, edge, faces_there = np.unique(keys, return_inverse=True, return_counts=True)
    rim = faces_there[edge.reshape(-1)] == 1
    start, end = start[rim], end[rim]
    rim_keys = np.minimum(place[start], place[end]).astype(np.int64) << 32 | np.maximum(
        place[start], place[end]
    )
    order = np.argsort(rim_keys, kind="stable")
    sorted_keys = rim_keys[order]
    first = (
        np.flatnonzero(np.r_[True, sorted_keys[1:] != sorted_keys[:-1]]) if len(order) else order
    )
    sizes = np.diff(np.r_[first, len(sorted_keys)])
    pairs = first[sizes == 2]
    a, b = order[pairs], order[pairs + 1]
    opposite = (place[start[a]] == place[end[b]]) & (place[start[a]] != place[end[a]])
    a, b = a[opposite], b[opposite]
    return _joined(same, np.r_[start[a], end[a]], np.r_[end[b], start[b]])


def _joined(label: IntArray, a: npt.NDArray[np.int32], b: npt.NDArray[np.int32]) -> IntArray:
    """The smallest vertex of every class that the pairs make; each round halves the longest chain at least."""
    while True:
        low = np.minimum(label[a], label[b])
        if np.array_equal(label[a], label[b]):
            return label
        np.minimum.at(label, label[a], low)
        np.minimum.at(label, label[b], low)
        label = label[label]
