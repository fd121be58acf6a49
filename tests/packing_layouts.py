"""Layouts to pack: drawn islands of random size, blobs, letters, rings and strips, each a map without flips."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from judges.disjoint_sets import DisjointSets
from surfaces import joined

Array = npt.NDArray[np.float64]
Faces = npt.NDArray[np.int32]


@dataclass
class Layout:
    vertices: Array  # (n, 3), z = 0
    faces: Faces  # (m, 3)
    island: npt.NDArray[np.int32]  # (m,), which island a face is of

    @property
    def uv(self) -> Array:
        return np.ascontiguousarray(self.vertices[self.faces][:, :, :2])

    @property
    def islands(self) -> int:
        return int(self.island.max()) + 1


def flat(uv: Array) -> Layout:
    """The layout of a map, its surface the map itself. Islands are told by their corners' places."""
    _, vertex = np.unique(uv.reshape(-1, 2), axis=0, return_inverse=True)
    faces = vertex.reshape(-1, 3).astype(np.int32)
    points = np.zeros((int(faces.max()) + 1, 3))
    points[faces.ravel(), :2] = uv.reshape(-1, 2)
    parts = DisjointSets(len(points))
    for a, b, c in faces.tolist():
        parts.join(a, b)
        parts.join(b, c)
    roots = np.array([parts.find(int(a)) for a in faces[:, 0]])
    return Layout(points, faces, np.unique(roots, return_inverse=True)[1].astype(np.int32))


def drawn(kind: str, count: int, seed: int) -> Layout:
    random = np.random.default_rng(seed)
    parts = []
    for i in range(count):
        points, triangles = shape(kind, random)
        angle = random.uniform(0.0, 2.0 * np.pi)
        turn = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
        points = points @ turn.T + [4.0 * (i % 100), 4.0 * (i // 100)]
        parts.append((np.column_stack([points, np.zeros(len(points))]), triangles))
    sizes = [len(triangles) for _, triangles in parts]
    return Layout(*joined(*parts), np.repeat(np.arange(count, dtype=np.int32), sizes))


def shape(kind: str, random: np.random.Generator) -> tuple[Array, Faces]:
    if kind == "mixed":
        kind = str(random.choice(["blobs", "blobs", "letters", "rings", "strips"]))
    size = float(np.exp(random.normal(0.0, 0.5)))
    if kind == "sizes":  # from large to dust
        kind, size = "blobs", float(np.exp(random.normal(-0.5, 1.0)))
    makers = {"blobs": _blob, "letters": _letter, "rings": _ring, "strips": _strip}
    points, triangles = makers[kind](random)
    return points * size * 0.5, triangles


def _blob(random: np.random.Generator) -> tuple[Array, Faces]:
    """A star-shaped outline: a few waves on a circle."""
    n = int(random.integers(8, 40))
    t = np.linspace(0.0, 2.0 * np.pi, n, endpoint=False)
    r = np.ones(n)
    for wave in range(1, 6):
        r += random.uniform(0.0, 0.35 / wave) * np.cos(wave * t + random.uniform(0.0, 6.3))
    points = np.maximum(r, 0.2)[:, None] * np.column_stack([np.cos(t), np.sin(t)])
    points *= [1.0, random.uniform(0.4, 1.0)]
    own = np.arange(n)
    fan = np.column_stack([np.full(n, n), own, np.roll(own, -1)])
    return np.vstack([points, [[0.0, 0.0]]]), fan.astype(np.int32)


def _letter(random: np.random.Generator) -> tuple[Array, Faces]:
    """L, T, U, E or S on a grid of 3 x 5 cells."""
    rows = str(
        random.choice(
            [
                "x..x..x..x..xxx",
                "xxx.x..x..x..x.",
                "x.xx.xx.xx.xxxx",
                "xxxx..xx.x..xxx",
                "xxxx..xxx..xxxx",
            ]
        )
    )
    cells = {(k % 3, k // 3) for k, mark in enumerate(rows) if mark == "x"}
    ids: dict[tuple[int, int], int] = {}
    triangles = []
    for x, y in sorted(cells):
        a, b, c, d = (
            ids.setdefault(p, len(ids)) for p in ((x, y), (x + 1, y), (x + 1, y + 1), (x, y + 1))
        )
        triangles += [(a, b, c), (a, c, d)]
    points = np.array(list(ids), float) * [random.uniform(0.3, 0.8), random.uniform(0.3, 0.8)]
    return points - points.mean(0), np.array(triangles, np.int32)


def _band(inner: Array, outer: Array, closed: bool) -> tuple[Array, Faces]:
    n = len(inner)
    triangles = []
    for i in range(n if closed else n - 1):
        j = (i + 1) % n
        triangles += [(i, n + i, n + j), (i, n + j, j)]
    return np.vstack([inner, outer]), np.array(triangles, np.int32)


def _ring(random: np.random.Generator) -> tuple[Array, Faces]:
    n = int(random.integers(12, 40))
    closed = bool(random.integers(0, 2))
    t = np.linspace(
        0.0, 2.0 * np.pi if closed else random.uniform(2.0, 5.5), n, endpoint=not closed
    )
    circle = np.column_stack([np.cos(t), np.sin(t)])
    return _band(random.uniform(0.4, 0.8) * circle, circle, closed)


def _strip(random: np.random.Generator) -> tuple[Array, Faces]:
    n = int(random.integers(2, 12))
    x = np.linspace(0.0, random.uniform(1.0, 4.0), n)
    wave = random.uniform(0.0, 0.4) * np.sin(2.0 * x)
    width = random.uniform(0.1, 0.6)
    low = np.column_stack([x, wave])
    return _band(low + [0.0, width], low, False)
