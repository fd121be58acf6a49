"""PLY with new texture coordinates: the faces' list `texcoord` is new, all other elements and properties stay as they are.

Texture coordinates of vertices are the old map, which other programs would take for the new one: they go.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field
from itertools import pairwise
from typing import Any

import numpy as np
import numpy.typing as npt

from .polygons import NewMap, on_polygons

_TYPES = {
    **dict.fromkeys(("char", "int8"), "i1"),
    **dict.fromkeys(("uchar", "uint8"), "u1"),
    **dict.fromkeys(("short", "int16"), "i2"),
    **dict.fromkeys(("ushort", "uint16"), "u2"),
    **dict.fromkeys(("int", "int32"), "i4"),
    **dict.fromkeys(("uint", "uint32"), "u4"),
    **dict.fromkeys(("float", "float32"), "f4"),
    **dict.fromkeys(("double", "float64"), "f8"),
}
_CORNERS, _TEXTURE = ("vertex_indices", "vertex_index"), "texcoord"
_OF_VERTICES = (("s", "t"), ("u", "v"), ("texture_u", "texture_v"))
_ORDERS = {"ascii": "", "binary_little_endian": "<", "binary_big_endian": ">"}


#: (rows, properties + 1): where every property of every row begins, and the last one ends. Places are bytes of a binary file,
#: words of a text.
Places = npt.NDArray[np.int64]

#: (a, b) -> values a to b as they are written.
Cells = Callable[[int, int], bytes]


@dataclass(frozen=True)
class _Property:
    """kind: numpy's name of its type. count: that of a list's length; empty: it is no list."""

    name: str
    kind: str
    count: str = ""


@dataclass
class _Element:
    """header: its own line, then those of its properties with what stands between them."""

    name: str
    count: int
    properties: list[_Property] = field(default_factory=list)
    header: list[bytes] = field(default_factory=list)

    def announce(self, count: int, properties: dict[int, bytes | None]) -> None:
        """Another count in the header; instead of a property's line another one, or none. The number after the last
        property's is a new one."""
        end = b"\r" if self.header[0].endswith(b"\r") else b""
        words = self.header[0].split()
        self.header[0] = b" ".join([*words[:2], b"%d" % count]) + end
        places = [k for k, line in enumerate(self.header) if line.split()[:1] == [b"property"]]
        lines: list[bytes | None] = [*self.header, None]
        for k, line in properties.items():
            at = places[k] if k < len(places) else len(self.header)
            lines[at] = None if line is None else line + end
        self.header = [line for line in lines if line is not None]


def rewritten(content: bytes, new: NewMap) -> bytes:
    """The file's content with the map."""
    head, elements, body = _parsed(content)
    parts: list[bytes] = []
    done: set[str] = set()
    for element in elements:
        places = body.places(element.count, element.properties)
        if element.name in done or element.name not in ("vertex", "face"):
            parts += _copied(body, places)
            continue
        done.add(element.name)
        rows = _vertices if element.name == "vertex" else _faces
        parts += rows(element, places, body, new)
    lines = [*head, *(line for element in elements for line in element.header)]
    return b"\n".join([*lines, b"end_header"]) + b"\n" + b"".join(parts) + body.rest()


def _parsed(content: bytes) -> tuple[list[bytes], list[_Element], _Body]:
    """The header's lines before the first element, the elements with theirs, what follows the header."""
    elements: list[_Element] = []
    head: list[bytes] = []
    order, at = "", 0
    while True:
        end = content.index(b"\n", at)
        line = content[at:end]
        at = end + 1
        words = [word.decode("latin-1") for word in line.split()]
        match words:
            case ["end_header", *_]:
                return head, elements, _Body(content[at:], order) if order else _Words(content[at:])
            case ["format", name, *_]:
                order = _ORDERS[name]
            case ["element", name, count, *_]:
                elements.append(_Element(name, int(count)))
            case ["property", "list", count, kind, *name]:
                one = _Property(" ".join(name[:1]), _TYPES[kind], _TYPES[count])
                elements[-1].properties.append(one)
            case ["property", kind, *name]:
                elements[-1].properties.append(_Property(" ".join(name[:1]), _TYPES[kind]))
        (elements[-1].header if elements else head).append(line)


def _copied(body: _Body, places: Places) -> Iterator[bytes]:
    for begin, end in body.runs(places):
        yield body.row([body.cut(begin, end)])


def _vertices(element: _Element, places: Places, body: _Body, new: NewMap) -> Iterator[bytes]:
    names = {p.name: k for k, p in reversed([*enumerate(element.properties)]) if not p.count}
    pair = next((pair for pair in _OF_VERTICES if set(pair) <= set(names)), ())
    old = sorted(names[name] for name in pair)
    element.announce(element.count + len(new.vertices), dict.fromkeys(old))
    if old:
        ends = [-1, *old, len(element.properties)]
        for row in places.tolist():
            yield body.row([body.cut(row[a + 1], row[b]) for a, b in pairwise(ends)])
    else:
        yield from _copied(body, places)
    if len(new.vertices):
        kept = [k for k in range(len(element.properties)) if k not in old]
        yield from _new_vertices(element, places, body, new, kept)


def _new_vertices(
    element: _Element, places: Places, body: _Body, new: NewMap, kept: list[int]
) -> Iterator[bytes]:
    """They have of every property what those around them have, weighted; empty lists."""
    ones = np.ones(element.count, np.int64)
    columns = []
    for k in kept:
        p = element.properties[k]
        if p.count:
            columns.append((p.count, np.zeros(len(new.vertices))))
        elif p.name in ("x", "y", "z"):
            columns.append((p.kind, new.vertices[:, "xyz".index(p.name)]))
        else:
            values = body.numbers(p.kind, places[:, k], ones).astype(np.float64)
            mixed = new.interpolated(values[:, None])[:, 0]
            columns.append((p.kind, mixed if p.kind[0] == "f" else np.rint(mixed)))
    cells = [body.cells(kind, values) for kind, values in columns]
    for i in range(len(new.vertices)):
        yield body.row([cell(i, i + 1) for cell in cells])


def _faces(element: _Element, places: Places, body: _Body, new: NewMap) -> Iterator[bytes]:
    lists = {p.name: k for k, p in reversed([*enumerate(element.properties)]) if p.count}
    corner_at = next(lists[name] for name in _CORNERS if name in lists)
    texture_at = lists.get(_TEXTURE, len(element.properties))
    of_corners = element.properties[corner_at]
    starts = places[:, corner_at]
    counts = body.numbers(of_corners.count, starts, np.ones(len(starts), np.int64))
    corners = body.numbers(of_corners.kind, starts + body.width(of_corners.count), counts)
    corners = corners.astype(np.int32)
    begin = np.concatenate([[0], np.cumsum(counts, dtype=np.int64)]).astype(np.int32)
    placed = on_polygons(corners, begin, new)

    rows = [row for p in sorted(placed.pieces) for row in placed.pieces[p]]
    is_small = max(int(counts.max(initial=0)), 3) < 128  # every program knows lengths of one byte
    length = "u1" if is_small else "i4"
    lines: dict[int, bytes | None] = {
        texture_at: b"property list %s float texcoord" % (b"uchar" if is_small else b"int")
    }
    is_anew = len(rows) > 0
    if is_anew:  # the file's types of lengths and indices may be too small
        lines[corner_at] = b"property list %s int %s" % (
            b"uchar" if is_small else b"int",
            of_corners.name.encode("latin-1"),
        )
    element.announce(element.count + len(rows) - len(placed.pieces), lines)

    index = body.cells("i4", np.concatenate([corners, new.faces[rows].ravel()]))
    uv = np.concatenate([placed.corner_uv, new.uv[rows].reshape(-1, 2)])
    missing = np.concatenate([[0], np.cumsum(~np.isfinite(uv).all(axis=1))]).tolist()
    texture = body.cells("f4", uv.ravel())
    size = body.cells(length, np.arange(256 if is_small else 2 * int(counts.max(initial=3)) + 1))

    def row_of(row: list[int], a: int, b: int) -> bytes:
        """A face with the corners from a to b."""
        if missing[a] == missing[b]:
            cell = [size(2 * (b - a), 2 * (b - a) + 1), texture(2 * a, 2 * b)]
        else:
            cell = [size(0, 1)]
        after = row[texture_at + 1] if texture_at + 1 < len(row) else row[-1]
        if not is_anew:
            parts = [body.cut(row[0], row[texture_at]), *cell, body.cut(after, row[-1])]
            return body.row(parts)
        polygon = [size(b - a, b - a + 1), index(a, b)]
        instead = {corner_at: polygon, texture_at: cell}
        parts = []
        for k in range(max(texture_at + 1, len(row) - 1)):
            parts += instead.get(k) or [body.cut(row[k], row[k + 1])]
        return body.row(parts)

    at, begins = len(corners), begin.tolist()
    for p, row in enumerate(places.tolist()):
        if p not in placed.pieces:
            yield row_of(row, begins[p], begins[p + 1])
            continue
        for _ in placed.pieces[p]:
            yield row_of(row, at, at + 3)
            at += 3


class _Body:
    """The values behind a header, which are found, cut out and written in the same terms; elements are taken from it one after
    the other. order: of the bytes of numbers, "<" or ">"."""

    def __init__(self, content: bytes, order: str) -> None:
        self._at = 0
        self._content: Sequence[Any] = content
        self._order = order

    def width(self, kind: str) -> int:
        """Places that a value takes."""
        return int(kind[1])

    def cut(self, begin: int, end: int) -> bytes:
        """What stands there."""
        return bytes(self._content[begin:end])

    def numbers(self, kind: str, starts: Places, counts: npt.NDArray[Any]) -> npt.NDArray[Any]:
        """Values of one type, as many as told from each of these places on."""
        width = self.width(kind)
        at = _each(starts, counts, width)
        content = np.frombuffer(self._content, np.uint8)  # type: ignore[call-overload]
        rows = np.ascontiguousarray(content[at[:, None] + np.arange(width)])
        found: npt.NDArray[Any] = rows.view(self._order + kind).ravel()
        return found

    def cells(self, kind: str, values: npt.NDArray[Any]) -> Cells:
        """Values that are to be written."""
        width, text = self.width(kind), values.astype(self._order + kind).tobytes()
        return lambda a, b: text[a * width : b * width]

    def row(self, parts: list[bytes]) -> bytes:
        """The parts of one row, or of several that are one part."""
        return b"".join(parts)

    def runs(self, places: Places) -> list[tuple[int, int]]:
        """Rows that can be cut out in one piece."""
        return [(int(places[0, 0]), int(places[-1, -1]))] if len(places) else []

    def rest(self) -> bytes:
        """What no element has taken."""
        return self.cut(self._at, len(self._content))

    def places(self, count: int, properties: list[_Property]) -> Places:
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

    def _row(self, at: int, properties: list[_Property]) -> list[int]:
        row = [at]
        for p in properties:
            if p.count:
                at += self.width(p.count) + self.width(p.kind) * self._length(p.count, at)
            else:
                at += self.width(p.kind)
            row.append(at)
        return row

    def _uniform(self, count: int, properties: list[_Property]) -> Places | None:
        """If all rows have lists as long as the first one's."""
        first = np.array(self._row(self._at, properties), np.int64)
        found: Places = first + (first[-1] - first[0]) * np.arange(count)[:, None]
        if found[-1, -1] > len(self._content):
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

    def _length(self, kind: str, at: int) -> int:
        raw = self.cut(at, at + self.width(kind))
        return int.from_bytes(raw, "big" if self._order == ">" else "little", signed=kind[0] == "i")


class _Words(_Body):
    """The same of a text."""

    def __init__(self, content: bytes) -> None:
        super().__init__(b"", "")
        self._content = content.split()

    def width(self, kind: str) -> int:
        return 1

    def cut(self, begin: int, end: int) -> bytes:
        return b" ".join(self._content[begin:end])

    def numbers(self, kind: str, starts: Places, counts: npt.NDArray[Any]) -> npt.NDArray[Any]:
        read = float if kind[0] == "f" else int
        return np.array([read(self._content[at]) for at in _each(starts, counts, 1).tolist()])

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
        return int(self._content[at])


def _each(starts: Places, counts: npt.NDArray[Any], width: int) -> Places:
    """Places of all values: counts[i] of them from starts[i] on."""
    counts = counts.astype(np.int64)
    before = np.cumsum(counts) - counts
    within = np.arange(int(counts.sum())) - np.repeat(before, counts)
    found: Places = np.repeat(starts, counts) + width * within
    return found
