"""How far islands are apart: by every edge of their triangles against every other, slow and simple.

    narrowest(islands, within) -> Gap      # the least distance between two islands, if it is at most `within`

Distances are computed in 64 bits from 32-bit values, with a relative error below 1e-12, which is taken off. Islands inside each
other's triangles have the distance 0; islands in holes do not.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

Array = npt.NDArray[np.float64]


@dataclass
class Gap:
    distance: float
    first: int = -1  # the islands, -1 if none are as close as asked
    second: int = -1


def area(triangles: Array) -> float:
    a, b = triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0]
    return float(np.abs(a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]).sum() / 2)


def edges_of(triangles: Array) -> Array:
    """(3 k, 2, 2): start and end of every edge."""
    return np.stack([triangles, np.roll(triangles, -1, axis=1)], axis=2).reshape(-1, 2, 2)


def to_segments(points: Array, segments: Array) -> Array:
    """(p, s) distances."""
    side = segments[:, 1] - segments[:, 0]
    off = points[:, None] - segments[None, :, 0]
    square = (side**2).sum(-1)
    along = np.einsum("psk,sk->ps", off, side)
    t = np.clip(np.divide(along, square, out=np.zeros_like(along), where=square > 0), 0.0, 1.0)
    return np.asarray(np.linalg.norm(off - t[..., None] * side, axis=-1))


def crossing(a: Array, b: Array) -> bool:
    """Whether some edge of one crosses some edge of the other from side to side."""

    def side(p: Array, q: Array, r: Array) -> Array:
        return np.asarray(
            (q[..., 0] - p[..., 0]) * (r[..., 1] - p[..., 1])
            - (q[..., 1] - p[..., 1]) * (r[..., 0] - p[..., 0])
        )

    p, q = a[:, None, 0], a[:, None, 1]
    r, s = b[None, :, 0], b[None, :, 1]
    apart = side(p, q, r) * side(p, q, s) < 0
    return bool((apart & (side(r, s, p) * side(r, s, q) < 0)).any())


def inside(point: Array, triangles: Array) -> bool:
    ahead = np.roll(triangles, -1, axis=1) - triangles
    off = point - triangles
    turn = ahead[..., 0] * off[..., 1] - ahead[..., 1] * off[..., 0]
    return bool(((turn > 0).all(1) | (turn < 0).all(1)).any())


def between(a: Array, b: Array, within: float) -> float:
    """The distance of two islands' triangles (k, 3, 2), or infinity if it is more than `within`."""

    def near(edges: Array, other: Array) -> Array:
        low, high = other.min((0, 1)) - within, other.max((0, 1)) + within
        return edges[((edges.max(1) >= low) & (edges.min(1) <= high)).all(1)]

    own, others = near(edges_of(a), b), near(edges_of(b), a)
    least = np.inf
    for part in np.array_split(own, len(own) // 256 + 1):
        if not len(part) or not len(others):
            continue
        if crossing(part, others):
            return 0.0
        least = min(
            least,
            float(to_segments(part[:, 0], others).min()),
            float(to_segments(others[:, 0], part).min()),
        )
    # Starts of edges are all corners: every triangle's edges run around it.
    if (
        inside(a[0, 0], b)
        or inside(b[0, 0], a)
        or inside(a[0].mean(0), b)
        or inside(b[0].mean(0), a)
    ):
        return 0.0
    return least * (1.0 - 1e-12) if least <= within else np.inf


def narrowest(islands: list[Array], within: float) -> Gap:
    boxes = np.array([[t.min((0, 1)), t.max((0, 1))] for t in islands])
    order = np.argsort(boxes[:, 0, 0])
    found = Gap(np.inf)
    for at, i in enumerate(order):
        later = order[at + 1 :]
        end = np.searchsorted(boxes[later, 0, 0], boxes[i, 1, 0] + within, side="right")
        later = later[:end]
        beside = (boxes[later, 0, 1] <= boxes[i, 1, 1] + within) & (
            boxes[later, 1, 1] >= boxes[i, 0, 1] - within
        )
        for j in later[beside]:
            distance = between(islands[i], islands[j], within)
            if distance < found.distance:
                found = Gap(distance, int(i), int(j))
    return found
