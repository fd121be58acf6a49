"""Improve: less distortion for an existing map, without a flip on the way."""

from __future__ import annotations

from functools import partial
from typing import Any

from .. import _native
from ..arrays import as_corner_uv, as_indices, as_vertices, refuse_beyond_storage
from ..conversions import parametrization_from
from ..errors import InvalidInput
from ..job import Job, Progress, solver_call
from ..options import as_count, as_flag, as_positive, as_seconds, as_threads, filled
from ..results import Parametrization
from .certification import Pins, pins_to_corners


@solver_call
def improve(
    map_or_arrays: Any,
    *,
    pins: Pins | None = None,
    keep_bijective: bool = True,
    iterations: int = 200,
    tolerance: float = 1e-4,
    max_seconds: float | None = None,
    threads: int | None = None,
    progress: Progress | None = None,
) -> Job[Parametrization]:
    """Lowers the distortion of a flip-free map; every step keeps every triangle open.

    The map is cut where the UVs on the two sides of an edge differ. Charts get one common scale and keep their
    centres and directions; they are not packed again. Without pins the energy is never higher than before.

    Args:
        map_or_arrays: a Parametrization, or (vertices, faces, uv) with any triangles and uv (m, 3, 2), one per face corner.
        pins: {vertex or (face, corner): (u, v)}, met bit for bit.
        keep_bijective: charts that do not overlap themselves go on not to.
        iterations: most optimiser iterations per chart. tolerance: share of the energy that a step must promise.
        max_seconds: of the clock; None or 0 is no limit. What was gained by then is kept, and
            ``stats["time_limit_reached"]`` is 1; NotConverged (code "time limit reached") if there is no map yet.
        threads: None is all cores; the result has the same bits for every number, unless a limit of time is reached.
        progress: called with (stage, fraction) about 20 times per second; returning False cancels.

    Raises:
        InvalidInput (also for a map with flipped triangles, which are named), NotConverged, Cancelled.
    """
    if isinstance(map_or_arrays, Parametrization):
        given = map_or_arrays
        vertices, faces, uv = given.vertices, given.faces, given.uv
    else:
        try:
            vertices, faces, uv = map_or_arrays
        except Exception:  # it has another number of parts, or none
            raise InvalidInput(
                "improve takes a Parametrization or (vertices, faces, uv).",
                code="array of the wrong shape",
            ) from None
    face_array = as_indices(faces, "faces", 3)
    pin_corners, pin_uv = pins_to_corners(pins, face_array)
    corner_uv = as_corner_uv(uv, "uv", len(face_array))
    refuse_beyond_storage(corner_uv, "uv")
    positions = as_vertices(vertices, face_array)
    options = filled(
        _native.ImproveOptions(),
        pins=(pin_corners, pin_uv),
        keep_bijective=as_flag(keep_bijective, "keep_bijective"),
        iterations=as_count(iterations, "iterations"),
        tolerance=as_positive(tolerance, "tolerance"),
        max_seconds=as_seconds(max_seconds, "max_seconds"),
    )
    native = _native.improve(positions.scaled, face_array, corner_uv, options, as_threads(threads))
    return Job(native, partial(parametrization_from, positions=positions))
