# SPDX-License-Identifier: GPL-3.0-or-later
"""From UVs per triangle corner to one per loop, as meshes store them."""

import numpy as np


def steps(snapshot, corner_uv: np.ndarray):
    """(loops, float32 value (k, 2) of each, rows of the flat corner_uv whose loop has another value elsewhere). A generator: in
    steps between which a window goes on."""
    values = np.ascontiguousarray(corner_uv, dtype=np.float32).reshape(-1, 2)
    at = snapshot.triangle_loops.ravel()
    # Both numbers of a UV as one: several times faster.
    bits = values.view(np.uint64).ravel()
    stored = np.zeros(len(snapshot.uv), np.uint64)
    stored[at] = bits
    yield
    used = np.zeros(len(stored), bool)
    used[at] = True
    loops = np.flatnonzero(used)
    yield
    uv = stored.view(np.float32).reshape(-1, 2)
    other = np.flatnonzero(bits != stored[at])
    torn = other[(values[other] != uv[at[other]]).any(axis=1)]  # zeros of either sign are one place
    return loops, uv if len(loops) == len(uv) else uv[loops], torn
