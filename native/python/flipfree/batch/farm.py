"""A batch on the workers of a Dask scheduler. Every worker solves in children of its own, with the same limits."""

from __future__ import annotations

import asyncio
import collections
import concurrent.futures
import threading
from collections.abc import Iterator, Sequence
from typing import Any

from .child import Child, NotStarted
from .plan import Item, PlanError
from .results import Record, hash_of
from .run import Runner, Work, solve_item

#: Times that a model is given up by the scheduler, after several workers each, before it counts as failed.
_MOST_DEATHS = 4

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
                "--dask needs the package distributed: pip install distributed."
            ) from None
        try:
            client = distributed.Client(address, timeout=30)
        except (OSError, ValueError) as error:
            raise NotStarted(f"--dask {address}: no scheduler answers there: {error}") from error
        with client:
            yield from _solved(client, items, work)

    return runner


def _solved(client: Any, items: Sequence[Item], work: Work) -> Iterator[Record]:
    import distributed

    def submitted(item: Item) -> Any:
        return client.submit(solve_on_worker, item, work, pure=False)

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
        except (asyncio.CancelledError, concurrent.futures.CancelledError, OSError) as error:
            raise NotStarted(
                f"The scheduler was lost ({error}). --resume goes on with what is left."
            ) from error
        future.release()
        yield record if record is not None else _lost(item, work, "its worker was stopped")


def _lost(item: Item, work: Work, message: str) -> Record:
    return {
        "input": item.source.as_posix(),
        "output": None if item.target is None else item.target.as_posix(),
        "status": "failed",
        "message": message,
        "reason": "crash",
        "written": False,
        "hash": hash_of(work.root / item.source),
        **work.said,
        "seconds": 0.0,
    }
