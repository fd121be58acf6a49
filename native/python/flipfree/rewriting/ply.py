"""PLY with new texture coordinates: the faces' list `texcoord` is new, all other elements and properties stay as they are.

Texture coordinates of vertices are the old map, which other programs would take for the new one: they go.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
from itertools import pairwise

import numpy as np

from .ply_body import Body, Places, Property, body_of
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


@dataclass
class _Element:
    """header: its own line, then those of its properties with what stands between them."""

    name: str
    count: int
    properties: list[Property] = field(default_factory=list)
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


def _parsed(content: bytes) -> tuple[list[bytes], list[_Element], Body]:
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
                return head, elements, body_of(content[at:], order)
            case ["format", name, *_]:
                order = _ORDERS[name]
            case ["element", name, count, *_]:
                elements.append(_Element(name, int(count)))
            case ["property", "list", count, kind, *name]:
                one = Property(" ".join(name[:1]), _TYPES[kind], _TYPES[count])
                elements[-1].properties.append(one)
            case ["property", kind, *name]:
                elements[-1].properties.append(Property(" ".join(name[:1]), _TYPES[kind]))
        (elements[-1].header if elements else head).append(line)


def _copied(body: Body, places: Places) -> Iterator[bytes]:
    for begin, end in body.runs(places):
        yield body.row([body.cut(begin, end)])


def _vertices(element: _Element, places: Places, body: Body, new: NewMap) -> Iterator[bytes]:
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
    element: _Element, places: Places, body: Body, new: NewMap, kept: list[int]
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


def _faces(element: _Element, places: Places, body: Body, new: NewMap) -> Iterator[bytes]:
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
