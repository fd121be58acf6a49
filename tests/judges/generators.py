"""Maps in the plane at random: grids with slits whose sides are moved past each other, apart, onto each other; rings wound
several times around a point; islands beside, on and in each other."""

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
    together,
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


def coverings(random: Random) -> PlaneMap:
    """A ring wound once, twice or thrice around, closed or cut open, maybe pushed about; or a disk around its centre."""
    turns = int(random.choice([1, 2, 2, 3]))
    sectors = int(random.integers(3 * turns, 6 * turns + 1))
    rings = int(random.integers(1, 3))
    sheet = grid(sectors, rings, random)
    angle, level = 2 * np.pi * turns * sheet.place[:, 0] / sectors, sheet.place[:, 1]
    closed = random.random() < 0.6
    growth = 0.0 if closed else random.choice([0.0, 0.0, 0.3])
    radius = 2.0 - 1.0 * level / rings + growth * sheet.place[:, 0] / sectors
    place = radius[:, None] * np.stack([np.cos(angle), np.sin(angle)], 1)
    corner = sheet.corner
    if closed:
        first, last = sheet.place[:, 0] == 0, sheet.place[:, 0] == sectors
        weld = np.arange(len(place))
        weld[np.flatnonzero(last)] = np.flatnonzero(first)
        corner = weld[corner]
        if random.random() < 0.2:
            centre = np.flatnonzero(level == rings)
            weld[centre] = centre[0]
            corner, place[centre] = weld[corner], 0.0
            corner = corner[[len(set(c)) == 3 for c in corner.tolist()]]
    sheet = only(Sheet(corner, place), np.arange(len(corner)))
    if random.random() < 0.7:
        sheet = jittered(sheet, random, random.choice([1e-9, 0.05, 0.3]))
    return map_of(transformed(sheet, random), random)


def islands(random: Random) -> PlaneMap:
    """A few pieces: apart, at random, on top of each other, side by side, in each other's holes."""
    pieces: list[Sheet] = []
    if random.random() < 0.3:
        pieces += _nested(random)
    for _ in range(int(random.integers(2, 6)) - len(pieces)):
        piece = _piece(random)
        mode = int(random.integers(5))
        if not pieces or mode == 0:
            shift = random.uniform(-4, 4, 2)
        elif mode == 1:
            piece, shift = pieces[-1], np.zeros(2)
        elif mode == 2:
            other = pieces[int(random.integers(len(pieces)))].place
            shift = np.array([other[:, 0].max() - piece.place[:, 0].min(), random.integers(-2, 3)])
        elif mode == 3:
            shift = random.integers(-3, 4, 2).astype(float)
        else:
            shift = np.array([60.0 * len(pieces), 0.0])
        # Islands are judged against each other even where triangles are flipped.
        mirror = np.array([1.0, -1.0 if random.random() < 0.05 else 1.0])
        pieces.append(nudged(piece.with_place(piece.place * mirror + shift), random))
    return map_of(transformed(together(pieces), random), random)


def _nested(random: Random) -> list[Sheet]:
    """A ring, and a square in its hole that leaves a gap, fits, or is too big by a last place."""
    sheet = grid(4, 4)
    middle = np.abs(sheet.uv().mean(1) - 2.0).max(1)
    fit = random.choice(
        [0.5, 1.0, np.nextafter(1.0, 2.0), np.nextafter(np.float32(1), np.float32(2))]
    )
    inner = grid(2, 2)
    inner = inner.with_place(2.0 + fit * (inner.place - 1.0))
    return [only(sheet, np.flatnonzero(middle > 1.0)), inner]


def _piece(random: Random) -> Sheet:
    size = int(random.integers(1, 6))
    sheet = grid(size, size)
    if size > 2 and random.random() < 0.7:
        middle = sheet.uv().mean(1)
        sheet = only(sheet, np.flatnonzero((np.abs(middle - size / 2) > size / 2 - 1).any(1)))
    return sheet
