# SPDX-License-Identifier: GPL-3.0-or-later
"""Reads what is shown, outside of drawing: a timer, while anything is switched on, looks ten times a second for meshes that
changed and have come to rest. No reference to Blender's data lives from one look to the next.
"""

from dataclasses import dataclass

import bpy

import flipfree

from .. import aspect, scene, texture, watch
from ..meshes import mesh_io
from . import faces, faults, field, legend, marks, reading, shapes, state

_INTERVAL = 0.1  # seconds
_MOST_TRIANGLES = 4_000_000
_MARKS = {
    "cones": marks.draw_cones,
    "field": field.draw,
    "seams": marks.draw_seams,
    "pins": marks.draw_pins,
}


@dataclass
class Entry:
    """What is drawn of an object. batches: of the GPU, made by the callbacks when they first want them."""

    name: str
    stamp: tuple
    drawing: shapes.Drawing
    batches: dict | None = None
    job: object = None
    snapshot: mesh_io.Snapshot | None = None


entries: dict[int, Entry] = {}  # by watch.uid of the object
_seen: dict[int, tuple] = {}  # the stamp at the last look
_shown = {"legend": legend.Legend(), "reads": 0}


def current_legend() -> legend.Legend:
    return _shown["legend"]


def reads() -> int:
    """How many meshes were read so far; for tests."""
    return _shown["reads"]


def start() -> None:
    if not bpy.app.timers.is_registered(_look):
        bpy.app.timers.register(_look, first_interval=0.0, persistent=True)


def stop() -> None:
    if bpy.app.timers.is_registered(_look):
        bpy.app.timers.unregister(_look)
    for entry in entries.values():
        _end(entry)
    entries.clear()
    _seen.clear()
    _shown["legend"] = legend.Legend()


def objects() -> dict[int, bpy.types.Object]:
    """What is drawn: selected mesh objects and the active one of all windows, by watch.uid."""
    found = {}
    for window in bpy.context.window_manager.windows:
        layer = window.view_layer
        for ob in (*layer.objects.selected, layer.objects.active):
            if ob is not None and ob.type == "MESH" and ob.visible_get(view_layer=layer):
                found[watch.uid(ob)] = ob
    return found


def _look() -> float:
    if not watch.busy():
        look()
    return _INTERVAL


def look(*, at_once: bool = False) -> None:
    """Brings `entries` up to date. at_once: without waiting for meshes to come to rest."""
    shown = objects()
    changed = False
    for uid in entries.keys() - shown.keys():
        _end(entries.pop(uid))
        changed = True
    for uid, ob in shown.items():
        stamp = (*watch.stamp(ob), *_looks(ob), state.current.version)
        rests, _seen[uid] = _seen.get(uid) == stamp, stamp
        entry = entries.get(uid)
        if (entry is None or entry.stamp != stamp) and (rests or at_once or entry is None):
            if entry is not None:
                _end(entry)
            entries[uid] = _read(ob, stamp)
            changed = True
        changed |= _collect(entries[uid])
    if changed:
        _shown["legend"] = legend.of([e.drawing for e in entries.values()], state.current.faces)
        for entry in entries.values():
            entry.batches = None
        redraw()


def _looks(ob) -> tuple:
    """What else than the mesh decides how it is drawn."""
    layer = ob.data.uv_layers.active
    seen = (aspect.shown(ob), texture.size()) if state.current.faces in faces.SCALES else ()
    return layer.name if layer else "", scene.matrix(ob).tobytes(), *seen


def _read(ob, stamp) -> Entry:
    _shown["reads"] += 1
    drawing = shapes.Drawing()
    entry = Entry(ob.name, stamp, drawing)
    if len(ob.data.loops) > 3 * _MOST_TRIANGLES:
        drawing.notes.append((faults.FLIPPED, f"{ob.name} is too large to be drawn over"))
        return entry
    with reading.reading(ob) as read:
        if state.current.faces in faces.SCALES:
            faces.draw(read, drawing)
        for name in sorted(state.current.marks):
            _MARKS[name](read, drawing)
        if state.current.faces == "faults":
            _start_faults(read, entry)
    return entry


def _start_faults(read, entry: Entry) -> None:
    if not read.layer:
        entry.drawing.notes.append((faces.UNKNOWN, f"{entry.name} has no UV map"))
        return
    try:
        entry.snapshot = read.snapshot()
        entry.job = faults.start(entry.snapshot)
    except (mesh_io.MeshProblem, flipfree.FlipfreeError) as problem:
        entry.drawing.notes.append((faults.FLIPPED, str(problem)))


def _collect(entry: Entry) -> bool:
    """Takes the certificate once it is there; whether it is."""
    if entry.job is None or not entry.job.wait(0.0):
        return False
    job, entry.job = entry.job, None
    try:
        found = faults.collect(entry.snapshot, job.result())
        faults.draw(entry.snapshot, found, entry.drawing)
    except flipfree.FlipfreeError as problem:
        entry.drawing.notes.append((faults.FLIPPED, str(problem)))
    entry.snapshot = None
    return True


def _end(entry: Entry) -> None:
    """No solver thread outlives what wanted it."""
    if entry.job is not None:
        entry.job.cancel()
        entry.job.wait(10.0)
        entry.job = None


def redraw() -> None:
    for window in bpy.context.window_manager.windows:
        for area in window.screen.areas:
            if area.type in ("VIEW_3D", "IMAGE_EDITOR"):
                area.tag_redraw()
