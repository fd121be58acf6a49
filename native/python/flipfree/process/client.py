"""Solver calls in a process of their own: it may crash or be killed, and its caller goes on.

    SolverProcess --start(name, ...)--> ProcessJob: wait, progress, accept, cancel, result, as of flipfree.job.Job

Children are talked to in lines of JSON through pipes, with objects in files, and live no longer than their parent. No Python
thread of the parent is involved, and nothing in it waits for a child unless it is asked to. The program may not be Python's
own: Blender leaves SIGPIPE at what ends a process.
"""

import collections
import contextlib
import ctypes
import json
import os
import pickle
import queue
import select
import shutil
import signal
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Callable, Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import IO, Any

from .. import jobs
from ..errors import Cancelled, FlipfreeError, NotConverged
from ..job import LONGEST_WAIT, POLL_SECONDS, Job, StagedJob, Stages, ours_only

if sys.platform == "win32":
    from . import windows


Message = Mapping[str, Any]

#: Begins every line that a child says to its parent.
_MARK = b"@flipfree "
_AT_ONCE = 1 << 16  # bytes
_KEPT_LINES = 12
_PR_SET_PDEATHSIG = 1


class Child(subprocess.Popen[bytes]):
    """``said``: the last lines that are no messages; ``spoke``: whether there was a message."""

    def __init__(self, command: Sequence[str], environment: Mapping[str, str]) -> None:
        """Raises OSError."""
        super().__init__(
            list(command),
            bufsize=0,
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            env={**os.environ, **environment},
            start_new_session=os.name == "posix",  # the terminal's Ctrl C is the parent's
            creationflags=getattr(subprocess, "CREATE_NO_WINDOW", 0),
        )
        # A parent that is killed takes it along; elsewhere the child asks for that (die_with).
        self._job: int | None = None
        if sys.platform == "win32":
            self._job = windows.tie(int(self._handle))
        self.said: collections.deque[str] = collections.deque(maxlen=_KEPT_LINES)
        self._read = b""
        self.spoke = False

    def tell(self, message: Message) -> None:
        """If it has died, whoever waits for its answer will see."""
        assert self.stdin is not None
        send(self.stdin, json.dumps(message).encode() + b"\n")

    def heard(self, seconds: float) -> list[dict[str, Any]] | None:
        """Its messages by then; None once it has ended and all was read."""
        assert self.stdout is not None
        if self.stdout.closed:
            return None
        found: list[dict[str, Any]] = []
        while readable(self.stdout, seconds):
            data = os.read(self.stdout.fileno(), _AT_ONCE)
            if not data:
                return found or None
            *lines, self._read = (self._read + data).split(b"\n")
            for line in lines:
                if line.startswith(_MARK):
                    found.append(json.loads(line[len(_MARK) :]))
                    self.spoke = True
                elif line.strip():
                    self.said.append(line.decode(errors="replace").rstrip())
            seconds = 0.0
        return found

    def end(self, patience: float | None = None) -> None:
        """Ends it and what it has started, whatever it is doing; the system may be busy with its memory for longer than the
        patience to wait."""
        with contextlib.suppress(OSError):
            if os.name == "posix" and self.poll() is None:
                os.killpg(self.pid, signal.SIGKILL)
            else:
                self.kill()
        if sys.platform == "win32" and self._job is not None:
            windows.close(self._job)
            self._job = None
        for stream in (self.stdin, self.stdout):
            assert stream is not None
            with contextlib.suppress(OSError):
                stream.close()
        with contextlib.suppress(subprocess.TimeoutExpired):
            self.wait(patience)


def say(message: Message) -> None:
    """The child's side: in one piece, on a line of its own, past whatever is still in buffers."""
    _write(1, b"\n" + _MARK + json.dumps(message, allow_nan=False).encode() + b"\n")


def how_ended(status: int, if_killed: str) -> str:
    """A process with this status, in words; and in which, where it was killed, perhaps because memory ran out."""
    if status < 0:
        killed = if_killed if status == -signal.SIGKILL else ""
        return f"was ended by signal {-status} ({signal.Signals(-status).name}){killed}"
    # Windows' own words for a crash are large.
    return f"ended with status {status if status < 1 << 31 else hex(status)}"


def send(stream: IO[bytes], data: bytes) -> bool:
    """Writes all of it to an unbuffered pipe; False if nobody reads there any more."""
    try:
        file = stream.fileno()
    except ValueError:  # closed
        return False
    if os.name == "nt":
        return _write(file, data)
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGPIPE})
    try:
        sent = _write(file, data)
        if not sent and signal.SIGPIPE in signal.sigpending():
            signal.sigwait({signal.SIGPIPE})  # it is this write's
        return sent
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


def _write(file: int, data: bytes) -> bool:
    rest = memoryview(data)
    try:
        while rest:
            rest = rest[os.write(file, rest) :]
    except OSError:
        return False
    return True


def readable(stream: IO[bytes], seconds: float) -> bool:
    """Whether it can be read without waiting, or has ended; waits for that as long."""
    if sys.platform == "win32":
        end = time.monotonic() + seconds
        while not windows.waiting(stream.fileno()):  # a pipe there can only be looked into
            if time.monotonic() >= end:
                return False
            time.sleep(0.005)
        return True
    return bool(select.select([stream.fileno()], [], [], seconds)[0])


def die_with(parent: int, by: int | None = None) -> bool:
    """A parent that is killed takes its children along, on Linux by this, on Windows by the parent's own doing; on macOS they
    have to notice that nobody writes to them any more.

    by: the signal that they get then; None is one that nobody can ignore. False: it had died before, so no signal will come.
    """
    if sys.platform.startswith("linux"):
        ctypes.CDLL(None, use_errno=True).prctl(_PR_SET_PDEATHSIG, by or signal.SIGKILL)
        try:
            os.kill(parent, 0)  # a launcher may stand between it and its child
        except ProcessLookupError:
            return False
        except PermissionError:  # it is there
            pass
    return True


def write_object(path: Path, value: object) -> None:
    """A Python object; its arrays go from and to memory as they lie there. Raises OSError if there is no room."""
    with path.open("wb") as file:
        pickle.dump(value, file, protocol=5)


def read_object(path: Path) -> Any:
    """Only of files that this user's own processes have written: whoever writes them decides what happens here."""
    with path.open("rb") as file:
        return pickle.load(file)


#: Codes of errors that the process itself meets, see docs/errors.md.
NOT_STARTED = "solver process not started"
ENDED = "solver process ended"

_BOOT = (
    "import sys, json; opening = json.loads(sys.argv[1]); sys.path[:] = opening['path']; "
    "from flipfree.process import client; client.serve(opening)"
)


class _Solver(Child):
    """Solves calls, which lie in its folder, as their answers do."""

    def __init__(self, command: Sequence[str]) -> None:
        """Raises OSError."""
        self.folder = Path(tempfile.mkdtemp(prefix="flipfree-"))
        path = [entry for entry in sys.path if entry and os.path.exists(entry)]
        opening = {"parent": os.getpid(), "folder": str(self.folder), "path": path}
        try:
            super().__init__([*command, "-I", "-B", "-c", _BOOT, json.dumps(opening)], {})
        except OSError:
            self._forget()
            raise

    def _forget(self) -> None:
        shutil.rmtree(self.folder, ignore_errors=True)

    def end(self, patience: float | None = 2.0 if os.name == "nt" else 0.05) -> None:
        """Its files go too; what is mapped from them stays."""
        super().end(patience)  # Windows removes no open file
        self._forget()

    def answer(self, number: int) -> tuple[str, Any]:
        """("result" or "error", the value) of a call that has ended."""
        answer: tuple[str, Any]
        try:
            answer = read_object(self.folder / f"answer-{number}")
        except OSError as error:  # somebody tidies up
            return "error", _ended(f"left no answer: {error}")
        for name in ("call", "answer"):
            with contextlib.suppress(OSError):
                (self.folder / f"{name}-{number}").unlink()
        return answer

    def death(self) -> FlipfreeError:
        """Why it is no longer there, as an error for whoever waits for it."""
        status = self.wait()
        said = next(reversed(self.said), "")
        if not self.spoke:
            return not_started(said or f"it ended with status {status}")
        how = how_ended(status, ", perhaps because memory ran out")
        return _ended(f"{how}. {said}")


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
        self._process: _Solver | None = None
        self._calls = 0
        self._job: ProcessJob | None = None
        self.solved_here = ""

    @property
    def pid(self) -> int | None:
        """Of the process, while there is one."""
        return None if self._process is None else self._process.pid

    def start(self, name: str, *arguments: Any, **options: Any) -> Job[Any]:
        """Starts ``flipfree.jobs.<name>`` there. What it raises at once here, the job's ``result`` raises."""
        if self._job is not None:
            self._job.cancel()  # whoever started it has let go of it
        here: Callable[[], Job[Any]] = partial(getattr(jobs, name), *arguments, **options)
        if self.solved_here:
            return here()
        self._calls += 1
        try:
            if self._process is None or self._process.poll() is not None:
                self.close()
                self._process = _Solver(self._command)
            call = self._process.folder / f"call-{self._calls}"
            write_object(call, (name, arguments, options))
        except OSError as error:
            self.close()
            why = f"{self._command[0]}: {error.strerror or error}"  # the system names no command
            if not self._or_here:
                raise not_started(why) from error
            self.solved_here = why
            return here()
        self._process.tell({"call": self._calls})
        self._job = ProcessJob(self, self._process, self._calls)
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
        """Ends the process, whatever it is doing."""
        process, self._process, self._job = self._process, None, None
        if process is not None:
            process.end()

    def __del__(self) -> None:
        self.close()


class ProcessJob(Job[Any]):
    """A call that is being solved in another process."""

    def __init__(self, process: SolverProcess, child: _Solver, number: int) -> None:
        self._process, self._child = process, child
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
            messages = self._child.heard(max(left, 0.0))
            if messages is None:
                self._answer = ("error", self._child.death())
                self._process.close()
                break
            for message in messages:
                if "progress" in message:
                    stage, fraction = message["progress"]
                    self._progress = (stage, fraction)
                if message.get("answer") == self._number:
                    self._answer = self._child.answer(self._number)
            if left <= 0.0:
                break
        return self.ended

    def progress(self) -> tuple[str, float]:
        """(stage, fraction) as last heard of; the fraction never falls."""
        return self._progress

    def accept(self) -> None:
        """Takes the map as it is, as ``Job.accept`` does."""
        if not self.ended:
            self._child.tell({"accept": True})

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


_NICER = 5


def serve(opening: Message) -> None:
    """opening: {"parent": pid, "folder": where calls and answers lie}. Does not return."""
    _stand_back()
    folder = Path(opening["folder"])
    signal.signal(signal.SIGTERM, lambda *_: _leave(folder))
    if not die_with(opening["parent"], signal.SIGTERM):
        _leave(folder)
    messages: queue.SimpleQueue[Message] = queue.SimpleQueue()
    threading.Thread(target=_listen, args=(messages, folder), daemon=True).start()
    say({"ready": True})
    while True:
        message = messages.get()
        if "call" in message:
            _answer(message, folder, messages)


def _listen(messages: queue.SimpleQueue[Message], folder: Path) -> None:
    """Nothing more to read: the parent is no longer there, and nobody waits for what is being solved."""
    with contextlib.suppress(OSError, ValueError):
        for line in iter(sys.stdin.buffer.readline, b""):
            messages.put(json.loads(line))
    _leave(folder)


def _leave(folder: Path) -> None:
    shutil.rmtree(folder, ignore_errors=True)
    os._exit(0)


def _answer(message: Message, folder: Path, messages: queue.SimpleQueue[Message]) -> None:
    number, target = message["call"], folder / f"answer-{message['call']}"
    try:
        _solved(folder / f"call-{number}", target, messages)
    except FlipfreeError as error:
        write_object(target, ("error", error))
    say({"answer": number})


@ours_only
def _solved(call: Path, target: Path, messages: queue.SimpleQueue[Message]) -> None:
    """Writes what a call returns."""
    name, arguments, options = read_object(call)
    job = getattr(jobs, name)(*arguments, **options)
    told = None
    while not job.wait(POLL_SECONDS):
        now = job.progress()
        if now != told:
            told = now
            say({"progress": now})
        while not messages.empty():
            if "accept" in messages.get():
                job.accept()
    write_object(target, ("result", job.result()))


def _stand_back() -> None:
    """The parent is what somebody works with: it has the processor first, and where the system ends a process because memory
    runs out, it shall be this one."""
    with contextlib.suppress(OSError):
        if os.name == "posix":
            os.nice(_NICER)
    with contextlib.suppress(OSError):
        Path("/proc/self/oom_score_adj").write_text("600")
