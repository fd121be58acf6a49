"""Half of a surface, cut at a plane between left and right, and both halves from what was made of one."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from .errors import FlipfreeError, bad_option
from .results import FloatArray, IntArray

Ints = npt.NDArray[np.int64]

#: Vertices this near to the plane, as a share of the extent, are on it.
_ON = 1e-6
#: Corners as another mirrored face has them: turned over.
_BACK = [0, 2, 1]


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

    @contextmanager
    def named_on_input(self) -> Iterator[None]:
        """Errors that name what is the half's name what is the input's."""
        try:
            yield
        except FlipfreeError as error:
            ids = np.array(error.elements, np.int64)
            known = self.parent if error.kind == "face" else self.origin[:, 0]
            error.elements = known[ids].tolist() if (ids < len(known)).all() else []
            raise

    def edges(self, pairs: IntArray) -> IntArray:
        """What is left of edges of the input."""
        sides = np.concatenate([self.faces[:, [k, (k + 1) % 3]] for k in range(3)]).astype(np.int64)
        ends = np.sort(self.origin[sides].reshape(-1, 4), axis=1)
        size = int(self.origin.max(initial=0)) + 1
        wanted = np.sort(np.asarray(pairs, np.int64).reshape(-1, 2), axis=1)
        two = ((ends == ends[:, :1]) | (ends == ends[:, 3:])).all(axis=1) & (
            ends[:, 0] < ends[:, 3]
        )
        on = two & np.isin(ends[:, 0] * size + ends[:, 3], wanted[:, 0] * size + wanted[:, 1])
        return np.unique(np.sort(sides[on], axis=1), axis=0).astype(np.int32)


def half_of(vertices: FloatArray, faces: IntArray, axis: int) -> Half:
    """Faces across the plane are divided there."""
    place = vertices[:, axis]
    near = _ON * float(np.ptp(vertices, axis=0).max(initial=0.0))
    side = np.where(np.abs(place) <= near, 0.0, np.sign(place))
    sides = side[faces]
    whole = (sides >= 0).all(axis=1) & (sides > 0).any(axis=1)
    corners: list[Any] = faces[whole].tolist()
    parent = np.flatnonzero(whole).tolist()
    weights = [np.eye(3)] * len(parent)
    ends = [(v, v) for v in range(len(vertices))]
    share = [0.0] * len(vertices)
    divided: dict[tuple[int, int], int] = {}
    for f in np.flatnonzero((sides > 0).any(axis=1) & (sides < 0).any(axis=1)).tolist():
        polygon: list[tuple[int, Any]] = []
        for k in range(3):
            a, b = int(faces[f, k]), int(faces[f, (k + 1) % 3])
            if side[a] >= 0:
                polygon.append((a, np.eye(3)[k]))
            if side[a] * side[b] < 0:
                low, high = min(a, b), max(a, b)
                if (low, high) not in divided:
                    divided[low, high] = len(ends)
                    ends.append((low, high))
                    share.append(float(place[low] / (place[low] - place[high])))
                new = divided[low, high]
                t = share[new] if a == low else 1.0 - share[new]
                polygon.append((new, (1.0 - t) * np.eye(3)[k] + t * np.eye(3)[(k + 1) % 3]))
        for i in range(1, len(polygon) - 1):
            piece = [polygon[0], polygon[i], polygon[i + 1]]
            corners.append([v for v, _ in piece])
            parent.append(f)
            weights.append(np.array([w for _, w in piece]))
    if not corners:
        raise bad_option(
            "No face lies on the positive side of the plane of symmetry. Choose another axis."
        )
    used, compact = np.unique(np.array(corners), return_inverse=True)
    origin, along = np.array(ends)[used], np.array(share)[used]
    points = vertices[origin[:, 0]] + along[:, None] * (
        vertices[origin[:, 1]] - vertices[origin[:, 0]]
    )
    on = (along > 0) | (side[origin[:, 0]] == 0)
    points[on, axis] = 0.0
    return Half(
        points,
        compact.reshape(-1, 3).astype(np.int32),
        origin,
        along,
        np.array(parent),
        np.array(weights),
    )


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


def on_other_side(
    vertices: FloatArray,
    faces: IntArray,
    axis: int,
    parent: Ints,
    weights: FloatArray,
    points: FloatArray,
) -> tuple[Ints, FloatArray]:
    """(faces, weights) of points that mirror those at (parent, weights): in the nearest of the faces around the vertices that
    mirror the parent's; where there are no such vertices, the same ones."""
    grid = 10 * _ON * max(float(np.ptp(vertices, axis=0).max(initial=0.0)), 1e-300)
    mirrored = vertices.copy()
    mirrored[:, axis] *= -1.0
    keys, others = (np.rint(p / grid).astype(np.int64) for p in (vertices, mirrored))
    number = {key: v for v, key in enumerate(map(tuple, keys.tolist()))}
    twin = np.array([number.get(key, -1) for key in map(tuple, others.tolist())], np.int64)
    order = np.argsort(faces.ravel(), kind="stable")
    count = np.bincount(faces.ravel(), minlength=len(vertices))
    first = np.cumsum(count) - count
    # Every point with every face around every twin.
    around = twin[faces[parent]]
    many = np.where(around >= 0, count[around], 0).ravel()
    row = np.repeat(np.arange(len(many)), many)
    step = np.arange(len(row)) - np.repeat(np.cumsum(many) - many, many)
    face, point = order[first[around.ravel()[row]] + step] // 3, row // 3
    corner = vertices[faces[face]]
    a, b, p = corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0], points[point] - corner[:, 0]
    aa, ab, bb, ap, bp = (
        np.einsum("ij,ij->i", *pair) for pair in ((a, a), (a, b), (b, b), (a, p), (b, p))
    )
    area = np.maximum(aa * bb - ab * ab, 1e-300)
    share = np.stack([(bb * ap - ab * bp) / area, (aa * bp - ab * ap) / area], axis=1)
    found = np.maximum(np.column_stack([1.0 - share.sum(axis=1), share]), 0.0)
    found /= found.sum(axis=1, keepdims=True)
    off = np.linalg.norm(np.einsum("ik,ikj->ij", found, corner) - points[point], axis=1)
    best = np.lexsort((face, off, point))
    best = best[np.append(True, point[best][1:] != point[best][:-1])[: len(best)]]
    parent, weights = parent.copy(), weights.copy()
    parent[point[best]], weights[point[best]] = face[best], found[best]
    return parent, weights
