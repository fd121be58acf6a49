"""Children that are talked to: in lines of JSON through pipes, with objects in files, and not for longer than their parent lives.

In a program that may not be Python's own: Blender leaves SIGPIPE at what ends a process.
"""

from __future__ import annotations

import collections
import contextlib
import ctypes
import json
import os
import pickle
import select
import signal
import subprocess
import sys
import time
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import IO, Any

if sys.platform == "win32":
    from . import windows

Message = Mapping[str, Any]

#: Begins every line that a child says to its parent.
_MARK = b"@flipfree "
_AT_ONCE = 1 << 16  # bytes
_KEPT_LINES = 12
_PR_SET_PDEATHSIG = 1


class Child(subprocess.Popen[bytes]):
    """``said``: the last lines that are no messages."""

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

    def tell(self, message: Message) -> None:
        """If it has died, whoever waits for its answer will see."""
        assert self.stdin is not None
        send(self.stdin, json.dumps(message).encode() + b"\n")

    def heard(self, seconds: float) -> list[dict[str, Any]] | None:
        """Its messages by then; None once it has ended and all was read."""
        assert self.stdout is not None
        found: list[dict[str, Any]] = []
        while readable(self.stdout, seconds):
            data = os.read(self.stdout.fileno(), _AT_ONCE)
            if not data:
                return found or None
            *lines, self._read = (self._read + data).split(b"\n")
            for line in lines:
                if line.startswith(_MARK):
                    found.append(json.loads(line[len(_MARK) :]))
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
    data = b"\n" + _MARK + json.dumps(message, allow_nan=False).encode() + b"\n"
    while data:
        data = data[os.write(1, data) :]


def how_ended(status: int, if_killed: str) -> str:
    """A process with this status, in words; and in which, where it was killed, perhaps because memory ran out."""
    if status < 0:
        killed = if_killed if status == -signal.SIGKILL else ""
        return f"was ended by signal {-status} ({signal.Signals(-status).name}){killed}"
    # Windows' own words for a crash are large.
    return f"ended with status {status if status < 1 << 31 else hex(status)}"


def send(stream: IO[bytes], data: bytes) -> bool:
    """Writes all of it to an unbuffered pipe; False if nobody reads there any more."""
    if os.name == "nt":
        return _write(stream, data)
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGPIPE})
    try:
        sent = _write(stream, data)
        if not sent and signal.SIGPIPE in signal.sigpending():
            signal.sigwait({signal.SIGPIPE})  # it is this write's
        return sent
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


def _write(stream: IO[bytes], data: bytes) -> bool:
    rest = memoryview(data)
    try:
        while rest:
            rest = rest[os.write(stream.fileno(), rest) :]
    except (OSError, ValueError):  # ValueError: it was closed here
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
        return os.getppid() == parent or _is_ancestor(parent)
    return True


def _is_ancestor(pid: int) -> bool:
    """A launcher may stand between a child and its parent."""
    at = os.getpid()
    while at > 1:
        try:
            at = int(Path(f"/proc/{at}/stat").read_text().rpartition(")")[2].split()[1])
        except (OSError, ValueError, IndexError):
            return True
        if at == pid:
            return True
    return False


def write_object(path: Path, value: object) -> None:
    """A Python object; its arrays go from and to memory as they lie there. Raises OSError if there is no room."""
    with path.open("wb") as file:
        pickle.dump(value, file, protocol=5)


def read_object(path: Path) -> Any:
    """Only of files that this user's own processes have written: whoever writes them decides what happens here."""
    with path.open("rb") as file:
        return pickle.load(file)
