"""The values behind a PLY header, binary or as words, which are found, cut out and written in the same terms.

Places are bytes of a binary file, words of a text.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

#: (rows, properties + 1): where every property of every row begins, and the last one ends.
Places = npt.NDArray[np.int64]

#: (a, b) -> values a to b as they are written.
Cells = Callable[[int, int], bytes]


@dataclass(frozen=True)
class Property:
    """kind: numpy's name of its type. count: that of a list's length; empty: it is no list."""

    name: str
    kind: str
    count: str = ""


class Body(ABC):
    """What follows the header; elements are taken from it one after the other."""

    def __init__(self) -> None:
        self._at = 0

    @abstractmethod
    def width(self, kind: str) -> int:
        """Places that a value takes."""

    @abstractmethod
    def cut(self, begin: int, end: int) -> bytes:
        """What stands there."""

    @abstractmethod
    def numbers(
        self, kind: str, starts: npt.NDArray[np.int64], counts: npt.NDArray[Any]
    ) -> npt.NDArray[Any]:
        """Values of one type, as many as told from each of these places on."""

    @abstractmethod
    def cells(self, kind: str, values: npt.NDArray[Any]) -> Cells:
        """Values that are to be written."""

    @abstractmethod
    def row(self, parts: list[bytes]) -> bytes:
        """The parts of one row, or of several that are one part."""

    @abstractmethod
    def runs(self, places: Places) -> list[tuple[int, int]]:
        """Rows that can be cut out in one piece."""

    @abstractmethod
    def rest(self) -> bytes:
        """What no element has taken."""

    @abstractmethod
    def _length(self, kind: str, at: int) -> int: ...

    @abstractmethod
    def _end(self) -> int: ...

    def places(self, count: int, properties: list[Property]) -> Places:
        """Those of the element that comes next."""
        if count == 0 or not properties:
            return np.full((0, len(properties) + 1), self._at, np.int64)
        found = self._uniform(count, properties)
        if found is None:
            rows, at = [], self._at
            for _ in range(count):
                rows.append(self._row(at, properties))
                at = rows[-1][-1]
            found = np.array(rows, np.int64)
        self._at = int(found[-1, -1])
        return found

    def _row(self, at: int, properties: list[Property]) -> list[int]:
        row = [at]
        for p in properties:
            if p.count:
                at += self.width(p.count) + self.width(p.kind) * self._length(p.count, at)
            else:
                at += self.width(p.kind)
            row.append(at)
        return row

    def _uniform(self, count: int, properties: list[Property]) -> Places | None:
        """If all rows have lists as long as the first one's."""
        first = np.array(self._row(self._at, properties), np.int64)
        found: Places = first + (first[-1] - first[0]) * np.arange(count)[:, None]
        if found[-1, -1] > self._end():
            return None
        ones = np.ones(count, np.int64)
        for k, p in enumerate(properties):
            if p.count:
                try:
                    lengths = self.numbers(p.count, found[:, k], ones)
                except ValueError:  # words of longer rows before
                    return None
                if (lengths != lengths[0]).any():
                    return None
        return found


class _Binary(Body):
    def __init__(self, content: bytes, order: str) -> None:
        super().__init__()
        self._content, self._order = content, order
        self._bytes = np.frombuffer(content, np.uint8)

    def width(self, kind: str) -> int:
        return int(kind[1])

    def cut(self, begin: int, end: int) -> bytes:
        return self._content[begin:end]

    def numbers(
        self, kind: str, starts: npt.NDArray[np.int64], counts: npt.NDArray[Any]
    ) -> npt.NDArray[Any]:
        width = self.width(kind)
        at = _each(starts, counts, width)
        rows = np.ascontiguousarray(self._bytes[at[:, None] + np.arange(width)])
        found: npt.NDArray[Any] = rows.view(self._order + kind).ravel()
        return found

    def cells(self, kind: str, values: npt.NDArray[Any]) -> Cells:
        width, text = self.width(kind), values.astype(self._order + kind).tobytes()
        return lambda a, b: text[a * width : b * width]

    def row(self, parts: list[bytes]) -> bytes:
        return b"".join(parts)

    def runs(self, places: Places) -> list[tuple[int, int]]:
        return [(int(places[0, 0]), int(places[-1, -1]))] if len(places) else []

    def rest(self) -> bytes:
        return self._content[self._at :]

    def _length(self, kind: str, at: int) -> int:
        raw = self._content[at : at + self.width(kind)]
        return int.from_bytes(raw, "big" if self._order == ">" else "little", signed=kind[0] == "i")

    def _end(self) -> int:
        return len(self._content)


class _Text(Body):
    def __init__(self, content: bytes) -> None:
        super().__init__()
        self._words = content.split()

    def width(self, kind: str) -> int:
        return 1

    def cut(self, begin: int, end: int) -> bytes:
        return b" ".join(self._words[begin:end])

    def numbers(
        self, kind: str, starts: npt.NDArray[np.int64], counts: npt.NDArray[Any]
    ) -> npt.NDArray[Any]:
        read = float if kind[0] == "f" else int
        return np.array([read(self._words[at]) for at in _each(starts, counts, 1).tolist()])

    def cells(self, kind: str, values: npt.NDArray[Any]) -> Cells:
        form = {"f4": "%.9g", "f8": "%r"}.get(kind, "%d")
        words = [(form % value).encode() for value in values.tolist()]
        return lambda a, b: b" ".join(words[a:b])

    def row(self, parts: list[bytes]) -> bytes:
        return b" ".join(part for part in parts if part) + b"\n"

    def runs(self, places: Places) -> list[tuple[int, int]]:
        return [(row[0], row[-1]) for row in places.tolist()]

    def rest(self) -> bytes:
        return b""

    def _length(self, kind: str, at: int) -> int:
        return int(self._words[at])

    def _end(self) -> int:
        return len(self._words)


def _each(
    starts: npt.NDArray[np.int64], counts: npt.NDArray[Any], width: int
) -> npt.NDArray[np.int64]:
    """Places of all values: counts[i] of them from starts[i] on."""
    counts = counts.astype(np.int64)
    before = np.cumsum(counts) - counts
    within = np.arange(int(counts.sum())) - np.repeat(before, counts)
    found: npt.NDArray[np.int64] = np.repeat(starts, counts) + width * within
    return found


def body_of(content: bytes, order: str) -> Body:
    """order: of the bytes of numbers, "<" or ">"; empty: words."""
    return _Binary(content, order) if order else _Text(content)
