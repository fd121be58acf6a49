"""What a run says while it goes on: a line per model, with the time that is left, and a sum at the end."""

from __future__ import annotations

import collections
import time
from collections.abc import Sequence
from typing import TextIO

from ..texts import counted
from .plan import OTHER_KIND, Item, listed
from .results import STATUSES, Record

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
