# SPDX-License-Identifier: GPL-3.0-or-later
"""The last certificate of each UV map, for the sidebar; nothing of it is kept with the file.

A certificate speaks of values. So each is kept with a checksum of the mesh and the UVs that it was computed for: once these are
others, by whatever tool, it no longer holds; and it holds again once undo brings them back.
"""

import zlib
from dataclasses import dataclass

import bmesh
import numpy as np

from . import compat, records, watch
from .meshes import selection

# While larger meshes are edited, comparing them at each change would be felt.
_MOST_EDITED = 20_000
_MOST_KEPT = 256

_kept: dict[tuple, "Kept"] = {}  # by mesh and UV map
_sums: dict[tuple, tuple] = {}  # by mesh and UV map: (watch.stamp, checksum)


@dataclass(frozen=True)
class Kept:
    """figures: as in `--json` (records.of_task). faces: of the mesh that were worked on; of: how many it has. stacked_ok: islands
    lie on each other on purpose."""

    verb: str
    figures: dict
    stacked_ok: bool
    faces: int
    of: int
    checksum: int


def remember(tasks, verb: str):
    """Keeps what these tasks, already written, found; those without a certificate leave things as they are. A generator: of
    steps between which a window goes on."""
    there = watch.objects_by_uid()
    found = []
    for task in tasks:
        ob = there.get(task.object_uid)
        if ob is None or not task.judged or ob.data.uv_layers.active is None:
            continue
        found.append((task, _key(ob)))
        _kept.pop(found[-1][1], None)
    for task, key in found[-_MOST_KEPT:]:
        _kept.pop(key, None)
        seen = np.zeros(task.snapshot.counts[3], bool)
        for judged in task.judged:
            seen[judged.faces] = True
        figures = records.of_task(task, "", "")
        yield
        ob = there[task.object_uid]
        if not watch.is_there(ob) or ob.data.uv_layers.active is None or _key(ob) != key:
            continue
        with selection.whole_mesh(ob) as mesh:
            checksum = _sum_of(*_arrays(mesh))
        _kept[key] = Kept(
            verb,
            figures,
            getattr(task, "stacked_ok", False),
            int(np.count_nonzero(seen)),
            len(seen),
            checksum,
        )
        while len(_kept) > _MOST_KEPT:
            del _kept[next(iter(_kept))]
        yield


def of(ob) -> Kept | None:
    """The last one of the active UV map."""
    return None if ob.data.uv_layers.active is None else _kept.get(_key(ob))


def holds(ob, kept: Kept) -> bool | None:
    """Whether the mesh and its active UV map still are what was certified; None: too large to tell while it is edited, or
    another operator is at work on it, under whose hands looking at loops would move them (live/edited.py)."""
    if ob.mode == "EDIT" and (
        watch.busy() or len(bmesh.from_edit_mesh(ob.data).faces) > _MOST_EDITED
    ):
        return None
    key, stamp = _key(ob), watch.stamp(ob)
    known = _sums.get(key)
    if known is None or known[0] != stamp:
        _sums[key] = known = (stamp, _checksum(ob))
    return known[1] == kept.checksum


def forget() -> None:
    _kept.clear()
    _sums.clear()


def _key(ob) -> tuple:
    return watch.uid(ob.data), ob.data.uv_layers.active.name


def _checksum(ob) -> int:
    """Of positions, corners and the active UVs; the same in both modes. Changes nothing, so it may be called while drawing."""
    if ob.mode != "EDIT":
        return _sum_of(*_arrays(ob.data))
    bm = bmesh.from_edit_mesh(ob.data)
    layer = bm.loops.layers.uv[ob.data.uv_layers.active.name]
    bm.verts.index_update()
    loops = [loop for face in bm.faces for loop in face.loops]
    return _sum_of(
        np.array([v.co for v in bm.verts], np.float32),
        np.array([loop.vert.index for loop in loops], np.int32),
        np.array([loop[layer].uv for loop in loops], np.float32),
    )


def _arrays(mesh) -> tuple:
    return (
        compat.positions(mesh),
        compat.corner_vertices(mesh),
        compat.uv_values(mesh, mesh.uv_layers.active.name),
    )


def _sum_of(*arrays) -> int:
    total = 0
    for array in arrays:
        total = zlib.crc32(np.ascontiguousarray(array), total)
    return total
