"""OBJ, PLY and OFF files read slowly, word by word, into polygons and all else that they say; areas of polygons.

    obj(bytes), ply(bytes), off(bytes) -> PolygonFile
    area(points) of a polygon in space, area_of_map(uv) with its sign, length(uv) around it

`rest` of two files is equal where they differ in nothing but texture coordinates. Shares nothing with the package.
"""

from __future__ import annotations

import math
import struct
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import Any

Place = tuple[float, float]


@dataclass
class PolygonFile:
    points: list[tuple[float, ...]] = field(default_factory=list)
    polygons: list[list[int]] = field(default_factory=list)
    uv: list[list[Place] | None] = field(default_factory=list)
    rest: list[Any] = field(default_factory=list)


def obj(content: bytes) -> PolygonFile:
    found = PolygonFile()
    textures: list[Place] = []
    statements = content.decode().replace("\\\r\n", " ").replace("\\\n", " ").split("\n")
    # Texture coordinates may follow what uses them.
    total = [s.split() for s in statements]
    places = [(float(w[1]), float(w[2])) for w in total if w[:1] == ["vt"]]
    for words in total:
        if words[:1] == ["vt"]:
            textures.append(places[len(textures)])
            continue
        if words[:1] == ["v"]:
            found.points.append(tuple(map(float, words[1:4])))
        if words[:1] not in (["f"], ["l"]):
            found.rest.append(words)
            continue
        corners, uv, said = [], [], []
        for word in words[1:]:
            if word.startswith("#"):
                break
            vertex, _, more = word.partition("/")
            texture, _, normal = more.partition("/")
            number = int(vertex)
            corners.append(number - 1 if number > 0 else len(found.points) + number)
            at = int(texture) if texture else 0
            uv.append(places[at - 1 if at > 0 else len(textures) + at] if at else None)
            said.append((vertex, normal))
        comment = words[1 + len(said) :]
        if words[0] == "l":
            found.rest.append(["l", said, uv, comment])
            continue
        found.rest.append(["f", said, comment])
        found.polygons.append(corners)
        found.uv.append(None if None in uv else uv)  # type: ignore[arg-type]
    return found


_STRUCT = {
    **{"char": "b", "uchar": "B", "short": "h", "ushort": "H", "int": "i", "uint": "I"},
    **{"float": "f", "double": "d", "int8": "b", "uint8": "B", "int16": "h", "uint16": "H"},
    **{"int32": "i", "uint32": "I", "float32": "f", "float64": "d"},
}


def ply(content: bytes) -> PolygonFile:
    head, _, body = content.partition(b"end_header")
    body = body.partition(b"\n")[2]
    found = PolygonFile()
    elements: list[tuple[str, int, list[list[str]]]] = []
    order = ""
    for line in head.decode().splitlines():
        words = line.split()
        match words:
            case ["format", name, _]:
                order = {"ascii": "", "binary_little_endian": "<", "binary_big_endian": ">"}[name]
                found.rest.append(words)
            case ["element", name, count]:
                elements.append((name, int(count), []))
            case ["property", *property]:
                elements[-1][2].append(property)
            case _:
                found.rest.append(words)
    following = _binary(body, order) if order else _words(body)
    for name, count, properties in elements:
        old = {("vertex", "s"), ("vertex", "t"), ("face", "texcoord")}
        kept = [p for p in properties if (name, p[-1]) not in old]
        found.rest.append((name, count, kept))
        for _ in range(count):
            row: dict[str, Any] = {}
            for p in properties:
                if p[0] == "list":
                    length = int(following(p[1]))
                    row[p[-1]] = [following(p[2]) for _ in range(length)]
                else:
                    row[p[-1]] = following(p[0])
            if name == "vertex":
                found.points.append((row["x"], row["y"], row["z"]))
            if name == "face":
                found.polygons.append([int(v) for v in row["vertex_indices"]])
                uv = row.get("texcoord", [])
                found.uv.append(list(zip(uv[::2], uv[1::2], strict=True)) or None)
            found.rest.append([row[p[-1]] for p in kept])
    return found


def _binary(body: bytes, order: str) -> Callable[[str], float]:
    """What reads the next value, of a type."""
    at = 0

    def following(kind: str) -> float:
        nonlocal at
        (value,) = struct.unpack_from(order + _STRUCT[kind], body, at)
        at += struct.calcsize(order + _STRUCT[kind])
        return value  # type: ignore[no-any-return]

    return following


def _words(body: bytes) -> Callable[[str], float]:
    words = iter(body.split())
    return lambda kind: float(next(words)) if _STRUCT[kind] in "fd" else int(next(words))


def off(content: bytes) -> PolygonFile:
    found = PolygonFile()
    words = [
        w for line in content.decode().splitlines()[1:] for w in line.partition("#")[0].split()
    ]
    vertices, faces, at = int(words[0]), int(words[1]), 3
    for _ in range(vertices):
        found.points.append(tuple(map(float, words[at : at + 3])))
        at += 3
    for _ in range(faces):
        count = int(words[at])
        found.polygons.append([int(w) for w in words[at + 1 : at + 1 + count]])
        found.uv.append(None)
        at += 1 + count
    return found


def area(points: Sequence[Sequence[float]]) -> float:
    """Of a planar polygon in space, whatever its shape: the sum of cross products around its first corner."""
    total = [0.0, 0.0, 0.0]
    origin = points[0]
    for p, q in zip(points, [*points[1:], points[0]], strict=True):
        a = [p[k] - origin[k] for k in range(3)]
        b = [q[k] - origin[k] for k in range(3)]
        for k in range(3):
            i, j = (k + 1) % 3, (k + 2) % 3
            total[k] += a[i] * b[j] - a[j] * b[i]
    return math.sqrt(math.fsum(t * t for t in total)) / 2


def area_of_map(uv: Sequence[Place]) -> float:
    """Its sign is that of a polygon that runs counter-clockwise."""
    u0, v0 = uv[0]
    sides = zip(uv, [*uv[1:], uv[0]], strict=True)
    return math.fsum((a[0] - u0) * (b[1] - v0) - (a[1] - v0) * (b[0] - u0) for a, b in sides) / 2


def length(uv: Sequence[Place]) -> float:
    return math.fsum(math.dist(a, b) for a, b in zip(uv, [*uv[1:], uv[0]], strict=True))
