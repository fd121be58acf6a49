# SPDX-License-Identifier: GPL-3.0-or-later
"""One driver for every operator that solves: reads all objects, solves them one after the other, writes at the end.

                 invoke (window)                             execute (redo panel, scripts, background)
                    |  timer, 10 per second                      |  waits
                    v                                            v
    make_run ... -> Run.advance() ... -> Run.writing() ... -> report, undo step

Reading a large mesh takes several ticks, too. Meshes are written only after the last solver has ended, so Esc leaves every one
of them as it was. Return takes each map as it is then, or as soon as there is one. Writing takes several ticks where a mesh is
large; it cannot be cancelled, and whatever else ends it leaves no mesh half written.
"""

import inspect
import time

import bpy

from . import certificates, errors, mends
from .meshes import mesh_io
from .runs import steps
from .runs.run import MOMENT, Judged, Pause, Run, StagedTask, Task, close_all, live_runs

__all__ = [
    "Judged",
    "Pause",
    "Run",
    "SolverOperator",
    "StagedTask",
    "Task",
    "close_all",
    "live_runs",
]


def paused(steps):
    """A generator's steps as stages of a task, each of which may be a tick's; its result."""
    while True:
        try:
            next(steps)
        except StopIteration as end:
            return end.value
        yield Pause()


def doubles(snapshot):
    """The snapshot's UVs at corners (#St, 3, 2) as float64, in stages."""
    yield Pause()
    uv = snapshot.corner_uv
    yield Pause()
    return (yield from paused(steps.doubles(uv)))


_INTERVAL = 0.1  # seconds between looks at the solver
_AT_ONCE = 0.15  # seconds in which small meshes are done, without a flicker in the status bar
# Navigating stays possible while solving; everything else waits, so the mesh cannot change
# meanwhile.
_NAVIGATION = set(
    (
        "MIDDLEMOUSE WHEELUPMOUSE WHEELDOWNMOUSE WHEELINMOUSE WHEELOUTMOUSE TRACKPADPAN "
        "TRACKPADZOOM MOUSEROTATE MOUSESMARTZOOM NDOF_MOTION"
    ).split()
)
_ACCEPT = {"RET", "NUMPAD_ENTER"}


def _moment(work, seconds: float) -> tuple[bool, object]:
    """One step of a generator, and more in so many seconds; whether it has ended, and what it returns then."""
    begin = time.perf_counter()
    try:
        next(work)
        while time.perf_counter() - begin < seconds:
            next(work)
    except StopIteration as end:
        return True, end.value
    return False, None


class SolverOperator:
    """Mixin for bpy.types.Operator. Subclasses give, besides `make_run(context)`, of tasks that were written: `summary(tasks)`,
    the report line; `between(tasks)`, what their results have to do with each other, as its end; `advice(tasks)`, what to do
    where a result is valid but not good, as the report is a warning then; and `hint(tasks)`, what would do better although all
    is well.
    """

    # What is left to read before there is a run (_start); None once it is read.
    _beginning = None
    _run = None
    _accepted = False  # Return was pressed, perhaps before there was a run
    # Of a run that has ended: what is left to write and to report (_conclude).
    _conclusion = None

    def make_run(self, context) -> Run:
        """One task per object; raises MeshProblem if the selection cannot be worked on. May be a generator that returns the run,
        for what takes longer than a window should stand still."""
        raise NotImplementedError

    # -- blocking: scripts, redo panel, background
    # ---------------------------------------------------------
    def execute(self, context):
        run = steps.result_of(self._start(context))
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
        self._beginning = self._start(context)
        status = self._tick(_AT_ONCE)
        if status is not None:
            return status
        self._timer = context.window_manager.event_timer_add(_INTERVAL, window=context.window)
        context.window_manager.modal_handler_add(self)
        self._show_progress(context)
        return {"RUNNING_MODAL"}

    def modal(self, context, event):
        if event.value == "PRESS" and self._conclusion is None:
            if event.type == "ESC":
                if self._run is None:
                    self._beginning.close()
                    self._stop_showing(context)
                    return self._cancelled()
                self._run.cancel()
            if event.type in _ACCEPT:
                self._accepted = True
                if self._run is not None:
                    self._run.accept()
        if event.type in _NAVIGATION:
            return {"PASS_THROUGH"}
        if event.type != "TIMER":
            return {"RUNNING_MODAL"}
        try:
            status = self._tick(0.0)
        except BaseException:  # a mistake of ours: Blender would go on calling the timer
            self.cancel(context)
            raise
        if status is None:
            self._show_progress(context)
            return {"RUNNING_MODAL"}
        self._stop_showing(context)
        return status

    def _tick(self, seconds: float) -> set[str] | None:
        """What there is to do in `seconds`, or in a moment; what the operator returns, once all is done."""
        enough = time.perf_counter() + max(seconds, MOMENT)
        if self._run is None:
            ended, self._run = _moment(self._beginning, max(seconds, MOMENT))
            if ended and self._run is None:
                return {"CANCELLED"}
            if ended and self._accepted:
                self._run.accept()
            if not ended or time.perf_counter() > enough:
                return None
        if self._conclusion is None and self._run.advance(seconds):
            self._conclusion = self._conclude(self._run)
            if time.perf_counter() > enough:
                return None
        return self._go_on()

    def _go_on(self) -> set[str] | None:
        """A moment's work of writing and reporting; what the operator returns, once all is done."""
        return None if self._conclusion is None else _moment(self._conclusion, MOMENT)[1]

    def cancel(self, context):
        """Blender ends the operator: a file is loaded, or Blender quits."""
        if self._conclusion is not None:
            self._conclusion.close()  # what is half written goes back
        if self._run is None:
            self._beginning.close()
        else:
            self._run.close()
        self._stop_showing(context)

    def _show_progress(self, context):
        text, fraction = ("", 0.0) if self._run is None else self._run.progress()
        hint = "[Esc] cancel  [Return] take it as it is"
        if self._run is None:
            hint = "[Esc] cancel  reading ..."
        elif self._conclusion is not None:
            text, hint = "", "writing ..."
        elif self._run.cancelled:
            hint = "stopping ..."
        elif self._run.accepted:
            hint = "[Esc] cancel  taking the map as it is ..."
        context.workspace.status_text_set(
            f"{self.bl_label}  {100 * fraction:.0f} %   {text}   {hint}"
        )

    def _stop_showing(self, context):
        context.window_manager.event_timer_remove(self._timer)
        context.workspace.status_text_set(None)

    # -- both
    # ----------------------------------------------------------------------------------------------
    def _start(self, context):
        """Steps that make the run; None, with the reason reported, if there is nothing to run."""
        errors.remember([])
        mends.forget()
        try:
            run = self.make_run(context)
            return (yield from run) if inspect.isgenerator(run) else run
        except mesh_io.MeshProblem as problem:
            errors.complain(self, str(problem))
            return None

    def _concluded(self, run: Run) -> set[str]:
        return steps.result_of(self._conclude(run))

    def _conclude(self, run: Run):
        """Writes the results and reports, in steps as Run.writing(); returns what the operator does."""
        if run.cancelled:
            return self._cancelled()
        yield from run.writing()
        seconds = time.perf_counter() - run.started
        if run.failures:
            self._report_failures(run.failures, written=bool(run.done))
        if not run.done:
            return self._refused(run.failures)
        mends.remember(run.done)
        yield
        yield from certificates.remember(run.done, self.bl_label)
        text = f"{self.summary(run.done)}{self.between(run.done)}, {seconds:.2f} s"
        yield
        if run.ended_early:
            text += ", accepted early"
        if run.solved_here:
            text += ", solved inside Blender as no process could be started for it"
        advice = self.advice(run.done)
        hint = self.hint(run.done)
        whole = ". ".join(filter(None, [text, advice, hint]))
        first = ". ".join(filter(None, [advice, text, hint]))
        errors.tell(self, "WARNING" if advice else "INFO", whole, first)
        return {"FINISHED"}

    def _cancelled(self) -> set[str]:
        self.report({"INFO"}, "Cancelled. Nothing was changed")
        return {"CANCELLED"}

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
            errors.tell(self, "WARNING", text)
        else:
            errors.complain(self, text)
