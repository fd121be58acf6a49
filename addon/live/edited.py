# SPDX-License-Identifier: GPL-3.0-or-later
"""UVs and pins of a mesh in Edit Mode, read and written in place: another operator may be at work on it meanwhile.

Python's first look at a loop gives every loop of the edited mesh room for a handle, and the last reference to that mesh takes it
away: both move all of their data elsewhere, under the hands of a transform. So it is held, from when nothing is at work on.
"""

from itertools import chain

import bmesh
import numpy as np


def held(ob):
    """The edited mesh, its loops looked at; while it is kept and `is_valid`, reading and writing move nothing."""
    bm = bmesh.from_edit_mesh(ob.data)
    for face in bm.faces:
        face.loops[0]  # noqa: B018
        break
    return bm


def read(ob, layer_name: str) -> tuple[np.ndarray, np.ndarray]:
    """((#loops, 2) float32 UVs, (#loops,) bool pins)."""
    bm = bmesh.from_edit_mesh(ob.data)
    layer = bm.loops.layers.uv[layer_name]
    found = [loop[layer] for face in bm.faces for loop in face.loops]
    uv = np.fromiter(chain.from_iterable(d.uv for d in found), np.float32, 2 * len(found))
    pinned = np.fromiter((d.pin_uv for d in found), bool, len(found))
    return uv.reshape(-1, 2), pinned


def write(ob, layer_name: str, values: np.ndarray, chosen: np.ndarray) -> None:
    """Stores values (#loops, 2) float32 at the loops of the mask `chosen`; nothing is allocated anew, so that a transform that
    is under way goes on."""
    bm = bmesh.from_edit_mesh(ob.data)
    layer = bm.loops.layers.uv[layer_name]
    uv, wanted = values.astype(np.float64).tolist(), chosen.tolist()
    index = 0
    for face in bm.faces:
        for loop in face.loops:
            if wanted[index]:
                loop[layer].uv = uv[index]
            index += 1
    bmesh.update_edit_mesh(ob.data, loop_triangles=False, destructive=False)
