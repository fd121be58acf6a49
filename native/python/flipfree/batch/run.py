"""Solves items in children, several at a time, and writes a line of results as each ends."""

from __future__ import annotations

import os
import queue
import tempfile
import threading
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from ..texts import counted
from .child import Child, Engine, Limits, NotStarted
from .plan import OTHER_KIND, Item, PlanError
from .progress import Progress
from .results import Record, Results, hash_of, in_use, load, still_holds

#: Reason of a record: the model is solved, and the place for its output fails, as it would for the next one.
NOT_WRITTEN = "output cannot be written"


def not_written(target: Path, error: Exception) -> Record:
    """Of a model whose output there failed with that error."""
    message = str(error).strip()
    if isinstance(error, OSError):
        cure = "Check that there is room and that the folder may be written to."
        message = f"{target} cannot be written: {error.strerror or error}. {cure}"
    return {"status": "failed", "reason": NOT_WRITTEN, "message": message}


@dataclass(frozen=True)
class Work:
    """What is done with every item.

    Attributes:
        said: what every record says of it: "command", "options", "versions" and "limits".
        root: folder that relative paths are meant from, also on other machines.
    """

    engine: Engine
    limits: Limits
    said: Mapping[str, Any]
    root: Path


def work_of(
    engine: Engine,
    limits: Limits,
    command: str,
    options: Mapping[str, Any],
    versions: Mapping[str, str],
) -> Work:
    said = {"command": command, "options": dict(options), "versions": dict(versions)}
    return Work(engine, limits, {**said, "limits": asdict(limits)}, Path.cwd())


#: Solves items in whatever order; ends early when the event is set.
Runner = Callable[[Sequence[Item], Work, threading.Event], Iterator[Record]]


def solve_item(child: Child, item: Item, work: Work) -> Record | None:
    """The whole record of an item; None if it was given up. Raises NotStarted."""
    source = work.root / item.source
    target = None if item.target is None else str(work.root / item.target)
    content = hash_of(source)
    if item.refusal:
        answer: Record | None = _refused(item)
    else:
        answer = child.solve({"source": str(source), "target": target})
    if answer is None:
        return None
    answer.pop("restart", None)
    record: Record = {
        "input": item.source.as_posix(),
        "output": None if item.target is None else item.target.as_posix(),
        "status": answer.pop("status"),
        "message": answer.pop("message", ""),
        "reason": answer.pop("reason", ""),
        "written": answer.pop("written", False),
        "hash": content,
        **work.said,
    }
    return record | {name: answer[name] for name in sorted(answer)}


def _refused(item: Item) -> Record:
    return {
        "status": "refused",
        "reason": OTHER_KIND,
        "message": item.refusal,
        "seconds": 0.0,
    }


def on_this_machine(jobs: int) -> Runner:
    """That many models at a time, each in a child process."""

    def runner(items: Sequence[Item], work: Work, stop: threading.Event) -> Iterator[Record]:
        waiting: queue.SimpleQueue[Item] = queue.SimpleQueue()
        for item in items:
            waiting.put(item)
        ended: queue.SimpleQueue[Record | BaseException | None] = queue.SimpleQueue()
        threads = [
            threading.Thread(target=_solve_waiting, args=(waiting, ended, work, stop))
            for _ in range(min(jobs, len(items)))
        ]
        for thread in threads:
            thread.start()
        living = len(threads)
        try:
            while living:
                found = ended.get()
                if found is None:
                    living -= 1
                elif isinstance(found, BaseException):
                    raise found
                else:
                    yield found
        finally:
            stop.set()
            for thread in threads:
                thread.join()

    return runner


def _solve_waiting(
    waiting: queue.SimpleQueue[Item],
    ended: queue.SimpleQueue[Record | BaseException | None],
    work: Work,
    stop: threading.Event,
) -> None:
    child = Child(work.engine, work.limits, stop)
    try:
        while not stop.is_set():
            record = solve_item(child, waiting.get_nowait(), work)
            if record is not None:
                ended.put(record)
    except queue.Empty:
        pass
    except BaseException as error:
        ended.put(error)
    finally:
        child.close()
        ended.put(None)


def run(
    items: Sequence[Item],
    work: Work,
    *,
    runner: Runner,
    file: Path | None,
    resume: bool,
    retry: bool,
    keep_going: bool,
    progress: Progress,
) -> int:
    """Solves all items that the file of results does not have yet; the exit status.

    Args:
        file: of the results. resume: it may have lines already; those that still hold are kept.
        retry: lines with status "failed" are not.
        keep_going: False ends the run at the first model that is refused or fails.

    Raises:
        PlanError, NotStarted: nothing, or nothing more, can be solved.
    """
    kept, left = sorted_out(items, work, file=file, resume=resume, retry=retry)
    _refuse_bad_places(left)
    _make_folders(left, file)
    try:
        results = Results(file, kept)
    except OSError as error:
        raise _no_results(file, error) from error
    progress.begin(items, left)
    stop, status = threading.Event(), 0
    records = runner(left, work, stop)
    try:
        for record in records:
            results.add(record)
            progress.ended(record)
            bad = record["status"] in ("refused", "failed")
            if record["reason"] == NOT_WRITTEN or (bad and not keep_going):
                status = 1
            if bad and not keep_going:
                break
    except OSError as error:  # the disk is full: no result would be kept
        raise PlanError(f"{file}: the results cannot be written: {error.strerror}.") from error
    finally:
        stop.set()
        close = getattr(records, "close", None)
        if close is not None:
            close()
        results.close()
    progress.end()
    return status


def sorted_out(
    items: Sequence[Item], work: Work, *, file: Path | None, resume: bool, retry: bool
) -> tuple[list[Record], list[Item]]:
    """(lines that are kept, items that are to be solved). Raises PlanError."""
    if file is None:
        if resume:
            raise PlanError("--resume goes on with a file of results: name it with --json.")
        return [], list(items)
    if in_use(file):
        raise PlanError(f"{file}: another run writes to this file. Give another one with --json.")
    lines = load(file)
    if lines and not resume:
        raise PlanError(
            f"{file} has {counted(len(lines), 'result')} already. "
            "Go on from there (--resume), delete the file, or name another one."
        )
    last = {record["input"]: record for record in lines}
    left = []
    for item in items:
        name = item.source.as_posix()
        record = last.get(name)
        if record is None or (retry and record["status"] == "failed"):
            holds = False
        else:
            holds = still_holds(record, item, work.said, hash_of(item.source))
        if not holds:
            left.append(item)
            last.pop(name, None)
    return list(last.values()), left


def _refuse_bad_places(items: Sequence[Item]) -> None:
    """Folders that cannot be made or written to are found before anything is solved."""
    for folder in _folders(items):
        there = folder
        while not there.exists() and there != there.parent:
            there = there.parent
        if not there.is_dir():
            raise PlanError(f"{folder}: {there} is a file, not a folder. Give another --out.")
        if not os.access(there, os.W_OK | os.X_OK):
            raise PlanError(
                f"{folder}: {there} cannot be written to. Give another --out, or change its permissions."
            )


def _make_folders(items: Sequence[Item], file: Path | None) -> None:
    """Those of outputs and of the results. Permissions are not all that keeps files from being made, so it is tried."""
    try:
        if file is not None:
            _try(file.parent)
    except OSError as error:
        raise _no_results(file, error) from error
    for folder in _folders(items):
        try:
            _try(folder)
        except OSError as error:
            raise PlanError(
                f"{folder}: no files can be made there: {error.strerror or error}. Give another --out."
            ) from error


def _folders(items: Sequence[Item]) -> list[Path]:
    return sorted({item.target.parent for item in items if item.target is not None})


def _try(folder: Path) -> None:
    folder.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryFile(dir=folder):
        pass


def _no_results(file: Path | None, error: OSError) -> PlanError:
    return PlanError(f"{file}: the results cannot be written there: {error.strerror or error}.")


__all__ = [
    "NOT_WRITTEN",
    "NotStarted",
    "Runner",
    "Work",
    "not_written",
    "on_this_machine",
    "run",
    "solve_item",
    "sorted_out",
    "work_of",
]
