"""Vertices where faces touch only in a point, separated: for user interfaces that cut faces out of a mesh."""

from __future__ import annotations

from typing import Any

import numpy as np

from .. import _native
from ..arrays import as_indices
from ..job import ours_only
from ..results import IntArray


@ours_only
def split_fans(faces: Any, *, cuts: Any = None) -> tuple[IntArray, IntArray]:
    """Renumbers triangles so that every fan of edge-connected triangles around a point has a vertex of its own.

    Args:
        faces: (m, 3). All triangles of an edge count as connected, however many they are and whichever way they run.
        cuts: (s, 2) vertex pairs; these edges connect nothing. Pairs that are no edge are ignored.

    Returns:
        (faces (m, 3) over the new vertices, (n,) the old vertex of each). Vertices keep their order, fans of one vertex
        the order of their first triangles; vertices without triangles are left out. Linear, 0.1 s for two million triangles.
    """
    pairs = np.zeros((0, 2), np.int32) if cuts is None else as_indices(cuts, "cuts", 2)
    triangles, origin = _native.split_fans(as_indices(faces, "faces", 3), pairs)
    return triangles, origin
