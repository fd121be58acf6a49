"""The parent's side: a process that solves, and its calls as jobs.

    SolverProcess --start(name, ...)--> ProcessJob: wait, progress, accept, cancel, result, as of flipfree.job.Job

No Python thread is involved, and nothing here waits for the child unless it is asked to. The child ends with its parent.
"""

from __future__ import annotations

import contextlib
import json
import os
import shutil
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from .. import jobs
from ..errors import Cancelled, FlipfreeError, InvalidInput, NotConverged
from ..job import LONGEST_WAIT, Job
from . import pipes, store
from .server import MARK

#: Codes of errors that the process itself meets, see docs/errors.md.
NOT_STARTED = "solver process not started"
ENDED = "solver process ended"

_BOOT = (
    "import sys, json; opening = json.loads(sys.argv[1]); sys.path[:] = opening['path']; "
    "from flipfree.process import server; server.main(opening)"
)
_AT_ONCE = 1 << 16  # bytes


class SolverProcess:
    """Starts with its first call, and again with the first one after it has ended. One call at a time."""

    def __init__(
        self,
        command: Sequence[str] = (sys.executable,),
        *,
        or_here: bool = False,
        environment: Mapping[str, str] | None = None,
    ) -> None:
        """command: starts a Python of this one's version; it finds its modules where this one does.

        or_here: calls are solved in this process if none can be started; ``solved_here`` says then why.
        environment: added to this process'.
        """
        self._command = list(command)
        self._or_here = or_here
        self._environment = dict(environment or {})
        self._process: subprocess.Popen[bytes] | None = None
        self._folder: Path | None = None
        self._read = b""
        self._ready = False
        self._calls = 0
        self._job: ProcessJob | None = None
        self.solved_here = ""

    @property
    def pid(self) -> int | None:
        """Of the process, while there is one."""
        return None if self._process is None else self._process.pid

    def start(self, name: str, *arguments: Any, **options: Any) -> Job[Any] | ProcessJob:
        """Starts ``flipfree.jobs.<name>`` there. What it raises at once here, the job's ``result`` raises."""
        if self._job is not None and not self._job.ended:
            self.close()  # whoever started it has let go of it
        if self.solved_here:
            return self.here(name, arguments, options)
        self._calls += 1
        try:
            self._open()
            assert self._folder is not None
            store.write(self._folder / f"call-{self._calls}", (name, arguments, options))
        except OSError as error:
            self.close()
            why = f"{self._command[0]}: {error.strerror or error}"  # the system names no command
            if self._or_here:
                self.solved_here = why
                return self.here(name, arguments, options)
            raise not_started(why) from error
        self.send({"call": self._calls})
        self._job = ProcessJob(self, self._calls, (name, arguments, options))
        return self._job

    def here(self, name: str, arguments: Sequence[Any], options: Mapping[str, Any]) -> Job[Any]:
        """The same call in this process."""
        job: Job[Any] = getattr(jobs, name)(*arguments, **options)
        return job

    def close(self) -> None:
        """Ends the process, whatever it is doing, and removes its files. What is mapped from them stays."""
        process, self._process = self._process, None
        if process is not None:
            process.kill()
            for stream in (process.stdin, process.stdout):
                assert stream is not None
                with contextlib.suppress(OSError):
                    stream.close()
            with contextlib.suppress(subprocess.TimeoutExpired):
                process.wait(
                    timeout=0.05
                )  # the system may still be busy with its memory; it ends by itself
        folder, self._folder = self._folder, None
        if folder is not None:
            shutil.rmtree(folder, ignore_errors=True)
        self._job = None

    def __del__(self) -> None:
        self.close()

    def _open(self) -> None:
        """Raises OSError."""
        if self._process is not None and self._process.poll() is None:
            return
        self.close()
        self._folder = folder = Path(tempfile.mkdtemp(prefix="flipfree-"))
        self._read, self._ready = b"", False
        opening = {
            "parent": os.getpid(),
            "folder": str(folder),
            "path": [entry for entry in sys.path if entry and os.path.exists(entry)],
        }
        with (folder / "said").open("wb") as said:
            self._process = subprocess.Popen(
                [*self._command, "-I", "-B", "-c", _BOOT, json.dumps(opening)],
                bufsize=0,
                stdin=subprocess.PIPE,
                stdout=subprocess.PIPE,
                stderr=said,
                env={**os.environ, **self._environment},
                start_new_session=os.name == "posix",  # the terminal's Ctrl C is the parent's
                creationflags=getattr(subprocess, "CREATE_NO_WINDOW", 0),
            )

    def send(self, message: Mapping[str, Any]) -> None:
        assert self._process is not None and self._process.stdin is not None
        # If it has died, whoever waits for it will see.
        pipes.send(self._process.stdin, json.dumps(message).encode() + b"\n")

    def receive(self, seconds: float) -> list[dict[str, Any]] | None:
        """What it has said by then; None once it has ended and all was read."""
        if self._process is None:
            return None
        assert self._process.stdout is not None
        found: list[dict[str, Any]] = []
        while pipes.readable(self._process.stdout, seconds):
            data = os.read(self._process.stdout.fileno(), _AT_ONCE)
            if not data:
                return found or None
            *lines, self._read = (self._read + data).split(b"\n")
            found += [json.loads(line[len(MARK) :]) for line in lines if line.startswith(MARK)]
            seconds = 0.0
        self._ready |= any("ready" in message for message in found)
        return found

    def answer(self, number: int) -> tuple[str, Any]:
        """("result" or "error", the value) of a call that has ended."""
        assert self._folder is not None
        answer: tuple[str, Any]
        try:
            answer = store.read(self._folder / f"answer-{number}")
        except OSError as error:  # somebody tidies up
            return "error", _ended(f"left no answer: {error}")
        for name in ("call", "answer"):
            with contextlib.suppress(OSError):
                (self._folder / f"{name}-{number}").unlink()
        return answer

    def death(self) -> FlipfreeError:
        """Why it is no longer there, as an error for whoever waits for it."""
        assert self._process is not None
        status, said = self._process.wait(), self._last_words()
        if not self._ready:
            return not_started(said or f"it ended with status {status}")
        how = f"ended with status {status}"
        if status < 0:
            how = f"was ended by signal {-status} ({signal.strsignal(-status)})"
        if os.name == "posix" and status == -signal.SIGKILL:
            how += ", perhaps because memory ran out"
        return _ended(f"{how}. {said}")

    def falls_back(self, error: FlipfreeError) -> bool:
        """Whether calls are solved in this process from now on, because of this error."""
        if self._or_here and error.code == NOT_STARTED:
            self.solved_here = str(error)
        return bool(self.solved_here)

    def _last_words(self) -> str:
        if self._folder is None:
            return ""
        with contextlib.suppress(OSError):
            lines = (self._folder / "said").read_text(errors="replace").split("\n")
            return next((line.strip() for line in reversed(lines) if line.strip()), "")
        return ""


class ProcessJob:
    """A call that is being solved in another process; the same to its user as :class:`flipfree.job.Job`."""

    def __init__(
        self,
        process: SolverProcess,
        number: int,
        call: tuple[str, Sequence[Any], Mapping[str, Any]],
    ) -> None:
        self._process = process
        self._number = number
        self._call = call
        self._progress = ("starting a process", 0.0)
        self._answer: tuple[str, Any] | None = None
        self._here: Job[Any] | None = None  # the same call, where no process could be started
        self._accepted = False
        self._collected = False

    @property
    def ended(self) -> bool:
        return self._answer is not None

    def wait(self, seconds: float) -> bool:
        """Waits up to ``seconds``; True when the call has ended, well or badly, or its process has."""
        end = time.monotonic() + min(max(seconds, 0.0), LONGEST_WAIT)
        while self._answer is None and self._here is None:
            left = end - time.monotonic()
            messages = self._process.receive(max(left, 0.0))
            if messages is None:
                self._lost(self._process.death())
                break
            for message in messages:
                if "progress" in message:
                    stage, fraction = message["progress"]
                    self._progress = (stage, fraction)
                if message.get("answer") == self._number:
                    self._answer = self._process.answer(self._number)
            if self._answer is None and left <= 0.0:
                return False
        if self._here is not None:
            return self._here.wait(max(end - time.monotonic(), 0.0))
        return True

    def _lost(self, error: FlipfreeError) -> None:
        """Its process is no longer there."""
        self._process.close()
        if not self._process.falls_back(error):
            self._answer = ("error", error)
            return
        name, arguments, options = self._call
        try:
            self._here = self._process.here(name, arguments, options)
        except FlipfreeError as refused:
            self._answer = ("error", refused)
            return
        if self._accepted:
            self._here.accept()

    def progress(self) -> tuple[str, float]:
        """(stage, fraction) as last heard of; the fraction never falls."""
        return self._progress if self._here is None else self._here.progress()

    def accept(self) -> None:
        """Takes the map as it is, as ``Job.accept`` does."""
        self._accepted = True
        if self._here is not None:
            self._here.accept()
        elif self._answer is None:
            self._process.send({"accept": True})

    def cancel(self) -> None:
        """Ends the process at once. Then ``result`` raises Cancelled."""
        if self._here is not None:
            self._here.cancel()
        elif self._answer is None:
            self._process.close()
            self._answer = ("error", Cancelled("Cancelled by the caller.", code="cancelled"))

    def result(self) -> Any:
        """Waits for the end; the result, once, or the solver's exception."""
        while not self.wait(LONGEST_WAIT):
            pass
        if self._here is not None:
            return self._here.result()
        if self._collected:
            raise InvalidInput(
                "The result of this job was already collected. Keep it, it is not held here.",
                code="bad option",
            )
        self._collected = True
        assert self._answer is not None
        kind, value = self._answer
        self._answer = ("error", None)
        if kind == "error":
            raise value
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
