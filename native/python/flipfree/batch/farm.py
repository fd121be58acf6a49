"""A batch on the workers of a Dask scheduler. Every worker solves in children of its own, with the same limits."""

from __future__ import annotations

import threading
from collections.abc import Iterator, Sequence
from typing import Any

from .child import Child, NotStarted
from .plan import Item, PlanError
from .results import Record
from .run import Runner, Work, solve_item

_here = threading.local()  # of a worker's thread: its child, which outlives a model


def solve_on_worker(item: Item, work: Work) -> Record | None:
    """Runs on the worker; the thread's child goes from one model to the next as long as the work is the same."""
    known = getattr(_here, "child", None)
    if known is None or _here.work != work:
        if known is not None:
            known.close()
        _here.child, _here.work = Child(work.engine, work.limits), work
    child: Child = _here.child
    return solve_item(child, item, work)


def on_dask(address: str) -> Runner:
    def runner(items: Sequence[Item], work: Work, stop: threading.Event) -> Iterator[Record]:
        try:
            import distributed
        except ImportError:
            raise PlanError(
                "--dask needs the package `distributed`: pip install distributed."
            ) from None
        try:
            client = distributed.Client(address, timeout=30)
        except (OSError, ValueError) as error:
            raise NotStarted(f"--dask {address}: no scheduler answers there: {error}") from error
        with client:
            asked = {client.submit(solve_on_worker, item, work, pure=False): item for item in items}
            for future in distributed.as_completed(asked):
                yield _result(future, asked[future], work)
                future.release()

    return runner


def _result(future: Any, item: Item, work: Work) -> Record:
    """Of a future that has ended. A model that kills its workers is one model's failure."""
    import distributed

    try:
        record: Record | None = future.result()
    except distributed.KilledWorker as error:
        return _lost(item, work, f"the workers that solved it died: {error}")
    if record is None:
        return _lost(item, work, "its worker was stopped")
    return record


def _lost(item: Item, work: Work, message: str) -> Record:
    return {
        "input": item.source.as_posix(),
        "output": None if item.target is None else item.target.as_posix(),
        "status": "failed",
        "message": message,
        "reason": "crash",
        "hash": None,
        **work.said,
        "seconds": 0.0,
    }
