"""Solves items in children, several at a time, and writes a line of results as each ends: the file of results has one line of
JSON per input, there as soon as the input is done, which decides on resuming what is left.

On the workers of a Dask scheduler too: every worker solves in children of its own, with the same limits.
"""

from __future__ import annotations

import asyncio
import collections
import contextlib
import json
import os
import sys
import tempfile
import threading
import time
from collections.abc import Callable, Generator, Iterator, Mapping, Sequence
from concurrent.futures import CancelledError, ThreadPoolExecutor, as_completed
from dataclasses import dataclass
from pathlib import Path
from typing import Any, BinaryIO, TextIO

from ..texts import counted
from .child import Child, Engine, Limits, NotStarted
from .plan import OTHER_KIND, Item, PlanError, Record, hash_of, listed

if sys.platform == "win32":
    from ..process import windows

#: Best first.
STATUSES = ("certified", "warned", "refused", "failed")

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


#: Of items, in whatever order they end in; nothing goes on when it is closed.
Records = Generator[Record, None, None]


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


_here = threading.local()  # of a thread that solves: its child, which ends with it


def solve_on_thread(item: Item, work: Work) -> Record | None:
    """Runs here or on a worker; the thread's child goes from one model to the next as long as the work is the same."""
    if getattr(_here, "work", None) != work:
        _here.child, _here.work = Child(work.engine, work.limits), work
    child: Child = _here.child
    try:
        return solve_item(child, item, work)
    except BaseException:  # which holds what is here
        child.close()
        raise


def on_this_machine(items: Sequence[Item], work: Work, jobs: int) -> Records:
    """That many models at a time, each in a child process."""
    stop = threading.Event()

    def begin() -> None:
        _here.child, _here.work = Child(work.engine, work.limits, stop), work

    pool = ThreadPoolExecutor(max(min(jobs, len(items)), 1), initializer=begin)
    solved = [pool.submit(solve_on_thread, item, work) for item in items]
    try:
        yield from filter(None, (future.result() for future in as_completed(solved)))
    finally:
        stop.set()
        pool.shutdown(cancel_futures=True)


#: Times that a model is given up by the scheduler, after several workers each, before it counts as failed.
_MOST_DEATHS = 4


def on_dask(items: Sequence[Item], work: Work, address: str) -> Records:
    """On the workers of the scheduler with this address. Raises PlanError, NotStarted."""
    try:
        import distributed
    except ImportError:
        raise PlanError("--dask needs the package distributed: pip install distributed.") from None
    try:
        client = distributed.Client(address, timeout=30)
    except (OSError, ValueError) as error:
        raise NotStarted(f"--dask {address}: no scheduler answers there: {error}") from error

    def submitted(item: Item) -> Any:
        return client.submit(solve_on_thread, item, work, pure=False)

    with client:
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
    records: Records, add: Callable[[Record], None], progress: Progress, *, keep_going: bool
) -> int:
    """Solves until there are no more; the exit status. Raises PlanError, NotStarted: nothing more can be solved.

    keep_going: False ends the run at the first model that is refused or fails.
    """
    status = 0
    with contextlib.closing(records):
        for record in records:
            add(record)
            progress.ended(record)
            bad = record["status"] in ("refused", "failed")
            if record["reason"] == NOT_WRITTEN or (bad and not keep_going):
                status = 1
            if bad and not keep_going:
                break
    progress.end()
    return status


def load(path: Path) -> list[Record]:
    """The whole lines; one that was cut off when its run was killed is none."""
    try:
        content = path.read_bytes()
    except OSError:  # there is none, or none can be there: writing says why
        return []
    records = []
    for line in content.split(b"\n")[:-1]:
        try:
            record = json.loads(line)
        except ValueError:
            continue
        if isinstance(record, dict) and "input" in record and record.get("status") in STATUSES:
            records.append(record)
    return records


def still_holds(record: Record, item: Item, wanted: Mapping[str, Any], content: str | None) -> bool:
    """Whether a line is what solving the item again would give.

    Args:
        wanted: what the record of this run would say of "command", "options", "versions" and "limits".
        content: hash of the input now.
    """
    target = None if item.target is None else item.target.as_posix()
    same = record.get("output") == target and record.get("hash") == content
    same = same and all(record.get(name) == wanted[name] for name in ("command", "options"))
    same = same and record.get("versions") == wanted["versions"]
    if record["status"] == "failed":  # more time or memory may help
        return same and record.get("limits") == wanted["limits"]
    written = target is None or not record.get("written") or Path(target).is_file()
    return same and written


def in_use(path: Path) -> bool:
    """Whether a run that lives writes to this file."""
    try:
        with path.open("rb") as file:
            return not _locked(file)
    except OSError:
        return False


def _locked(file: BinaryIO) -> bool:
    """Takes the file's lock, which ends with its process."""
    if sys.platform == "win32":
        return windows.lock(file)
    import fcntl

    try:
        fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except OSError:
        return False
    return True


def line_of(record: Record) -> bytes:
    """Bytes of names that are no UTF-8 are surrogates here, and so written as JSON has them: as \\udce9."""
    text = json.dumps(record, allow_nan=False, ensure_ascii=False)
    return text.encode(errors="backslashreplace") + b"\n"


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
    part = file.with_name(f".{file.name}.{os.getpid()}.part")
    try:
        part.write_bytes(b"".join(map(line_of, kept)))
        part.replace(file)
        stream = file.open("ab", buffering=0)  # lines that are appended are there at once
    except OSError as error:
        with contextlib.suppress(OSError):
            part.unlink()
        # Windows replaces no open file.
        replacing = error.filename2 is not None
        in_way = os.name == "nt" and isinstance(error, PermissionError) and replacing
        raise (_busy(file) if in_way else _no_results(file, error)) from error

    def add(record: Record) -> None:
        try:
            stream.write(line_of(record))
        except OSError as error:  # the disk is full: no result would be kept
            raise _no_results(file, error) from error

    with stream:
        if not _locked(stream):
            raise _busy(file)
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
        raise _busy(file)
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


def _busy(file: Path) -> PlanError:
    return PlanError(f"{file}: another run writes to this file. Give another one with --json.")


def _no_results(file: Path, error: OSError) -> PlanError:
    return PlanError(f"{file}: the results cannot be written there: {error.strerror or error}.")


#: Bytes of input that cost as much as what every model costs.
_EACH = 20_000


class Progress:
    """Lines on a stream; None: nothing is said."""

    def __init__(self, stream: TextIO | None, items: Sequence[Item], left: Sequence[Item]) -> None:
        """left: those of all items that are still to be solved."""
        self._stream = stream
        self._counts: collections.Counter[str] = collections.Counter()
        self._other_kinds: list[str] = []
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
