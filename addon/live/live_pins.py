# SPDX-License-Identifier: GPL-3.0-or-later
"""Live Pins: maps follow their pins while these are moved by whatever tool, until Esc or the operator again.

    bpy.app.timers --tick--> Session: looks, starts jobs, writes        window timer --> operator: reports the end

The first goes on while a transform has the window's events, the second does not.
"""

import bpy

from .. import aspect, errors, watch
from ..meshes import mesh_io
from ..operators import common
from ..runs import processes
from . import following

# All meshes together: reading and writing so many takes a tenth of a second at most.
MOST_TRIANGLES = 20_000
_INTERVAL = 0.05  # seconds

_current: list["Session"] = []  # at most one


class Session:
    """What Live Pins follows, from its start to its end."""

    def __init__(self, objects: list, *, texture=1.0):
        """texture: its width over its height. Raises MeshProblem: nothing to follow, or too much of it."""
        self.followed: list[following.Followed] = []
        self.ended = False
        self.ending = False
        self.lost = ""  # why it ended by itself
        self._unsaved = False  # something was written after the last undo step
        self._shown = ""
        with_map = [ob for ob in objects if ob.data.uv_layers.active is not None]
        for ob in with_map:
            self.followed.append(following.Followed(ob, aspect=texture))
        triangles = sum(len(one.snapshot.triangles) for one in self.followed)
        if triangles > MOST_TRIANGLES:
            raise mesh_io.MeshProblem(
                f"{common.plural(triangles, 'triangle')} are too many to follow their pins while these are moved: at most "
                f"{MOST_TRIANGLES}. Auto Unwrap keeps pins too, and Match Pins meets them, once they are where they belong"
            )
        self.process = processes.of(self.followed)
        for one in self.followed:
            one.process = self.process

    @property
    def unsaved(self) -> bool:
        return self._unsaved

    @property
    def problem(self) -> str:
        return next((one.problem for one in self.followed if one.problem), "")

    @property
    def updates(self) -> int:
        return sum(one.updates for one in self.followed)

    def tick(self, at_rest: bool) -> None:
        """Never waits for the solver. at_rest: no other operator moves anything."""
        there = {watch.uid(ob): ob for ob in bpy.data.objects}
        for one in self.followed:
            ob = there.get(one.uid)
            if ob is None or ob.mode != "EDIT" or ob.data.uv_layers.active is None:
                self._restore(there)
                self._end(f"{one.name} is no longer edited")
                return
            try:
                if one.tick(ob, at_rest):
                    self._unsaved = at_rest
            except mesh_io.MeshProblem as problem:
                self._end(str(problem))
                return
        if self.ending and at_rest and all(one.idle for one in self.followed):
            self._end(self._restore(there))

    def _restore(self, there: dict) -> str:
        """Puts back what is not met; what was, "" for nothing."""
        problem = self.problem
        for one in self.followed:
            if one.uid in there and one.restore(there[one.uid]):
                self._unsaved = True
        return f"{problem}. They were put back to where they last could be" if problem else ""

    def text(self) -> str:
        """For status bar and sidebar."""
        if self.problem:
            return f"{self.problem}: the last good map stays"
        if not all(one.idle for one in self.followed):
            return "following the pins ..."
        if not any(one.pinned.any() for one in self.followed):
            return "no UV is pinned yet: pin some with P and move them"
        return f"{common.plural(self.updates, 'update')}, all pins met"

    def stop(self) -> None:
        """Ends once what was begun is done."""
        self.ending = True

    def _end(self, why: str = "") -> None:
        self.lost = why
        self.close()

    def close(self) -> None:
        for one in self.followed:
            one.close()
        if self.process is not None:
            self.process.close()
        self.ended = True

    def show(self, at_rest: bool) -> None:
        """In the status bar, unless another operator needs it, and in the sidebars."""
        text = f"Live Pins: {self.text()}   [Esc] end" if at_rest else ""
        if text == self._shown:
            return
        self._shown = text
        for window in bpy.context.window_manager.windows:
            if text:
                window.workspace.status_text_set(text)
            for area in window.screen.areas:
                for region in area.regions:
                    if region.type == "UI":
                        region.tag_redraw()


def current() -> Session | None:
    return _current[0] if _current and not _current[0].ended else None


def _tick() -> float | None:
    session = current()
    if session is None:
        return None
    at_rest = not watch.busy()
    try:
        session.tick(at_rest)
    except BaseException:  # a mistake of ours: Blender goes on without it
        session.close()
        raise
    session.show(at_rest)
    return _INTERVAL


class UV_OT_flipfree_live_pins(bpy.types.Operator):
    bl_idname = "uv.flipfree_live_pins"
    bl_label = "Live Pins"
    bl_description = (
        "While pinned UVs are moved, by whatever tool, their islands follow at once and without flips, until Esc or a second "
        "call. Of small meshes, in Edit Mode"
    )
    bl_options = {"UNDO"}

    @classmethod
    def poll(cls, context):
        if current() is not None:
            return True
        return common.allowed(
            cls, context.mode == "EDIT_MESH", "Works in Edit Mode of meshes"
        ) and common.poll(cls, context, needs_uv=True)

    def execute(self, context):
        session = current()
        if session is not None:
            session.stop()
            return {"CANCELLED"}  # the first call reports, and makes the undo step
        if bpy.app.background:
            errors.complain(self, "Without a window nobody moves pins. Use Match Pins")
            return {"CANCELLED"}
        try:
            self._session = Session(common.meshes(context), texture=aspect.active(context))
        except mesh_io.MeshProblem as problem:
            errors.complain(self, str(problem))
            return {"CANCELLED"}
        _current[:] = [self._session]
        bpy.app.timers.register(_tick, first_interval=0.0)
        manager = context.window_manager
        self._timer = manager.event_timer_add(_INTERVAL, window=context.window)
        manager.modal_handler_add(self)
        return {"RUNNING_MODAL"}

    def modal(self, context, event):
        if event.type == "ESC" and event.value == "PRESS" and not self._session.ended:
            self._session.stop()
            return {"RUNNING_MODAL"}
        if event.type != "TIMER" or not self._session.ended:
            return {"PASS_THROUGH"}
        self._stop_showing(context)
        session = self._session
        text = f"Live Pins ended: {common.plural(session.updates, 'update')}"
        if session.lost:
            self.report({"WARNING"}, f"{text}. {session.lost}")
        else:
            self.report({"INFO"}, text)
        # What was written while pins moved is part of the steps of what moved them.
        return {"FINISHED"} if session.unsaved else {"CANCELLED"}

    def cancel(self, context):
        """Blender ends the operator: a file is loaded, or Blender quits."""
        self._session.close()
        self._stop_showing(context)

    def _stop_showing(self, context):
        context.window_manager.event_timer_remove(self._timer)
        for window in context.window_manager.windows:
            window.workspace.status_text_set(None)


def close() -> None:
    """For unregister: neither timer nor solver thread outlives the extension."""
    if _current:
        _current.pop().close()
    if bpy.app.timers.is_registered(_tick):
        bpy.app.timers.unregister(_tick)
