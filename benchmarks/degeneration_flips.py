"""Metrics by flips where triangles degenerate (thesis 4.2.2 and 4.6.2; Campen and Zorin 2017): what Delaunay flips replace.

In doubles, for conformal.py alone. A Newton direction is followed to where the first triangle has no area; its longest side is
flipped there by Ptolemy's formula, and a new direction found.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt
from scipy.sparse import coo_matrix
from scipy.sparse.linalg import spsolve

from surfaces import Mesh

Array = npt.NDArray[Any]


class Metric:
    """Of a closed surface: logarithms of lengths, halfedge 3 f + k from corner k of face f to the next."""

    def __init__(self, mesh: Mesh) -> None:
        points, faces = mesh
        self.at = faces.astype(np.int64)
        ends = np.stack([self.at, np.roll(self.at, -1, axis=1)], -1).reshape(-1, 2)
        number = {(a, b): h for h, (a, b) in enumerate(ends.tolist())}
        self.twin = np.array([number[b, a] for a, b in ends.tolist()])
        sides = np.linalg.norm(points[ends[:, 1]] - points[ends[:, 0]], axis=1)
        self.log = np.log(sides).reshape(-1, 3)
        self.flips = 0

    def lengths(self, u: Array) -> Array:
        """Of the metric with these scale factors; each face at a scale of its own."""
        log = self.log + (u[self.at] + u[np.roll(self.at, -1, axis=1)]) / 2
        lengths: Array = np.exp(log - log.max(axis=1, keepdims=True))
        return lengths

    def room(self, u: Array) -> Array:
        lengths = self.lengths(u)
        room: Array = lengths.sum(axis=1) - 2 * lengths.max(axis=1)
        return room

    def flip(self, h: int) -> None:
        at, log, twin = self.at.reshape(-1), self.log.reshape(-1), self.twin
        o = int(twin[h])
        (b, c), (a, d) = ((k - k % 3 + (k + 1) % 3, k - k % 3 + (k + 2) % 3) for k in (h, o))
        f, g = h - h % 3, o - o % 3
        moved = {b: f + 2, c: g + 1, a: g + 2, d: f + 1}  # faces c d b and d c a
        was = {k: (at[k], log[k], int(twin[k])) for k in moved}
        across = np.logaddexp(log[b] + log[a], log[c] + log[d]) - log[h]
        for k, to in moved.items():
            at[to], log[to], beside = was[k]
            twin[to] = moved.get(beside, beside)
        for to in moved.values():
            twin[twin[to]] = to
        at[f], at[g], twin[f], twin[g] = was[c][0], was[d][0], g, f
        log[f] = log[g] = across
        self.flips += 1

    def gradient(self, u: Array, target: Array) -> tuple[Array, Array]:
        """(angles less targets, cotangents opposite each halfedge)"""
        a = self.lengths(u)
        b, c = np.roll(a, -1, axis=1), np.roll(a, -2, axis=1)
        angle = np.arccos(np.clip((a * a + c * c - b * b) / (2 * a * c), -1.0, 1.0))
        with np.errstate(divide="ignore"):
            cotangent = np.roll(1 / np.tan(angle), -2, axis=1)
        return np.bincount(self.at.ravel(), angle.ravel(), len(target)) - target, cotangent

    def direction(self, gradient: Array, cotangent: Array) -> Array:
        i, j, w = self.at.ravel(), np.roll(self.at, -1, axis=1).ravel(), cotangent.ravel() / 2
        rows, columns = np.concatenate([i, j, i, j]), np.concatenate([i, j, j, i])
        n = len(gradient)
        system = coo_matrix((np.concatenate([w, w, -w, -w]), (rows, columns)), (n, n)).tocsr()
        return np.append(0.0, spsolve(system[1:, 1:], gradient[1:]))

    def newton(self, target: Array, tolerance: float, most: int) -> tuple[int, float]:
        """(systems solved, largest error): until it is within the tolerance, so many are solved, or one is singular."""
        u = np.zeros(len(target))
        for solved in range(most + 1):
            gradient, cotangent = self.gradient(u, target)
            error = float(np.abs(gradient).max())
            if error <= tolerance or solved == most:
                break
            d, step = self.direction(gradient, cotangent), 1.0
            if not np.isfinite(d).all():
                break
            while step > 1e-12:
                if self.room(u + step * d).min() > 0.0:
                    if self.gradient(u + step * d, target)[0] @ d >= 0.0:
                        u = u + step * d
                        break
                    step /= 2  # past the minimum along it
                    continue
                low, high = 0.0, step
                for _ in range(60):
                    middle = (low + high) / 2
                    fits = self.room(u + middle * d).min() > 0.0
                    low, high = (middle, high) if fits else (low, middle)
                if self.gradient(u + low * d, target)[0] @ d < 0.0:
                    step = low / 2
                    continue
                face, longest = self.room(u + high * d).argmin(), self.lengths(u + high * d)
                u = u + low * d
                self.flip(3 * int(face) + int(longest[face].argmax()))
                break
        return solved, error
