"""Which boxes of a set meet: a balanced tree of boxes, walked level by level with arrays."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

Floats = npt.NDArray[np.float64]
#: Up to so many boxes, all pairs are tried.
SMALL = 256


def meeting_boxes(low: Floats, high: Floats, *, closed: bool) -> npt.NDArray[np.int64]:
    """(k, 2) pairs i < j of boxes low..high (n, 2) that share a point; of their interiors unless `closed`.

    Cost: O(n log^2 n + pairs) where sizes vary as they do in layouts.
    """
    below = np.less_equal if closed else np.less
    if len(low) <= SMALL:
        meets = (below(low[:, None], high) & below(low, high[:, None])).all(2)
        return np.argwhere(np.triu(meets, 1))
    return _walked(low, high, below)


def _walked(low: Floats, high: Floats, below: np.ufunc) -> npt.NDArray[np.int64]:
    count = len(low)
    depth = (count - 1).bit_length()
    padded = 1 << depth
    # Boxes that meet nothing fill the tree up.
    low = np.vstack([low, np.full((padded - count, 2), np.inf)])
    high = np.vstack([high, np.full((padded - count, 2), -np.inf)])
    with np.errstate(invalid="ignore"):
        centre = np.where(np.isfinite(low), low + high, np.inf)
    order = np.arange(padded).reshape(1, padded)
    for level in range(depth):
        by = np.argsort(centre[order, level % 2], axis=1, kind="stable")
        order = np.take_along_axis(order, by, 1).reshape(2 << level, -1)
    order = order.ravel()

    lows, highs = [low[order]], [high[order]]
    for _ in range(depth):
        lows.append(np.minimum(lows[-1][0::2], lows[-1][1::2]))
        highs.append(np.maximum(highs[-1][0::2], highs[-1][1::2]))
    a = b = np.zeros(1, np.int64)
    for level in reversed(range(depth)):
        same = a == b
        a, b = (
            np.concatenate([2 * a, 2 * a, 2 * a + 1, (2 * a + 1)[~same]]),
            np.concatenate([2 * b, 2 * b + 1, 2 * b + 1, (2 * b)[~same]]),
        )
        meets = below(lows[level][a], highs[level][b]) & below(lows[level][b], highs[level][a])
        # A node meets itself, whatever its box; a leaf is no pair.
        keep = meets.all(1) | ((a == b) & (level > 0))
        keep &= (a != b) | (level > 0)
        a, b = a[keep], b[keep]
    i, j = order[a], order[b]
    pairs = np.stack([np.minimum(i, j), np.maximum(i, j)], 1)
    return pairs[np.lexsort((pairs[:, 1], pairs[:, 0]))]
