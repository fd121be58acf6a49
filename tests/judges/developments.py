"""Charts that grow piece by piece, as unfolded polyhedra do, and ribbons along curves: sooner or later most overlap."""

from __future__ import annotations

import numpy as np

from .maps import (
    Floats,
    Ints,
    PlaneMap,
    Random,
    Sheet,
    doubled_areas,
    grid,
    inner_edges,
    is_surface,
    jittered,
    map_of,
    nudged,
    only,
    opened,
    together,
    transformed,
)

Cell = tuple[int, int]
_SIDES: tuple[Cell, ...] = ((0, -1), (1, 0), (0, 1), (-1, 0))
_CORNERS = np.array([(0, 0), (1, 0), (1, 1), (0, 1)])


def cell_tree(random: Random, count: int | None = None) -> Sheet:
    """Unit squares glued side to side, each to one before it, in a place that may be taken already; squares that came to lie
    side by side are sometimes glued as well."""
    count = int(random.integers(2, 14)) if count is None else count
    straight = random.random()
    cells: list[Cell] = [(0, 0)]
    glued: dict[tuple[int, int], tuple[int, int]] = {}  # (square, side) -> (square, side)
    last = 0
    while len(cells) < count:
        i = len(cells) - 1 if random.random() < straight else int(random.integers(len(cells)))
        side = last if random.random() < 0.3 else int(random.integers(4))
        if (i, side) in glued:
            continue
        (x, y), (dx, dy) = cells[i], _SIDES[side]
        glued[i, side] = (len(cells), (side + 2) % 4)
        glued[len(cells), (side + 2) % 4] = (i, side)
        cells.append((x + dx, y + dy))
        last = side
    tree = dict(glued)
    closing = random.choice([0.0, 0.0, 0.5, 1.0])
    for i, (x, y) in enumerate(cells):
        for side, (dx, dy) in enumerate(_SIDES):
            for j in (k for k, c in enumerate(cells) if c == (x + dx, y + dy)):
                free = (i, side) not in glued and (j, (side + 2) % 4) not in glued
                if free and random.random() < closing:
                    glued[i, side], glued[j, (side + 2) % 4] = (j, (side + 2) % 4), (i, side)
    closed = _squares(cells, glued)
    # Layers on top of each other can be glued into what is no surface.
    return closed if is_surface(closed) else _squares(cells, tree)


def _squares(cells: list[Cell], glued: dict[tuple[int, int], tuple[int, int]]) -> Sheet:
    point = np.arange(4 * len(cells)).reshape(-1, 4)
    # Side s of a square runs from its corner s to the next one.
    for _ in range(len(cells)):
        for (i, s), (j, t) in glued.items():
            for a, b in ((s, (t + 1) % 4), ((s + 1) % 4, t)):
                point[i, a] = point[j, b] = min(point[i, a], point[j, b])
    place = (np.array(cells)[:, None] + _CORNERS).reshape(-1, 2).astype(float)
    corner = np.vstack([point[:, [0, 1, 2]], point[:, [0, 2, 3]]])
    return only(Sheet(corner, place), np.arange(len(corner)))


def cells(random: Random) -> PlaneMap:
    sheet = cell_tree(random)
    if random.random() < 0.3:
        sheet = jittered(sheet, random, 0.1)
    return map_of(transformed(nudged(sheet, random), random), random)


def triangle_tree(random: Random) -> PlaneMap:
    """Triangles with corners on a lattice, each glued to a free side of one before it."""
    lattice = random.random() < 0.6
    place = [np.array(p, float) for p in ((0, 0), (3, 0), (1, 2))]
    corners, free = [(0, 1, 2)], [(0, 1), (1, 2), (2, 0)]
    count = int(random.integers(2, 16))
    while len(corners) < count:
        a, b = free.pop(int(random.integers(len(free))))
        along = place[b] - place[a]
        out = np.array([along[1], -along[0]])
        apex = place[a] + random.uniform(-0.5, 1.5) * along + random.uniform(0.2, 1.5) * out
        apex = np.rint(apex) if lattice else apex
        e = apex - place[a]
        if along[0] * e[1] - along[1] * e[0] >= 0:
            free.append((a, b))
            continue
        if np.abs(apex).max() > 40:
            break
        c = len(place)
        place.append(apex)
        corners.append((b, a, c))
        free += [(a, c), (c, b)]
    sheet = Sheet(np.array(corners), np.array(place))
    return map_of(transformed(nudged(sheet, random), random), random)


def ribbons(random: Random) -> PlaneMap:
    """A strip along a spiral, a wandering curve or a curve with a crossing, as wide as triangles allow."""
    steps = int(random.integers(8, 40))
    kind = int(random.integers(3))
    if kind == 0:
        turns = random.uniform(0.5, 3.0)
        radius = 1.0 + random.uniform(0.0, 0.5) * np.linspace(0, turns, steps)
        angle = 2 * np.pi * np.linspace(0, turns, steps)
        curve = radius[:, None] * np.stack([np.cos(angle), np.sin(angle)], 1)
    else:
        bend = random.normal(0, 0.5) if kind == 2 else 0.0
        direction = np.cumsum(random.normal(bend, 0.3, steps))
        curve = np.cumsum(np.stack([np.cos(direction), np.sin(direction)], 1), 0)
    return map_of(
        transformed(nudged(_strip(curve, random.uniform(0.05, 1.0), random), random), random),
        random,
    )


def _strip(curve: Floats, width: float, random: Random) -> Sheet:
    """Narrowed until all triangles are positive."""
    along = np.gradient(curve, axis=0)
    normal = np.stack([-along[:, 1], along[:, 0]], 1) / np.linalg.norm(along, axis=1)[:, None]
    rows = int(random.integers(1, 3))
    sheet = grid(len(curve) - 1, rows, random)
    for _ in range(20):
        across = np.linspace(-0.5, 0.5, rows + 1)[:, None, None] * width
        place = (curve + across * normal).reshape(-1, 2)
        if (doubled_areas(sheet, place) > 0).all():
            break
        width *= 0.7
    return sheet.with_place(place)


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
    if random.random() < 0.4:
        return cell_tree(random, int(random.integers(1, 7)))
    size = int(random.integers(1, 6))
    sheet = grid(size, size)
    if size > 2 and random.random() < 0.7:
        middle = sheet.uv().mean(1)
        sheet = only(sheet, np.flatnonzero((np.abs(middle - size / 2) > size / 2 - 1).any(1)))
    return sheet


def cut_up(random: Random) -> PlaneMap:
    """A grid of one mesh, cut in the map along random edges, its charts shifted: some not at all, so that they are one again."""
    sheet = grid(int(random.integers(2, 6)), int(random.integers(2, 6)), random)
    edges = inner_edges(sheet)
    chosen = edges[random.random(len(edges)) < random.choice([0.3, 0.6])]
    sheet = opened(sheet, chosen, in_mesh=False)
    place = sheet.place.copy()
    for piece in _pieces(sheet):
        mode = int(random.integers(4))
        if mode == 1:
            place[piece] += random.integers(-2, 3, 2)
        elif mode > 1:
            place[piece] += random.normal(0, 2, 2)
    return map_of(transformed(nudged(sheet.with_place(place), random), random), random)


def _pieces(sheet: Sheet) -> list[Ints]:
    """Points of the sheet that hang together."""
    label = np.arange(len(sheet.place))
    while True:
        least = label.copy()
        for k in range(3):
            np.minimum.at(least, sheet.corner.ravel(), np.repeat(label[sheet.corner[:, k]], 3))
        if (least == label).all():
            return [np.flatnonzero(label == i) for i in np.unique(label)]
        label = least
