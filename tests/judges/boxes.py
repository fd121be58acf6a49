"""Which boxes of a set meet: a balanced tree of boxes, walked level by level with arrays."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

Floats = npt.NDArray[np.float64]
#: Rows of the boxes, by their left sides, that are tried at once.
_ROWS = 256


def meeting_boxes(low: Floats, high: Floats, *, closed: bool) -> npt.NDArray[np.int64]:
    """(k, 2) pairs i < j of boxes low..high (n, 2) that share a point; of their interiors unless `closed`. Cost: pairs of boxes
    that stand above each other."""
    below = np.less_equal if closed else np.less
    order = np.argsort(low[:, 0], kind="stable")
    last = np.searchsorted(low[order, 0], high[order, 0], "right")
    found = [np.zeros((0, 2), np.int64)]
    for first in range(0, len(order), _ROWS):
        rows = np.arange(first, min(first + _ROWS, len(order)))
        size = np.maximum(last[rows] - rows - 1, 0)
        i = np.repeat(rows, size)
        j = i + 1 + np.arange(len(i)) - np.repeat(size.cumsum() - size, size)
        pairs = np.sort(np.stack([order[i], order[j]], 1), axis=1)
        p, q = pairs.T
        found.append(pairs[(below(low[p], high[q]) & below(low[q], high[p])).all(1)])
    pairs = np.concatenate(found)
    return pairs[np.lexsort((pairs[:, 1], pairs[:, 0]))]
