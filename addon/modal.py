# SPDX-License-Identifier: GPL-3.0-or-later
"""One driver for every operator that solves: reads all objects, solves them one after the other, writes at the end.

                 invoke (window)                             execute (redo panel, scripts, background)
                    |  timer, 10 per second                      |  waits
                    v                                            v
    make_tasks -> Run.advance() ... -> Run.writing() ... -> report, undo step

Meshes are written only after the last solver has ended, so Esc leaves every one of them as it was. Return takes each map as
it is then, or as soon as there is one. Writing itself takes several ticks where a mesh is large; it cannot be cancelled, and
whatever else ends it leaves no mesh half written.
"""

import time

import bpy

from . import certificates, errors, mends
from .meshes import mesh_io
from .runs.run import MOMENT, Pause, Run, StagedTask, Task, close_all, live_runs

__all__ = ["Pause", "Run", "SolverOperator", "StagedTask", "Task", "close_all", "live_runs"]


def paused(steps):
    """A generator's steps as stages of a task, each of which may be a tick's; its result."""
    while True:
        try:
            next(steps)
        except StopIteration as end:
            return end.value
        yield Pause()


_INTERVAL = 0.1  # seconds between looks at the solver
# Navigating stays possible while solving; everything else waits, so the mesh cannot change
# meanwhile.
_NAVIGATION = {
    "MIDDLEMOUSE",
    "WHEELUPMOUSE",
    "WHEELDOWNMOUSE",
    "WHEELINMOUSE",
    "WHEELOUTMOUSE",
    "TRACKPADPAN",
    "TRACKPADZOOM",
    "MOUSEROTATE",
    "MOUSESMARTZOOM",
    "NDOF_MOTION",
}
_ACCEPT = {"RET", "NUMPAD_ENTER"}


class SolverOperator:
    """Mixin for bpy.types.Operator: subclasses give `make_run(context)` and `summary(tasks)`."""

    # Name in the status bar, e.g. "Unwrap".
    verb = "Solve"
    # Of a run that has ended: what is left to write and to report (_conclude).
    _conclusion = None

    def make_run(self, context) -> Run:
        """One task per object; raises MeshProblem if the selection cannot be worked on."""
        raise NotImplementedError

    def summary(self, tasks: list[Task]) -> str:
        """The report line for tasks that were written."""
        raise NotImplementedError

    def hint(self, tasks: list[Task]) -> str:
        """What would do better, although all is well; "" if nothing is known."""
        return ""

    def advice(self, tasks: list[Task]) -> str:
        """What to do where a result is valid but not good; the report is a warning then. "" if all is well."""
        return ""

    # -- blocking: scripts, redo panel, background
    # ---------------------------------------------------------
    def execute(self, context):
        run = self._start(context)
        if run is None:
            return {"CANCELLED"}
        manager = context.window_manager
        quiet = bpy.app.background
        if not quiet:
            manager.progress_begin(0, 100)
        try:
            while not run.advance(_INTERVAL):
                if not quiet:
                    manager.progress_update(int(100 * run.progress()[1]))
        except BaseException:  # a keyboard interrupt in a script
            run.close()
            raise
        finally:
            if not quiet:
                manager.progress_end()
        return self._concluded(run)

    # -- modal: menus
    # --------------------------------------------------------------------------------------
    def invoke(self, context, event):
        if bpy.app.background:
            return self.execute(context)
        self._run = self._start(context)
        if self._run is None:
            return {"CANCELLED"}
        # Small meshes are done at once, without a flicker in the status bar.
        if self._run.advance(0.15):
            self._conclusion = self._conclude(self._run)
            status = self._go_on()
            if status is not None:
                return status
        self._timer = context.window_manager.event_timer_add(_INTERVAL, window=context.window)
        context.window_manager.modal_handler_add(self)
        self._show_progress(context)
        return {"RUNNING_MODAL"}

    def modal(self, context, event):
        if event.value == "PRESS" and self._conclusion is None:
            if event.type == "ESC":
                self._run.cancel()
            if event.type in _ACCEPT:
                self._run.accept()
        if event.type in _NAVIGATION:
            return {"PASS_THROUGH"}
        if event.type != "TIMER":
            return {"RUNNING_MODAL"}
        try:
            if self._conclusion is None and self._run.advance(0.0):
                self._conclusion = self._conclude(self._run)
            status = self._go_on()
        except BaseException:  # a mistake of ours: Blender would go on calling the timer
            self.cancel(context)
            raise
        if status is None:
            self._show_progress(context)
            return {"RUNNING_MODAL"}
        self._stop_showing(context)
        return status

    def _go_on(self) -> set[str] | None:
        """A moment's work of writing and reporting; what the operator returns, once all is done."""
        if self._conclusion is None:
            return None
        begin = time.perf_counter()
        try:
            next(self._conclusion)
            while time.perf_counter() - begin < MOMENT:
                next(self._conclusion)
        except StopIteration as end:
            return end.value
        return None

    def cancel(self, context):
        """Blender ends the operator: a file is loaded, or Blender quits."""
        if self._conclusion is not None:
            self._conclusion.close()  # what is half written goes back
        self._run.close()
        self._stop_showing(context)

    def _show_progress(self, context):
        text, fraction = self._run.progress()
        hint = "[Esc] cancel  [Return] take it as it is"
        if self._conclusion is not None:
            text, hint = "", "writing ..."
        elif self._run.cancelled:
            hint = "stopping ..."
        elif self._run.accepted:
            hint = "[Esc] cancel  taking the map as it is ..."
        context.workspace.status_text_set(f"{self.verb}  {100 * fraction:.0f} %   {text}   {hint}")

    def _stop_showing(self, context):
        context.window_manager.event_timer_remove(self._timer)
        context.workspace.status_text_set(None)

    # -- both
    # ----------------------------------------------------------------------------------------------
    def _start(self, context) -> Run | None:
        errors.remember([])
        mends.forget()
        try:
            return self.make_run(context)
        except mesh_io.MeshProblem as problem:
            errors.complain(self, str(problem))
            return None

    def _concluded(self, run: Run) -> set[str]:
        conclusion = self._conclude(run)
        while True:
            try:
                next(conclusion)
            except StopIteration as end:
                return end.value

    def _conclude(self, run: Run):
        """Writes the results and reports, in steps as Run.writing(); returns what the operator does."""
        if run.cancelled:
            self.report({"INFO"}, "Cancelled. Nothing was changed")
            return {"CANCELLED"}
        yield from run.writing()
        seconds = time.perf_counter() - run.started
        if run.failures:
            self._report_failures(run.failures, written=bool(run.done))
        if not run.done:
            return self._refused(run.failures)
        mends.remember(run.done)
        yield
        yield from certificates.remember(run.done, self.verb)
        text = f"{self.summary(run.done)}, {seconds:.2f} s"
        yield
        if run.ended_early:
            text += ", accepted early"
        if run.solved_here:
            text += ", solved inside Blender as no process could be started for it"
        advice = self.advice(run.done)
        text = ". ".join(filter(None, [text, advice, self.hint(run.done)]))
        self.report({"WARNING"} if advice else {"INFO"}, text)
        return {"FINISHED"}

    def _refused(self, failures) -> set[str]:
        """Where an option of ours would help, the redo panel has to show it, and Blender shows that of finished operators only:
        nothing was changed, but it counts as one. Scripts get an exception in either case."""
        if bpy.app.background:
            return {"CANCELLED"}
        properties = self.properties.bl_rna.properties
        names = [properties[name].name for name in getattr(self, "option_names", ())]
        helps = any(name in str(f) for name in (*names, "redo panel") for f in failures)
        return {"FINISHED"} if helps else {"CANCELLED"}

    def _report_failures(self, failures, written: bool):
        """Says what failed; the selection stays. With results for other objects it is a warning: an error would make the
        whole call fail for scripts."""
        text = "\n".join(str(f) for f in failures)
        if errors.remember(failures):
            text += f". {errors.HINT}"
        if written:
            self.report({"WARNING"}, text)
        else:
            errors.complain(self, text)
