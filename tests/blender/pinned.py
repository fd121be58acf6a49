# SPDX-License-Identifier: GPL-3.0-or-later
"""Sheets with pins in Edit Mode, for tests and benchmarks of Live Pins."""

import bmesh
import bpy
import numpy as np
import shapes


def edited(ob):
    shapes.activate(ob)
    bpy.ops.object.mode_set(mode="EDIT")
    return ob


def corners(n):
    """Loops at the four corners of shapes.grid(n)."""
    return [v for v in (0, n, n * (n + 1), (n + 1) ** 2 - 1)]


def pinned_grid(n=8):
    """Unwrapped, its four corners pinned, in Edit Mode; the loops of each of these."""
    ob = shapes.grid(n, uv=True)
    assert bpy.ops.uv.flipfree_unwrap() == {"FINISHED"}
    vertex = shapes.corners(ob)
    at = [np.flatnonzero(vertex == v) for v in corners(n)]
    shapes.set_pins(ob, np.concatenate(at))
    return edited(ob), at


def move(ob, loops, to):
    """As a transform does: only these UVs."""
    bm = bmesh.from_edit_mesh(ob.data)
    layer = bm.loops.layers.uv.active
    chosen = set(np.asarray(loops).tolist())
    every = (loop for face in bm.faces for loop in face.loops)
    for index, loop in enumerate(every):
        if index in chosen:
            loop[layer].uv = to
    bmesh.update_edit_mesh(ob.data)
    bpy.context.view_layer.update()
