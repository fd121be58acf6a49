"""The parent's side: a process that solves, and its calls as jobs.

    SolverProcess --start(name, ...)--> ProcessJob: wait, progress, accept, cancel, result, as of flipfree.job.Job

No Python thread is involved, and nothing here waits for the child unless it is asked to. The child ends with its parent.
"""

from __future__ import annotations

import contextlib
import json
import os
import shutil
import sys
import tempfile
import time
from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path
from typing import Any

from .. import jobs
from ..errors import Cancelled, FlipfreeError, NotConverged
from ..job import LONGEST_WAIT, Job, StagedJob, Stages
from .pipes import Child, Message, how_ended, read_object, write_object

#: Codes of errors that the process itself meets, see docs/errors.md.
NOT_STARTED = "solver process not started"
ENDED = "solver process ended"

_BOOT = (
    "import sys, json; opening = json.loads(sys.argv[1]); sys.path[:] = opening['path']; "
    "from flipfree.process import server; server.main(opening)"
)


class SolverProcess:
    """Starts with its first call, and again with the first one after it has ended. One call at a time."""

    def __init__(
        self, command: Sequence[str] = (sys.executable,), *, or_here: bool = False
    ) -> None:
        """command: starts a Python of this one's version; it finds its modules where this one does.

        or_here: calls are solved in this process if none can be started; ``solved_here`` says then why.
        """
        self._command = list(command)
        self._or_here = or_here
        self._process: Child | None = None
        self._folder: Path | None = None
        self._ready = False
        self._calls = 0
        self._job: ProcessJob | None = None
        self.solved_here = ""

    @property
    def pid(self) -> int | None:
        """Of the process, while there is one."""
        return None if self._process is None else self._process.pid

    def start(self, name: str, *arguments: Any, **options: Any) -> Job[Any]:
        """Starts ``flipfree.jobs.<name>`` there. What it raises at once here, the job's ``result`` raises."""
        if self._job is not None and not self._job.ended:
            self.close()  # whoever started it has let go of it
        here: Callable[[], Job[Any]] = partial(getattr(jobs, name), *arguments, **options)
        if self.solved_here:
            return here()
        self._calls += 1
        try:
            folder = self._open()
            write_object(folder / f"call-{self._calls}", (name, arguments, options))
        except OSError as error:
            self.close()
            why = f"{self._command[0]}: {error.strerror or error}"  # the system names no command
            if not self._or_here:
                raise not_started(why) from error
            self.solved_here = why
            return here()
        self.send({"call": self._calls})
        self._job = ProcessJob(self, self._calls)
        return StagedJob(self._there_or(here, self._job)) if self._or_here else self._job

    def _there_or(self, here: Callable[[], Job[Any]], job: Job[Any]) -> Stages[Any]:
        try:
            return (yield job, 1.0)
        except NotConverged as error:
            if error.code != NOT_STARTED:
                raise
            self.solved_here = str(error)
        return (yield here(), 1.0)

    def close(self) -> None:
        """Ends the process, whatever it is doing, and removes its files. What is mapped from them stays."""
        process, self._process = self._process, None
        if process is not None:
            process.end(patience=2.0 if os.name == "nt" else 0.05)  # no open file is removed there
        folder, self._folder = self._folder, None
        if folder is not None:
            shutil.rmtree(folder, ignore_errors=True)
        self._job = None

    def __del__(self) -> None:
        self.close()

    def _open(self) -> Path:
        """The folder of calls and answers. Raises OSError."""
        if self._process is not None and self._folder is not None and self._process.poll() is None:
            return self._folder
        self.close()
        self._folder = folder = Path(tempfile.mkdtemp(prefix="flipfree-"))
        self._ready = False
        opening = {
            "parent": os.getpid(),
            "folder": str(folder),
            "path": [entry for entry in sys.path if entry and os.path.exists(entry)],
        }
        command = [*self._command, "-I", "-B", "-c", _BOOT, json.dumps(opening)]
        self._process = Child(command, {})
        return folder

    def send(self, message: Message) -> None:
        assert self._process is not None
        self._process.tell(message)

    def receive(self, seconds: float) -> list[dict[str, Any]] | None:
        """What it has said by then; None once it has ended and all was read."""
        found = None if self._process is None else self._process.heard(seconds)
        self._ready |= any("ready" in message for message in found or ())
        return found

    def answer(self, number: int) -> tuple[str, Any]:
        """("result" or "error", the value) of a call that has ended."""
        assert self._folder is not None
        answer: tuple[str, Any]
        try:
            answer = read_object(self._folder / f"answer-{number}")
        except OSError as error:  # somebody tidies up
            return "error", _ended(f"left no answer: {error}")
        for name in ("call", "answer"):
            with contextlib.suppress(OSError):
                (self._folder / f"{name}-{number}").unlink()
        return answer

    def death(self) -> FlipfreeError:
        """Why it is no longer there, as an error for whoever waits for it."""
        assert self._process is not None
        status = self._process.wait()
        said = next(reversed(self._process.said), "")
        if not self._ready:
            return not_started(said or f"it ended with status {status}")
        how = how_ended(status, ", perhaps because memory ran out")
        return _ended(f"{how}. {said}")


class ProcessJob(Job[Any]):
    """A call that is being solved in another process."""

    def __init__(self, process: SolverProcess, number: int) -> None:
        self._process = process
        self._number = number
        self._progress = ("starting a process", 0.0)
        self._answer: tuple[str, Any] | None = None

    @property
    def ended(self) -> bool:
        return self._answer is not None

    def wait(self, seconds: float) -> bool:
        """Waits up to ``seconds``; True when the call has ended, well or badly, or its process has."""
        end = time.monotonic() + min(max(seconds, 0.0), LONGEST_WAIT)
        while self._answer is None:
            left = end - time.monotonic()
            messages = self._process.receive(max(left, 0.0))
            if messages is None:
                self._answer = ("error", self._process.death())
                self._process.close()
                break
            for message in messages:
                if "progress" in message:
                    stage, fraction = message["progress"]
                    self._progress = (stage, fraction)
                if message.get("answer") == self._number:
                    self._answer = self._process.answer(self._number)
            if left <= 0.0:
                break
        return self.ended

    def progress(self) -> tuple[str, float]:
        """(stage, fraction) as last heard of; the fraction never falls."""
        return self._progress

    def accept(self) -> None:
        """Takes the map as it is, as ``Job.accept`` does."""
        if not self.ended:
            self._process.send({"accept": True})

    def cancel(self) -> None:
        """Ends the process at once. Then ``result`` raises Cancelled."""
        if not self.ended:
            self._process.close()
            self._answer = ("error", Cancelled("Cancelled by the caller.", code="cancelled"))

    def _result(self) -> Any:
        assert self._answer is not None
        kind, value = self._answer
        if kind == "error":
            raise value
        self._answer = ("error", None)  # it is not held here
        return value


def _ended(how: str) -> NotConverged:
    return NotConverged(
        f"The solver's process {how.rstrip('. ')}. Close other programs, or solve the mesh in parts; if that does not help, "
        "please report this mesh.",
        code=ENDED,
    )


def not_started(why: str) -> NotConverged:
    return NotConverged(
        f"No process could be started for the solver: {why.rstrip('. ')}. Solve in this process instead.",
        code=NOT_STARTED,
    )
