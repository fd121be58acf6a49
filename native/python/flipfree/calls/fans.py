"""What belongs together in a mesh and in its map: for user interfaces, which cut faces out of meshes and move islands."""

from __future__ import annotations

from typing import Any

import numpy as np

from .. import _native
from ..arrays import as_corner_uv, as_indices
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


@ours_only
def islands(faces: Any, uv: Any = None) -> tuple[IntArray, int]:
    """Which faces make an island: those that share an edge and the UVs at both its ends, bit for bit as 32-bit floats.

    Args:
        faces: (m, 3), any triangles, whichever way they run. uv: (m, 3, 2), one per face corner; None: a common edge is enough.

    Returns:
        ((m,) the smallest face of each face's island, how many edges have sides that differ in the last bits only, which were
        never meant to be cuts). Linear, 0.2 s for two million triangles.
    """
    triangles = as_indices(faces, "faces", 3)
    places = None
    if isinstance(uv, np.ndarray) and uv.dtype == np.float32 and uv.shape == (*triangles.shape, 2):
        places = uv.reshape(-1, 2)  # of a million faces the way through doubles would be felt
    elif uv is not None:
        with np.errstate(over="ignore"):  # beyond 32 bits: infinite, as it would be stored
            places = as_corner_uv(uv, "uv", len(triangles)).astype(np.float32)
    first, nearly_joined = _native.islands(triangles, places)
    return first, nearly_joined
