"""Certified results of ff.unwrap, spoilt: loops turned inside out, vertices put past an edge by a last place, islands moved."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

import flipfree as ff

from .charts import charts_of
from .generators import path
from .maps import (
    Floats,
    Ints,
    PlaneMap,
    Random,
    Sheet,
    displaced,
    doubled_areas,
    grid,
    inner_edges,
    jittered,
    map_of,
    only,
    opened,
)
from surfaces import bumpy_grid, cylinder, octahedron_sphere


def mutations(random: Random) -> PlaneMap:
    result = _unwrapped(random)
    sheet, rims = _sheet_of(result)
    changed = _CHANGES[int(random.integers(len(_CHANGES)))](sheet, rims, random)
    return replace(result, uv=changed.uv())


def _unwrapped(random: Random) -> PlaneMap:
    while True:
        vertices, faces = _mesh(random)
        cuts = _cuts(Sheet(faces, vertices[:, :2]), random)
        try:
            bijective = bool(random.random() < 0.8)
            result = ff.unwrap(
                vertices,
                faces,
                cuts=cuts,
                bijective=bijective,
                iterations=20,
                threads=1,
                seams="given",
            )
        except ff.FlipfreeError:
            continue
        return PlaneMap(result.vertices, result.faces, result.uv)


def _cuts(sheet: Sheet, random: Random) -> Ints:
    """Edges here and there, or paths of them."""
    edges = inner_edges(sheet)
    if random.random() < 0.5:
        return edges[random.random(len(edges)) < random.uniform(0, 0.25)]
    return np.concatenate([path(sheet, random) for _ in range(int(random.integers(1, 4)))])


def rough_ring(random: Random) -> tuple[Floats, Ints]:
    """An open cylinder of a few faces, tapered and dented: its hole tempts the unwrap to turn it inside out."""
    vertices, faces = cylinder(int(random.integers(4, 14)), int(random.integers(1, 4)))
    taper = 1 + vertices[:, 2:] / 2 * random.uniform(-0.9, 3)
    vertices = vertices * np.hstack([taper, taper, np.full_like(taper, random.uniform(0.05, 2))])
    return vertices + random.normal(0, random.choice([0, 0.1, 0.3]), vertices.shape), faces


def _mesh(random: Random) -> tuple[Floats, Ints]:
    kind = int(random.integers(5))
    if kind == 4:
        return rough_ring(random)
    if kind == 0:
        return cylinder(int(random.integers(5, 10)), int(random.integers(1, 4)))
    if kind == 1:
        return octahedron_sphere(int(random.integers(0, 3)))
    size = int(random.integers(3, 7))
    if kind == 2:
        return bumpy_grid(size, size, random.uniform(0, 1), random.uniform(0.5, 3))
    sheet = grid(size, size, random)
    chosen = np.flatnonzero(random.random(len(sheet.corner)) < 0.85)
    sheet = jittered(opened(only(sheet, chosen), [], in_mesh=True), random, 0.1)
    flat = map_of(sheet, random)
    height = random.uniform(0, 1) * flat.vertices[:, 2]
    vertices = np.zeros_like(flat.vertices)
    vertices[flat.faces, :2] = flat.uv
    vertices[:, 2] = height
    return vertices, flat.faces


def _sheet_of(result: PlaneMap) -> tuple[Sheet, Ints]:
    """With (b, 2) the boundary edges, as points of the sheet."""
    charts = charts_of(result.faces, result.uv)
    count = int(charts.corner.max()) + 1
    place, vertex = np.zeros((count, 2)), np.zeros(count, np.int64)
    place[charts.corner] = result.uv
    vertex[charts.corner] = result.faces
    f, k = charts.boundary // 3, charts.boundary % 3
    rims = np.stack([charts.corner[f, k], charts.corner[f, (k + 1) % 3]], 1)
    return Sheet(charts.corner, place, vertex), rims


def _as_it_is(sheet: Sheet, rims: Ints, random: Random) -> Sheet:
    return sheet


def _pushed_about(sheet: Sheet, rims: Ints, random: Random) -> Sheet:
    edge = sheet.place[rims[:, 0]] - sheet.place[rims[:, 1]]
    size = float(np.linalg.norm(edge, axis=1).mean())
    return jittered(sheet, random, size * random.choice([1e-6, 0.1, 0.5]))


def _past_an_edge(sheet: Sheet, rims: Ints, random: Random) -> Sheet:
    """A boundary point put onto a boundary edge near it, and beside it by a last place of a float."""
    for _ in range(10):
        p = int(rims[int(random.integers(len(rims))), 0])
        others = rims[(rims != p).all(1)]
        if len(others) == 0:
            break
        distance = np.linalg.norm(sheet.place[others].mean(1) - sheet.place[p], axis=1)
        nearest = np.argsort(distance, kind="stable")[:3]
        a, b = sheet.place[others[int(random.choice(nearest))]]
        moved = _put(sheet, p, a + random.choice([0.0, 0.25, 0.5, 1.0]) * (b - a), random)
        if moved is not None:
            return moved
    return _pushed_about(sheet, rims, random)


def _onto_its_copy(sheet: Sheet, rims: Ints, random: Random) -> Sheet:
    """A point of a cut put onto the other side's, or beside it by a last place of a float."""
    assert sheet.vertex is not None
    copies = np.bincount(sheet.vertex)[sheet.vertex] > 1
    for _ in range(10 if copies.any() else 0):
        p = int(random.choice(np.flatnonzero(copies)))
        twin = int(random.choice(np.flatnonzero(sheet.vertex == sheet.vertex[p])))
        moved = _put(sheet, p, sheet.place[twin], random)
        if twin != p and moved is not None:
            return moved
    return _past_an_edge(sheet, rims, random)


def _put(sheet: Sheet, p: int, target: Floats, random: Random) -> Sheet | None:
    """The point p at the target, off by a last place or not; None if a triangle flips."""
    place = sheet.place.copy()
    place[p] = target
    if random.random() < 0.7:
        d, towards = int(random.integers(2)), np.float32(random.choice([-np.inf, np.inf]))
        place[p, d] = np.nextafter(np.float32(target[d]), towards)
    return sheet.with_place(place) if (doubled_areas(sheet, place) > 0).all() else None


def _inside_out(sheet: Sheet, rims: Ints, random: Random) -> Sheet:
    """A boundary loop mirrored, more than once until it is through."""
    label = np.arange(len(sheet.place))
    for _ in range(len(rims)):
        least = np.minimum(label[rims[:, 0]], label[rims[:, 1]])
        np.minimum.at(label, rims[:, 0], least)
        np.minimum.at(label, rims[:, 1], least)
    loops = np.unique(label[rims[:, 0]])
    loop = np.flatnonzero(label == random.choice(loops))
    direction = random.normal(size=2)
    direction /= np.linalg.norm(direction)
    for _ in range(4):
        away = sheet.place[loop] - sheet.place[loop].mean(0)
        move = np.zeros_like(sheet.place)
        move[loop] = -random.uniform(1, 2.5) * (away @ direction)[:, None] * direction
        sheet = displaced(sheet, move)
    return sheet


def _island_moved(sheet: Sheet, rims: Ints, random: Random) -> Sheet:
    """One chart moved so that one of its points comes to lie on one of another's, on an edge or in a triangle; maybe off by a
    last place of a float."""
    label = np.arange(len(sheet.place))
    while True:
        before = label.copy()
        least = label[sheet.corner].min(1)
        for k in range(3):
            np.minimum.at(label, sheet.corner[:, k], least)
        if (label == before).all():
            break
    pieces = np.unique(label)
    if len(pieces) < 2:
        return _past_an_edge(sheet, rims, random)
    one, other = random.choice(pieces, 2, replace=False)
    own = np.flatnonzero(label == one)
    faces = np.flatnonzero(label[sheet.corner[:, 0]] == other)
    corners = sheet.place[sheet.corner[int(random.choice(faces))]]
    weights = np.array([(1, 0, 0), (0.5, 0.5, 0), (0.25, 0.25, 0.5)])[int(random.integers(3))]
    target = weights @ corners
    if random.random() < 0.3:
        # The rightmost point of one on the leftmost of the other: they touch, or nearly do.
        target = sheet.place[np.flatnonzero(label == other)]
        target = target[np.argmin(target[:, 0])]
        handle = own[np.argmax(sheet.place[own, 0])]
    else:
        handle = random.choice(own)
    if random.random() < 0.6:
        target = target.copy()
        target[0] = np.nextafter(np.float32(target[0]), np.float32(random.choice([-1e9, 1e9])))
    place = sheet.place.copy()
    place[own] += target - place[handle]
    return sheet.with_place(place)


_CHANGES = (
    _as_it_is,
    _pushed_about,
    _past_an_edge,
    _onto_its_copy,
    _onto_its_copy,
    _inside_out,
    _island_moved,
    _island_moved,
)
