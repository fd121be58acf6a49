"""A map at points that are no vertices (thesis 4.5), the way back, and two maps one after the other (thesis 3.4.1).

A map is known on the pieces of an overlay: the triangles of the result, each inside one triangle of the input. It is linear
on every piece, or projective where the result has ``log_weight``.
"""

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from . import _native
from .checks import as_floats, as_indices, as_map, as_places, checked
from .errors import bad_option, bad_shape, out_of_range
from .job import ours_only, run, start_map
from .results import Array, FloatArray, IntArray, Parametrization

#: What weights may be below zero by rounding.
_SLACK = 1e-12
#: Rounding of places, relative: of doubles, and of two maps that are stored in 32 bits, whose straight sides are no longer.
_DOUBLE, _STORED = 4e-15, 2.0**-22


@ours_only
def map_points(found: Parametrization, faces: Any, barycentrics: Any) -> FloatArray:
    """See :meth:`Parametrization.map_points`."""
    face, weights = _points_of(found, faces, barycentrics)
    order = np.argsort(found.parent_face, kind="stable")
    begin, end = (
        np.searchsorted(found.parent_face[order], face, side=side) for side in ("left", "right")
    )
    if (begin == end).any():
        lost = face[begin == end][0]
        raise out_of_range(f"Face {lost} is not in the map. Leave its points out.", "face", [lost])
    query = np.repeat(np.arange(len(face)), end - begin)
    place = np.arange(len(query)) - np.repeat(np.cumsum(end - begin) - end, end - begin)
    piece = order[place]
    shares = _shares(corners_in_parents(found, piece), weights[query])
    deepest = np.lexsort((shares.min(axis=1), query))[np.cumsum(end - begin) - 1]
    piece, shares = piece[deepest], np.maximum(shares[deepest], 0.0)
    shares = _normalised(shares * _projective(found, piece))
    return np.asarray(np.einsum("qk,qkd->qd", shares, found.uv[piece]))


@ours_only
def find_points(found: Parametrization, uv: Any) -> tuple[IntArray, IntArray, FloatArray]:
    """See :meth:`Parametrization.find_points`."""
    return Finder(found).find(as_places(uv, "uv"))


def _points_of(
    found: Parametrization, faces: Any, barycentrics: Any
) -> tuple[IntArray, FloatArray]:
    face, weights = as_indices(faces, "faces"), as_floats(barycentrics, "barycentrics", 3)
    if len(face) != len(weights):
        raise bad_shape(f"barycentrics must have shape ({len(face)}, 3), one row for each face.")
    wrong = (face < 0) | (face >= len(found.input_faces))
    if wrong.any():
        raise out_of_range(f"faces names face {face[wrong][0]} of {len(found.input_faces)}.")
    with np.errstate(invalid="ignore"):
        wrong = ~((weights >= -_SLACK).all(axis=1) & (np.abs(weights.sum(axis=1) - 1.0) < 1e-9))
    if wrong.any():
        raise bad_option(
            f"barycentrics must be three weights from 0 on with the sum 1, not {weights[wrong][0]}.",
            "face",
            face[wrong][:1],
        )
    return face, weights


def corners_in_parents(found: Parametrization, piece: Array) -> FloatArray:
    """(q, 3, 3) weights of the corners of these faces of the result in the input's faces that contain them."""
    vertex = found.faces[piece]
    named = found.input_faces[found.vertex_parent[vertex]]
    wanted = found.input_faces[found.parent_face[piece]]
    same = (named[..., None] == wanted[:, None, None]).astype(np.float64)
    return np.asarray(np.einsum("qcj,qcjk->qck", found.vertex_barycentric[vertex], same))


def on_input(
    found: Parametrization, piece: Array, weights: FloatArray
) -> tuple[IntArray, FloatArray]:
    """Points in faces of the result as such in the input's faces."""
    places = np.einsum("qc,qck->qk", weights, corners_in_parents(found, piece))
    return found.parent_face[piece], places


def of_pieces(given: Parametrization, made: Parametrization) -> Parametrization:
    """A map of pieces of the other's faces, as one of its input."""
    new = slice(len(given.vertices), None)
    parent, added = on_input(given, made.vertex_parent[new], made.vertex_barycentric[new])
    return replace(
        made,
        parent_face=given.parent_face[made.parent_face],
        vertex_parent=np.concatenate([given.vertex_parent, parent]),
        vertex_barycentric=np.concatenate([given.vertex_barycentric, added]),
        input_faces=given.input_faces,
    )


def split_edges(found: Parametrization, old: int, faces: IntArray) -> IntArray:
    """(k, 2) edges with vertices that a map has added to the first ``old``, as ends in these faces, which parents count."""
    weights = found.vertex_barycentric[old:]
    on_edge = (weights == 0.0).any(axis=1)
    ends = faces[found.vertex_parent[old:][on_edge]]
    return np.asarray(ends[weights[on_edge] != 0.0].reshape(-1, 2))


def _shares(corner: FloatArray, point: FloatArray) -> FloatArray:
    """(q, 3) weights of corners (q, 3, 3) that make points (q, 3), all of them weights of one triangle. -inf: flat corners."""
    after, before = np.roll(corner, -1, axis=1), np.roll(corner, -2, axis=1)
    part = np.einsum("qd,qcd->qc", point, np.cross(after, before))
    whole = np.einsum("qd,qd->q", corner[:, 0], np.cross(corner[:, 1], corner[:, 2]))
    with np.errstate(divide="ignore", invalid="ignore"):
        return np.asarray(np.where(whole[:, None] > 0.0, part / whole[:, None], -np.inf))


def _projective(found: Parametrization, piece: Array) -> FloatArray:
    """(q, 3) weights of the corners of these faces: the largest is 1."""
    if found.log_weight is None:
        return np.ones((len(piece), 3))
    logs = found.log_weight[found.faces[piece]]
    return np.asarray(np.exp(logs - logs.max(axis=1, keepdims=True)))


def _normalised(weights: FloatArray) -> FloatArray:
    return np.asarray(weights / weights.sum(axis=1, keepdims=True))


class Finder:
    """Finds points of the plane in a map: boxes around its triangles in a binary tree, in the order of a Z curve over their
    ranks, so that maps of very different sizes are no worse. O(m log m) for m triangles."""

    def __init__(self, found: Parametrization) -> None:
        self.map = found
        low, high = found.uv.min(axis=1), found.uv.max(axis=1)
        rank = np.argsort(np.argsort(low + high, axis=0), axis=0).astype(np.int64)
        key = np.zeros(len(low), np.int64)
        for bit in range(max(len(low) - 1, 1).bit_length()):
            for axis in (0, 1):
                key |= (rank[:, axis] >> bit & 1) << (2 * bit + axis)
        self.order = np.argsort(key, kind="stable")
        leaves = 1 << max(len(low) - 1, 0).bit_length()
        box = np.full((leaves, 2, 2), np.inf)  # low, -high
        box[: len(low), 0], box[: len(low), 1] = low[self.order], -high[self.order]
        self.levels = [box]
        while len(box) > 1:
            box = box.reshape(-1, 2, 2, 2).min(axis=1)
            self.levels.append(box)

    def find(
        self, uv: FloatArray, rounding: float = _DOUBLE
    ) -> tuple[IntArray, IntArray, FloatArray]:
        """As Parametrization.find_points; of a place's pieces the one in which it is deepest comes first."""
        size = np.abs(uv).max(initial=0.0) + np.abs(self.map.uv).max(initial=0.0)
        sides = np.stack([uv, -uv], axis=1) + max(_SLACK, rounding) * size
        query, node = np.arange(len(uv)), np.zeros(len(uv), np.int64)
        for box in reversed(self.levels):
            inside = (box[node] <= sides[query]).all(axis=(1, 2))
            query, node = query[inside], node[inside]
            if len(box) < len(self.levels[0]):
                query, node = np.repeat(query, 2), (2 * node[:, None] + [0, 1]).ravel()
        piece = self.order[node]
        corner = self.map.uv[piece] - uv[query][:, None]
        after, before = np.roll(corner, -1, axis=1), np.roll(corner, -2, axis=1)
        part = after[..., 0] * before[..., 1] - after[..., 1] * before[..., 0]
        whole = part.sum(axis=1)
        reach = np.abs(corner).max(axis=(1, 2))
        with np.errstate(divide="ignore", invalid="ignore"):
            shares = part / whole[:, None]
            slack = _SLACK + rounding * reach * (reach + size) / whole
            within = (whole > 0.0) & (shares.min(axis=1) >= -slack)
        query, piece, shares = query[within], piece[within], shares[within]
        first = np.lexsort((-shares.min(axis=1, initial=np.inf), query))
        shares = np.maximum(shares, 0.0)
        shares = _normalised(_normalised(shares) / _projective(self.map, piece))
        faces, weights = on_input(self.map, piece, shares)
        return query[first].astype(np.int32), faces[first].astype(np.int32), weights[first]


@dataclass(frozen=True, eq=False)
class SurfaceMap:
    """From one surface to another through a common image in the plane: what :func:`compose` returns."""

    first: Parametrization
    second: Parametrization
    _finder: Finder

    def map_points(self, faces: Any, barycentrics: Any) -> tuple[IntArray, FloatArray]:
        """Points of the first surface on the second.

        Args:
            faces: (k,) faces of the first input. barycentrics: (k, 3) weights there, from 0 on, with the sum 1.

        Returns:
            ((k,) faces of the second input, (k, 3) weights there). On an edge: one of its faces. A point outside by no more
            than 32 bits round, as straight sides are that are stored, goes to the nearest piece.

        Raises:
            InvalidInput: no such face or weights; a point outside the second image, which the message names.

        O((k + p) log m), p the pieces in these faces.
        """
        uv = self.first.map_points(faces, barycentrics)
        at, there = np.full(len(uv), -1, np.int32), np.zeros((len(uv), 3))
        for rounding in (_DOUBLE, _STORED):
            left = np.flatnonzero(at < 0)
            query, face, weights = self._finder.find(uv[left], rounding)
            found, first = np.unique(query, return_index=True)
            at[left[found]], there[left[found]] = face[first], weights[first]
        if (at < 0).any():
            lost = int(np.argmin(at))
            on_face = int(np.asarray(faces)[lost])
            raise bad_option(
                f"Point {lost}, on face {on_face}, lies outside the second map. Map both surfaces onto one domain, such as a "
                "square.",
                "face",
                [on_face],
            )
        return at, there

    def map_corners(self) -> tuple[IntArray, FloatArray]:
        """Every corner of every face of the first surface: ((m, 3) faces of the second input, (m, 3, 3) weights there). On a cut:
        as seen from that corner's face. Raises InvalidInput for faces that are not in the map."""
        m = len(self.first.input_faces)
        face, weights = self.map_points(np.repeat(np.arange(m), 3), np.tile(np.eye(3), (m, 1)))
        return face.reshape(m, 3), weights.reshape(m, 3, 3)


def _map_of(name: str, given: Any) -> Parametrization:
    if isinstance(given, Parametrization):
        return given
    vertices, faces, uv = as_map(given, name)
    mesh, options = checked(locals(), "uv")
    return run(start_map(_native.judged, mesh, options, {}))


@ours_only
def compose(first: Any, second: Any) -> SurfaceMap:
    """Two surfaces over one domain: the map from the first to the second, one-to-one and without a fold (thesis 3.4.1).

    It is second^-1 after first, linear (or projective) on every piece of the overlay of the two; ``compose(second, first)``
    is its inverse. Either is a Parametrization, or (vertices, faces, uv) as ``certify`` takes them. Both maps cover the same
    part of the plane, each point once: such as ``embed`` of two disks onto one square, with corresponding ``corners``.

    Raises:
        InvalidInput: a map covers places twice, or is not certified; or a vertex of one lies outside the other, by name.

    O((n + m) log m) for n vertices and m faces of both.
    """
    first, second = _map_of("first", first), _map_of("second", second)
    for name, found in (("first", first), ("second", second)):
        told = found.certificate
        if not told.ok or told.overlaps != 0 or told.island_overlaps > 0:
            raise bad_option(
                f"The {name} map is not one-to-one, so that a point of the plane has several places on its surface. Take maps "
                "without overlaps."
            )
    there, back = (
        SurfaceMap(first, second, Finder(second)),
        SurfaceMap(second, first, Finder(first)),
    )
    for one in (there, back):
        face = np.repeat(np.arange(len(one.first.input_faces), dtype=np.int32), 3)
        known = np.isin(face, one.first.parent_face)
        one.map_points(face[known], np.tile(np.eye(3), (len(face) // 3, 1))[known])
    return there
