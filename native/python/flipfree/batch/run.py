"""Solves items in children, several at a time, and writes a line of results as each ends.

On the workers of a Dask scheduler too: every worker solves in children of its own, with the same limits.
"""

from __future__ import annotations

import asyncio
import collections
import contextlib
import tempfile
import threading
import time
from collections.abc import Callable, Generator, Iterator, Mapping, Sequence
from concurrent.futures import CancelledError, ThreadPoolExecutor, as_completed
from dataclasses import dataclass
from pathlib import Path
from typing import Any, TextIO

from ..texts import counted
from .child import Child, Engine, Limits, NotStarted
from .plan import OTHER_KIND, Item, PlanError, listed
from .results import STATUSES, Record, begun, hash_of, in_use, line_of, load, still_holds

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


#: Solves items in whatever order; ends early when the event is set.
Records = Generator[Record, None, None]
Runner = Callable[[Sequence[Item], Work, threading.Event], Records]


def solve_item(child: Child, item: Item, work: Work) -> Record | None:
    """The whole record of an item; None if it was given up. Raises NotStarted."""
    source = work.root / item.source
    target = None if item.target is None else str(work.root / item.target)
    content = hash_of(source)
    if item.refusal:
        refused = {"status": "refused", "reason": OTHER_KIND, "message": item.refusal}
        return record_of(item, work, content, refused | {"seconds": 0.0})
    answer = child.solve({"source": str(source), "target": target})
    return None if answer is None else record_of(item, work, content, answer)


def record_of(item: Item, work: Work, content: str | None, answer: Record) -> Record:
    """content: hash of the input. answer: what a child says, or what became of it."""
    record: Record = {
        "input": item.source.as_posix(),
        "output": None if item.target is None else item.target.as_posix(),
        "status": answer["status"],
        "message": answer.get("message", ""),
        "reason": answer.get("reason", ""),
        "written": answer.get("written", False),
        "hash": content,
        **work.said,
    }
    more = sorted(answer.keys() - record.keys() - {"restart"})
    return record | {name: answer[name] for name in more}


def on_this_machine(jobs: int) -> Runner:
    """That many models at a time, each in a child process."""

    def runner(items: Sequence[Item], work: Work, stop: threading.Event) -> Records:
        def begin() -> None:
            _here.child, _here.work = Child(work.engine, work.limits, stop), work

        pool = ThreadPoolExecutor(max(min(jobs, len(items)), 1), initializer=begin)
        solved = [pool.submit(solve_on_thread, item, work) for item in items]
        try:
            yield from filter(None, (future.result() for future in as_completed(solved)))
        finally:
            stop.set()
            pool.shutdown(cancel_futures=True)

    return runner


#: Times that a model is given up by the scheduler, after several workers each, before it counts as failed.
_MOST_DEATHS = 4

_here = threading.local()  # of a thread that solves: its child, which ends with it


def solve_on_thread(item: Item, work: Work) -> Record | None:
    """Runs here or on a worker; the thread's child goes from one model to the next as long as the work is the same."""
    if getattr(_here, "work", None) != work:
        _here.child, _here.work = Child(work.engine, work.limits), work
    child: Child = _here.child
    return solve_item(child, item, work)


def on_dask(address: str) -> Runner:
    def runner(items: Sequence[Item], work: Work, stop: threading.Event) -> Records:
        try:
            import distributed
        except ImportError:
            raise PlanError(
                "--dask needs the package distributed: pip install distributed."
            ) from None
        try:
            client = distributed.Client(address, timeout=30)
        except (OSError, ValueError) as error:
            raise NotStarted(f"--dask {address}: no scheduler answers there: {error}") from error
        with client:
            yield from _solved(client, items, work)

    return runner


def _solved(client: Any, items: Sequence[Item], work: Work) -> Records:
    import distributed

    def submitted(item: Item) -> Any:
        return client.submit(solve_on_thread, item, work, pure=False)

    item_of = {submitted(item): item for item in items}
    deaths: collections.Counter[Item] = collections.Counter()
    ended = distributed.as_completed(item_of)
    for future in ended:
        item = item_of.pop(future)
        try:
            record = future.result()
        except distributed.KilledWorker as error:
            # Its workers died with it; not necessarily of it, so it is asked for again.
            deaths[item] += 1
            if deaths[item] < _MOST_DEATHS:
                again = submitted(item)
                item_of[again] = item
                ended.add(again)
                continue
            record = _lost(item, work, f"the workers that solved it died: {error}")
        except (asyncio.CancelledError, CancelledError, OSError) as error:
            raise NotStarted(
                f"The scheduler was lost ({error}). --resume goes on with what is left."
            ) from error
        future.release()
        yield record if record is not None else _lost(item, work, "its worker was stopped")


def _lost(item: Item, work: Work, message: str) -> Record:
    answer = {"status": "failed", "message": message, "reason": "crash", "seconds": 0.0}
    return record_of(item, work, hash_of(work.root / item.source), answer)


def run(
    items: Sequence[Item],
    left: Sequence[Item],
    work: Work,
    runner: Runner,
    add: Callable[[Record], None],
    progress: Progress,
    *,
    keep_going: bool,
) -> int:
    """Solves those that are left of all items; the exit status. Raises PlanError, NotStarted: nothing more can be solved.

    keep_going: False ends the run at the first model that is refused or fails.
    """
    progress.begin(items, left)
    stop, status = threading.Event(), 0
    records = runner(left, work, stop)
    try:
        for record in records:
            add(record)
            progress.ended(record)
            bad = record["status"] in ("refused", "failed")
            if record["reason"] == NOT_WRITTEN or (bad and not keep_going):
                status = 1
            if bad and not keep_going:
                break
    finally:
        stop.set()
        records.close()
    progress.end()
    return status


@contextlib.contextmanager
def results_in(
    file: Path | None, kept: Sequence[Record], left: Sequence[Item]
) -> Iterator[Callable[[Record], None]]:
    """What adds a line to the file of results, which begins anew with the lines ``kept``; the folders of all outputs are there.
    Raises PlanError."""
    _make_folders(left, file)
    if file is None:
        yield lambda _record: None
        return
    try:
        stream = begun(file, kept)
    except OSError as error:
        raise _no_results(file, error) from error

    def add(record: Record) -> None:
        try:
            stream.write(line_of(record))
        except OSError as error:  # the disk is full: no result would be kept
            raise _no_results(file, error) from error

    with stream:
        yield add


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
        failed = retry and record is not None and record["status"] == "failed"
        if failed or not (record and still_holds(record, item, work.said, hash_of(item.source))):
            left.append(item)
            last.pop(name, None)
    return list(last.values()), left


def _make_folders(items: Sequence[Item], file: Path | None) -> None:
    """Those of outputs and of the results, before anything is solved. Permissions are not all that keeps files from being made,
    so it is tried."""
    folders = sorted({item.target.parent for item in items if item.target is not None})
    for folder in folders:
        there = next(place for place in (folder, *folder.parents) if place.exists())
        if not there.is_dir():
            raise PlanError(f"{folder}: {there} is a file, not a folder. Give another --out.")
    for folder in [*([] if file is None else [file.parent]), *folders]:
        try:
            folder.mkdir(parents=True, exist_ok=True)
            with tempfile.TemporaryFile(dir=folder):
                pass
        except OSError as error:
            if file is not None and folder == file.parent:
                raise _no_results(file, error) from error
            why = error.strerror or error
            raise PlanError(
                f"{folder}: no files can be made there: {why}. Give another --out."
            ) from error


def _no_results(file: Path, error: OSError) -> PlanError:
    return PlanError(f"{file}: the results cannot be written there: {error.strerror or error}.")


#: Bytes of input that cost as much as what every model costs.
_EACH = 20_000


class Progress:
    """Lines on a stream; None: nothing is said."""

    def __init__(self, stream: TextIO | None) -> None:
        self._stream = stream
        self._counts: collections.Counter[str] = collections.Counter()
        self._other_kinds: list[str] = []

    def begin(self, items: Sequence[Item], left: Sequence[Item]) -> None:
        self._begin = time.monotonic()
        self._total, self._done = len(items), len(items) - len(left)
        self._sizes = {item.source.as_posix(): _size(item) for item in left}
        self._size_left = self._size = sum(self._sizes.values())
        if self._done:
            self._say(
                f"{self._done} of {counted(self._total, 'model')} {'is' if self._total == 1 else 'are'} done already"
            )

    def ended(self, record: Record) -> None:
        self._done += 1
        self._counts[record["status"]] += 1
        if record["reason"] == OTHER_KIND:
            self._other_kinds.append(record["input"])
        self._size_left -= self._sizes.get(record["input"], 0)
        width = len(str(self._total))
        line = f"[{self._done:{width}}/{self._total}] {record['status']:9} {record['input']}  {record['seconds']:.2f} s"
        if self._done < self._total:
            line += f"  ({self._left()} left)"
        text = record["message"].splitlines()
        self._say(f"{line}\n    {text[0]}" if text else line)

    def end(self) -> None:
        parts = [f"{self._counts[name]} {name}" for name in STATUSES if self._counts[name]]
        seconds = _time(time.monotonic() - self._begin)
        self._say(
            f"{counted(self._counts.total(), 'model')} in {seconds}: {', '.join(parts) or 'none'}"
        )
        if self._other_kinds:
            self._say(f"Not mapped, as files of another type: {listed(self._other_kinds)}")

    def _left(self) -> str:
        done = self._size - self._size_left
        passed = time.monotonic() - self._begin
        return _time(passed * self._size_left / done) if done else "?"

    def _say(self, text: str) -> None:
        if self._stream is not None:
            print(text, file=self._stream, flush=True)


def _size(item: Item) -> int:
    try:
        return item.source.stat().st_size + _EACH
    except OSError:
        return _EACH


def _time(seconds: float) -> str:
    if seconds < 100:
        return f"{seconds:.0f} s"
    if seconds < 6000:
        return f"{seconds / 60:.0f} min"
    return f"{seconds / 3600:.1f} h"
