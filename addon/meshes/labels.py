# SPDX-License-Identifier: GPL-3.0-or-later
"""What belongs together: components of faces, islands of a UV map."""

import numpy as np

import flipfree
from flipfree.separated import edge_keys as edge_keys


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


def groups(label: np.ndarray) -> list[np.ndarray]:
    """What has each label, ascending, in the order of the labels. In one sweep, however many they are."""
    if not len(label):
        return []
    order = np.argsort(label, kind="stable")
    return np.split(order, 1 + np.flatnonzero(np.diff(label[order])))


def face_components(triangles: np.ndarray) -> np.ndarray:
    """(m,) smallest triangle of each triangle's component; triangles are joined by common edges."""
    return flipfree.islands(triangles)[0]


def island_labels(triangles: np.ndarray, uv: np.ndarray) -> np.ndarray:
    """(m,) smallest triangle of each triangle's island in the map uv (m, 3, 2): triangles belong together if they share an
    edge and its UVs, bit for bit."""
    return flipfree.islands(triangles, uv)[0]


def count_islands(triangles: np.ndarray, uv: np.ndarray) -> int:
    return int(np.count_nonzero(island_labels(triangles, uv) == np.arange(len(triangles))))


def nearly_joined(triangles: np.ndarray, uv: np.ndarray) -> int:
    """Edges whose UVs on the two sides differ, but only in the last bits that 32-bit floats have: never meant to be cuts."""
    return flipfree.islands(triangles, uv)[1]


def edges_of(triangles: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """(e, 2) edges, lower vertex first, and (e,) how many triangles have each."""
    ends = np.stack([triangles, np.roll(triangles, -1, axis=1)], axis=-1).reshape(-1, 2)
    return np.unique(np.sort(ends, axis=1), axis=0, return_counts=True)


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
