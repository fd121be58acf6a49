# SPDX-License-Identifier: GPL-3.0-or-later
"""UVs into a mesh in Edit Mode, which Python reaches loop by loop only: seconds for a million faces, so a slice at a time.

A slice may come a tick after the one before. Whatever ends the writing before its end, a mesh that has become another one or
a file that is closed, takes back what was written.
"""

import contextlib

import bmesh
import numpy as np

from ... import compat

# Faces of a slice: some hundredths of a second.
_SLICE = 20_000


def writing(ob, snapshot, loops, values, new_seams, changed: Exception):
    """mesh_io.writing_uv() of a mesh in Edit Mode. changed: raised if it is no longer the one that was read."""
    bm = bmesh.from_edit_mesh(ob.data)
    starts = yield from _starts(ob, bm, snapshot, changed)
    name = snapshot.layer_name or bm.loops.layers.uv.new("UVMap").name
    row = np.full(snapshot.counts[2], -1, dtype=np.int64)
    row[loops] = np.arange(len(loops))
    try:
        for first in range(0, len(starts) - 1, _SLICE):
            _store(bm, name, starts, row, values, first)
            yield
            if not _unchanged(ob, bm, snapshot, name):
                raise changed
    except BaseException:  # closed by its user among them
        with contextlib.suppress(ReferenceError):  # the object is no longer there
            _take_back(ob, bm, name, starts, row, snapshot, loops)
        raise
    if new_seams is not None and len(new_seams):
        bm.edges.ensure_lookup_table()
        for edge in new_seams.tolist():
            bm.edges[edge].seam = True
    bmesh.update_edit_mesh(ob.data, loop_triangles=False, destructive=False)


def _take_back(ob, bm, name, starts, row, snapshot, loops) -> None:
    """To what was read, if it still is the same mesh."""
    old = snapshot.uv[loops]
    if _unchanged(ob, bm, snapshot, name):
        for first in range(0, len(starts) - 1, _SLICE):
            _store(bm, name, starts, row, old, first)
        if not snapshot.layer_name:
            bm.loops.layers.uv.remove(bm.loops.layers.uv[name])
        bmesh.update_edit_mesh(ob.data, loop_triangles=False, destructive=False)
    elif ob.mode != "EDIT" and len(ob.data.loops) == len(snapshot.uv):
        layer = ob.data.uv_layers.get(name)
        if layer is None:
            return
        if not snapshot.layer_name:
            ob.data.uv_layers.remove(layer)
            return
        stored = compat.uv_values(ob.data, name)
        stored[loops] = old
        compat.set_uv_values(ob.data, name, stored)
        ob.data.update()


def _starts(ob, bm, snapshot, changed):
    """(#faces + 1,) the first loop of each face."""
    if not _unchanged(ob, bm, snapshot, snapshot.layer_name):
        raise changed
    sizes = []
    bm.faces.ensure_lookup_table()
    for first in range(0, len(bm.faces), 4 * _SLICE):
        sizes += [len(face.loops) for face in bm.faces[first : first + 4 * _SLICE]]
        yield
        if not _unchanged(ob, bm, snapshot, snapshot.layer_name):
            raise changed
    starts = np.append(0, np.cumsum(np.array(sizes, np.int64)))
    if int(starts[-1]) != snapshot.counts[2]:
        raise changed
    return starts


def _unchanged(ob, bm, snapshot, name: str) -> bool:
    """Whether it still is the mesh that was read, with a UV map of this name ("" for any)."""
    vertices, edges, _, faces = snapshot.counts
    if ob.mode != "EDIT" or not bm.is_valid:
        return False
    if name and bm.loops.layers.uv.get(name) is None:
        return False
    return (len(bm.verts), len(bm.edges), len(bm.faces)) == (vertices, edges, faces)


def _store(bm, name, starts, row, values, first) -> None:
    """The UVs of one slice of faces."""
    layer = bm.loops.layers.uv[name]  # each time: others may come and go between two slices
    bm.faces.ensure_lookup_table()
    last = min(first + _SLICE, len(starts) - 1)
    # Lists of Python numbers are read several times faster than numpy rows.
    rows = row[starts[first] : starts[last]]
    wanted = np.flatnonzero(rows >= 0)
    if not len(wanted):
        return
    uv = np.zeros((len(rows), 2))
    uv[wanted] = values[rows[wanted]]
    uv, chosen = uv.tolist(), (rows >= 0).tolist()
    index = 0
    for k in range(first, last):
        for loop in bm.faces[k].loops:
            if chosen[index]:
                loop[layer].uv = uv[index]
            index += 1
