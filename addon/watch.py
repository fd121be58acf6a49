# SPDX-License-Identifier: GPL-3.0-or-later
"""Which meshes changed since one last looked: for what is kept about them between redraws (certificates, drawings).

stamp = watch.stamp(ob)          # compare with the one kept beside what was computed
"""

import bpy
from bpy.app import handlers

# Goes on beside all others.
LIVE = "UV_OT_flipfree_live_pins"

_state = {"everything": 0, "clock": 0}
_changed: dict[int, int] = {}  # session_uid of a mesh or object -> when


def _tick() -> int:
    _state["clock"] += 1
    return _state["clock"]


def uid(datablock) -> int:
    """The same for a datablock throughout the session, undo included; no other one has it."""
    return getattr(datablock, "session_uid", 0) or datablock.as_pointer()


def is_there(datablock) -> bool:
    """Whether it still exists: a script may have removed it since."""
    try:
        return bool(datablock.name or True)
    except ReferenceError:
        return False


def objects_by_name() -> dict[str, bpy.types.Object]:
    """As bpy.data.objects.get finds them, which searches them all for each: too long where a scene has thousands."""
    return {ob.name: ob for ob in reversed(bpy.data.objects.values())}


def objects_by_uid() -> dict[int, bpy.types.Object]:
    """By what stays when they are renamed."""
    return {uid(ob): ob for ob in bpy.data.objects}


def busy() -> bool:
    """Whether an operator is at work in some window: a transform that may still be cancelled, a solver."""
    for window in bpy.context.window_manager.windows:
        for operator in getattr(window, "modal_operators", ()):
            if operator is not None and operator.bl_idname != LIVE:
                return True
    return False


def stamp(ob: bpy.types.Object) -> tuple:
    """Differs once the object's mesh may have become another. Of objects that are not edited together."""
    latest = max(_changed.get(uid(ob), 0), _changed.get(uid(ob.data), 0))
    return uid(ob.data), ob.mode, _state["everything"], latest


@handlers.persistent
def forget_all(*_arguments) -> None:
    """Undo, redo, another file: any mesh may be another."""
    _changed.clear()
    _state["everything"] = _tick()


@handlers.persistent
def _note(_scene, depsgraph) -> None:
    for update in depsgraph.updates:
        if update.is_updated_geometry:
            _changed[uid(update.id.original)] = _tick()


_HANDLERS = (
    ("depsgraph_update_post", _note),
    ("undo_post", forget_all),
    ("redo_post", forget_all),
    ("load_post", forget_all),
)


def register() -> None:
    for name, function in _HANDLERS:
        getattr(handlers, name).append(function)


def unregister() -> None:
    for name, function in _HANDLERS:
        getattr(handlers, name).remove(function)
