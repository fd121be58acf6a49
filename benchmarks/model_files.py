"""Triangles of the files that games, simulators and libraries of parts ship: AC3D, VRML, PMD.

Only what a mesh is made of is read: positions and polygons, polygons fanned, all parts of a file in one mesh, as an artist
who joins them has it; no transformations of parts. `ff.read` reads OBJ, PLY, OFF and STL.
"""

from __future__ import annotations

import gzip
import re
import struct
from collections.abc import Callable, Iterable
from pathlib import Path

import numpy as np
import numpy.typing as npt

import flipfree as ff

Mesh = tuple[npt.NDArray[np.float64], npt.NDArray[np.int32]]


class Unreadable(Exception):
    """The file holds no mesh that this module knows how to read."""


def fanned(polygons: Iterable[Iterable[int]]) -> list[tuple[int, int, int]]:
    triangles = []
    for polygon in polygons:
        corner = list(polygon)
        triangles += [(corner[0], corner[i], corner[i + 1]) for i in range(1, len(corner) - 1)]
    return triangles


def joined(parts: list[tuple[npt.ArrayLike, npt.ArrayLike]]) -> Mesh:
    """Parts (positions, triangles) in one mesh; whatever they name stays as it is, sense or nonsense."""
    positions, triangles, offset = [], [], 0
    for vertices, faces in parts:
        own = np.asarray(vertices, np.float64).reshape(-1, 3)
        positions.append(own)
        triangles.append(np.asarray(faces, np.int64).reshape(-1, 3) + offset)
        offset += len(own)
    if not parts or sum(map(len, triangles)) == 0:
        raise Unreadable("no polygons")
    return np.vstack(positions), np.vstack(triangles).astype(np.int32)


def welded(mesh: Mesh) -> Mesh:
    """Vertices at exactly one place become one: these formats double them for texture coordinates and normals."""
    _, first, inverse = np.unique(mesh[0], axis=0, return_index=True, return_inverse=True)
    return mesh[0][first], inverse.reshape(-1)[mesh[1]].astype(np.int32)


def read_ac3d(data: bytes) -> Mesh:
    lines = iter(data.decode("latin-1").splitlines())
    parts, vertices, polygons = [], [], []
    for line in lines:
        word = line.split()
        if not word:
            continue
        if word[0] == "numvert":
            vertices = [[float(x) for x in next(lines).split()[:3]] for _ in range(int(word[1]))]
        elif word[0] == "SURF":
            line_only = int(word[1], 0) & 15
        elif word[0] == "refs":
            corner = [int(next(lines).split()[0]) for _ in range(int(word[1]))]
            polygons += [] if line_only else [corner]
        elif word[0] == "kids" and vertices:
            parts.append((vertices, fanned(polygons)))
            vertices, polygons = [], []
    return joined(parts)


def read_vrml(data: bytes) -> Mesh:
    text = re.sub(r"#[^\n]*", "", data.decode("latin-1"))
    parts = []
    for piece in text.split("IndexedFaceSet")[1:]:
        point = re.search(r"point\s*\[([^\]]*)\]", piece)
        index = re.search(r"coordIndex\s*\[([^\]]*)\]", piece)
        if not point or not index:
            continue
        numbers = [float(x) for x in point[1].replace(",", " ").split()]
        polygons: list[list[int]] = [[]]
        for i in map(int, index[1].replace(",", " ").split()):
            if i < 0:
                polygons.append([])
            else:
                polygons[-1].append(i)
        parts.append((numbers, fanned(polygons)))
    return joined(parts)


def read_pmd(data: bytes) -> Mesh:
    if data[:4] != b"PSMD":
        raise Unreadable("no PMD file")
    version, _, vertices = struct.unpack_from("<3I", data, 4)
    sheets, at = (struct.unpack_from("<I", data, 16)[0], 20) if version >= 4 else (1, 16)
    size = 24 + 8 * sheets + 20
    rows = np.frombuffer(data, np.uint8, vertices * size, at).reshape(vertices, size)
    place = np.frombuffer(rows[:, :12].tobytes(), "<f4").reshape(-1, 3)
    (faces,) = struct.unpack_from("<I", data, at + vertices * size)
    corners = np.frombuffer(data, "<u2", 3 * faces, at + vertices * size + 4)
    return welded(joined([(place, corners)]))


READERS: dict[str, Callable[[bytes], Mesh]] = {
    ".ac": read_ac3d,
    ".wrl": read_vrml,
    ".pmd": read_pmd,
}
NATIVE = (".obj", ".ply", ".off", ".stl")
SUFFIXES = {*READERS, *NATIVE}


def read_model(path: Path) -> Mesh:
    """Raises Unreadable for files that are broken, empty or of another kind than their name says."""
    suffix = path.suffix.lower()
    try:
        if suffix in NATIVE:
            mesh = ff.read(path)
            return mesh.vertices, mesh.faces
        data = path.read_bytes()
        data = gzip.decompress(data) if data[:2] == b"\x1f\x8b" else data
        return READERS[suffix](data)
    except (
        ff.FlipfreeError,
        ArithmeticError,
        LookupError,
        OSError,
        RuntimeError,
        StopIteration,
        ValueError,
        struct.error,
    ) as error:
        raise Unreadable(f"{type(error).__name__}: {error}") from error
