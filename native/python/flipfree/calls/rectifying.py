"""Rectify: islands of quads onto grids, whose rows and columns are straight and as wide as they are on the surface."""

from __future__ import annotations

from collections import deque
from typing import Any

import numpy as np
import numpy.typing as npt

from ..checks import as_corner_uv, as_face_numbers, as_mesh, checked
from ..errors import InvalidInput
from ..job import Job, Progress, job_of, solver_call
from ..results import FloatArray, Parametrization
from ..separated import islands
from ..texts import counted
from .unwrapping import pack

Ints = npt.NDArray[np.int64]

#: From a cell to the next one below, on the right, above, on the left.
_WAYS = np.array([(0, -1), (1, 0), (0, 1), (-1, 0)])


@solver_call
def rectify(
    vertices: Any,
    faces: Any,
    uv: Any = None,
    *,
    polygons: Any = None,
    cuts: Any = None,
    margin: float = 0.005,
    aspect: float = 1.0,
    max_seconds: float | None = None,
    threads: int | None = None,
    progress: Progress | None = None,
) -> Job[Parametrization]:
    """Islands of quads as straight strips and grids, packed: every row and every column of faces has one width, the mean of its
    edges. Islands that close up, such as tubes and rings, are cut along one row. O(m log m).

    Args:
        vertices: (n, 3) float64. faces: (m, 3), consistently oriented. uv: (m, 3, 2), one per face corner: islands end where it
            differs on the two sides of an edge, but for those that are grids without their seams, such as tubes, which get a
            straight one. None: at cuts and boundaries alone.
        polygons: (m,) whole numbers: the two triangles of a quad have the same one. Triangles that are alone are taken as quads
            in pairs, across what is the longest side of both.
        cuts: (s, 2) vertex pairs: seams, where islands end as well.
        margin: space between islands, in units of the unit square.
        aspect: width over height of the texture that the unit square shows; widths are those in its pixels.
        max_seconds: of the clock; None or 0 is no limit. NotConverged (code "time limit reached") when they are over.
        threads: None is all cores; the result has the same bits for every number.
        progress: called with (stage, fraction) about 20 times per second; returning False cancels.

    Returns:
        A certified map; its energy says what straightening costs.

    Raises:
        InvalidInput (codes "no quad"; "no grid": where three or five quads meet inside, or an island lies on itself; a face of
        each place is named), NotConverged, Cancelled.
    """
    mesh = as_mesh(vertices, faces)
    options = checked(locals(), "cuts margin aspect max_seconds")
    numbers = as_face_numbers(polygons, "polygons", len(mesh.faces))
    if polygons is None:
        numbers = np.arange(len(mesh.faces), dtype=np.int32)
    old = None if uv is None else as_corner_uv(uv, "uv", len(mesh.faces)).reshape(-1, 3, 2)
    known = len(mesh.faces) and 0 <= mesh.faces.min() and mesh.faces.max() < len(mesh.scaled)
    straight = np.zeros((len(mesh.faces), 3, 2))
    if known:  # else it is refused by name where the mesh is
        with np.errstate(all="ignore"):  # numbers beyond all range are refused there, too
            straight = _straight(
                mesh.scaled, mesh.faces.astype(np.int64), numbers, old, options["cuts"]
            )
    return job_of(pack)(
        vertices,
        faces,
        straight / [options["aspect"], 1.0],
        margin=options["margin"],
        aspect=options["aspect"],
        rotation="quarters",
        scale_true=True,
        effort=0.2,
        max_seconds=max_seconds,
        threads=threads,
    )


def _refuse(triangles: Ints, why: str, code: str = "no grid") -> None:
    """Where there are such triangles."""
    if len(triangles):
        named = np.unique(triangles)
        raise InvalidInput(
            f"{counted(len(named), 'face')}, first face {named[0]}: {why}. Cut around, or leave these islands out.",
            code=code,
            kind="face",
            elements=named[:1000].tolist(),
        )


def _straight(vertices: FloatArray, faces: Ints, polygons: Any, uv: Any, cuts: Any) -> FloatArray:
    """(m, 3, 2) of all islands, beside each other."""
    pair, corner_of = _quads(faces, _paired(vertices, faces, polygons))
    quads = np.zeros((len(pair), 4), np.int64)
    rows = np.repeat(np.arange(len(pair)), 6)
    quads[rows, corner_of.ravel()] = faces[pair].ravel()
    across = _across(quads, cuts)
    if uv is not None:
        places = np.zeros((len(pair), 4, 2), np.float32)
        places[rows, corner_of.ravel()] = uv[pair].reshape(-1, 2)
        across = _by_islands(across, places, islands(faces, uv.astype(np.float32))[0][pair[:, 0]])
    _refuse(
        pair[_irregular(across), 0],
        "other than four quads meet inside the island",
    )
    island, turn, cell = _cells(across)
    _refuse(pair[_closed_wrongly(across, island, turn, cell), 0], "its island is no grid")
    corner = vertices[quads]
    lengths = np.linalg.norm(np.roll(corner, -1, axis=1) - corner, axis=2)
    lengths = np.take_along_axis(lengths, (turn[:, None] + np.arange(4)) % 4, axis=1)
    ends = [_ends(island, cell[:, k], (lengths[:, k] + lengths[:, k + 2]) / 2) for k in (0, 1)]
    # Beside each other: the sides of an edge between two islands must not meet.
    wide = 1.5 * max(float(end.max()) for end in ends)
    many = int(np.ceil(np.sqrt(island.max() + 1)))
    (left, right), (low, high) = (
        e + wide * k for e, k in zip(ends, (island % many, island // many), strict=True)
    )
    box = np.stack([[left, low], [right, low], [right, high], [left, high]]).transpose(2, 0, 1)
    found = np.empty((len(faces), 3, 2))
    local = (corner_of - turn[:, None, None]) % 4
    found[pair] = box[np.arange(len(pair))[:, None, None], local]
    return found


def _paired(vertices: FloatArray, faces: Ints, polygons: Any) -> Ints:
    """Numbers of polygons, with triangles that are alone in pairs."""
    _, at, count = np.unique(polygons, return_inverse=True, return_counts=True)
    found = at.ravel()
    alone = np.flatnonzero(count[found] == 1)
    corner = vertices[faces[alone]]
    longest = np.linalg.norm(np.roll(corner, -1, axis=1) - corner, axis=2).argmax(axis=1)
    ends = np.sort([faces[alone, longest], faces[alone, (longest + 1) % 3]], axis=0)
    _, pair = np.unique(ends, axis=1, return_inverse=True)
    found[alone] = len(count) + pair.ravel()
    return found


def _quads(faces: Ints, polygons: Any) -> tuple[Ints, Ints]:
    """((k, 2) triangles of each quad, (k, 2, 3) which corner of the quad each of their corners is). Refuses all else."""
    order = np.argsort(polygons, kind="stable")
    _, first, count = np.unique(polygons[order], return_index=True, return_counts=True)
    alone = np.repeat(count != 2, count)
    _refuse(order[alone], "no quad", "no quad")
    pair = np.column_stack([order[first], order[first + 1]])
    one, other = faces[pair[:, 0]], faces[pair[:, 1]]
    back = np.roll(other, -1, axis=1)
    same = (one[:, :, None] == back[:, None]) & (
        np.roll(one, -1, axis=1)[:, :, None] == other[:, None]
    )
    at = same.reshape(-1, 9).argmax(axis=1)
    k, m = (at // 3)[:, None], (at % 3)[:, None]
    apex = np.take_along_axis(other, (m + 2) % 3, axis=1)
    wrong = (same.sum(axis=(1, 2)) != 1) | (one == apex).any(axis=1)
    _refuse(pair[wrong, 0], "its two triangles make no quad", "no quad")
    three = np.arange(3)
    corner_of = np.stack(
        [np.array([2, 0, 1])[(three - k) % 3], np.array([0, 2, 3])[(three - m) % 3]], axis=1
    )
    return pair, corner_of


def _across(quads: Ints, cuts: Any) -> Ints:
    """(4 k,) the side of another quad beyond each, -1 where the island ends. Side s is from corner s to the next."""
    start, end = quads.ravel(), np.roll(quads, -1, axis=1).ravel()
    size = int(quads.max()) + 1
    keys, back = start * size + end, end * size + start
    known, first, count = np.unique(keys, return_index=True, return_counts=True)
    at = np.minimum(np.searchsorted(known, back), len(known) - 1)
    itself = count[np.searchsorted(known, keys)] == 1
    found = np.where((known[at] == back) & (count[at] == 1) & itself, first[at], -1)
    if len(cuts):
        low, high = np.minimum(start, end), np.maximum(start, end)
        pairs = np.sort(np.asarray(cuts, np.int64), axis=1)
        found[np.isin(low * size + high, pairs[:, 0] * size + pairs[:, 1])] = -1
    return found


def _by_islands(across: Ints, places: Any, label: Any) -> Ints:
    """The same with islands of a map, which end at each other. Where one is torn inside, it is joined if that makes a grid, to be
    cut straight then: the seams of tubes are crooked as a rule."""
    label = np.unique(label, return_inverse=True)[1].ravel()
    own, other = np.repeat(label, 4), label[across // 4]
    joined = np.where((across >= 0) & (own == other), across, -1)
    begin, stop = places.reshape(-1, 2), np.roll(places, -1, axis=1).reshape(-1, 2)
    torn = ~((begin == stop[joined]) & (stop == begin[joined])).all(axis=1) & (joined >= 0)
    if not torn.any():
        return joined
    wrong = [_irregular(joined), _closed_wrongly(joined, *_cells(joined))]
    return np.where(torn & np.isin(own, label[np.concatenate(wrong)]), -1, joined)


def _irregular(across: Ints) -> Ints:
    """Quads with a corner inside at which other than four meet."""
    around = np.where(across >= 0, across - across % 4 + (across + 1) % 4, -1)
    fourth = np.arange(len(around))
    for _ in range(4):
        fourth = np.where(fourth >= 0, around[fourth], -1)
    return np.flatnonzero((fourth >= 0) & (fourth != np.arange(len(around)))) // 4


def _cells(across: Ints) -> tuple[Ints, Ints, Ints]:
    """Of each quad its island, the side that is its lower one, and its (column, row). One row of each island comes first, then
    its columns: so an island that closes up is cut straight."""
    beyond = across.tolist()
    count = len(beyond) // 4
    island, turn = [-1] * count, [0] * count
    cell = [(0, 0)] * count

    def step(quad: int, way: int) -> int:
        """The next quad, if it has no place yet: it has one then."""
        side = beyond[4 * quad + (turn[quad] + way) % 4]
        if side < 0 or island[side // 4] >= 0:
            return -1
        following: int = side // 4
        island[following], turn[following] = island[quad], (side - way - 2) % 4
        column, row = cell[quad]
        cell[following] = (column + int(_WAYS[way][0]), row + int(_WAYS[way][1]))
        return following

    number = 0
    for seed in range(count):
        if island[seed] >= 0:
            continue
        island[seed] = number
        number += 1
        line = [seed]
        for way in (1, 3):
            at = seed
            while (at := step(at, way)) >= 0:
                line.append(at)
        later: deque[int] = deque()
        while line or later:
            ways = (0, 2) if line else (1, 3)
            at = line.pop() if line else later.popleft()
            if ways == (0, 2):
                later.append(at)
            line += [found for way in ways if (found := step(at, way)) >= 0]
    return np.array(island), np.array(turn), np.array(cell)


def _closed_wrongly(across: Ints, island: Ints, turn: Ints, cell: Ints) -> Ints:
    """Quads beside which the grid does not go on, or on whose cell another one lies."""
    sides = np.flatnonzero(across >= 0)
    quad, side = np.divmod(sides, 4)
    other, entry = np.divmod(across[sides], 4)
    way = (side - turn[quad]) % 4
    shift = cell[other] - cell[quad] - _WAYS[way]
    # An island that closes up comes back in the same row or column.
    wrong = ((entry - way - 2) % 4 != turn[other]) | (shift != 0).all(axis=1)
    _, at, count = np.unique(
        np.column_stack([island, cell]), axis=0, return_inverse=True, return_counts=True
    )
    return np.unique(np.concatenate([quad[wrong], np.flatnonzero(count[at.ravel()] > 1)]))


def _ends(island: Ints, line: Ints, widths: FloatArray) -> FloatArray:
    """(2, k) where the columns, or rows, of these quads begin and end: as wide as their quads in the mean."""
    keys, at = np.unique(np.column_stack([island, line]), axis=0, return_inverse=True)
    at = at.ravel()
    width = np.bincount(at, widths) / np.bincount(at)
    width = np.maximum(width, 1e-6 * width.max(initial=0.0))
    edges = np.append(0.0, np.cumsum(width))
    first = np.searchsorted(keys[:, 0], island)
    return np.stack([edges[at] - edges[first], edges[at + 1] - edges[first]])
