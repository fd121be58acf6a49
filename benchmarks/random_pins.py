"""Pins at random: vertices of a surface, each with a place."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

Pins = dict[int, tuple[float, float]]


def pinned(ids: npt.NDArray[np.integer], places: npt.NDArray[np.float64]) -> Pins:
    """Vertex ids (k,) with places (k, 2), as ff.match takes them."""
    return {int(v): (float(p[0]), float(p[1])) for v, p in zip(ids, places, strict=True)}


def pins_in_square(ids: npt.NDArray[np.integer], count: int, random: np.random.Generator) -> Pins:
    """`count` of the vertices, at places in the unit square."""
    chosen = random.choice(ids, count, replace=False)
    return pinned(chosen, random.random((count, 2)))
