"""Improve and repair: less distortion, or no flips, for an existing map, whose islands stay in their UDIM tiles. Rectify: islands
of quads onto grids, whose rows and columns are straight and as wide as they are on the surface."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any, Unpack

import numpy as np

from .. import _native
from ..checks import Pins, as_map, checked, refuse_beyond_storage
from ..errors import FlipfreeError
from ..job import Job, Limits, StagedJob, Stages, job_of, solver_call, start_job, start_map
from ..results import Certificate, Flags, FloatArray, IntArray, Ints, Parametrization
from ..separated import islands
from .certification import certify
from .unwrapping import pack

#: Islands brought back end this far inside, so that 32 bits do not put them out again.
_INSIDE = 1e-5


@solver_call
def improve(
    map_or_arrays: Any,
    *,
    pins: Pins | None = None,
    keep_bijective: bool = True,
    repair: bool = True,
    iterations: int = 200,
    tolerance: float = 1e-4,
    aspect: float = 1.0,
    **limits: Unpack[Limits],
) -> Job[Parametrization]:
    """Lowers the distortion of a map; every step keeps every triangle open.

    The map is cut where the UVs on the two sides of an edge differ. Charts get one common scale and keep their
    centres and directions, and their UDIM tiles: they are moved back into these, and all made smaller if one would not fit.
    They are not packed again. Without pins the energy is never higher than before.

    Args:
        map_or_arrays: a Parametrization, or (vertices, faces, uv) with any triangles and uv (m, 3, 2), one per face corner.
        pins: {vertex or (face, corner): (u, v)}, met bit for bit.
        keep_bijective: charts that do not overlap themselves go on not to.
        repair: a map with flipped or collapsed triangles, or with corners that are not finite, is mended first, as
            ``repair`` does; ``stats["flips_before"]`` counts them. Off: it is refused.
        iterations: most optimiser iterations per chart. tolerance: share of the energy that a step must promise.
        aspect: width over height of the texture that the unit square shows; distortion is that in its pixels.
        max_seconds: of the clock; None or 0 is no limit. What was gained by then is kept, and
            ``stats["time_limit_reached"]`` is 1; NotConverged (code "time limit reached") if there is no map yet.
        threads: None is all cores; the result has the same bits for every number, unless a limit of time is reached.
        progress: called with (stage, fraction) about 20 times per second; returning False cancels.

    Raises:
        InvalidInput (without ``repair`` also for a map with flipped triangles, which are named), NotConverged, Cancelled.
    """
    vertices, faces, uv = as_map(map_or_arrays, "improve")
    mesh, options = checked(locals())
    refuse_beyond_storage(options["uv"], "uv")
    aspect, bijective = options["aspect"], options["keep_bijective"]
    job = start_map(_native.improve, mesh, options, limits, aspect=aspect)

    def bring(found: Parametrization, seen: Strays) -> Stages[Parametrization]:
        uv = moved_back(found, seen)
        if uv is None:
            return found
        stored = uv.astype(np.float32)
        how: dict[str, Any] = dict(pins=pins, aspect=aspect, **limits)
        how["bijective"] = bijective and found.certificate.overlaps == 0
        judging = job_of(certify)(found.vertices, found.faces, stored, **how)
        return _at(found, uv, stored, (yield judging, 1.0))

    return _kept_in_tiles(job, options["uv"], options["pins"][0], bring)


@solver_call
def repair(
    vertices: Any,
    faces: Any,
    uv: Any,
    *,
    cuts: Any = None,
    uncuttable: Any = None,
    pins: Pins | None = None,
    overlaps: str = "cut",
    stretched: str = "keep",
    disjoint: bool = False,
    margin: float = 0.005,
    iterations: int = 200,
    tolerance: float = 1e-4,
    aspect: float = 1.0,
    **limits: Unpack[Limits],
) -> Job[Parametrization]:
    """Mends a map with flipped, collapsed or overlapping faces, and changes as little of it as that takes.

    The map is cut where the UVs on the two sides of an edge differ. A chart without damage stays bit for bit. One whose
    faces are mostly flipped is mirrored; else few vertices of what is bad are placed anew between those around, or
    more and more of them; a chart of which not enough is left is unwrapped, and put where it was at the scale that it had.
    Islands stay in their UDIM tiles where there is room; ``stats["left_tiles"]`` counts others.
    ``stats`` tells what the map had ("flips_before", "winding_failures_before", "overlaps_before",
    "island_overlaps_before", "corners_without_place"), how many corners were torn off and are joined to others again
    ("corners_rejoined"), and what became of its charts ("charts_mirrored",
    "charts_unfolded", "charts_anew", "charts_cut", "charts_moved"); "corners_kept" of 3 m corners have their old bits.

    Args:
        vertices: (n, 3) float64. faces: (m, 3), any triangles. uv: (m, 3, 2), one per face corner. Corners that are not
            finite, or beyond what 32 bits hold, get a place from their neighbours.
        cuts: (s, 2) vertex pairs: seams. A chart that is unwrapped is cut there too.
        uncuttable: (d, 2) vertex pairs that automatic cuts must avoid, such as diagonals of polygons.
        pins: {vertex or (face, corner): (u, v)}, met bit for bit.
        overlaps: what becomes of a chart that lies on itself: "cut" into pieces, of which the largest stays and the others
            are moved to where there is room; "open": unwrapped without further cuts; "keep".
        stretched: what becomes of charts whose energy is more than 1.1 times that of an unwrap of them: "keep" bit for bit (and
            count them, up to 50 000 faces each: "stretched_charts"), or "improve": where they are, or unwrapped again along
            their seams where that is not enough ("charts_improved", "charts_stretched_anew"), and without pins at the scale that
            most other charts have, or else at their own; then "stretched_charts" counts those whose pins do not allow it.
        disjoint: charts that lie on larger ones are moved to where there is room, but for those with pins.
        margin: space around charts that are moved, in units of the unit square.
        iterations: most optimiser iterations per chart that is unwrapped. tolerance: share of the energy a step must promise.
        aspect: width over height of the texture that the unit square shows; what is made anew has its shape in its pixels.
        max_seconds: of the clock; None or 0 is no limit. NotConverged (code "time limit reached") when they are over.
        threads: None is all cores; the result has the same bits for every number.
        progress: called with (stage, fraction) about 20 times per second; returning False cancels.

    Raises:
        InvalidInput, NotConverged (also for pins that no map on these triangles was found for), Cancelled.
    """
    mesh, options = checked(locals())
    margin, aspect = options["margin"], options["aspect"]
    job = start_map(_native.repair, mesh, options, limits, aspect=aspect)
    if aspect != 1.0:  # packing is of squares
        return job

    def bring(found: Parametrization, seen: Strays) -> Stages[Parametrization]:
        """A place beside all others of their tile, at a smaller scale if need be. Of several tiles that have lost islands,
        the first one's."""
        free = seen.stray & ~seen.held & ((seen.tile >= 0) & (seen.tile < 10)).all(axis=1)
        if not free.any():
            return found
        tile = seen.tile[np.flatnonzero(free)[0]]
        moves = (free & (seen.tile == tile).all(axis=1))[seen.island]
        unmoved = 3 * np.flatnonzero(~moves).astype(np.int32)
        how: dict[str, Any] = dict(unmoved=unmoved, tile=1001 + int(tile[0] + 10 * tile[1]))
        how |= dict(margin=margin, scale_true=True, effort=0.2, **limits)
        packing = job_of(pack)(found.vertices, found.faces, found.uv, **how)
        packed: Parametrization = yield packing, 1.0
        moved = _at(found, packed.uv, packed.uv32(), packed.certificate)
        kept = (moved.uv == options["uv"].reshape(-1, 3, 2)).all(axis=2).sum()
        return replace(moved, stats={**moved.stats, "corners_kept": int(kept)})

    return _kept_in_tiles(job, options["uv"], options["pins"][0], bring)


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
    **limits: Unpack[Limits],
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
    mesh, finding = checked(locals(), "margin aspect cuts polygons" + " uv" * (uv is not None))
    options = {name: finding.pop(name) for name in ("margin", "aspect")}
    if uv is not None:
        finding["corner_uv"] = finding.pop("uv")

    def stages() -> Stages[Parametrization]:
        job = start_job(_native.rectify, mesh, finding, limits, lambda data, _mesh: data)
        straight = yield job, 0.3
        placed = straight.reshape(-1, 3, 2) / [options["aspect"], 1.0]
        how = options | dict(rotation="quarters", scale_true=True, effort=0.2)
        found: Parametrization = yield job_of(pack)(vertices, faces, placed, **how, **limits), 1.0
        return found

    return StagedJob(stages())


@dataclass(frozen=True)
class Strays:
    """Islands of a map that were within one tile and no longer are.

    Attributes:
        island: (m,) number of each face's island. low, high: (k, 2) its box. tile: (k, 2) lower corner of its tile.
        stray: (k,) whether it has left its tile. held: (k,) whether it has pins, and so stays where it is.
    """

    island: Ints
    low: FloatArray
    high: FloatArray
    tile: FloatArray
    stray: Flags
    held: Flags


def strays(found: Parametrization, before: FloatArray, pinned: IntArray) -> Strays:
    """before: (m, 3, 2) UVs that the map was made of. pinned: corners 3 face + corner."""
    island = np.unique(islands(found.faces, found.uv32())[0], return_inverse=True)[1].reshape(-1)
    count = int(island.max(initial=-1)) + 1
    old_low, old_high = _boxes(before.reshape(-1, 3, 2), island, count)
    low, high = _boxes(found.uv32().astype(np.float64), island, count)
    with np.errstate(invalid="ignore"):
        tile = np.floor((old_low + old_high) / 2)
        within = ((old_low >= tile) & (old_high <= tile + 1)).all(axis=1)
        out = ((low < tile) | (high > tile + 1)).any(axis=1)
    held = np.zeros(count, bool)
    held[island[pinned // 3]] = True
    left = np.asarray(within & out, bool)
    return Strays(island, low, high, tile, left, held)


def _boxes(uv: FloatArray, island: Ints, count: int) -> tuple[FloatArray, FloatArray]:
    low, high = np.full((count, 2), np.inf), np.full((count, 2), -np.inf)
    with np.errstate(invalid="ignore"):  # of places that are no numbers: no tile has them
        np.minimum.at(low, island, uv.min(axis=1))
        np.maximum.at(high, island, uv.max(axis=1))
    return low, high


def moved_back(found: Parametrization, seen: Strays) -> FloatArray | None:
    """(m, 3, 2) with strays in their tiles again, all islands without pins smaller at one scale if some would not fit; None if
    there is nothing to move."""
    free = seen.stray & ~seen.held
    if not free.any():
        return None
    room = 1.0 - 2.0 * _INSIDE
    scale = min(1.0, room / float((seen.high - seen.low)[free].max()))
    middle, half = (seen.low + seen.high) / 2, (seen.high - seen.low) / 2 * scale
    low, high = seen.tile + _INSIDE + half, seen.tile + 1.0 - _INSIDE - half
    to = np.where(free[:, None], np.clip(middle, low, np.maximum(low, high)), middle)
    moves = ~seen.held if scale < 1.0 else free
    own, there = middle[seen.island][:, None], to[seen.island][:, None]
    uv = np.where(moves[seen.island][:, None, None], (found.uv - own) * scale + there, found.uv)
    return np.asarray(uv, np.float64)


def _kept_in_tiles(
    first: Job[Parametrization],
    before: FloatArray,
    pinned: IntArray,
    bring: Callable[[Parametrization, Strays], Stages[Parametrization]],
) -> Job[Parametrization]:
    """A job, and where its map has left tiles what brings it back. ``stats["left_tiles"]``: islands that have left theirs all the
    same, as their pins or what else is there leave no room."""

    def stages() -> Stages[Parametrization]:
        found: Parametrization = yield first, 0.9
        try:
            found = yield from bring(found, strays(found, before, pinned))
        except FlipfreeError as error:
            if error.code == "cancelled":
                raise
        left = int(np.count_nonzero(strays(found, before, pinned).stray))
        return replace(found, stats={**found.stats, "left_tiles": left})

    return StagedJob(stages())


def _at(
    found: Parametrization, uv: FloatArray, stored: Any, judged: Certificate
) -> Parametrization:
    """The map with other UVs, if these passed."""
    if not judged.ok:
        return found
    judged = replace(judged, mends=found.certificate.mends)
    return replace(found, uv=uv, uv64=uv, _uv32=stored, certificate=judged)
