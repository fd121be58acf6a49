"""How far a map is from the surface, triangle by triangle, and the stretch bound.

The energy of a triangle is (|J|^2 + |J^-1|^2) / 4, 1 where it is isometric. Its *stretch* s is what has this energy where areas
are kept: lengths along one direction s times those across, s + 1/s = 2 energy. Here both are measured at the scale that half
of the surface is above and half below: at the scale of the least mean, which the certificate's energy has, one island that is
crushed makes all others look stretched. So a map with a mean above the bound has triangles and islands above it here as well.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from . import _native

Array = npt.NDArray[Any]

#: As much as a map that is no warning stretches; automatic seams keep to it by default.
STRETCH_BOUND = 1.25
#: The energy of that stretch is 1.025; the rest is what one scale for all islands and 32 bits may cost.
BOUND_ENERGY = 1.03
#: What a checker shows: up to the bound squares; from there rectangles, 5 to 4; from stretch 2 on, which is the second energy,
#: pairs of squares.
LEVELS = ("fine", "stretched", "badly stretched")
_LEVEL_ENERGIES = (BOUND_ENERGY, 1.25)
#: Of the surface, by area: what is less than this together is too small to be seen.
_VISIBLE = 0.01
#: The same of single triangles, which automatic seams leave a hundredth of every island of.
_VISIBLE_TRIANGLES = 0.02
#: Height over longest side of a triangle that is a needle.
_NEEDLE = 1e-3

_MOST_ISLANDS = 100


def energies(vertices: Array, faces: Array, uv: Array, aspect: float = 1.0) -> tuple[Array, Array]:
    """((m,) energy, (m,) area on the surface) of the triangles of uv (m, 3, 2), whichever way they run there; those without
    area in the map have infinite energy. aspect: of the texture on which they are measured."""
    squares, mapped, twice = derivatives(vertices, faces, uv * np.array([aspect, 1.0]))
    with np.errstate(all="ignore"):
        inverse = squares / mapped**2  # |J^-1| = |J| / |det J|
        measured = np.isfinite(squares) & np.isfinite(inverse) & (twice > 0.0)
        # Each triangle's own: squares s^2 + inverse / s^2 is smallest at s^4 = inverse / squares.
        own = np.sqrt(inverse[measured] / squares[measured])
        scale = percentiles(own, twice[measured], (50,))[0] if len(own) else 1.0
        energy = (squares * scale + inverse / scale) / 4.0
    energy[~np.isfinite(energy)] = np.inf
    return energy, twice / 2.0


def derivatives(vertices: Array, faces: Array, uv: Array) -> tuple[Array, Array, Array]:
    """Of each triangle |J|^2, det J, and twice the area on the surface."""
    corner = np.asarray(vertices, np.float64)[faces]
    x, y = corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0]
    plane = np.asarray(uv, np.float64).reshape(-1, 3, 2)
    u, v = plane[:, 1] - plane[:, 0], plane[:, 2] - plane[:, 0]
    with np.errstate(all="ignore"):
        twice = np.linalg.norm(np.cross(x, y), axis=1)
        mapped = u[:, 0] * v[:, 1] - u[:, 1] * v[:, 0]
        # |J|^2 is a ratio of dot products and areas (Pinkall and Polthier 1993).
        squares = _dot(u, u) * _dot(y, y) - 2.0 * _dot(u, v) * _dot(x, y) + _dot(v, v) * _dot(x, x)
        return squares / twice**2, mapped / twice, twice


def percentiles(values: Array, weights: Array, shares: Sequence[int]) -> list[float]:
    """Of values that weigh something together."""
    order = np.argsort(values, kind="stable")
    total = np.cumsum(weights[order])
    places = np.searchsorted(total, [total[-1] * share / 100 for share in shares])
    return [float(values[order[min(int(at), len(order) - 1)]]) for at in places]


def _dot(a: Array, b: Array) -> Array:
    return np.asarray(np.einsum("ij,ij->i", a, b))


def needles(vertices: Array, faces: Array, energy: Array) -> int:
    """How many triangles of the surface are as thin as needles and badly stretched: merging what is at one place ends them."""
    badly = energy > _LEVEL_ENERGIES[1]
    corner = np.asarray(vertices, np.float64)[faces[badly]]
    sides = np.roll(corner, -1, axis=1) - corner
    with np.errstate(all="ignore"):
        longest = np.einsum("tij,tij->ti", sides, sides).max(axis=1, initial=0.0)
        twice = np.linalg.norm(np.cross(sides[:, 0], sides[:, 1]), axis=1)
    return int(np.count_nonzero((twice > 0.0) & (twice < _NEEDLE * longest)))


@dataclass(frozen=True)
class Stretched:
    """share: of the surface, by area, whose triangles are above the bound; islands: (k,) a face of each island whose own mean is,
    the worst first, at most 100; level: an index of LEVELS."""

    share: float
    islands: npt.NDArray[np.int32]
    level: int


def level_of(mean: float) -> int:
    """Of a map's mean energy alone."""
    return sum(not mean <= bound for bound in _LEVEL_ENERGIES)


def stretched(faces: Array, uv: Array, energy: Array, area: Array, mean: float) -> Stretched:
    """Of a map of this mean energy. What is stretched is as its worst part that can be seen: the mean; its islands; triangles,
    which are a level lower, as around every cone some are stretched."""
    whole = float(area.sum())
    share = float(area[energy > BOUND_ENERGY].sum()) / whole if whole > 0.0 else 0.0
    if not share > 0.0:
        return Stretched(share, np.zeros(0, np.int32), level_of(mean))
    label = _native.islands(faces, np.asarray(uv, np.float32).reshape(-1, 2))[0]
    counted = area > 0.0
    size = np.bincount(label, area, len(label))
    with np.errstate(all="ignore"):
        sums = np.bincount(label[counted], (energy * area)[counted], len(label))
        means = np.where(size > 0.0, sums / size, 0.0)
    level = level_of(mean)
    for k, bound in enumerate(_LEVEL_ENERGIES, start=1):
        if size[means > bound].sum() > _VISIBLE * whole:
            level = max(level, k)
    if area[energy > _LEVEL_ENERGIES[1]].sum() > _VISIBLE_TRIANGLES * whole:
        level = max(level, 1)
    found = np.flatnonzero(means > BOUND_ENERGY)
    worst = found[np.argsort(-means[found], kind="stable")]
    return Stretched(share, worst[:_MOST_ISLANDS].astype(np.int32), level)
