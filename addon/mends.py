# SPDX-License-Identifier: GPL-3.0-or-later
"""What meshes were separated for (docs/method/unwrap.md), by place: for Select Mesh Defects and for records."""

from dataclasses import dataclass

import bpy
import numpy as np

from . import watch
from .meshes import mesh_io

# Of the last run; Select Mesh Defects asks for them.
_remembered: list["Mended"] = []


@dataclass
class Mended:
    """One kind of mend in one object. `elements` are ids of the Blender mesh, of the first thousand or so."""

    object_name: str
    what: str
    count: int
    kind: str  # "vertex", "edge" or "face"
    elements: np.ndarray
    counts: tuple = ()  # of the mesh that the ids belong to (mesh_io.counts)


def of_task(task) -> list[Mended]:
    found = []
    for judged in task.judged:
        for mend in judged.certificate.mends:
            snapshot = task.snapshot.whole or task.snapshot
            kind, ids = mesh_io.to_mesh_elements(snapshot, mend.kind, mend.elements)
            found.append(Mended(task.snapshot.object_name, mend.what, mend.count, kind, ids))
    return found


def remember(tasks: list) -> None:
    """Keeps what these tasks, already written, were mended for, until the next run. New vertices have new ids."""
    _remembered.clear()
    there = watch.objects_by_uid()
    for task in tasks:
        ob = there.get(task.object_uid)
        if ob is None or getattr(task, "new_vertices", 0):
            continue
        for mended in of_task(task):
            mended.object_name = ob.name
            mended.counts = task.snapshot.counts  # where faces were split, their ids are others now
            _remembered.append(mended)


def forget() -> None:
    _remembered.clear()


def there_are() -> bool:
    return bool(_remembered)


def places() -> list[tuple[bpy.types.Object, str, np.ndarray]]:
    """One (object, kind, ids) for each object that still is as it was; its vertices, where kinds are mixed."""
    by_object: dict[str, list[Mended]] = {}
    for mended in _remembered:
        by_object.setdefault(mended.object_name, []).append(mended)
    found = []
    for name, group in by_object.items():
        ob = bpy.data.objects.get(name)
        if ob is None or mesh_io.counts(ob) != group[0].counts:
            continue
        kinds = {mended.kind for mended in group}
        kind = kinds.pop() if len(kinds) == 1 else "vertex"
        ids = [
            mended.elements if mended.kind == kind else _vertices(ob, mended) for mended in group
        ]
        found.append((ob, kind, np.unique(np.concatenate(ids))))
    return found


def _vertices(ob, mended: Mended) -> np.ndarray:
    if ob.mode == "EDIT":
        ob.update_from_editmode()
    sequence = ob.data.edges if mended.kind == "edge" else ob.data.polygons
    return np.array([v for i in mended.elements.tolist() for v in sequence[i].vertices], np.int64)
