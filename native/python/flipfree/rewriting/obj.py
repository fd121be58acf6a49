"""Wavefront OBJ with new texture coordinates: `vt` and the faces' indices of them are new, all other lines stay.

A line is a statement, and goes on in the next one where it ends in a backslash. Where a map adds vertices, these follow the
file's own ones, and faces count them from the file's first vertex.
"""

from __future__ import annotations

import re
from dataclasses import dataclass, field

import numpy as np
import numpy.typing as npt

from ..results import IntArray
from .polygons import NewMap, OnPolygons, on_polygons

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

    @property
    def corners(self) -> tuple[IntArray, IntArray]:
        """Vertices of all faces' corners, and where each face begins."""
        found = [
            _resolved(word.partition(b"/")[0], face.vertices) - 1
            for face in self.faces
            for word in face.words
        ]
        found = [v if 0 <= v < len(self.vertices) else -1 for v in found]  # of faces of two corners
        counts = [len(face.words) for face in self.faces]
        return np.array(found, np.int32), np.cumsum([0, *counts]).astype(np.int32)


def rewritten(content: bytes, new: NewMap) -> bytes:
    """The file's content with the map."""
    found = _statements(content)
    corners, begin = found.corners
    placed = on_polygons(corners, begin, new)
    numbers, textures = _numbered(placed)
    refined = len(new.vertices) > 0
    _write_others(found, textures, renumber=refined)
    vertex, texture = (placed.vertices + 1).tolist(), numbers.tolist()
    for face, parts in zip(found.faces, placed.faces, strict=True):
        texts = []
        for a, b in parts:
            words = face.words
            if a >= len(corners):  # without normals: new vertices have none
                words = [b"%d" % v for v in vertex[a:b]]
            elif refined:
                own = zip(vertex[a:b], words, strict=True)
                words = [b"/".join([b"%d" % v, *word.split(b"/")[1:]]) for v, word in own]
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


def _numbered(placed: OnPolygons) -> tuple[npt.NDArray[np.int64], list[bytes]]:
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
