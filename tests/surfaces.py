"""Small meshes that tests and benchmarks generate: (vertices, faces) pairs."""

from __future__ import annotations

from collections.abc import Iterable
from itertools import product

import numpy as np
import numpy.typing as npt

Mesh = tuple[npt.NDArray[np.float64], npt.NDArray[np.int32]]
#: Vertices, faces, and a total angle per vertex.
MeshWithAngles = tuple[npt.NDArray[np.float64], npt.NDArray[np.int32], npt.NDArray[np.float64]]


def _cells(columns: int, rows: int, index: npt.NDArray[np.int64]) -> npt.NDArray[np.int32]:
    """Two triangles per cell of a lattice of vertex ids (rows + 1, columns + 1)."""
    a, b = index[:-1, :-1].ravel(), index[:-1, 1:].ravel()
    c, d = index[1:, 1:].ravel(), index[1:, :-1].ravel()
    assert len(a) == columns * rows
    return (
        np.stack([np.stack([a, b, c], 1), np.stack([a, c, d], 1)], 1)
        .reshape(-1, 3)
        .astype(np.int32)
    )


def edges_of(faces: npt.ArrayLike) -> npt.NDArray[np.int64]:
    """(k, 2) every edge once, the lower vertex first."""
    sides = np.asarray(faces, np.int64)
    ends = np.sort(np.stack([sides, np.roll(sides, -1, axis=1)], -1).reshape(-1, 2), axis=1)
    return np.unique(ends, axis=0)


def open_edges(faces: npt.ArrayLike) -> npt.NDArray[np.int64]:
    """(k, 2) edges with one face, in its direction."""
    sides = np.asarray(faces, np.int64)
    ends = np.stack([sides, np.roll(sides, -1, axis=1)], -1).reshape(-1, 2)
    key, backward = ends @ [1 << 32, 1], ends @ [1, 1 << 32]
    return ends[~np.isin(key, backward)]


def euler(faces: npt.ArrayLike) -> int:
    """V - E + F of the vertices that are used."""
    return len(np.unique(faces)) - len(edges_of(faces)) + len(np.asarray(faces))


def compact(vertices: npt.NDArray[np.float64], faces: npt.ArrayLike) -> Mesh:
    """Without vertices that no face uses."""
    used, ids = np.unique(faces, return_inverse=True)
    return vertices[used], ids.reshape(-1, 3).astype(np.int32)


def joined(*meshes: tuple[npt.ArrayLike, npt.ArrayLike]) -> Mesh:
    """All of them as one, in this order."""
    points = [np.asarray(vertices, float) for vertices, _ in meshes]
    first = np.cumsum([0, *map(len, points)])
    faces = [np.asarray(own) + at for (_, own), at in zip(meshes, first, strict=False)]
    return np.concatenate(points), np.concatenate(faces).astype(np.int32)


def areas_of(vertices: npt.NDArray[np.float64], faces: npt.ArrayLike) -> npt.NDArray[np.float64]:
    """(m,) of the triangles in space."""
    a, b, c = np.moveaxis(vertices[np.asarray(faces)], 1, 0)
    areas: npt.NDArray[np.float64] = np.linalg.norm(np.cross(b - a, c - a), axis=1) / 2
    return areas


def signed_areas(uv: npt.ArrayLike) -> npt.NDArray[np.float64]:
    """(m,) of triangles (m, 3, 2) of the plane, positive if counter-clockwise."""
    a, b, c = np.moveaxis(np.asarray(uv, np.float64), 1, 0)
    areas: npt.NDArray[np.float64] = ((b - a) * (c - a)[:, ::-1] @ [1.0, -1.0]) / 2
    return areas


def bumpy_grid(
    columns: int = 20, rows: int = 15, height: float = 0.2, frequency: float = 3.0
) -> Mesh:
    """A disk over the unit square."""
    x, y = np.meshgrid(np.linspace(0, 1, columns + 1), np.linspace(0, 1, rows + 1))
    z = height * np.sin(frequency * np.pi * x) * np.cos(frequency * np.pi * y)
    index = np.arange((columns + 1) * (rows + 1)).reshape(rows + 1, columns + 1)
    return np.stack([x, y, z], -1).reshape(-1, 3), _cells(columns, rows, index)


def cylinder(sectors: int = 16, rings: int = 6) -> Mesh:
    """Two boundary loops."""
    angle = 2 * np.pi * np.arange(sectors) / sectors
    height = np.linspace(0, 2, rings + 1)
    points = np.stack(
        [
            np.tile(np.cos(angle), rings + 1),
            np.tile(np.sin(angle), rings + 1),
            np.repeat(height, sectors),
        ],
        -1,
    )
    index = np.arange(sectors * (rings + 1)).reshape(rings + 1, sectors)
    return points, _cells(sectors, rings, np.hstack([index, index[:, :1]]))


def torus(sectors: int = 24, rings: int = 12, minor: float = 0.4) -> Mesh:
    """Closed, genus 1."""
    phi, theta = np.meshgrid(
        2 * np.pi * np.arange(sectors) / sectors, 2 * np.pi * np.arange(rings) / rings
    )
    radius = 1 + minor * np.cos(theta)
    points = np.stack([radius * np.cos(phi), radius * np.sin(phi), minor * np.sin(theta)], -1)
    index = np.arange(sectors * rings).reshape(rings, sectors)
    index = np.vstack([index, index[:1]])
    return points.reshape(-1, 3), _cells(sectors, rings, np.hstack([index, index[:, :1]]))


Cell = tuple[int, int, int]


def plate(holes: int) -> list[Cell]:
    """Cubes of a plate with so many holes in a row, that many handles."""
    return [(x, y, 0) for x in range(2 * holes + 1) for y in range(3) if y != 1 or x % 2 == 0]


def of_cubes(cells: Iterable[Cell], n: int = 1) -> Mesh:
    """The surface of unit cubes, no two of which touch in an edge or a corner only; every square is divided into n x n, and
    each of these in triangles (a, b, c) and (a, c, d)."""
    solid = set(cells)
    number: dict[Cell, int] = {}
    faces = []
    for cell, axis, up in product(sorted(solid), range(3), range(2)):
        beside = list(cell)
        beside[axis] += 2 * up - 1
        if tuple(beside) in solid:
            continue
        first, second = ((axis + 1) % 3, (axis + 2) % 3) if up else ((axis + 2) % 3, (axis + 1) % 3)
        for x, y in product(range(n), range(n)):
            corners = []
            for dx, dy in ((0, 0), (1, 0), (1, 1), (0, 1)):
                place = [c * n for c in cell]
                place[axis] += up * n
                place[first] += x + dx
                place[second] += y + dy
                key = (place[0], place[1], place[2])
                corners.append(number.setdefault(key, len(number)))
            a, b, c, d = corners
            faces += [(a, b, c), (a, c, d)]
    return np.array(list(number), float) / n, np.array(faces, np.int32)


def octahedron_sphere(levels: int = 3) -> Mesh:
    """Closed, genus 0: an octahedron subdivided and pushed to the unit sphere."""
    points = [
        np.array(p, float)
        for p in [(1, 0, 0), (-1, 0, 0), (0, 1, 0), (0, -1, 0), (0, 0, 1), (0, 0, -1)]
    ]
    faces = [(0, 2, 4), (2, 1, 4), (1, 3, 4), (3, 0, 4), (2, 0, 5), (1, 2, 5), (3, 1, 5), (0, 3, 5)]
    for _ in range(levels):
        middle: dict[tuple[int, int], int] = {}

        def split(a: int, b: int, middle: dict[tuple[int, int], int] = middle) -> int:
            key = (min(a, b), max(a, b))
            if key not in middle:
                p = points[a] + points[b]
                points.append(p / np.linalg.norm(p))
                middle[key] = len(points) - 1
            return middle[key]

        finer = []
        for a, b, c in faces:
            ab, bc, ca = split(a, b), split(b, c), split(c, a)
            finer += [(a, ab, ca), (b, bc, ab), (c, ca, bc), (ab, bc, ca)]
        faces = finer
    return np.array(points), np.array(faces, np.int32)


def shuffled(mesh: Mesh, seed: int) -> Mesh:
    """The same surface with vertices, faces and the first corner of each face in another order."""
    random = np.random.default_rng(seed)
    vertices, faces = mesh
    order = random.permutation(len(vertices))
    place = np.empty_like(order)
    place[order] = np.arange(len(order))
    faces = place[faces][random.permutation(len(faces))]
    turn = random.integers(0, 3, len(faces))
    corners = (np.arange(3)[None, :] + turn[:, None]) % 3
    return vertices[order], np.take_along_axis(faces, corners, 1).astype(np.int32)


def disk_of_rings(spokes: int, rings: int) -> Mesh:
    """The unit disk: vertex 0 in the middle, then rings from the inside out; the last `spokes` vertices are the boundary."""
    angle = 2 * np.pi * np.arange(spokes) / spokes
    circle = np.stack([np.cos(angle), np.sin(angle), 0 * angle], 1)
    vertices = np.concatenate([np.zeros((1, 3)), *(circle * (r + 1) / rings for r in range(rings))])
    i = np.arange(spokes)
    j = (i + 1) % spokes
    faces = [np.stack([0 * i, 1 + i, 1 + j], 1)]
    for r in range(rings - 1):
        a, b = 1 + r * spokes + i, 1 + r * spokes + j
        faces += [np.stack([a, a + spokes, b + spokes], 1), np.stack([a, b + spokes, b], 1)]
    return vertices, np.concatenate(faces).astype(np.int32)


def prism(sectors: int, height: float = 1.0) -> Mesh:
    """Closed, genus 0, as CAD programs write it: needles, and caps fanned from one vertex."""
    a = 2 * np.pi * np.arange(sectors) / sectors
    ring = np.stack([np.cos(a), np.sin(a), 0 * a], 1)
    i = np.arange(sectors)
    j, fan = (i + 1) % sectors, i[1:-1]
    faces = [
        np.stack([i, j, sectors + j], 1),
        np.stack([i, sectors + j, sectors + i], 1),
        np.stack([0 * fan, fan + 1, fan], 1),
        np.stack([0 * fan + sectors, sectors + fan, sectors + fan + 1], 1),
    ]
    return np.concatenate([ring, ring + [0, 0, height]]), np.concatenate(faces).astype(np.int32)


def prism_with_cones(sectors: int = 120) -> MeshWithAngles:
    """Twelve cones of quarter turns on a prism."""
    angles = np.full(2 * sectors, 2 * np.pi)
    angles[[3, 20, 41, 60, 83, 99, 110, 130, 150, 200]] = 1.5 * np.pi
    angles[[12, 140]] = 2.5 * np.pi
    return *prism(sectors, 3.0), angles


def strip_of_needles(seed: int) -> MeshWithAngles:
    """A rough sheet squeezed to a thousandth of its width, columns ever narrower; four steep cones, the rest flat."""
    random = np.random.default_rng(seed)
    x, y = np.meshgrid(np.linspace(0, 1, 13) ** 3, np.linspace(0, 1e-3, 13))
    z = 2e-4 * random.random(x.shape)
    i = np.arange(13 * 13).reshape(13, 13)
    a, b, c, d = i[:-1, :-1].ravel(), i[:-1, 1:].ravel(), i[1:, 1:].ravel(), i[1:, :-1].ravel()
    faces = np.concatenate([np.stack([a, b, c], 1), np.stack([a, c, d], 1)]).astype(np.int32)
    angles = np.full(13 * 13, 2 * np.pi)
    angles[np.r_[i[0], i[-1], i[1:-1, 0], i[1:-1, -1]]] = np.pi
    random = np.random.default_rng(seed)
    angles[random.choice(13 * 13, 4, replace=False)] *= random.uniform(0.3, 2, 4)
    angles *= np.pi * len(faces) / angles.sum()
    return np.stack([x, y, z], -1).reshape(-1, 3), faces, angles
