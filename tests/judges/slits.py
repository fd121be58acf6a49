"""Grids with slits and holes whose sides are moved: past each other, apart, onto each other."""

from __future__ import annotations

import numpy as np

from .maps import (
    Floats,
    Ints,
    PlaneMap,
    Random,
    Sheet,
    displaced,
    grid,
    inner_edges,
    jittered,
    map_of,
    nudged,
    only,
    opened,
    transformed,
)


def inverted_slit() -> PlaneMap:
    """4 x 4 cells, the centre opened along two inner edges, its lower copy moved up to 2.3, its upper one down to 1.7: an
    inner boundary that is simple, turned inside out, and encloses a region covered twice."""
    sheet = grid(4, 4)
    centre = 12  # of the points, five in a row
    sheet = opened(sheet, [(centre - 1, centre), (centre, centre + 1)], in_mesh=False)
    copies = np.flatnonzero((sheet.place == 2.0).all(1))
    height = [sheet.uv()[(sheet.corner == copy).any(1), :, 1].mean() for copy in copies]
    place = sheet.place.copy()
    place[copies[int(np.argmin(height))], 1] = 2.3
    place[copies[int(np.argmax(height))], 1] = 1.7
    return map_of(sheet.with_place(place), np.random.default_rng(0))


def slits(random: Random) -> PlaneMap:
    """A grid opened along one or more paths of edges, in the map or in the mesh."""
    sheet = grid(int(random.integers(3, 9)), int(random.integers(3, 9)), random)
    edges = np.concatenate([path(sheet, random) for _ in range(int(random.integers(1, 3)))])
    sheet = opened(sheet, edges, in_mesh=bool(random.random() < 0.5))
    sheet = displaced(sheet, _sides_moved(sheet, random))
    if random.random() < 0.3:
        sheet = jittered(sheet, random, 0.2)
    return map_of(transformed(nudged(sheet, random), random), random)


def holes(random: Random) -> PlaneMap:
    """A grid with holes, each of them mirrored, turned, moved away or shrunk, as far as triangles stay positive."""
    size = int(random.integers(5, 9))
    sheet = grid(size, size, random)
    removed: set[int] = set()
    for _ in range(int(random.integers(1, 4))):
        removed |= _patch(sheet, size, random)
    left = np.setdiff1d(np.arange(len(sheet.corner)), sorted(removed))
    sheet = only(sheet, left)
    rim = np.isin(sheet.place, [0.0, float(size)]).any(1)
    edges = np.sort(np.stack([sheet.corner, np.roll(sheet.corner, -1, 1)], -1).reshape(-1, 2), 1)
    unique, count = np.unique(edges, axis=0, return_counts=True)
    loop = np.zeros(len(sheet.place), bool)
    loop[unique[count == 1]] = True
    move = np.zeros_like(sheet.place)
    for group in _groups(sheet.place, loop & ~rim):
        centre = sheet.place[group].mean(0)
        away = sheet.place[group] - centre
        scale = random.choice([-1.2, -0.7, -0.3, 0.0, 0.5, 1.0], 2)
        shift = random.normal(0, random.choice([0.0, 0.5, 3.0]), 2)
        move[group] = away * (scale - 1) + shift
    sheet = displaced(sheet, move)
    if random.random() < 0.5:
        sheet = jittered(sheet, random, 0.3)
    return map_of(transformed(nudged(sheet, random), random), random)


def path(sheet: Sheet, random: Random) -> Ints:
    """Two to five inner edges in a row, or as many as there are."""
    edges = inner_edges(sheet)
    at = {int(p): edges[(edges == p).any(1)] for p in np.unique(edges)}
    here = int(random.choice(list(at)))
    path, seen = [], {here}
    for _ in range(int(random.integers(2, 6))):
        steps = [e for e in at[here].tolist() if not set(e) <= seen]
        if not steps:
            break
        step = steps[int(random.integers(len(steps)))]
        here = step[0] if step[1] == here else step[1]
        seen.add(here)
        path.append(step)
    return np.array(path).reshape(-1, 2)


def _sides_moved(sheet: Sheet, random: Random) -> Floats:
    """Every copy of a point that was opened, towards its own faces or away from them."""
    move = np.zeros_like(sheet.place)
    middle = sheet.uv().mean(1)
    _, twin, copies = np.unique(sheet.place, axis=0, return_inverse=True, return_counts=True)
    amount = random.choice([-1.0, 1.0]) * random.uniform(0, 0.7)
    # Sometimes by less than a float holds.
    amount *= random.choice([1.0, 1.0, 1.0, 1e-8, 1e-15])
    alike = random.random() < 0.6
    for p in np.flatnonzero(copies[twin.reshape(-1)] > 1):
        inward = middle[(sheet.corner == p).any(1)].mean(0) - sheet.place[p]
        length = np.linalg.norm(inward)
        if length > 1e-9:
            own = 1.0 if alike else random.choice([0.0, 0.5, 1.0, 1.0, -1.0])
            move[p] = amount * own * inward / length
    return move


def _patch(sheet: Sheet, size: int, random: Random) -> set[int]:
    """One to six faces that hang together, away from the rim."""
    inside = ((sheet.uv() > 0) & (sheet.uv() < size)).all((1, 2))
    faces = np.flatnonzero(inside)
    patch = {int(random.choice(faces))}
    for _ in range(int(random.integers(0, 6))):
        points = [set(sheet.corner[f].tolist()) for f in patch]
        near = [
            f for f in faces if any(len(p & set(sheet.corner[f].tolist())) == 2 for p in points)
        ]
        patch.add(int(random.choice(near)) if near else next(iter(patch)))
    return patch


def _groups(place: Floats, chosen: Ints) -> list[Ints]:
    """Points of the inner rims, grouped by nearness: holes that are close move as one."""
    left = np.flatnonzero(chosen).tolist()
    groups = []
    while left:
        group, queue = [], [left.pop()]
        while queue:
            p = queue.pop()
            group.append(p)
            near = [q for q in left if np.abs(place[q] - place[p]).max() <= 1.0]
            left = [q for q in left if q not in near]
            queue += near
        groups.append(np.array(group))
    return groups
