# SPDX-License-Identifier: GPL-3.0-or-later
"""What belongs together: components of faces, islands of a UV map."""

import numpy as np


def edge_keys(pairs: np.ndarray) -> np.ndarray:
    """One int64 per vertex pair, the same for both directions."""
    pairs = pairs.astype(np.int64)
    return np.minimum(pairs[:, 0], pairs[:, 1]) << 32 | np.maximum(pairs[:, 0], pairs[:, 1])


def connected_components(n: int, a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """(n,) smallest member of each element's component under the links a[i] - b[i]. O((n + #links) log n)."""
    label = np.arange(n)
    while len(a):
        low, high = np.minimum(label[a], label[b]), np.maximum(label[a], label[b])
        differ = low != high
        if not differ.any():
            break
        a, b, low, high = a[differ], b[differ], low[differ], high[differ]
        np.minimum.at(label, high, low)
        while True:
            up = label[label]
            if np.array_equal(up, label):
                break
            label = up
    return label


def face_components(triangles: np.ndarray) -> np.ndarray:
    """(m,) smallest triangle of each triangle's component; triangles are joined by common edges."""
    m = len(triangles)
    key = edge_keys(np.concatenate([triangles[:, e] for e in ((0, 1), (1, 2), (2, 0))]))
    order = np.argsort(key, kind="stable")
    same = np.flatnonzero(key[order][1:] == key[order][:-1])
    return connected_components(m, order[same] % m, order[same + 1] % m)


def _edge_ends(triangles: np.ndarray):
    """Corners at both ends of every inner edge, in one triangle and in the other: (low, other low, high, other high)."""
    m = len(triangles)
    low_corner, high_corner = [], []
    for k in range(3):
        here, there = 3 * np.arange(m) + k, 3 * np.arange(m) + (k + 1) % 3
        up = triangles[:, k] < triangles[:, (k + 1) % 3]
        low_corner.append(np.where(up, here, there))
        high_corner.append(np.where(up, there, here))
    low, high = np.concatenate(low_corner), np.concatenate(high_corner)
    vertex = triangles.ravel().astype(np.int64)
    key = vertex[low] << 32 | vertex[high]
    order = np.argsort(key, kind="stable")
    same = np.flatnonzero(key[order][1:] == key[order][:-1])
    a, b = order[same], order[same + 1]
    return low[a], low[b], high[a], high[b]


def island_labels(triangles: np.ndarray, uv: np.ndarray) -> np.ndarray:
    """(m,) smallest triangle of each triangle's island in the map uv (m, 3, 2): triangles belong together if they share an
    edge and its UVs, bit for bit."""
    low, other_low, high, other_high = _edge_ends(triangles)
    flat = uv.reshape(-1, 2)
    joined = (flat[low] == flat[other_low]).all(axis=1) & (flat[high] == flat[other_high]).all(
        axis=1
    )
    return connected_components(len(triangles), low[joined] // 3, other_low[joined] // 3)


def count_islands(triangles: np.ndarray, uv: np.ndarray) -> int:
    return int(np.count_nonzero(island_labels(triangles, uv) == np.arange(len(triangles))))


def nearly_joined(triangles: np.ndarray, uv: np.ndarray) -> int:
    """Edges whose UVs on the two sides differ, but only in the last bits that 32-bit floats have: never meant to be cuts."""
    low, other_low, high, other_high = _edge_ends(triangles)
    flat = uv.reshape(-1, 2).astype(np.float64)
    apart = np.concatenate([flat[low] - flat[other_low], flat[high] - flat[other_high]], axis=1)
    size = np.maximum(np.abs(flat[low]), np.abs(flat[high])).max(axis=1, initial=1.0)
    gap = np.abs(apart).max(axis=1)
    last_bits = 4 * np.finfo(np.float32).eps * np.maximum(size, 1.0)
    return int(np.count_nonzero((gap > 0) & (gap <= last_bits)))


def members(keys: np.ndarray, among: np.ndarray) -> np.ndarray:
    """np.isin for int64, without hashing or stable sorts: (len(keys),) bool."""
    if not len(among):
        return np.zeros(len(keys), bool)
    among = np.sort(among)
    if len(among) < 1 << 16:  # fits the cache
        return among[np.minimum(np.searchsorted(among, keys), len(among) - 1)] == keys
    order = np.argsort(keys)
    place = np.searchsorted(among, keys[order])  # in ascending order: one pass through memory
    found = np.zeros(len(keys), bool)
    found[order] = among[np.minimum(place, len(among) - 1)] == keys[order]
    return found
