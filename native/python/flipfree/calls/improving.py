"""Improve and repair: less distortion, or no flips, for an existing map."""

from __future__ import annotations

from functools import partial
from typing import Any

from .. import _native
from ..arrays import as_corner_uv, as_indices, as_vertices, refuse_beyond_storage
from ..conversions import parametrization_from
from ..errors import InvalidInput
from ..job import Job, Progress, solver_call
from ..maps.tiles import improved, repaired
from ..options import (
    as_aspect,
    as_choice,
    as_count,
    as_flag,
    as_margin,
    as_positive,
    as_seconds,
    as_threads,
)
from ..results import Parametrization
from .certification import Pins, pins_to_corners


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
    max_seconds: float | None = None,
    threads: int | None = None,
    progress: Progress | None = None,
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
    shape, bijective = as_aspect(aspect), as_flag(keep_bijective, "keep_bijective")
    options = dict(
        pins=(pin_corners, pin_uv),
        keep_bijective=bijective,
        iterations=as_count(iterations, "iterations"),
        tolerance=as_positive(tolerance, "tolerance"),
        aspect=shape,
        max_seconds=as_seconds(max_seconds, "max_seconds"),
    )
    native = _native.improve(
        positions.scaled,
        face_array,
        corner_uv,
        options,
        as_flag(repair, "repair"),
        as_threads(threads),
    )
    job = Job(native, partial(parametrization_from, positions=positions, aspect=shape))
    return improved(
        job,
        before=corner_uv.reshape(-1, 3, 2),
        pinned=pin_corners,
        pins=pins,
        bijective=bijective,
        aspect=shape,
        threads=threads,
    )


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
    max_seconds: float | None = None,
    threads: int | None = None,
    progress: Progress | None = None,
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
    face_array = as_indices(faces, "faces", 3)
    pin_corners, pin_uv = pins_to_corners(pins, face_array)
    corner_uv = as_corner_uv(uv, "uv", len(face_array))
    positions = as_vertices(vertices, face_array)
    shape, room = as_aspect(aspect), as_margin(margin)
    options = dict(
        cuts=as_indices([] if cuts is None else cuts, "cuts", 2),
        uncuttable=as_indices([] if uncuttable is None else uncuttable, "uncuttable", 2),
        pins=(pin_corners, pin_uv),
        overlaps=as_choice(overlaps, "overlaps", ("cut", "open", "keep")),
        stretched=as_choice(stretched, "stretched", ("keep", "improve")),
        disjoint=as_flag(disjoint, "disjoint"),
        margin=room,
        iterations=as_count(iterations, "iterations"),
        tolerance=as_positive(tolerance, "tolerance"),
        aspect=shape,
        max_seconds=as_seconds(max_seconds, "max_seconds"),
    )
    native = _native.repair(positions.scaled, face_array, corner_uv, options, as_threads(threads))
    job = Job(native, partial(parametrization_from, positions=positions, aspect=shape))
    if shape != 1.0:  # packing is of squares
        return job
    return repaired(
        job,
        before=corner_uv.reshape(-1, 3, 2),
        pinned=pin_corners,
        margin=room,
        threads=threads,
    )
