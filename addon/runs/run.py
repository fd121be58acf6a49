# SPDX-License-Identifier: GPL-3.0-or-later
"""A row of tasks, one for each object: solved one after the other, written at the end.

The solver runs on a C++ thread that touches neither Python nor Blender's data, or in a process of its own (processes.py);
no Python thread exists.
"""

import time
import weakref
from dataclasses import dataclass

import bpy
import numpy as np

import flipfree

from .. import errors, watch
from ..meshes import mesh_io
from . import processes

live_runs: "weakref.WeakSet[Run]" = weakref.WeakSet()

# Seconds of Blender's own thread after which a window shall be able to go on: what is left waits for the next tick.
MOMENT = 0.03


@dataclass
class Judged:
    """A certificate, and the mesh face of each triangle of its map as the mesh was read."""

    certificate: object
    faces: np.ndarray


class Task:
    """The work for one object. Subclasses hold plain arrays and names, never Blender data."""

    # Whether its result is an object's; a layout only changes what other tasks write.
    writes = True
    # Whether it maps surfaces as they are in object space, without the object's scale.
    flattens = False
    # watch.uid of the object that its result was written to.
    object_uid: int | None = None
    # Of what it made, where that is one map on the mesh's own triangles.
    certificate = None
    # Pairs of islands on each other, of different objects of the run; -1: nobody looked.
    object_overlaps = -1
    # Of the task's progress, what its present job makes.
    span = (0.0, 1.0)
    # Said with the failure in whose place it is done (instead()): what of the object stays as it was.
    leaves_out = ""
    # {code of an error: what to do about it}, where the usual text does not help.
    cures: dict[str, str] = {}

    def __init__(self, snapshot: mesh_io.Snapshot, **options):
        """options: attributes that the class has, instead of its defaults."""
        self.snapshot = snapshot
        for name, value in options.items():
            getattr(type(self), name)  # none that no subclass knows
            setattr(self, name, value)

    @property
    def judged(self) -> list[Judged]:
        """Certificates of what it made, with the mesh faces they speak of."""
        found = self.certificate
        return [] if found is None else [Judged(found, self.snapshot.triangle_face)]

    @property
    def certificates(self) -> list:
        return [judged.certificate for judged in self.judged]

    def values(self, names: str) -> dict:
        """Its options of these names, which blanks part, for a call that has them too."""
        return {name: getattr(self, name) for name in names.split()}

    def start(self):
        """Starts the solver; returns its job (flipfree.jobs)."""
        raise NotImplementedError

    def collect(self, result):
        """Takes the job's result. Returns the next job if there is a further stage, else None."""
        raise NotImplementedError

    def explain(self, error) -> None:
        """May turn ids in a solver's exception into ids of the snapshot, where the task gave it another mesh."""

    def instead(self) -> "Task | None":
        """After a failure of this task: another one to do in its place."""
        return None

    def recover(self, error: flipfree.FlipfreeError):
        """What collect() is for a job without a result: the next job, or the error."""
        raise error

    def write(self, ob: bpy.types.Object):
        """Puts the result into the mesh. Called once, after every task has ended."""
        raise NotImplementedError

    def writing(self, ob: bpy.types.Object):
        """The same as a generator, for what takes longer than a window should stand still: it goes on from each yield a tick
        later. Closed before its end, it leaves the mesh as it was."""
        self.write(ob)
        yield


class Pause:
    """A job that has ended as it began: a staged task yields one where a tick may end before it goes on."""

    def wait(self, seconds) -> bool:
        return True

    def result(self) -> None:
        return None

    def progress(self) -> tuple[str, float]:
        return "", 0.0

    def cancel(self) -> None:
        """There is nothing to end."""

    def accept(self) -> None:
        """There is no map."""


class StagedTask(Task):
    """A task of several jobs, written down as one generator: `result = yield job`."""

    def stages(self):
        raise NotImplementedError

    def start(self):
        self._stages = self.stages()
        return next(self._stages, None)

    def collect(self, result):
        try:
            return self._stages.send(result)
        except StopIteration:
            return None

    def recover(self, error):
        """A stage may catch what its job raises, and go on with another one."""
        try:
            return self._stages.throw(error)
        except StopIteration:
            return None


class Run:
    """A row of tasks: what is being solved, what has ended, what failed."""

    def __init__(
        self,
        tasks: list[Task],
        failures: list[errors.Failure] | None = None,
        *,
        layout=None,
        separate=True,
    ):
        """failures: of objects that could not even be read. layout: takes the list of tasks that ended well, once all
        have ended; returns a task that works on their results, or None. separate: solve in a process of its own where the
        preferences want it."""
        self._waiting = list(tasks)
        self._layout = layout
        self._process = processes.of(tasks) if separate else None
        self._total = len(tasks) + len(failures or [])
        self._task = None
        self._job = None
        self._step = None  # what there is to do with what the last job has found
        self._cancelled = False
        self._accepted = False
        self.ended_early = False  # some job ended because its map was taken as it was
        self.done: list[Task] = []
        self.failures: list[errors.Failure] = list(failures or [])
        self.started = time.perf_counter()
        self._stage = ""
        self._shown = 0.0  # largest fraction so far: a task's next job starts at zero again
        # By the names at the start: objects may be renamed meanwhile, or deleted and others get their names.
        there = watch.objects_by_name()
        self._uids = {
            ob.name: watch.uid(ob)
            for task in tasks
            if (ob := there.get(task.snapshot.object_name)) is not None
        }
        live_runs.add(self)

    def advance(self, seconds: float) -> bool:
        """Waits up to `seconds` for the solver; True once nothing is left to solve. Between two jobs there is work for
        Blender's own thread: of that no more than one step is done beyond a moment."""
        begin = time.perf_counter()
        while True:
            if self._step is not None:
                step, self._step = self._step, None
                self._guard(step)
            elif self._job is not None:
                if not self._job.wait(seconds):
                    return False
                job, self._job = self._job, None
                self._guard(lambda job=job: self._take(job))
            elif self._cancelled or not (self._waiting or self._add_layout()):
                self._end_process()
                return True
            else:
                self._task = self._waiting.pop(0)
                self._stage = ""
                self._guard(lambda: self._set_job(self._task.start()))
            if self._job is None and self._step is None and self._task is not None:
                if self._task.writes:
                    self.done.append(self._task)
                self._task = None
            if time.perf_counter() - begin > max(seconds, MOMENT):
                return False

    def _add_layout(self) -> bool:
        """Lets the layout follow when all tasks have ended; whether there is one."""
        layout, self._layout = self._layout, None
        task = layout(self.done) if layout is not None and self.done else None
        if task is not None:
            self._waiting.append(task)
        return task is not None

    def _set_job(self, job):
        self._job = job
        if job is not None and self._accepted:
            job.accept()

    def _take(self, job):
        """Takes the job's result, or its error; what the task makes of it is the next step."""
        task = self._task
        try:
            result = self._result(job)
        except flipfree.Cancelled:
            raise
        except flipfree.FlipfreeError as error:
            self._step = lambda error=error: self._set_job(task.recover(error))
        else:
            self._step = lambda: self._set_job(task.collect(result))

    def _result(self, job):
        result = job.result()
        if self._accepted and getattr(result, "stats", {}).get("time_limit_reached", 0):
            self.ended_early = True
        return result

    def _guard(self, step):
        """Runs one step of the current task; turns what it raises into a Failure and drops the task."""
        task = self._task
        try:
            with processes.within(self._process):
                step()
            return
        except flipfree.Cancelled:
            self._cancelled = True
        except flipfree.FlipfreeError as error:
            task.explain(error)
            self.failures.append(errors.from_solver(task.snapshot, error, task.cures))
        except mesh_io.MeshProblem as problem:
            self.failures.append(errors.from_problem(task.snapshot.object_name, problem))
        self._task = None
        self._job = self._step = None
        other = None if self._cancelled else task.instead()
        if other is not None:
            if other.leaves_out:
                self.failures[-1].message += f". {other.leaves_out}"
            self._waiting.append(other)

    def _end_process(self):
        if self._process is not None:
            self._process.close()

    @property
    def process_id(self) -> int | None:
        """Of the process that solves, while there is one."""
        return None if self._process is None else self._process.pid

    @property
    def solved_here(self) -> str:
        """Why it was solved in Blender's own process though another one was wanted; "" if it was not."""
        return "" if self._process is None else self._process.solved_here

    def cancel(self):
        self._cancelled = True
        if self._job is not None and not isinstance(self._job, Pause):
            self._job.cancel()
        elif self._job is not None or self._step is not None:
            self._job = self._step = self._task = None  # nothing further is started

    def accept(self):
        """Takes every map as it is, as soon as there is one. Nothing fails because of it."""
        self._accepted = True
        if self._job is not None:
            self._job.accept()

    @property
    def accepted(self) -> bool:
        return self._accepted

    @property
    def cancelled(self) -> bool:
        return self._cancelled

    def progress(self) -> tuple[str, float]:
        """(text, fraction over all tasks); the fraction never falls."""
        stage, fraction = self._job.progress() if self._job is not None else ("", 0.0)
        self._stage = stage = stage or self._stage  # between two jobs it is that of the first
        if self._task is not None:
            begin, end = self._task.span
            fraction = begin + fraction * (end - begin)
        ended = len(self.done) + len(self.failures)
        name = self._task.snapshot.object_name if self._task is not None else ""
        text = f"{name}: {stage}" if name and stage else name
        self._shown = max(self._shown, min((ended + fraction) / max(self._total, 1), 1.0))
        return text, self._shown

    def finish(self):
        """Writes every result, unless cancelled. A task that cannot be written joins the failures."""
        for _ in self.writing():
            pass

    def writing(self):
        """finish() as a generator, see Task.writing."""
        if self._cancelled:
            self.done = []
            return
        written = []
        # Once: to look for each of thousands among all takes longer than to map them.
        there = watch.objects_by_uid()
        for task in self.done:
            name = task.snapshot.object_name
            task.object_uid = self._uids.get(name)
            deleted = mesh_io.MeshProblem(f"{name}: the object was deleted meanwhile")
            ob = there.get(task.object_uid)
            try:
                if ob is None or not watch.is_there(ob):
                    raise deleted
                yield from task.writing(ob)
                written.append(task)
            except mesh_io.MeshProblem as problem:
                self.failures.append(errors.from_problem(name, problem))
            except ReferenceError:  # between two steps
                if watch.is_there(ob):
                    raise
                self.failures.append(errors.from_problem(name, deleted))
            yield
        self.done = written

    def close(self):
        """Ends the solver, whatever it is doing; waits for its thread (a fraction of a second)."""
        self.cancel()
        if self._job is not None:
            self._job.wait(10.0)
            self._job = None
        self._end_process()


def close_all():
    """For unregister: no solver thread outlives the extension."""
    for run in list(live_runs):
        run.close()
