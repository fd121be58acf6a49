"""A process that solves one model after the other, and may crash, hang or eat all memory: that costs one model.

    parent --{"settings"}--> child --ready--> parent --request--> child --answer--> parent --request--> ...

Requests and answers are lines of JSON on the child's standard input and output; what else it prints there is kept for
the report of a crash. A child that dies takes the request with it, which is tried once more in a fresh one if others were
solved there before: no model pays for what another left behind.
"""

from __future__ import annotations

import collections
import contextlib
import json
import os
import queue
import signal
import subprocess
import threading
import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from ..process import pipes
from .results import Record

#: Begins every answer of a child.
MARK = "@flipfree-batch "

_LOOK = 0.05  # seconds between looks at a child's memory
_START = 300.0  # seconds that a child may take to start: disks of farms can be slow
_KEPT_LINES = 12


class NotStarted(RuntimeError):
    """No child can be started: the infrastructure fails, not a model."""


@dataclass(frozen=True)
class Engine:
    """How children are started and what they solve; all of it can be sent to another machine.

    Attributes:
        command: of a child. environment: added to this process'.
        settings: what the child is to do with every request: JSON.
    """

    command: Sequence[str]
    environment: Mapping[str, str]
    settings: Mapping[str, Any]


@dataclass(frozen=True)
class Limits:
    """Of one model: seconds of the clock, megabytes of memory; None is no limit."""

    timeout: float | None = None
    memory: float | None = None


def memory_can_be_limited() -> bool:
    return Path("/proc/self/statm").exists()


class Child:
    """Starts when it is first needed. One thread at a time."""

    def __init__(self, engine: Engine, limits: Limits, stop: threading.Event | None = None) -> None:
        """stop: when it is set, a model that is being solved is given up (``solve`` returns None)."""
        self._engine, self._limits = engine, limits
        self._stop = stop or threading.Event()
        self._process: subprocess.Popen[bytes] | None = None
        self._lines: queue.SimpleQueue[bytes | None] = queue.SimpleQueue()
        self._said: collections.deque[str] = collections.deque(maxlen=_KEPT_LINES)
        self._solved = 0  # by this process

    def solve(self, request: Mapping[str, Any]) -> Record | None:
        """The child's answer, or what became of it as a record with status "failed". Raises NotStarted."""
        if self._process is None:
            self._start()
        fresh = self._solved == 0
        answer = self._ask(request)
        if answer is not None and answer.get("reason") in ("crash", "memory") and not fresh:
            self.close()
            return self.solve(request)
        if answer is None or answer.get("restart"):
            self.close()
        self._solved += 1
        return answer

    def close(self) -> None:
        """Ends the process, whatever it is doing."""
        process, self._process = self._process, None
        if process is None:
            return
        with contextlib.suppress(OSError):
            if os.name == "posix":
                os.killpg(process.pid, signal.SIGKILL)
            else:
                process.kill()
        process.wait()
        for stream in (process.stdin, process.stdout):
            if stream is not None:
                with contextlib.suppress(OSError):
                    stream.close()

    def _start(self) -> None:
        self._lines = queue.SimpleQueue()
        self._said.clear()
        self._solved = 0
        try:
            self._process = subprocess.Popen(
                list(self._engine.command),
                stdin=subprocess.PIPE,
                stdout=subprocess.PIPE,
                stderr=subprocess.STDOUT,
                env={**os.environ, **self._engine.environment},
                start_new_session=os.name == "posix",
            )
        except OSError as error:
            raise NotStarted(f"{self._engine.command[0]} cannot be started: {error}") from error
        assert self._process.stdout is not None
        threading.Thread(
            target=_pass_on, args=(self._process.stdout, self._lines), daemon=True
        ).start()
        self._send({"parent": os.getpid(), "settings": self._engine.settings})
        ready = self._answer(_START, None)
        if self._stop.is_set():
            return
        if ready is None or not ready.get("ready"):
            self.close()
            said = "\n  ".join(self._said) or "it said nothing"
            raise NotStarted(f"A process that solves models did not start:\n  {said}")

    def _ask(self, request: Mapping[str, Any]) -> Record | None:
        begin = time.monotonic()
        self._said.clear()
        self._send(request)
        record = self._answer(self._limits.timeout, self._limits.memory)
        if record is not None and record.get("restart"):
            record["seconds"] = round(time.monotonic() - begin, 3)
        return record

    def _send(self, line: Mapping[str, Any]) -> None:
        assert self._process is not None and self._process.stdin is not None
        # If it has died, the answer says so.
        pipes.send(self._process.stdin, json.dumps(line).encode() + b"\n")

    def _answer(self, seconds: float | None, memory: float | None) -> Record | None:
        """Waits for it; None if all is to be stopped."""
        assert self._process is not None
        end = None if seconds is None else time.monotonic() + seconds
        peak = 0.0
        while not self._stop.is_set():
            try:
                line = self._lines.get(timeout=_LOOK)
            except queue.Empty:
                now = resident(self._process.pid)
                peak = max(peak, now)
                if memory is not None and now > memory:
                    text = f"needed more than the {memory:g} MB that --memory allows"
                    return _lost("memory", text, peak)
                if end is not None and time.monotonic() > end:
                    text = f"took longer than the {seconds:g} s that --timeout allows"
                    return _lost("timeout", text, peak)
                continue
            if line is None:
                return self._death(peak)
            text = line.decode(errors="replace").rstrip()
            if text.startswith(MARK):
                found: Record = json.loads(text[len(MARK) :])
                return found
            if text:
                self._said.append(text)
        return None

    def _death(self, peak: float) -> Record:
        assert self._process is not None
        status = self._process.wait()
        how = f"ended with status {status}"
        if status < 0:
            how = f"was ended by signal {-status} ({signal.Signals(-status).name})"
        if status == -signal.SIGKILL if os.name == "posix" else False:
            how += ", perhaps because the machine ran out of memory: fewer --jobs, or --memory, keep it from that"
        said = f" Last it said: {self._said[-1]}" if self._said else ""
        return _lost("crash", f"its process {how}.{said}", peak)


def _lost(reason: str, message: str, peak: float) -> Record:
    return {
        "status": "failed",
        "reason": reason,
        "message": message,
        "peak_memory": round(peak, 1),
        "restart": True,
    }


def _pass_on(stream: Any, lines: queue.SimpleQueue[bytes | None]) -> None:
    with contextlib.suppress(OSError, ValueError):
        for line in iter(stream.readline, b""):
            lines.put(line)
    lines.put(None)


def resident(pid: int) -> float:
    """Memory of a process in MB; 0 where the system does not say."""
    try:
        pages = int(Path(f"/proc/{pid}/statm").read_text().split()[1])
    except (OSError, ValueError, IndexError):
        return 0.0
    return pages * os.sysconf("SC_PAGE_SIZE") / 2**20
