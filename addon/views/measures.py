# SPDX-License-Identifier: GPL-3.0-or-later
"""How far a map is from the surface, triangle by triangle: arrays in, arrays out.

Symmetric Dirichlet is that of certificates: (|J|^2 + |J^-1|^2) / 4 at the best global scale, 1 is isometric, no bound where a
triangle is flipped. Angle is the larger singular value of J over the smaller one. Area is the ratio of areas at the scale that
makes the total areas equal.
"""

from dataclasses import dataclass
from fractions import Fraction

import numpy as np

from flipfree import distortion

PERCENTILES = (50, 95, 99)


@dataclass
class Stretch:
    """Of every triangle: its area on the surface, the sum of squares of J's singular values, det J (negative: flipped). nan
    where the triangle has no area on the surface."""

    area: np.ndarray
    squares: np.ndarray
    det: np.ndarray

    @property
    def good(self) -> np.ndarray:
        return np.isfinite(self.det) & (self.det > 0) & np.isfinite(self.squares)


def stretch(points: np.ndarray, uv: np.ndarray) -> Stretch:
    """points (t, 3, 3), uv (t, 3, 2)."""
    every = np.arange(3 * len(points)).reshape(-1, 3)
    squares, det, twice = distortion.derivatives(points.reshape(-1, 3), every, uv)
    return Stretch(0.5 * twice, squares, det)


def dirichlet(found: Stretch, scale: float | None = None) -> np.ndarray:
    """(t,) symmetric Dirichlet; inf where flipped. scale: of the map, the best one if not given."""
    s2 = best_scale(found) if scale is None else scale
    value = np.full(len(found.det), np.inf)
    good = found.good
    squares, det = found.squares[good], found.det[good]
    value[good] = (s2 * squares + squares / (det**2 * s2)) / 4
    value[~np.isfinite(found.det)] = np.nan
    return value


def best_scale(found: Stretch) -> float:
    """Square of the factor by which the map is scaled for its mean symmetric Dirichlet to be least."""
    good = found.good
    area, squares, det = found.area[good], found.squares[good], found.det[good]
    grown = float((area * squares).sum())
    shrunk = float((area * squares / det**2).sum())
    return np.sqrt(shrunk / grown) if grown > 0 and np.isfinite(shrunk) else 1.0


def angle(found: Stretch) -> np.ndarray:
    """(t,) largest over smallest singular value, 1 is conformal; inf where flipped."""
    value = np.full(len(found.det), np.inf)
    good = found.good
    half = found.squares[good] / (2 * found.det[good])
    value[good] = half + np.sqrt(np.maximum(half**2 - 1, 0))
    value[~np.isfinite(found.det)] = np.nan
    return value


def area(found: Stretch) -> np.ndarray:
    """(t,) area in the map over area on the surface, 1 on average; inf where flipped."""
    good = found.good
    mean = float(found.area[good] @ found.det[good]) / max(float(found.area[good].sum()), 1e-300)
    value = np.full(len(found.det), np.inf)
    value[good] = found.det[good] / mean if mean > 0 else 1.0
    value[~np.isfinite(found.det)] = np.nan
    return value


def density(found: Stretch, pixels: float) -> np.ndarray:
    """(t,) pixels per unit of the surface. pixels: of the texture to a side."""
    return np.sqrt(np.abs(found.det)) * pixels


def of_faces(values: np.ndarray, weights: np.ndarray, faces: np.ndarray) -> np.ndarray:
    """(t,) the mean of each one's face."""
    if not len(faces):
        return values
    known = np.where(np.isnan(values), 0.0, weights)
    total = np.bincount(faces, known)
    with np.errstate(invalid="ignore", divide="ignore"):
        mean = np.bincount(faces, np.where(known > 0, values, 0.0) * known) / total
    return mean[faces]


@dataclass
class Figures:
    """Weighted by area, over all finite values; percentiles as in PERCENTILES, infinite values counted in."""

    mean: float
    percentiles: tuple
    worst: float
    count: int


def figures(values: np.ndarray, weights: np.ndarray) -> Figures | None:
    known = ~np.isnan(values) & (weights > 0)
    values, weights = values[known], weights[known]
    if not len(values):
        return None
    finite = np.isfinite(values)
    mean = float(np.average(values[finite], weights=weights[finite])) if finite.any() else np.inf
    chosen = distortion.percentiles(values, weights, PERCENTILES)
    return Figures(mean, tuple(chosen), float(values.max()), len(values))


def shares(values: np.ndarray, weights: np.ndarray, bins: int) -> np.ndarray:
    """(bins,) part of the area whose value, 0 to 1 along the legend, lies in each; what lies beyond counts in the last ones."""
    known = np.isfinite(values) & (weights > 0)
    at = np.clip((values[known] * bins).astype(np.int64), 0, bins - 1)
    total = np.bincount(at, weights[known], bins)
    return total / max(float(total.sum()), 1e-300)


def orientation(uv: np.ndarray) -> np.ndarray:
    """(t,) sign of each triangle's area in the map (t, 3, 2) float32, exactly; 0 where a coordinate is no number."""
    values = uv.astype(np.float64)
    a, b = values[:, 1] - values[:, 0], values[:, 2] - values[:, 0]
    with np.errstate(invalid="ignore", over="ignore"):
        left, right = a[:, 0] * b[:, 1], a[:, 1] * b[:, 0]
        doubled = left - right
        unclear = ~(np.abs(doubled) > 1e-14 * (np.abs(left) + np.abs(right)))
    sign = np.sign(doubled).astype(np.int8)
    for i in np.flatnonzero(unclear).tolist():
        sign[i] = _exact_sign(uv[i]) if np.isfinite(uv[i]).all() else 0
    return sign


def _exact_sign(triangle: np.ndarray) -> int:
    (ax, ay), (bx, by), (cx, cy) = (tuple(Fraction(float(x)) for x in p) for p in triangle)
    doubled = (bx - ax) * (cy - ay) - (by - ay) * (cx - ax)
    return (doubled > 0) - (doubled < 0)
