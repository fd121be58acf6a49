"""Maps at random on which judges of overlap are compared: what they are made of, and how they are varied."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from mesh_files import cut_corners

Ints = npt.NDArray[np.integer]
Floats = npt.NDArray[np.float64]
Random = np.random.Generator


@dataclass(frozen=True)
class PlaneMap:
    """A mesh with corner UVs."""

    vertices: Floats  # (n, 3)
    faces: npt.NDArray[np.int32]  # (m, 3)
    uv: Floats  # (m, 3, 2)


@dataclass(frozen=True)
class Sheet:
    """Triangles in the plane before they are a map: corners that name points."""

    corner: Ints  # (m, 3)
    place: Floats  # (p, 2)
    vertex: Ints | None = None  # (p,) the mesh vertex of each point; None: each has its own

    def uv(self) -> Floats:
        return self.place[self.corner]

    def with_place(self, place: Floats) -> Sheet:
        return Sheet(self.corner, place, self.vertex)


def map_of(sheet: Sheet, random: Random) -> PlaneMap:
    """Where the mesh lies in space plays no part in overlaps."""
    vertex = sheet.corner if sheet.vertex is None else sheet.vertex[sheet.corner]
    used, faces = np.unique(vertex, return_inverse=True)
    return PlaneMap(
        random.random((len(used), 3)), faces.reshape(-1, 3).astype(np.int32), sheet.uv()
    )


def doubled_areas(sheet: Sheet, place: Floats) -> Floats:
    p = place[sheet.corner]
    e, f = p[:, 1] - p[:, 0], p[:, 2] - p[:, 0]
    return np.asarray(e[:, 0] * f[:, 1] - e[:, 1] * f[:, 0])


def displaced(sheet: Sheet, displacement: Floats) -> Sheet:
    """Points moved by (p, 2), less where a triangle of positive area would lose it."""
    least = 1e-3 * np.abs(doubled_areas(sheet, sheet.place))
    for _ in range(12):
        bad = doubled_areas(sheet, sheet.place + displacement) <= least
        if not bad.any():
            return sheet.with_place(sheet.place + displacement)
        displacement = displacement.copy()
        displacement[np.unique(sheet.corner[bad])] *= 0.5
    return sheet


def jittered(sheet: Sheet, random: Random, size: float) -> Sheet:
    """Every point moved by up to about `size`, a few times over."""
    for _ in range(int(random.integers(1, 4))):
        sheet = displaced(sheet, random.normal(0, size, sheet.place.shape))
    return sheet


def transformed(sheet: Sheet, random: Random) -> Sheet:
    """Half of the time turned, scaled and shifted, so that coordinates are no round numbers any more."""
    if random.random() < 0.5:
        return sheet
    angle, scale = random.uniform(0, 2 * np.pi), 10.0 ** random.uniform(-3, 3)
    turn = scale * np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
    return sheet.with_place(sheet.place @ turn.T + scale * random.uniform(-10, 10, 2))


def nudged(sheet: Sheet, random: Random) -> Sheet:
    """Half of the time, one point moved by a unit in the last place of a float, of a double, or by a little."""
    if random.random() < 0.5:
        return sheet
    place = sheet.place.copy()
    p, d = int(random.integers(len(place))), int(random.integers(2))
    value, towards = place[p, d], random.choice([-np.inf, np.inf])
    kind = random.integers(3)
    if kind == 0:
        place[p, d] = np.nextafter(np.float32(value), np.float32(towards))
    elif kind == 1:
        place[p, d] = np.nextafter(value, towards)
    else:
        place[p, d] += random.normal(0, 1e-4)
    return sheet.with_place(place)


def grid(columns: int, rows: int, random: Random | None = None) -> Sheet:
    """Unit cells from (0, 0) on, cut along either diagonal at random; without `random` all along the same."""
    x, y = np.meshgrid(np.arange(columns + 1.0), np.arange(rows + 1.0))
    index = np.arange(x.size).reshape(x.shape)
    a, b = index[:-1, :-1].ravel(), index[:-1, 1:].ravel()
    c, d = index[1:, 1:].ravel(), index[1:, :-1].ravel()
    other = np.zeros(len(a), bool) if random is None else random.random(len(a)) < 0.5
    first = np.where(other[:, None], np.stack([a, b, d], 1), np.stack([a, b, c], 1))
    second = np.where(other[:, None], np.stack([b, c, d], 1), np.stack([a, c, d], 1))
    return Sheet(np.vstack([first, second]), np.stack([x.ravel(), y.ravel()], 1))


def opened(sheet: Sheet, edges: npt.ArrayLike, *, in_mesh: bool) -> Sheet:
    """The sheet cut along edges (s, 2), given as pairs of its points; `in_mesh`: the mesh is cut too, else only the map."""
    corners = sheet.corner.astype(np.int32)
    cut, _ = cut_corners(corners, np.asarray(edges, np.int64).reshape(-1, 2))
    kept, corner = np.unique(cut, return_inverse=True)
    origin = corners.ravel()[kept]
    vertex = origin if sheet.vertex is None else sheet.vertex[origin]
    return Sheet(corner.reshape(-1, 3), sheet.place[origin], None if in_mesh else vertex)


def only(sheet: Sheet, faces: Ints) -> Sheet:
    """Some of the faces, with fans that touch in a point only made separate."""
    used, corner = np.unique(sheet.corner[faces], return_inverse=True)
    vertex = None if sheet.vertex is None else sheet.vertex[used]
    part = Sheet(corner.reshape(-1, 3), sheet.place[used], vertex)
    return opened(part, [], in_mesh=sheet.vertex is None)


def inner_edges(sheet: Sheet) -> Ints:
    """(s, 2) edges with two faces."""
    edge = np.sort(np.stack([sheet.corner, np.roll(sheet.corner, -1, 1)], -1).reshape(-1, 2), 1)
    edges, count = np.unique(edge, axis=0, return_counts=True)
    return edges[count == 2]


def together(sheets: list[Sheet]) -> Sheet:
    """Several sheets as one mesh of several pieces."""
    corners, places, vertices, points, offset = [], [], [], 0, 0
    for sheet in sheets:
        vertex = np.arange(len(sheet.place)) if sheet.vertex is None else sheet.vertex
        corners.append(sheet.corner + points)
        places.append(sheet.place)
        vertices.append(vertex + offset)
        points += len(sheet.place)
        offset += int(vertex.max()) + 1
    return Sheet(np.vstack(corners), np.vstack(places), np.concatenate(vertices))
