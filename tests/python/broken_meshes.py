"""Meshes as imports and modelling accidents leave them: none is a clean surface, all have a meaning."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import numpy.typing as npt

from surfaces import bumpy_grid, cylinder, joined, octahedron_sphere, torus

Mesh = tuple[npt.NDArray[np.float64], npt.NDArray[np.int64]]
Random = np.random.Generator


def welded(mesh: Mesh, digits: int = 9) -> Mesh:
    """Vertices at one place become one."""
    vertices, faces = mesh
    _, first, inverse = np.unique(
        np.round(vertices, digits), axis=0, return_index=True, return_inverse=True
    )
    return vertices[first], inverse.reshape(-1)[faces]


def sheet(random: Random) -> Mesh:
    """A small surface that nothing is wrong with."""
    kind = random.integers(4)
    if kind == 0:
        vertices, faces = bumpy_grid(int(random.integers(1, 6)), int(random.integers(1, 6)))
    elif kind == 1:
        vertices, faces = cylinder(int(random.integers(3, 9)), int(random.integers(1, 4)))
    elif kind == 2:
        vertices, faces = torus(int(random.integers(4, 9)), int(random.integers(3, 6)))
    else:
        vertices, faces = octahedron_sphere(int(random.integers(0, 3)))
    return np.asarray(vertices, float), np.asarray(faces, np.int64)


def book(random: Random) -> Mesh:
    """3 to 50 pages at one spine."""
    pages = int(random.integers(3, 51))
    columns, rows = int(random.integers(1, 4)), int(random.integers(1, 4))
    angles = random.uniform(0, 2 * np.pi, pages)
    leaves = []
    for angle in angles:
        vertices, faces = bumpy_grid(columns, rows)
        x, y = vertices[:, 0] - vertices[:, 0].min(), vertices[:, 1]
        leaf = np.column_stack([x * np.cos(angle), x * np.sin(angle), y])
        leaves.append((leaf, np.asarray(faces)[:, ::-1] if random.random() < 0.5 else faces))
    return welded(joined(*leaves))


def t_wall(random: Random) -> Mesh:
    """Two walls that meet in a T, at a line of vertices of both."""
    columns, rows = 2 * int(random.integers(1, 4)), int(random.integers(1, 5))
    vertices, faces = bumpy_grid(columns, rows, height=0.0)
    x, y = vertices[:, 0], vertices[:, 1]
    wall = np.column_stack([x, 0 * x, y])
    middle = np.unique(x)[columns // 2]
    stem = np.column_stack([0 * x + middle, x - x.min(), y])
    return welded(joined((wall, faces), (stem, faces)))


def bow_tie(random: Random) -> Mesh:
    """Parts that touch in one vertex."""
    parts = [sheet(random) for _ in range(int(random.integers(2, 5)))]
    vertices, faces = joined(*parts)
    firsts = np.cumsum([0] + [len(v) for v, _ in parts[:-1]])
    for first in firsts[1:]:
        faces[faces == first] = 0
    return vertices, faces


def moebius(random: Random) -> Mesh:
    """A strip with one side."""
    columns, rows = int(random.integers(6, 30)), int(random.integers(1, 5))
    vertices, faces = bumpy_grid(columns, rows, height=0.0)
    t = 2 * np.pi * (vertices[:, 0] - vertices[:, 0].min()) / np.ptp(vertices[:, 0])
    s = 0.3 * (2 * (vertices[:, 1] - vertices[:, 1].min()) / np.ptp(vertices[:, 1]) - 1)
    r = 1 + s * np.cos(t / 2)
    return welded((np.column_stack([r * np.cos(t), r * np.sin(t), s * np.sin(t / 2)]), faces), 6)


def klein(random: Random) -> Mesh:
    """Klein's bottle in three dimensions, which passes through itself."""
    columns, rows = int(random.integers(8, 20)), int(random.integers(6, 14))
    vertices, faces = bumpy_grid(columns, rows, height=0.0)
    u = 2 * np.pi * (vertices[:, 0] - vertices[:, 0].min()) / np.ptp(vertices[:, 0])
    v = 2 * np.pi * (vertices[:, 1] - vertices[:, 1].min()) / np.ptp(vertices[:, 1])
    r = 2 + np.cos(u / 2) * np.sin(v) - np.sin(u / 2) * np.sin(2 * v)
    z = np.sin(u / 2) * np.sin(v) + np.cos(u / 2) * np.sin(2 * v)
    return welded((np.column_stack([r * np.cos(u), r * np.sin(u), z]), faces), 6)


def coincident(random: Random) -> Mesh:
    """Vertices moved onto others: edges of length zero, in chains too, and faces without area."""
    vertices, faces = sheet(random)
    for _ in range(int(random.integers(1, 1 + max(1, len(vertices) // 3)))):
        face = faces[random.integers(len(faces))]
        a, b = random.permutation(face)[:2]
        vertices[a] = vertices[b]
    return vertices, faces


def collinear(random: Random) -> Mesh:
    """Faces whose corners lie on one line."""
    vertices, faces = sheet(random)
    for _ in range(int(random.integers(1, 1 + max(1, len(faces) // 4)))):
        a, b, c = random.permutation(faces[random.integers(len(faces))])
        vertices[a] = 0.5 * (vertices[b] + vertices[c])
    return vertices, faces


def doubled(random: Random) -> Mesh:
    """The same faces twice, in one or in both directions."""
    vertices, faces = sheet(random)
    chosen = faces[random.random(len(faces)) < random.choice([0.2, 1.0])]
    again = chosen[:, ::-1] if random.random() < 0.5 else np.roll(chosen, 1, axis=1)
    return vertices, np.vstack([faces, again])


def turned(random: Random) -> Mesh:
    """Faces wound against the others."""
    vertices, faces = sheet(random)
    some = random.random(len(faces)) < random.choice([0.1, 0.5])
    faces[some] = faces[some][:, ::-1]
    return vertices, faces


def repeated(random: Random) -> Mesh:
    """Faces that use a vertex twice, or only one."""
    vertices, faces = sheet(random)
    extra = faces[random.integers(len(faces), size=int(random.integers(1, 4)))]
    extra[:, 1] = extra[:, 0]
    if random.random() < 0.3:
        extra[0] = extra[0, 0]
    return vertices, np.vstack([faces, extra])


def soup(random: Random) -> Mesh:
    """Triangles between any vertices."""
    count = int(random.integers(4, 20))
    faces = random.integers(count, size=(int(random.integers(1, 30)), 3))
    keep = [len(set(face)) == 3 for face in faces.tolist()]
    if not any(keep):
        faces = np.array([[0, 1, 2]])
    return random.normal(size=(count, 3)), faces


def mixed(random: Random) -> Mesh:
    """Several of the others welded, scaled, and doubled here and there."""
    parts = [
        KINDS[random.integers(len(KINDS) - 1)](random) for _ in range(int(random.integers(2, 4)))
    ]
    vertices, faces = joined(*parts)
    for _ in range(int(random.integers(0, 6))):
        a, b = random.integers(len(vertices), size=2)
        faces[faces == a] = b
    scale = 10.0 ** random.uniform(-6, 6)
    return scale * vertices, faces[random.permutation(len(faces))]


KINDS: list[Callable[[Random], Mesh]] = [
    book, t_wall, bow_tie, moebius, klein, coincident, collinear, doubled, turned, repeated, soup, mixed,
]  # fmt: skip


def broken_mesh(seed: int) -> tuple[str, Mesh]:
    """Mesh number `seed` and what kind it is."""
    random = np.random.default_rng(seed)
    kind = KINDS[seed % len(KINDS)]
    return kind.__name__, kind(random)
