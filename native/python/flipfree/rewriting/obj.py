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


@dataclass
class _Face:
    """A face's statement: where it stands, its corners' words, what follows them, how many vertices came before."""

    line: int
    words: list[bytes]
    tail: bytes
    vertices_before: int


@dataclass
class _Statements:
    """lines: each a statement, the last one's end left out. Of the others the numbers of lines."""

    lines: list[bytes]
    faces: list[_Face] = field(default_factory=list)
    vertices: list[int] = field(default_factory=list)
    textures: list[int] = field(default_factory=list)
    others: list[tuple[int, int, int]] = field(default_factory=list)  # line, vertices, vt before

    @property
    def corners(self) -> tuple[IntArray, IntArray]:
        """Vertices of all faces' corners, and where each face begins."""
        found = [
            _resolved(word.partition(b"/")[0], face.vertices_before) - 1
            for face in self.faces
            for word in face.words
        ]
        found = [v if 0 <= v < len(self.vertices) else -1 for v in found]  # of faces of two corners
        begin = np.zeros(len(self.faces) + 1, np.int32)
        np.cumsum([len(face.words) for face in self.faces], out=begin[1:])
        return np.array(found, np.int32), begin


def rewritten(content: bytes, new: NewMap) -> bytes:
    """The file's content with the map."""
    found = _statements(content)
    corners, begin = found.corners
    placed = on_polygons(corners, begin, new)
    numbers = _Numbers(corners, begin, new, placed)
    _write_others(found, numbers, renumber=len(new.vertices) > 0)
    textures, begins = numbers.of_corner.tolist(), begin.tolist()
    for polygon, face in enumerate(found.faces):
        own = slice(begins[polygon], begins[polygon + 1])
        if polygon in placed.pieces:
            text = numbers.pieces(placed.pieces[polygon], face.tail)
        else:
            vertices = (corners[own] + 1).tolist() if len(new.vertices) else None
            text = _face(face, textures[own], vertices)
        found.lines[face.line] = text
    return _joined(found, numbers.lines, new)


def _statements(content: bytes) -> _Statements:
    found = _Statements(_logical_lines(content))
    for number, line in enumerate(found.lines):
        head = line[:2]
        if head == b"v ":
            found.vertices.append(number)
            continue
        if head == b"vn" or head[:1] == b"#":
            continue
        text = line.replace(b"\\\r\n", b" ").replace(b"\\\n", b" ")
        if number == 0:
            text = text.removeprefix(b"\xef\xbb\xbf")
        words = text.split(None, 1)
        if not words:
            continue
        match words[0]:
            case b"v":
                found.vertices.append(number)
            case b"vt":
                found.textures.append(number)
            case b"f":
                found.faces.append(_face_of(number, words[-1] if len(words) > 1 else b"", found))
            case keyword if keyword in _OTHERS:
                found.others.append((number, len(found.vertices), len(found.textures)))
    return found


def _logical_lines(content: bytes) -> list[bytes]:
    lines = content.split(b"\n")
    if b"\\" not in content:
        return lines
    found: list[bytes] = []
    goes_on = False
    for line in lines:
        if goes_on:
            found[-1] += b"\n" + line
        else:
            found.append(line)
        goes_on = line.removesuffix(b"\r").endswith(b"\\")
    return found


def _face_of(number: int, text: bytes, found: _Statements) -> _Face:
    end = b"\r" if text.endswith(b"\r") else b""
    words = text.split()
    if b"#" in text:
        end = b" " + text[text.index(b"#") :]
        words = text[: text.index(b"#")].split()
    return _Face(number, words, end, len(found.vertices))


def _resolved(word: bytes, so_far: int) -> int:
    """An index from 1; negative ones count back from the last element so far."""
    index = int(word)
    return so_far + 1 + index if index < 0 else index


def _face(face: _Face, textures: list[int], vertices: list[int] | None) -> bytes:
    """textures: their numbers, 0 for none. vertices: instead of the file's words for them."""
    corners = []
    for k, word in enumerate(face.words):
        vertex, _, more = word.partition(b"/")
        normal = more.partition(b"/")[2]
        if vertices is not None:
            vertex = b"%d" % vertices[k]
        texture = b"%d" % textures[k] if textures[k] else b""
        if normal:
            corners.append(b"%s/%s/%s" % (vertex, texture, normal))
        else:
            corners.append(b"%s/%s" % (vertex, texture) if texture else vertex)
    return b"f " + b" ".join(corners) + face.tail


class _Numbers:
    """Texture coordinates in the order of the faces that use them: those of one vertex with the same bits are one."""

    def __init__(self, corners: IntArray, begin: IntArray, new: NewMap, placed: OnPolygons) -> None:
        self._new = new
        rows = np.array([row for rows in placed.pieces.values() for row in rows], np.int64)
        polygon = np.repeat(np.arange(len(begin) - 1), np.diff(begin))
        vertex = np.concatenate([corners, new.faces[rows].ravel()])
        uv = np.concatenate([placed.corner_uv, new.uv[rows].reshape(-1, 2)])
        of_polygon = np.concatenate([polygon, np.repeat(new.polygons[new.parent[rows]], 3)])
        order = np.argsort(of_polygon, kind="stable")
        order = order[np.isfinite(uv[order]).all(axis=1)]
        bits = uv.view(np.uint32).astype(np.uint64)
        numbers = np.zeros(len(vertex), np.int64)
        numbers[order], first = _by_first(vertex[order], (bits[:, 0] << 32 | bits[:, 1])[order])
        self.of_corner = numbers[: len(corners)]
        self._of_piece = dict(
            zip(rows.tolist(), numbers[len(corners) :].reshape(-1, 3).tolist(), strict=True)
        )
        self.lines = [b"vt %.9g %.9g" % (u, v) for u, v in uv[order[first]].tolist()]

    def pieces(self, rows: list[int], tail: bytes) -> bytes:
        """The faces that take the place of one, without normals: new vertices have none."""
        texts = []
        for row in rows:
            pairs = zip(self._new.faces[row].tolist(), self._of_piece[row], strict=True)
            words = (b"%d/%d" % (v + 1, t) if t else b"%d" % (v + 1) for v, t in pairs)
            texts.append(b"f " + b" ".join(words))
        return (b"\r\n" if tail.endswith(b"\r") else b"\n").join(texts) + tail

    def another(self, line: bytes) -> int:
        """The number of one more, as it stands in the file."""
        self.lines.append(line.removesuffix(b"\r"))
        return len(self.lines)


def _by_first(
    vertex: npt.NDArray[np.int32], bits: npt.NDArray[np.uint64]
) -> tuple[npt.NDArray[np.int64], npt.NDArray[np.int64]]:
    """Numbers from 1 of equal pairs, in the order in which they come first, and where each comes first."""
    if len(vertex) == 0:
        return np.zeros(0, np.int64), np.zeros(0, np.int64)
    order = np.lexsort((bits, vertex))
    starts = np.ones(len(order), bool)
    starts[1:] = (np.diff(vertex[order]) != 0) | (bits[order][1:] != bits[order][:-1])
    group = np.empty(len(order), np.int64)
    group[order] = np.cumsum(starts) - 1
    first = order[starts]  # the sort is stable: the first of each
    rank = np.empty(len(first), np.int64)
    rank[np.argsort(first)] = np.arange(len(first))
    return rank[group] + 1, np.sort(first)


def _write_others(found: _Statements, numbers: _Numbers, *, renumber: bool) -> None:
    """Lines, points and surfaces keep their texture coordinates, whose numbers change. renumber: vertices are counted from
    the first one."""
    kept: dict[int, int] = {}

    def word_of(word: bytes, vertices: int, textures: int) -> bytes:
        parts = word.split(b"/")
        try:
            if renumber and not is_surface and int(parts[0]) < 0:
                parts[0] = b"%d" % _resolved(parts[0], vertices)
            if len(parts) > 1 and parts[1]:
                old = _resolved(parts[1], textures)
                if not 1 <= old <= len(found.textures):
                    return word
                if old not in kept:
                    kept[old] = numbers.another(found.lines[found.textures[old - 1]])
                parts[1] = b"%d" % kept[old]
        except ValueError:  # no index: what it is, it stays
            return word
        return b"/".join(parts)

    for line, vertices, textures in found.others:
        text = found.lines[line]
        is_surface = text.lstrip().startswith(b"surf")  # it begins with parameters
        if renumber or b"/" in text:
            words = re.split(rb"([\s\\]+)", text)  # with what stands between them
            found.lines[line] = b"".join(word_of(word, vertices, textures) for word in words)


def _joined(found: _Statements, textures: list[bytes], new: NewMap) -> bytes:
    """All lines, texture coordinates before the first statement that may use them."""
    lines: list[bytes | None] = list(found.lines)
    users = [face.line for face in found.faces] + [line for line, _, _ in found.others]
    first = min([*users, *found.textures[:1]], default=len(lines))
    end = b"\r" if any(line.endswith(b"\r") for line in found.lines[:first]) else b""
    block = []
    if len(new.vertices):
        for line in found.vertices:  # readers know no vertex before its line
            if line > first:
                block.append(found.lines[line])
                lines[line] = None
        block += [text + end for text in _vertex_lines(found, new)]
    block += [text + end for text in textures]
    for line in found.textures:
        lines[line] = None
    kept = [line for line in lines[:first] if line is not None] + block
    return b"\n".join(kept + [line for line in lines[first:] if line is not None])


def _vertex_lines(found: _Statements, new: NewMap) -> list[bytes]:
    """New vertices have what all around them have beyond three coordinates: a weight, colours."""
    texts = []
    for position, origins, weights in zip(
        new.vertices.tolist(), new.origins.tolist(), new.weights.tolist(), strict=True
    ):
        more = [_numbers(found.lines[found.vertices[v]])[3:] for v in origins]
        count = min(map(len, more))
        mixed = (sum(w * m[k] for w, m in zip(weights, more, strict=True)) for k in range(count))
        texts.append(b"v " + " ".join(map(repr, [*position, *mixed])).encode())
    return texts


def _numbers(line: bytes) -> list[float]:
    found = []
    for word in line.replace(b"\\\r\n", b" ").replace(b"\\\n", b" ").split()[1:]:
        try:
            found.append(float(word))
        except ValueError:  # a comment
            break
    return found
