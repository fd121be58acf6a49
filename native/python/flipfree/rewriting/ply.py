"""PLY with new texture coordinates: the faces' list `texcoord` is new, all other elements and properties stay as they are.

Texture coordinates of vertices are the old map, which other programs would take for the new one: they go.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
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

#: Of one element each property as it is written: a list's length, empty where it is none, and the values.
Row = list[tuple[bytes, bytes]]
Rows = Iterable[Row]

#: (a, b) -> values a to b as they are written.
Cells = Callable[[int, int], bytes]


@dataclass
class _Line:
    """Of an element's header. kind: numpy's name of a property's type, empty where the line is another one; count: that of a
    list's length, empty where it is no list."""

    text: bytes | None
    name: str = ""
    kind: str = ""
    count: str = ""


@dataclass
class _Element:
    """lines: its own, then those of its properties with what stands between them."""

    count: int
    lines: list[_Line]

    @property
    def properties(self) -> list[_Line]:
        return [line for line in self.lines if line.kind]

    def announce(self, line: _Line, text: bytes) -> None:
        """The text of a line of the header, which ends as they do."""
        line.text = text + (b"\r" if (self.lines[0].text or b"").endswith(b"\r") else b"")

    def grow(self, count: int) -> None:
        words = (self.lines[0].text or b"").split()
        self.announce(self.lines[0], b" ".join([*words[:2], b"%d" % (self.count + count)]))


def rewritten(content: bytes, new: NewMap) -> bytes:
    """The file's content with the map."""
    head, elements, body = _parsed(content)
    parts: list[bytes] = []
    edits = {"vertex": _vertices, "face": _faces}
    for element in elements:
        rows = ([body.take(p) for p in element.properties] for _ in range(element.count))
        edit = edits.pop(element.lines[0].name, None)
        parts += map(body.row, rows if edit is None else edit(element, rows, body, new))
    lines = [*head, *(line.text for element in elements for line in element.lines)]
    header = b"\n".join(line for line in lines if line is not None)
    return header + b"\nend_header\n" + b"".join(parts) + body.rest()


def _parsed(content: bytes) -> tuple[list[bytes], list[_Element], _Body]:
    """The header's lines before the first element, the elements with theirs, what follows the header."""
    elements: list[_Element] = []
    head: list[bytes] = []
    order, at = "", 0
    while True:
        end = content.index(b"\n", at)
        text = content[at:end]
        at = end + 1
        line = _Line(text)
        match [word.decode("latin-1") for word in text.split()]:
            case ["end_header", *_]:
                return head, elements, _Body(content[at:], order) if order else _Words(content[at:])
            case ["format", name, *_]:
                order = _ORDERS[name]
            case ["element", name, count, *_]:
                elements.append(_Element(int(count), []))
                line = _Line(text, name)
            case ["property", "list", count, kind, *name]:
                line = _Line(text, " ".join(name[:1]), _TYPES[kind], _TYPES[count])
            case ["property", kind, *name]:
                line = _Line(text, " ".join(name[:1]), _TYPES[kind])
        if elements:
            elements[-1].lines.append(line)
        else:
            head.append(text)


def _vertices(element: _Element, rows: Rows, body: _Body, new: NewMap) -> Rows:
    """New ones have of every property what those around them have, weighted; empty lists."""
    properties = element.properties
    names = {p.name: p for p in reversed(properties) if not p.count}
    pair = next((pair for pair in _OF_VERTICES if set(pair) <= set(names)), ())
    for name in pair:
        names[name].text = None
    element.grow(len(new.vertices))
    kept = [k for k, p in enumerate(properties) if p.text is not None]
    if len(new.vertices):
        rows = list(rows)
    yield from ([row[k] for k in kept] for row in rows)
    columns = []
    for k in kept:
        p, values = properties[k], np.zeros(len(new.vertices))
        if p.name in ("x", "y", "z"):
            values = new.vertices[:, "xyz".index(p.name)]
        elif not p.count:
            known = body.numbers(p.kind, (row[k][1] for row in rows)).astype(np.float64)
            values = new.interpolated(known[:, None])[:, 0]
        cell = body.cells(p.count or p.kind, values)
        columns.append([(cell(i, i + 1), b"") for i in range(len(values))])
    yield from map(list, zip(*columns, strict=True))


def _faces(element: _Element, rows: Rows, body: _Body, new: NewMap) -> Rows:
    rows = list(rows)
    properties = element.properties
    lists = {p.name: k for k, p in reversed([*enumerate(properties)]) if p.count}
    corner_at = next(lists[name] for name in _CORNERS if name in lists)
    texture_at = lists.get(_TEXTURE, len(properties))
    p = properties[corner_at]
    counts = body.numbers(p.count, (row[corner_at][0] for row in rows)).astype(np.int64)
    corners = body.numbers(p.kind, (row[corner_at][1] for row in rows)).astype(np.int32)
    begin = np.concatenate([[0], np.cumsum(counts)]).astype(np.int32)
    placed = on_polygons(corners, begin, new)
    element.grow(placed.count - element.count)

    is_small = max(int(counts.max(initial=0)), 3) < 128  # every program knows lengths of one byte
    length, its_name = ("u1", b"uchar") if is_small else ("i4", b"int")
    if texture_at == len(properties):
        element.lines.append(_Line(None))
    texture = element.lines[-1] if texture_at == len(properties) else properties[texture_at]
    element.announce(texture, b"property list %s float texcoord" % its_name)
    is_anew = len(placed.uv) > len(corners)
    if is_anew:  # the file's types of lengths and indices may be too small
        text = b"property list %s int %s" % (its_name, p.name.encode("latin-1"))
        element.announce(p, text)

    index, places = body.cells("i4", placed.vertices), body.cells("f4", placed.uv.ravel())
    missing = np.concatenate([[0], np.cumsum(~np.isfinite(placed.uv).all(axis=1))]).tolist()
    size = body.cells(length, np.arange(256 if is_small else 2 * int(counts.max(initial=3)) + 1))
    for row, faces in zip(rows, placed.faces, strict=True):
        for a, b in faces:
            n = b - a if missing[a] == missing[b] else 0
            cell = (size(2 * n, 2 * n + 1), places(2 * a, 2 * (a + n)))
            found = [*row[:texture_at], cell, *row[texture_at + 1 :]]
            if is_anew:
                found[corner_at] = (size(b - a, b - a + 1), index(a, b))
            yield found


class _Body:
    """The values behind a header; rows of elements are taken from it one after the other. order: of the bytes of numbers, "<" or
    ">"."""

    def __init__(self, content: Sequence[Any], order: str) -> None:
        self._at, self._content, self._order = 0, content, order

    def take(self, p: _Line) -> tuple[bytes, bytes]:
        """The property that comes next."""
        size = self._next(p.count, 1) if p.count else b""
        return size, self._next(p.kind, self._number(p.count, size) if p.count else 1)

    def _next(self, kind: str, count: int) -> bytes:
        begin = self._at
        self._at += count * self._width(kind)
        return self._cut(begin, self._at)

    def _width(self, kind: str) -> int:
        return int(kind[1])

    def _cut(self, begin: int, end: int) -> bytes:
        return bytes(self._content[begin:end])

    def _number(self, kind: str, cell: bytes) -> int:
        order: Any = "big" if self._order == ">" else "little"
        return int.from_bytes(cell, order, signed=kind[0] == "i")

    def numbers(self, kind: str, cells: Iterable[bytes]) -> npt.NDArray[Any]:
        """What is written there."""
        return np.frombuffer(b"".join(cells), self._order + kind)

    def cells(self, kind: str, values: npt.NDArray[Any]) -> Cells:
        """Values that are to be written."""
        width, values = self._width(kind), values if kind[0] == "f" else np.rint(values)
        text = values.astype(self._order + kind).tobytes()
        return lambda a, b: text[a * width : b * width]

    def row(self, cells: Row) -> bytes:
        return b"".join(part for cell in cells for part in cell)

    def rest(self) -> bytes:
        """What no element has taken."""
        return self._cut(self._at, len(self._content))


class _Words(_Body):
    """The same of a text."""

    def __init__(self, content: bytes) -> None:
        super().__init__(content.split(), "")

    def _width(self, kind: str) -> int:
        return 1

    def _cut(self, begin: int, end: int) -> bytes:
        return b" ".join(self._content[begin:end])

    def _number(self, kind: str, cell: bytes) -> int:
        return int(cell)

    def numbers(self, kind: str, cells: Iterable[bytes]) -> npt.NDArray[Any]:
        return np.array(b" ".join(cells).split()).astype(float if kind[0] == "f" else int)

    def cells(self, kind: str, values: npt.NDArray[Any]) -> Cells:
        form = {"f4": "%.9g", "f8": "%r"}.get(kind, "%d")
        words = [(form % value).encode() for value in values.tolist()]
        return lambda a, b: b" ".join(words[a:b])

    def row(self, cells: Row) -> bytes:
        return b" ".join(part for cell in cells for part in cell if part) + b"\n"

    def rest(self) -> bytes:
        return b""
