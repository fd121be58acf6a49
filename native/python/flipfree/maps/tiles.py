"""Islands stay in their UDIM tiles: what improve and repair have moved out of one is brought back, where there is a way."""

from __future__ import annotations

import dataclasses
import time
from collections.abc import Callable
from functools import partial
from typing import Any

import numpy as np
import numpy.typing as npt

from ..arrays import FloatArray, IntArray
from ..calls.certification import Pins, certify
from ..calls.fans import islands
from ..calls.packing import pack
from ..errors import FlipfreeError
from ..job import Job, job_of
from ..results import Certificate, Parametrization, frozen

Boxes = tuple[FloatArray, FloatArray]

#: Islands brought back end this far inside, so that 32 bits do not put them out again.
_INSIDE = 1e-5


@dataclasses.dataclass(frozen=True)
class Strays:
    """Islands of a map that were within one tile and no longer are.

    Attributes:
        island: (m,) number of each face's island. low, high: (k, 2) its box. tile: (k, 2) lower corner of its tile.
        stray: (k,) whether it has left its tile. held: (k,) whether it has pins, and so stays where it is.
    """

    island: npt.NDArray[np.int64]
    low: FloatArray
    high: FloatArray
    tile: FloatArray
    stray: npt.NDArray[np.bool_]
    held: npt.NDArray[np.bool_]


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


def _boxes(uv: FloatArray, island: npt.NDArray[np.int64], count: int) -> Boxes:
    low, high = np.full((count, 2), np.inf), np.full((count, 2), -np.inf)
    with np.errstate(invalid="ignore"):  # of places that are no numbers: no tile has them
        for axis in range(2):
            np.minimum.at(low[:, axis], island, uv[:, :, axis].min(axis=1))
            np.maximum.at(high[:, axis], island, uv[:, :, axis].max(axis=1))
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


class KeptInTiles(Job[Parametrization]):
    """A job, and where its map has left tiles a second one that brings it back. ``stats["left_tiles"]``: islands that have
    left theirs all the same, as their pins or what else is there leave no room."""

    def __init__(
        self,
        first: Job[Parametrization],
        before: FloatArray,
        pinned: IntArray,
        bring: Callable[[Parametrization, Strays], tuple[Job[Any], FloatArray | None] | None],
    ) -> None:
        """bring: starts the second job, which is a certificate of the UVs that it returns as well, or a map."""
        self._first: Job[Parametrization] | None = first
        self._before, self._pinned, self._bring = before, pinned, bring
        self._second: Job[Any] | None = None
        self._uv: FloatArray | None = None
        self._map: Parametrization | None = None
        self._error: FlipfreeError | None = None
        self._cancelled = False

    def wait(self, seconds: float) -> bool:
        begin = time.monotonic()
        if self._first is not None:
            if not self._first.wait(seconds):
                return False
            first, self._first = self._first, None
            try:
                self._map = first.result()
                begun = self._bring(self._map, strays(self._map, self._before, self._pinned))
            except FlipfreeError as error:
                self._error = error
                return True
            if begun is not None:
                self._second, self._uv = begun
                if self._cancelled:
                    self._second.cancel()
        if self._second is None:
            return True
        return self._second.wait(max(seconds - (time.monotonic() - begin), 0.0))

    def progress(self) -> tuple[str, float]:
        if self._first is not None:
            stage, fraction = self._first.progress()
            return stage, 0.9 * fraction
        return ("done", 1.0) if self._second is None else (self._second.progress()[0], 0.95)

    def cancel(self) -> None:
        self._cancelled = True
        for job in (self._first, self._second):
            if job is not None:
                job.cancel()

    def accept(self) -> None:
        if self._first is not None:
            self._first.accept()

    def result(self) -> Parametrization:
        while not self.wait(3600.0):
            pass
        if self._error is not None:
            raise self._error
        assert self._map is not None
        found = self._taken(self._map)
        left = strays(found, self._before, self._pinned).stray
        return dataclasses.replace(
            found, stats={**found.stats, "left_tiles": int(np.count_nonzero(left))}
        )

    def _taken(self, found: Parametrization) -> Parametrization:
        if self._second is None:
            return found
        try:
            brought = self._second.result()
        except FlipfreeError as error:
            if error.code == "cancelled":
                raise
            return found
        if not isinstance(brought, Certificate):
            uv, stored, judged = brought.uv, brought.uv32(), brought.certificate
        else:
            assert self._uv is not None
            uv, stored, judged = frozen(self._uv), frozen(self._uv.astype(np.float32)), brought
        if not judged.ok:
            return found
        judged = dataclasses.replace(judged, mends=found.certificate.mends)
        return dataclasses.replace(found, uv=uv, uv64=uv, _uv32=stored, certificate=judged)


def improved(
    first: Job[Parametrization],
    *,
    before: FloatArray,
    pinned: IntArray,
    pins: Pins | None,
    bijective: bool,
    aspect: float,
    threads: int | None,
) -> KeptInTiles:
    """The job of ``improve``: its islands are moved back as they are."""

    def bring(found: Parametrization, seen: Strays) -> tuple[Job[Any], FloatArray | None] | None:
        uv = moved_back(found, seen)
        if uv is None:
            return None
        judge = partial(job_of(certify), found.vertices, found.faces, uv.astype(np.float32))
        whole = bijective and found.certificate.overlaps == 0
        return judge(pins=pins, bijective=whole, aspect=aspect, threads=threads), uv

    return KeptInTiles(first, before, pinned, bring)


def repaired(
    first: Job[Parametrization],
    *,
    before: FloatArray,
    pinned: IntArray,
    margin: float,
    threads: int | None,
) -> KeptInTiles:
    """The job of ``repair``: its islands get a place beside all others of their tile, at a smaller scale if need be. Of several
    tiles that have lost islands, the first one's."""

    def bring(found: Parametrization, seen: Strays) -> tuple[Job[Any], FloatArray | None] | None:
        free = seen.stray & ~seen.held & (seen.tile >= 0).all(axis=1) & (seen.tile < 10).all(axis=1)
        if not free.any():
            return None
        tile = seen.tile[np.flatnonzero(free)[0]]
        moves = (free & (seen.tile == tile).all(axis=1))[seen.island]
        stays = 3 * np.flatnonzero(~moves).astype(np.int32)
        packing = job_of(pack)(
            found.vertices,
            found.faces,
            found.uv,
            unmoved=stays,
            margin=margin,
            scale_true=True,
            tile=1001 + int(tile[0] + 10 * tile[1]),
            effort=0.2,
            threads=threads,
        )
        return packing, None

    return KeptInTiles(first, before, pinned, bring)
