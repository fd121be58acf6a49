"""Packing into textures that are no squares: in their pixels, of which the unit square has one shape only.

The longer side of the texture has length 1 in its own plane, where islands turn and gaps are measured; what lies beside it
in the unit square is an obstacle. The way back to UVs is one factor for u or v, a rounding, and a certificate of what that left.
"""

from __future__ import annotations

import dataclasses
import time
from collections.abc import Callable

import numpy as np
import numpy.typing as npt

from .arrays import FloatArray, IntArray
from .errors import FlipfreeError, InvalidInput, NotConverged
from .job import Job
from .results import Certificate, Parametrization


@dataclasses.dataclass(frozen=True)
class Texture:
    """aspect: width over height. column, row: of its UDIM tile."""

    aspect: float
    column: int = 0
    row: int = 0

    @property
    def _scale(self) -> FloatArray:
        return np.array([min(self.aspect, 1.0), min(1.0 / self.aspect, 1.0)])

    @property
    def _origin(self) -> FloatArray:
        return np.array([self.column, self.row], float)

    def in_pixels(self, uv: FloatArray) -> FloatArray:
        """UVs (..., 2) in the texture's plane."""
        return (uv - self._origin) * self._scale

    def in_uv(self, points: FloatArray) -> FloatArray:
        return points / self._scale + self._origin

    def beside(self) -> FloatArray:
        """(2, 3, 2) triangles: what the unit square has beyond the texture."""
        low = np.where(self._scale < 1.0, self._scale, 0.0)
        a, b, c, d = low, np.array([1.0, low[1]]), np.array([1.0, 1.0]), np.array([low[0], 1.0])
        return np.array([[a, b, c], [a, c, d]])


def held_by_pins(
    found: Parametrization, faces: IntArray, pinned: npt.NDArray[np.bool_]
) -> npt.NDArray[np.bool_]:
    """Of a map that met pins: its vertices that may not move any more, as a mask. They are the pinned ones of the input, whose
    faces these are, and new ones on edges between two of them, which may be a line or a part of the boundary."""
    n = len(pinned)
    weights, corners = found.vertex_barycentric[n:], pinned[faces[found.vertex_parent[n:]]]
    between = ((weights == 0.0) | corners).all(axis=1) & (weights == 0.0).any(axis=1)
    return np.concatenate([pinned, between])


def refuse_tiles(aspect: float, tiles: int) -> None:
    if aspect != 1.0 and tiles > 1:
        raise InvalidInput(
            "Charts are spread over several tiles only where these are squares. Pack into one tile, or leave aspect out.",
            code="bad option",
        )


class ShapedJob(Job[Parametrization]):
    """The packing in pixels, then the certificate of its UVs."""

    def __init__(
        self,
        packing: Job[Parametrization],
        uv: FloatArray,
        texture: Texture,
        judge: Callable[[FloatArray], Job[Certificate]],
    ) -> None:
        """uv: (m, 3, 2) before the packing. judge: starts the certificate of a map with these UVs."""
        self._packing: Job[Parametrization] | None = packing
        self._uv, self._texture, self._judge = uv, texture, judge
        self._map: Parametrization | None = None
        self._judging: Job[Certificate] | None = None
        self._error: FlipfreeError | None = None
        self._collected = self._cancelled = False

    def wait(self, seconds: float) -> bool:
        begin, left = time.monotonic(), seconds
        if self._packing is not None:
            if not self._packing.wait(seconds):
                return False
            packing, self._packing = self._packing, None
            try:
                self._map = self._in_uv(packing.result())
                self._judging = self._judge(self._map.uv)
            except FlipfreeError as error:
                self._error = error
            else:
                if self._cancelled:
                    self._judging.cancel()
            left = max(seconds - (time.monotonic() - begin), 0.0)
        if self._judging is None:
            return True
        return self._judging.wait(left)

    def _in_uv(self, packed: Parametrization) -> Parametrization:
        texture = self._texture
        if packed.stats["tile"] != 0:
            raise InvalidInput(
                "What stays leaves no room in the texture's tile. Pack into another tile, or leave aspect out.",
                code="bad option",
            )
        stays = (packed.uv == texture.in_pixels(self._uv)).all(axis=2, keepdims=True)
        uv = np.where(stays, self._uv, texture.in_uv(packed.uv))
        stored = uv.astype(np.float32)
        uv.flags.writeable = stored.flags.writeable = False
        stats = {**packed.stats, "tile": texture.column + 10 * texture.row}
        stats["fill"] *= max(texture.aspect, 1.0 / texture.aspect)
        return dataclasses.replace(packed, uv=uv, uv64=uv, _uv32=stored, stats=stats)

    def progress(self) -> tuple[str, float]:
        if self._packing is not None:
            stage, fraction = self._packing.progress()
            return stage, 0.8 * fraction
        if self._judging is not None:
            stage, fraction = self._judging.progress()
            return stage, 0.8 + 0.2 * fraction
        return "done", 1.0

    def cancel(self) -> None:
        self._cancelled = True
        for job in (self._packing, self._judging):
            if job is not None:
                job.cancel()

    def accept(self) -> None:
        if self._packing is not None:
            self._packing.accept()

    def result(self) -> Parametrization:
        if self._collected:
            raise InvalidInput(
                "The result of this job was already collected. Keep it, it is not held here.",
                code="bad option",
            )
        while not self.wait(3600.0):
            pass
        if self._error is not None:
            raise self._error
        assert self._map is not None and self._judging is not None
        packed = self._map
        found = self._judging.result()
        if not found.ok:
            raise NotConverged(
                f"The packed map failed its check: {'; '.join(found.failures)}. Leave aspect out, or pack fewer faces at once.",
                code="certificate failed",
                certificate=found,
            )
        self._collected = True
        seen = packed.certificate  # distortion is that of the texture on the surface
        return dataclasses.replace(
            packed,
            certificate=dataclasses.replace(
                found,
                energy=seen.energy,
                max_energy=seen.max_energy,
                energy_p99=seen.energy_p99,
                stretched=seen.stretched,
                area=seen.area,
                poor=seen.poor,
                poor_islands=seen.poor_islands,
            ),
        )
