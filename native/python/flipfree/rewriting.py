"""Files that get a new map and keep all else: what a file has besides texture coordinates is copied, never understood.

    content, polygons of the file + a map of its triangles --on_polygons--> texture coordinates of corners --obj, ply--> content

Each format finds the faces as the reader in C++ does, and leaves the rest as it stands.

Wavefront OBJ: `vt` and the faces' indices of them are new, all other lines stay. A line is a statement, and goes on in the next
one where it ends in a backslash. Where a map adds vertices, these follow the file's own ones, and faces count them from the
file's first vertex.

PLY: the faces' list `texcoord` is new, all other elements and properties stay as they are. Texture coordinates of vertices are
the old map, which other programs would take for the new one: they go.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import numpy.typing as npt

from .results import Array, Flags, Float32Array, FloatArray, IntArray, Ints


@dataclass(frozen=True, eq=False)
class NewMap:
    """Attributes:
    triangles, polygons, corners: (m, 3), (m,), (m, 3) of the file, as a MeshFile has them.
    faces, uv: (k, 3), (k, 3, 2) of the map, NaN where there is none. Vertices from the file's number on are new.
    parent: (k,) triangle of the file that each face is part of.
    vertices: (a, 3) the new ones. origins, weights: (a, 3) vertices of the file around each, and how much of them it has.
    """

    triangles: IntArray
    polygons: IntArray
    corners: IntArray
    faces: IntArray
    uv: Float32Array
    parent: IntArray
    vertices: FloatArray
    origins: IntArray
    weights: FloatArray

    def interpolated(self, values: Array) -> FloatArray:
        """What each new vertex has of values (n, d) of the file's vertices."""
        return np.asarray(np.einsum("ak,akd->ad", self.weights, values[self.origins]))


@dataclass(frozen=True, eq=False)
class OnPolygons:
    """What is written instead of the file's polygons.

    Attributes:
        vertices, uv: (c,), (c, 2) of corners, one face after the other; NaN where there is no map, vertex -1 in polygons of fewer
            than three corners. Those of the file's polygons, so many as ``old``, come first, then triangles of the map that take
            the place of one that was refined or is torn by the map.
        faces: of each polygon the corners, from and to, of the faces that it becomes.
    """

    vertices: IntArray
    uv: Float32Array
    old: int
    faces: list[list[tuple[int, int]]]


def on_polygons(counts: Ints, new: NewMap) -> OnPolygons:
    """counts: (p,) corners of each of the file's polygons."""
    ends, old = np.cumsum(counts), int(counts.sum())
    # The reader passes those of fewer than three over.
    passed = np.cumsum(np.where(counts < 3, counts, 0))
    corner = new.corners + passed[new.polygons][:, None]
    uv, unchanged = _on_triangles(new)
    vertices, corner_uv = np.full(old, -1, np.int32), np.full((old, 2), np.nan, np.float32)
    vertices[corner], corner_uv[corner] = new.triangles, uv
    torn = (_bits(corner_uv[corner]) != _bits(uv)).any(axis=(1, 2))
    is_whole = np.ones(len(counts), bool)
    is_whole[new.polygons[torn | ~unchanged]] = False
    corner_uv[np.repeat(~is_whole, counts)] = np.nan
    faces = [
        [(end - count, end)] for end, count in zip(ends.tolist(), counts.tolist(), strict=True)
    ]
    of_face = new.polygons[new.parent]
    sides = new.faces != np.roll(new.faces, 1, axis=1)
    rows = np.flatnonzero(~is_whole[of_face] & sides.all(axis=1))
    rows = rows[np.argsort(of_face[rows], kind="stable")]
    for polygon in of_face[rows].tolist():
        faces[polygon] = []
    for first, polygon in enumerate(of_face[rows].tolist()):
        faces[polygon].append((old + 3 * first, old + 3 * first + 3))
    return OnPolygons(
        np.concatenate([vertices, new.faces[rows].ravel()]),
        np.concatenate([corner_uv, new.uv[rows].reshape(-1, 2)]),
        old,
        faces,
    )


def _on_triangles(new: NewMap) -> tuple[Float32Array, Flags]:
    """(m, 3, 2) UVs of the file's triangles, and which of them the map has as they are."""
    count = len(new.triangles)
    row = np.zeros(count, np.int64)
    row[new.parent] = np.arange(len(new.parent))
    faces = new.faces[row]
    there = faces[:, None, :] == new.triangles[:, :, None]
    place = there.argmax(axis=2)
    place[(faces == new.triangles).all(axis=1)] = np.arange(3)
    unchanged = (np.bincount(new.parent, minlength=count) == 1) & there.any(axis=2).all(axis=1)
    return new.uv[row[:, None], place], unchanged


def _bits(values: Float32Array) -> npt.NDArray[np.uint32]:
    return np.ascontiguousarray(values).view(np.uint32)


#: Statements besides faces whose words name vertices, and perhaps texture coordinates behind a slash.
_OTHERS = (b"l", b"p", b"fo", b"surf")

_END = re.compile(rb"\n(?<!\\\n)(?<!\\\r\n)")
_GOES_ON = re.compile(rb"\\\r?\n")


@dataclass
class _User:
    """A statement that names vertices: its line, words (a face's alone), what follows these, vertices and vt before."""

    line: int
    words: list[bytes]
    tail: bytes
    vertices: int
    textures: int


@dataclass
class _Statements:
    """lines: each a statement, the last one's end left out. Of vertices and textures the numbers of lines."""

    lines: list[bytes]
    faces: list[_User] = field(default_factory=list)
    others: list[_User] = field(default_factory=list)
    vertices: list[int] = field(default_factory=list)
    textures: list[int] = field(default_factory=list)


def rewritten_obj(content: bytes, new: NewMap) -> bytes:
    """The file's content with the map."""
    found = _statements(content)
    placed = on_polygons(np.array([len(face.words) for face in found.faces], np.int64), new)
    numbers, textures = _numbered(placed)
    refined = len(new.vertices) > 0
    _write_others(found, textures, renumber=refined)
    vertex, texture = (placed.vertices + 1).tolist(), numbers.tolist()
    for face, parts in zip(found.faces, placed.faces, strict=True):
        texts = []
        for a, b in parts:
            words = face.words
            if a >= placed.old:  # without normals: new vertices have none
                words = [b"%d" % v for v in vertex[a:b]]
            elif refined:
                own = [word.split(b"/") for word in words]
                own_vertex = [_resolved(word[0], face.vertices) for word in own]
                words = [
                    b"/".join([b"%d" % v, *w[1:]]) for v, w in zip(own_vertex, own, strict=True)
                ]
            texts.append(b"f " + b" ".join(map(_with_texture, words, texture[a:b])))
        end = b"\r\n" if face.tail.endswith(b"\r") else b"\n"
        found.lines[face.line] = end.join(texts) + face.tail
    return _joined(found, textures, new)


def _with_texture(word: bytes, number: int) -> bytes:
    """A face's word for a corner with another texture coordinate, 0 for none."""
    vertex, _, more = word.partition(b"/")
    parts = [vertex, b"%d" % number if number else b"", more.partition(b"/")[2]]
    return b"/".join(parts).rstrip(b"/")


def _statements(content: bytes) -> _Statements:
    found = _Statements(_END.split(content))
    for number, line in enumerate(found.lines):
        text = _GOES_ON.sub(b" ", line) if b"\\" in line else line
        if number == 0:
            text = text.removeprefix(b"\xef\xbb\xbf")
        keyword, *rest = text.split(None, 1) or [b""]
        if keyword == b"v":
            found.vertices.append(number)
        elif keyword == b"vt":
            found.textures.append(number)
        elif keyword == b"f":
            words, mark, comment = b"".join(rest).partition(b"#")
            tail = b" #" + comment if mark else words[len(words.rstrip(b"\r")) :]
            user = _User(number, words.split(), tail, len(found.vertices), len(found.textures))
            found.faces.append(user)
        elif keyword in _OTHERS:
            user = _User(number, [], b"", len(found.vertices), len(found.textures))
            found.others.append(user)
    return found


def _resolved(word: bytes, so_far: int) -> int:
    """An index from 1; negative ones count back from the last element so far."""
    index = int(word)
    return so_far + 1 + index if index < 0 else index


def _numbered(placed: OnPolygons) -> tuple[Ints, list[bytes]]:
    """Of all corners the numbers of their texture coordinates, 0 for none, and these as lines: in the order of the faces that use
    them, those of one vertex with the same bits once."""
    order = np.array([k for faces in placed.faces for a, b in faces for k in range(a, b)], np.int64)
    order = order[np.isfinite(placed.uv[order]).all(axis=1)]
    bits = np.ascontiguousarray(placed.uv[order]).view(np.int32)
    pairs = np.column_stack([placed.vertices[order], bits])
    _, first, group = np.unique(pairs, axis=0, return_index=True, return_inverse=True)
    rank = np.argsort(np.argsort(first))
    numbers = np.zeros(len(placed.vertices), np.int64)
    numbers[order] = rank[group.reshape(-1)] + 1
    uv = placed.uv[order[np.sort(first)]].tolist()
    return numbers, [b"vt %.9g %.9g" % (u, v) for u, v in uv]


def _write_others(found: _Statements, textures: list[bytes], *, renumber: bool) -> None:
    """Lines, points and surfaces keep their texture coordinates, which are added to those of the map. renumber: vertices are
    counted from the first one."""
    kept: dict[int, int] = {}

    def word_of(word: bytes, user: _User) -> bytes:
        parts = word.split(b"/")
        try:
            if renumber and not is_surface and int(parts[0]) < 0:
                parts[0] = b"%d" % _resolved(parts[0], user.vertices)
            if len(parts) > 1 and parts[1]:
                old = _resolved(parts[1], user.textures)
                if not 1 <= old <= len(found.textures):
                    return word
                if old not in kept:
                    textures.append(found.lines[found.textures[old - 1]].removesuffix(b"\r"))
                    kept[old] = len(textures)
                parts[1] = b"%d" % kept[old]
        except ValueError:  # no index: what it is, it stays
            return word
        return b"/".join(parts)

    for user in found.others:
        text = found.lines[user.line]
        is_surface = text.lstrip().startswith(b"surf")  # it begins with parameters
        if renumber or b"/" in text:
            words = re.split(rb"([\s\\]+)", text)  # with what stands between them
            found.lines[user.line] = b"".join(word_of(word, user) for word in words)


def _joined(found: _Statements, textures: list[bytes], new: NewMap) -> bytes:
    """All lines, texture coordinates before the first statement that may use them."""
    lines = found.lines
    users = [user.line for user in found.faces + found.others]
    first = min([*users, *found.textures[:1]], default=len(lines))
    end = b"\r" if any(line.endswith(b"\r") for line in lines[:first]) else b""
    gone, block = set(found.textures), [text + end for text in textures]
    if len(new.vertices):  # readers know no vertex before its line
        late = [line for line in found.vertices if line > first]
        gone |= set(late)
        added = [text + end for text in _vertex_lines(found, new)]
        block = [*(lines[line] for line in late), *added, *block]
    rest = [line for k, line in enumerate(lines[first:], first) if k not in gone]
    return b"\n".join([*lines[:first], *block, *rest])


def _vertex_lines(found: _Statements, new: NewMap) -> list[bytes]:
    """New vertices have what all around them have beyond three coordinates: a weight, colours."""
    texts = []
    rows = zip(new.vertices.tolist(), new.origins.tolist(), new.weights, strict=True)
    for position, origins, weights in rows:
        more = [_numbers(found.lines[found.vertices[v]])[3:] for v in origins]
        mixed = [float(np.dot(weights, values)) for values in zip(*more, strict=False)]
        texts.append(b"v " + " ".join(map(repr, [*position, *mixed])).encode())
    return texts


def _numbers(line: bytes) -> list[float]:
    words = _GOES_ON.sub(b" ", line).partition(b"#")[0].split()
    return [float(word) for word in words[1:]]


#: numpy's names of the types that have other ones there.
_TYPES = dict(char="i1", uchar="u1", short="i2", ushort="u2", int="i4", uint="u4", float="f4")
_TYPES["double"] = "f8"
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


def rewritten_ply(content: bytes, new: NewMap) -> bytes:
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
                line = _Line(text, " ".join(name[:1]), _type(kind), _type(count))
            case ["property", kind, *name]:
                line = _Line(text, " ".join(name[:1]), _type(kind))
        if elements:
            elements[-1].lines.append(line)
        else:
            head.append(text)


def _type(name: str) -> str:
    return _TYPES.get(name) or np.dtype(name).str[1:]


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
    placed = on_polygons(counts, new)
    placed.vertices[: placed.old] = body.numbers(p.kind, (row[corner_at][1] for row in rows))
    element.grow(sum(map(len, placed.faces)) - element.count)

    is_small = max(int(counts.max(initial=0)), 3) < 128  # every program knows lengths of one byte
    length, its_name = ("u1", b"uchar") if is_small else ("i4", b"int")
    if texture_at == len(properties):
        element.lines.append(_Line(None))
    texture = element.lines[-1] if texture_at == len(properties) else properties[texture_at]
    element.announce(texture, b"property list %s float texcoord" % its_name)
    is_anew = len(placed.uv) > placed.old
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

    def numbers(self, kind: str, cells: Iterable[bytes]) -> Array:
        """What is written there."""
        return np.frombuffer(b"".join(cells), self._order + kind)

    def cells(self, kind: str, values: Array) -> Cells:
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

    def numbers(self, kind: str, cells: Iterable[bytes]) -> Array:
        return np.array(b" ".join(cells).split()).astype(float if kind[0] == "f" else int)

    def cells(self, kind: str, values: Array) -> Cells:
        form = {"f4": "%.9g", "f8": "%r"}.get(kind, "%d")
        words = [(form % value).encode() for value in values.tolist()]
        return lambda a, b: b" ".join(words[a:b])

    def row(self, cells: Row) -> bytes:
        return b" ".join(part for cell in cells for part in cell if part) + b"\n"

    def rest(self) -> bytes:
        return b""
