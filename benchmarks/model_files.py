"""Triangles of the files that games, simulators and libraries of parts ship: AC3D, VRML, Collada, MD3, 3DS, glTF, PMD.

Only what a mesh is made of is read: positions and polygons, polygons fanned, all parts of a file in one mesh, as an artist
who joins them has it; no transformations of parts. `ff.read` reads OBJ, PLY, OFF and STL.
"""

from __future__ import annotations

import base64
import gzip
import json
import re
import struct
from collections.abc import Callable, Iterable
from pathlib import Path
from xml.etree import ElementTree

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


def read_collada(data: bytes) -> Mesh:
    root = re.sub(rb'\sxmlns="[^"]*"', b"", data, count=1)
    parts = []
    for mesh in ElementTree.fromstring(root).iter("mesh"):
        position = mesh.find("vertices/input[@semantic='POSITION']")
        if position is None:
            continue
        name = position.get("source", "")[1:]
        source = next((s for s in mesh.iter("source") if s.get("id") == name), None)
        values = None if source is None else source.find("float_array")
        if values is None:
            continue
        triangles = []
        for kind in ("triangles", "polylist", "polygons"):
            for group in mesh.iter(kind):
                inputs = group.findall("input")
                stride = 1 + max(int(i.get("offset", 0)) for i in inputs)
                at = next(int(i.get("offset", 0)) for i in inputs if i.get("semantic") == "VERTEX")
                rows = [
                    [int(x) for x in (p.text or "").split()][at::stride] for p in group.iter("p")
                ]
                if kind == "polygons":
                    triangles += fanned(rows)
                    continue
                corners = sum(rows, [])
                counts = group.findtext("vcount", "").split() or ["3"] * (len(corners) // 3)
                ends = np.cumsum([int(n) for n in counts])
                triangles += fanned(
                    corners[e - int(n) : e] for e, n in zip(ends, counts, strict=True)
                )
        parts.append(([float(x) for x in (values.text or "").split()], triangles))
    return joined(parts)


def read_md3(data: bytes) -> Mesh:
    if data[:4] != b"IDP3":
        raise Unreadable("no MD3 file")
    _, _, count, _ = struct.unpack_from("<4i", data, 76)
    (at,) = struct.unpack_from("<i", data, 100)
    parts = []
    for _ in range(count):
        head = struct.unpack_from("<10i", data, at + 72)
        vertices, faces, to_faces, to_vertices, to_end = head[2], head[3], head[4], head[7], head[8]
        place = np.frombuffer(data, "<i2", 4 * vertices, at + to_vertices).reshape(-1, 4)[:, :3]
        parts.append((place / 64.0, np.frombuffer(data, "<i4", 3 * faces, at + to_faces)))
        at += to_end
    return welded(joined(parts))


def read_3ds(data: bytes) -> Mesh:
    parts: list[tuple[npt.ArrayLike, npt.ArrayLike]] = []
    vertices = np.zeros((0, 3))

    def walk(at: int, end: int) -> None:
        nonlocal vertices
        while at + 6 <= end:
            kind, size = struct.unpack_from("<HI", data, at)
            size = max(6, size)
            if kind in (0x4D4D, 0x3D3D, 0x4100):
                walk(at + 6, at + size)
            elif kind == 0x4000:
                walk(data.index(b"\0", at + 6) + 1, at + size)
            elif kind == 0x4110:
                (count,) = struct.unpack_from("<H", data, at + 6)
                vertices = np.frombuffer(data, "<f4", 3 * count, at + 8).reshape(-1, 3)
            elif kind == 0x4120:
                (count,) = struct.unpack_from("<H", data, at + 6)
                faces = np.frombuffer(data, "<u2", 4 * count, at + 8).reshape(-1, 4)[:, :3]
                parts.append((vertices, faces))
            at += size

    walk(0, len(data))
    return joined(parts)


def read_gltf(data: bytes, folder: Path) -> Mesh:
    chunk = b""
    if data[:4] == b"glTF":
        (size,) = struct.unpack_from("<I", data, 12)
        chunk = data[20 + size + 8 :]
        data = data[20 : 20 + size]
    scene = json.loads(data)
    if not isinstance(scene.get("meshes"), list):
        raise Unreadable("no glTF 2 with meshes")

    def accessor(index: int) -> npt.NDArray[np.float64]:
        own = scene["accessors"][index]
        width = {"SCALAR": 1, "VEC3": 3}[own["type"]]
        kind = {5121: "<u1", 5123: "<u2", 5125: "<u4", 5126: "<f4"}[own["componentType"]]
        view = scene["bufferViews"][own["bufferView"]]
        uri = scene["buffers"][view["buffer"]].get("uri")
        if uri is None:
            raw = chunk
        elif uri.startswith("data:"):
            raw = base64.b64decode(uri.split(",", 1)[1])
        else:
            raw = (folder / uri).read_bytes()
        at = view.get("byteOffset", 0) + own.get("byteOffset", 0)
        size = np.dtype(kind).itemsize * width
        stride = view.get("byteStride", size)
        rows = [raw[at + i * stride : at + i * stride + size] for i in range(own["count"])]
        return np.frombuffer(b"".join(rows), kind).reshape(-1, width).astype(np.float64)

    parts = []
    for mesh in scene["meshes"]:
        for part in mesh["primitives"]:
            if part.get("mode", 4) != 4 or "POSITION" not in part["attributes"]:
                continue
            vertices = accessor(part["attributes"]["POSITION"])
            faces = accessor(part["indices"]) if "indices" in part else np.arange(len(vertices))
            parts.append((vertices, faces.astype(np.int64)))
    return welded(joined(parts))


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
    ".dae": read_collada,
    ".md3": read_md3,
    ".3ds": read_3ds,
    ".pmd": read_pmd,
}
SUFFIXES = {*READERS, ".gltf", ".glb", ".obj", ".ply", ".off", ".stl"}


def read_model(path: Path) -> Mesh:
    """Raises Unreadable for files that are broken, empty or of another kind than their name says."""
    suffix = path.suffix.lower()
    try:
        if suffix in (".obj", ".ply", ".off", ".stl"):
            mesh = ff.read(path)
            return mesh.vertices, mesh.faces
        data = path.read_bytes()
        data = gzip.decompress(data) if data[:2] == b"\x1f\x8b" else data
        if suffix in (".gltf", ".glb"):
            return read_gltf(data, path.parent)
        return READERS[suffix](data)
    except (ff.FlipfreeError, ArithmeticError, LookupError, ValueError, OSError) as error:
        raise Unreadable(f"{type(error).__name__}: {error}") from error
    except (
        struct.error,
        ElementTree.ParseError,
        StopIteration,
        RuntimeError,
        TypeError,
        AttributeError,  # numbers where a glTF should have objects
    ) as error:
        raise Unreadable(f"{type(error).__name__}: {error}") from error
