"""Signs of determinants of floating-point numbers: doubles with a rigorous bound, then rational numbers."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from .rational import triangles_of, turn

Floats = npt.NDArray[np.float64]
Signs = npt.NDArray[np.int8]

# Shewchuk 1997, section 4.1: (3 + 16 e) e with e = 2^-53, rounded up.
_BOUND = 3.3306690738754731e-16


def turns(a: Floats, b: Floats, c: Floats) -> Signs:
    """Which way a, b, c (..., 2) turn, exactly: 1 left, -1 right, 0 straight."""
    a, b, c = np.broadcast_arrays(a, b, c)
    left = (a[..., 0] - c[..., 0]) * (b[..., 1] - c[..., 1])
    right = (a[..., 1] - c[..., 1]) * (b[..., 0] - c[..., 0])
    sign = np.sign(left - right).astype(np.int8)
    straight = _zero_factor(a, b, c, 0, 1) & _zero_factor(a, b, c, 1, 0)
    # Products that leave the normal range lose more than the relative bound says.
    clear = np.abs(left - right) > _BOUND * (np.abs(left) + np.abs(right)) + 1e-290
    open_ = ~clear & ~straight
    corners = triangles_of(np.stack([a[open_], b[open_], c[open_]], 1))
    sign[open_] = [(turn(*t) > 0) - (turn(*t) < 0) for t in corners]
    sign[straight] = 0
    return sign


def _zero_factor(a: Floats, b: Floats, c: Floats, i: int, j: int) -> npt.NDArray[np.bool_]:
    return (a[..., i] == c[..., i]) | (b[..., j] == c[..., j])


def flips(uv: npt.ArrayLike) -> int:
    """How many of the triangles (m, 3, 2) have no positive area."""
    points = np.asarray(uv).astype(np.float64)
    return int((turns(points[:, 0], points[:, 1], points[:, 2]) <= 0).sum())
