"""The child's side: settings and requests come in on the standard input, answers go out on the standard output."""

from __future__ import annotations

import json
import os
import re
import sys
import time
import traceback
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

from ..errors import FlipfreeError, Infeasible, InvalidInput
from ..process.client import die_with, say
from .results import Record

if sys.platform == "win32":
    from ..process import windows

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
    try:
        Path("/proc/self/clear_refs").write_text("5")
    except OSError:
        pass


def peak_megabytes() -> float:
    """Largest memory of this process since the last reset, MB; on Linux alone there is one, elsewhere it is of its whole life."""
    if sys.platform == "win32":
        return windows.memory()[1]
    try:
        for line in Path("/proc/self/status").read_text().splitlines():
            if line.startswith("VmHWM:"):
                return int(line.split()[1]) / 1024
    except OSError:
        pass
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
