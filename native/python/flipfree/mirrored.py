"""Half of a surface, cut at a plane between left and right, and both halves from what was made of one."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from .errors import bad_option
from .results import FloatArray, IntArray
from .separated import edge_keys, edges_on

Ints = npt.NDArray[np.int64]

#: Vertices this near to the plane, as a share of the extent, are on it.
_ON = 1e-6


class Half(NamedTuple):
    """What lies on the positive side of an axis.

    Attributes:
        vertices, faces: (h, 3), (k, 3). origin: (h, 2) the input's vertices between which each lies; share: (h,) of the way.
        parent, weights: (k,), (k, 3, 3) the input's face that holds each face, and the weights there of its corners.
    """

    vertices: FloatArray
    faces: IntArray
    origin: Ints
    share: FloatArray
    parent: Ints
    weights: FloatArray

    def of_vertices(self, values: FloatArray) -> FloatArray:
        a, b = (values[self.origin[:, k]] for k in (0, 1))
        return a + self.share * (b - a)

    def edges(self, pairs: IntArray) -> IntArray:
        """What is left of edges of the input."""
        return edges_on(self.faces, self.origin, pairs)

    def on_faces(self, faces: Any, weights: FloatArray) -> tuple[Ints, FloatArray]:
        """Points in faces of the half as such in faces of the input."""
        return self.parent[faces], np.einsum("vk,vkj->vj", weights, self.weights[faces])


def half_of(vertices: FloatArray, faces: IntArray, axis: int) -> Half:
    """Faces across the plane are divided there."""
    place, count = vertices[:, axis], len(vertices)
    near = _ON * float(np.ptp(vertices, axis=0).max(initial=0.0))
    side = np.where(np.abs(place) <= near, 0.0, np.sign(place))
    sides = side[faces]
    whole = np.flatnonzero((sides >= 0).all(axis=1) & (sides > 0).any(axis=1))
    across = np.flatnonzero((sides > 0).any(axis=1) & (sides < 0).any(axis=1))
    if not len(whole) + len(across):
        raise bad_option(
            "No face lies on the positive side of the plane of symmetry. Choose another axis."
        )
    before, after = faces[across], np.roll(faces[across], -1, axis=1)
    divided = side[before] * side[after] < 0
    ends = np.sort(np.stack([before, after], -1)[divided], axis=1)
    _, first, number = np.unique(edge_keys(ends), return_index=True, return_inverse=True)
    ends = np.concatenate([np.arange(count).repeat(2).reshape(-1, 2), ends[np.sort(first)]])
    low, high = place[ends].T
    share = np.append(np.zeros(count), low[count:] / (low[count:] - high[count:]))
    # Corners in turn with what divides the sides behind them; -1 where there is none.
    corner = np.full((len(across), 6), -1)
    corner[:, ::2] = np.where(side[before] >= 0, before, -1)
    corner[:, 1::2][divided] = count + np.argsort(np.argsort(first))[number]
    along = share[corner[:, 1::2], None]
    along = np.where((before < after)[..., None], along, 1.0 - along)
    weights = np.tile(np.eye(3), (len(across), 2, 1)).reshape(-1, 2, 3, 3).swapaxes(1, 2)
    weights[:, :, 1] += along * (np.roll(np.eye(3), 1, axis=1) - np.eye(3))
    # What is left has three or four corners.
    fan = np.argsort(corner < 0, axis=1, kind="stable")[:, [[0, 1, 2], [0, 2, 3]]]
    row, k = np.nonzero(corner[np.arange(len(across))[:, None, None], fan].min(axis=2) >= 0)
    at = row[:, None], fan[row, k]
    own = np.concatenate([np.tile(np.eye(3), (len(whole), 1, 1)), weights.reshape(-1, 6, 3)[at]])
    used, compact = np.unique(np.concatenate([faces[whole], corner[at]]), return_inverse=True)
    origin, along = ends[used], share[used]
    points = vertices[origin[:, 0]]
    points += along[:, None] * (vertices[origin[:, 1]] - points)
    points[(along > 0) | (side[origin[:, 0]] == 0), axis] = 0.0
    numbers = compact.reshape(-1, 3).astype(np.int32)
    return Half(points, numbers, origin, along, np.append(whole, across[row]), own)


def on_plane(vertices: FloatArray, polygons: Any, axis: int) -> npt.NDArray[np.bool_]:
    """(n,) vertices of sides with one polygon that lie on the plane."""
    ends = np.stack([polygons, np.roll(polygons, -1, axis=1)], -1).reshape(-1, 2)
    sides, uses = np.unique(np.sort(ends, axis=1), axis=0, return_counts=True)
    near = _ON * float(np.ptp(vertices, axis=0).max(initial=0.0))
    rim = sides[(uses == 1) & (np.abs(vertices[sides, axis]) <= near).all(axis=1)]
    found = np.zeros(len(vertices), bool)
    found[rim] = True
    return found


def doubled(vertices: FloatArray, polygons: Any, axis: int) -> tuple[FloatArray, Any, Any]:
    """(vertices, polygons, (n,) whether each vertex has a twin) of both halves, joined where they meet; twins come second, in
    order, as do the polygons, which turn the other way."""
    on = on_plane(vertices, polygons, axis)
    points = vertices.copy()
    points[on, axis] = 0.0
    twin = np.where(on, np.arange(len(on)), len(on) + np.cumsum(~on) - 1)
    other = points[~on].copy()
    other[:, axis] = -other[:, axis]
    back = np.roll(twin[polygons][:, ::-1], 1, axis=1)
    both = np.concatenate([polygons, back]).astype(polygons.dtype)
    return np.concatenate([points, other]), both, ~on
