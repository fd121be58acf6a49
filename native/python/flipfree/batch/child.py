"""A process that solves one model after the other, and may crash, hang or eat all memory: that costs one model.

    parent --{"settings"}--> child --ready--> parent --request--> child --answer--> parent --request--> ...

Requests and answers go through the child's standard input and output (process/client.py); what else it prints there is kept
for the report of a crash. A child that dies takes the request with it, which is tried once more in a fresh one if others were
solved there before: no model pays for what another left behind. The child's side is ``serve``.
"""

import contextlib
import json
import os
import re
import sys
import threading
import time
import traceback
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from ..errors import FlipfreeError, Infeasible, InvalidInput
from ..process.client import Child as Process
from ..process.client import die_with, how_ended, say

if sys.platform == "win32":
    from ..process import windows
from .plan import Record

_LOOK = 0.05  # seconds between looks at a child's memory
_START = 300.0  # seconds that a child may take to start: disks of farms can be slow


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
    """Linux and Windows say how much a process has; macOS would have to be asked by starting another."""
    return sys.platform == "win32" or Path("/proc/self/statm").exists()


class Child:
    """Starts when it is first needed. One thread at a time."""

    def __init__(self, engine: Engine, limits: Limits, stop: threading.Event | None = None) -> None:
        """stop: when it is set, a model that is being solved is given up (``solve`` returns None)."""
        self._engine, self._limits = engine, limits
        self._stop = stop or threading.Event()
        self._process: Process | None = None
        self._solved = 0  # by this process

    def solve(self, request: Mapping[str, Any]) -> Record | None:
        """The child's answer, or what became of it as a record with status "failed". Raises NotStarted."""
        process = self._process or self._start()
        fresh = self._solved == 0
        begin = time.monotonic()
        process.said.clear()
        process.tell(request)
        answer = self._answer(process, self._limits.timeout, self._limits.memory)
        if answer is not None and answer.get("restart"):
            answer["seconds"] = round(time.monotonic() - begin, 3)
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
        if process is not None:
            process.end()

    def __del__(self) -> None:
        self.close()

    def _start(self) -> Process:
        """The process; where all is to be stopped, it may not be ready."""
        self._solved = 0
        engine = self._engine
        try:
            process = Process(engine.command, engine.environment)
        except OSError as error:
            raise NotStarted(f"{engine.command[0]} cannot be started: {error}") from error
        self._process = process
        process.tell({"parent": os.getpid(), "settings": engine.settings})
        ready = self._answer(process, _START, None)
        if not self._stop.is_set() and (ready is None or not ready.get("ready")):
            self.close()
            said = "\n  ".join(process.said) or "it said nothing"
            raise NotStarted(f"A process that solves models did not start:\n  {said}")
        return process

    def _answer(
        self, process: Process, seconds: float | None, memory: float | None
    ) -> Record | None:
        """Waits for it; None if all is to be stopped."""
        end = None if seconds is None else time.monotonic() + seconds
        peak = 0.0
        while not self._stop.is_set():
            messages = process.heard(_LOOK)
            if messages is None:
                return _death(process, peak)
            if messages:
                return messages[0]
            now = resident(process)
            peak = max(peak, now)
            if memory is not None and now > memory:
                text = f"needed more than the {memory:g} MB that --memory allows"
                return _lost("memory", text, peak)
            if end is not None and time.monotonic() > end:
                text = f"took longer than the {seconds:g} s that --timeout allows"
                return _lost("timeout", text, peak)
        return None


def _death(process: Process, peak: float) -> Record:
    status = process.wait()
    killed = ", perhaps because the machine ran out of memory: fewer --jobs, or --memory, keep it from that"
    how = how_ended(status, killed)
    said = f" Last it said: {process.said[-1]}" if process.said else ""
    return _lost("crash", f"its process {how}.{said}", peak)


def _lost(reason: str, message: str, peak: float) -> Record:
    return {
        "status": "failed",
        "reason": reason,
        "message": message,
        "peak_memory": round(peak, 1),
        "restart": True,
    }


def resident(process: Process) -> float:
    """Memory of a process in MB; 0 where the system does not say."""
    if sys.platform == "win32":
        return windows.memory(int(process._handle))[0]
    try:
        pages = int(Path(f"/proc/{process.pid}/statm").read_text().split()[1])
    except (OSError, ValueError, IndexError):
        return 0.0
    return pages * os.sysconf("SC_PAGE_SIZE") / 2**20


#: What one model is solved by: (input, output or None) -> record with "status" at least.
Unit = Callable[[Path, Path | None], Record]


def serve(unit_of: Callable[[Mapping[str, Any]], Unit]) -> int:
    """Answers requests until there are no more. unit_of: settings -> the unit."""
    opening = json.loads(sys.stdin.buffer.readline() or b"{}")
    if "settings" not in opening:
        return 1
    if not die_with(opening["parent"]):
        os._exit(1)
    unit = unit_of(opening["settings"])
    limit = opening["settings"].get("options", {}).get("max_seconds")
    _say({"ready": True})
    for line in iter(sys.stdin.buffer.readline, b""):
        request = json.loads(line)
        target = request["target"]
        source = Path(request["source"])
        _say(answer(unit, source, None if target is None else Path(target), limit))
    return 0


def answer(
    unit: Unit, source: Path, target: Path | None, max_seconds: float | None = None
) -> Record:
    """The record of one model, whatever happens, short of the end of the process. max_seconds: of the command line."""
    begin = time.perf_counter()
    _reset_peak()
    try:
        record = unit(source, target)
    except FlipfreeError as error:
        record = of_error(error, max_seconds)
        record["message"] = record["message"].removeprefix(f"{source}: ")
    except MemoryError:
        text = "there is not enough memory: fewer --jobs, or a machine with more"
        record = {"status": "failed", "reason": "memory", "message": text, "restart": True}
    except OSError as error:
        record = {"status": "failed", "reason": "file", "message": str(error)}
    except Exception as error:  # ours: it is one model's, and others go on
        traceback.print_exc()
        text = f"{type(error).__name__}: {error}. Please report this as a bug."
        record = {"status": "failed", "reason": "internal error", "message": text}
    record["seconds"] = round(time.perf_counter() - begin, 3)
    record["peak_memory"] = round(peak_megabytes(), 1)
    return record


def of_error(error: FlipfreeError, max_seconds: float | None = None) -> Record:
    """What cannot be mapped is refused; what the solver could not do, or a file that cannot be reached, failed."""
    refused = isinstance(error, (InvalidInput, Infeasible)) and error.code != "file not accessible"
    record: Record = {
        "status": "refused" if refused else "failed",
        "reason": error.code or type(error).__name__,
        "message": in_command_line_terms(str(error), max_seconds),
    }
    if error.code == "out of memory":
        record |= {"reason": "memory", "restart": True}
    if error.kind != "none" and error.elements:
        record["place"] = {"kind": error.kind, "elements": list(map(int, error.elements[:20]))}
    return record


def _say(line: Mapping[str, Any]) -> None:
    sys.stdout.flush()
    say(line)


def _reset_peak() -> None:
    with contextlib.suppress(OSError):
        Path("/proc/self/clear_refs").write_text("5")


def peak_megabytes() -> float:
    """Largest memory of this process since the last reset, MB; on Linux alone there is one, elsewhere it is of its whole life."""
    if sys.platform == "win32":
        return windows.memory()[1]
    with contextlib.suppress(OSError):
        for line in Path("/proc/self/status").read_text().splitlines():
            if line.startswith("VmHWM:"):
                return int(line.split()[1]) / 1024
    import resource

    unit = 2**20 if sys.platform == "darwin" else 2**10
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / unit


#: Argument of the package, or words of Blender's windows -> option.
_WORDS = {
    r"\bmax_seconds = ": "--max-seconds ",
    r"\(max_seconds\)": "(--max-seconds)",
    r"\bmax_seconds\b": "--max-seconds",
    r"\bthreads\b(?= must)": "--threads",
    r"\bbound\b(?= must)": "--bound",
    r"\biterations\b(?= must)": "--iterations",
    r"Allow more time in the redo panel": "Allow more time with --max-seconds",
    r"Change them in the redo panel": "Change the options of the command",
    r"[Tt]urn on Cut Open in the redo panel": "give --cut-open",
    r"Turn on May Add Vertices in the redo panel": "Leave --no-new-vertices out",
    r"allow stacked ones in the redo panel": "allow stacked ones with --allow-stacked",
    r"in the redo panel": "with the options of the command (--help)",
}


def in_command_line_terms(text: str, max_seconds: float | None = None) -> str:
    """max_seconds: as given, where solvers got a part of it."""
    if max_seconds is not None:
        text = re.sub(r"\bmax_seconds = [\d.e+-]*\d", f"max_seconds = {max_seconds:g}", text)
    for words, option in _WORDS.items():
        text = re.sub(words, option, text)
    return text
