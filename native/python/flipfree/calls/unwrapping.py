"""Unwrap Flip-Free: seam islands onto the plane, and the seams for it."""

from __future__ import annotations

from functools import partial
from typing import Any

import numpy as np

from .. import _native
from ..arrays import (
    BAD_SHAPE,
    FloatArray,
    as_corner_uv,
    as_face_numbers,
    as_floats,
    as_indices,
    as_vertices,
)
from ..conversions import parametrization_from
from ..errors import InvalidInput
from ..job import Job, Progress, solver_call
from ..maps.distortion import STRETCH_BOUND
from ..options import (
    as_choice,
    as_count,
    as_effort,
    as_flag,
    as_margin,
    as_number,
    as_positive,
    as_seconds,
    as_stretch,
    as_threads,
    shown,
)
from ..results import IntArray, Parametrization
from ..texts import counted
from .certification import Pins, pins_to_corners

#: Where islands end unless a caller says otherwise.
SEAMS = "auto"


@solver_call
def unwrap(
    vertices: Any,
    faces: Any,
    *,
    cuts: Any = None,
    seams: str = SEAMS,
    stretch: float = STRETCH_BOUND,
    uncuttable: Any = None,
    materials: Any = None,
    polygons: Any = None,
    pins: Pins | None = None,
    bijective: bool = True,
    may_add_cuts: bool = True,
    cut_extremities: bool = True,
    iterations: int = 200,
    tolerance: float = 1e-4,
    margin: float = 0.005,
    effort: float = 0.2,
    place_like: Any = None,
    max_seconds: float | None = None,
    threads: int | None = None,
    progress: Progress | None = None,
) -> Job[Parametrization]:
    """One flip-free chart per seam island, free boundary, low distortion, on the given triangulation.

    All charts have one scale (the same area per area of their surface) and are packed into the unit square. Charts with
    pins stay; the others keep clear of them and take their scale if there is room.

    Islands end at ``cuts``, and by default at the seams that are found where one is closed, has handles, or would end above the
    stretch bound; all others stay whole, with their holes (``cut_edges`` has the cuts, ``stats["added_cuts"]`` counts those
    that opened something).

    Args:
        vertices: (n, 3) float64. faces: (m, 3), any triangles. What keeps them from being an oriented
            surface is separated first and listed in ``certificate.mends``.
        cuts: (s, 2) vertex pairs: seam edges.
        seams: "auto": the cuts, and whatever it takes to stay within ``stretch``, as ``auto_seams`` finds it; "given": the cuts
            and no more than a short cut graph of what is closed or has handles. So it is with pins, whatever is asked for.
        stretch: with automatic seams, the factor by which lengths may change, about; see ``auto_seams``.
        uncuttable: (d, 2) vertex pairs that automatic cuts avoid, such as diagonals of polygons. Where they leave no way to
            open a closed part or a handle, that is refused; with automatic seams a sphere is opened along some of them.
        materials: (m,) whole numbers: where more than two faces meet at an edge, those of one material rather go together.
        polygons: (m,) whole numbers: triangles of one polygon, whose corners have one UV each. They stay in one piece; a polygon
            that no cut can go around is an island of its own. Without it, ``uncuttable`` edges tell polygons.
        pins: {vertex or (face, corner): (u, v)}, met bit for bit. A pin that cannot be reached without a flip on
            this triangulation raises NotConverged; ``match`` refines the mesh instead.
        bijective: charts do not overlap themselves.
        may_add_cuts: with ``bijective``, a chart without pins that cannot be laid out without overlap at a distortion
            near that of its free map is cut further (``stats["overlap_cuts"]`` edges, part of ``cut_edges``) instead of
            crushed.
        cut_extremities: closed islands, which have to be cut open anyway, are also slit to their legs, fingers, and
            whatever else a flat map would have to shrink many times. Off: one short cut. Not done if there are pins.
        iterations: most optimiser iterations per chart. tolerance: share of the energy that a step must promise.
        margin: space between charts, in units of the unit square.
        effort: of the search for a dense layout, see ``pack``; 0 where another layout follows.
        place_like: (m, 3, 2) former UVs, whose places are kept if that leaves a usable layout: every island without pins
            was a flip-free island there and, turned and moved to fit at one common scale, lies in the unit square on
            top of no other. Then ``stats["kept_places"]`` is 1; otherwise all islands without pins are packed.
        max_seconds: of the clock; None or 0 is no limit. What was gained by then is kept, and
            ``stats["time_limit_reached"]`` is 1; NotConverged (code "time limit reached") if there is no map yet.
        threads: None is all cores; the result has the same bits for every number, unless a limit of time is reached.
        progress: called with (stage, fraction) about 20 times per second; returning False cancels.

    Raises:
        InvalidInput, Infeasible, NotConverged, Cancelled.
    """
    face_array = as_indices(faces, "faces", 3)
    pin_corners, pin_uv = pins_to_corners(pins, face_array)
    reference = (
        None if place_like is None else as_corner_uv(place_like, "place_like", len(face_array))
    )
    positions = as_vertices(vertices, face_array)
    options = dict(
        cuts=as_indices([] if cuts is None else cuts, "cuts", 2),
        uncuttable=as_indices([] if uncuttable is None else uncuttable, "uncuttable", 2),
        material=as_face_numbers(materials, "materials", len(face_array)),
        polygon=as_face_numbers(polygons, "polygons", len(face_array)),
        pins=(pin_corners, pin_uv),
        find_seams=as_choice(seams, "seams", ("given", "auto")) == "auto" and not len(pin_corners),
        stretch=as_stretch(stretch),
        bijective=as_flag(bijective, "bijective"),
        may_add_cuts=as_flag(may_add_cuts, "may_add_cuts"),
        cut_extremities=as_flag(cut_extremities, "cut_extremities"),
        iterations=as_count(iterations, "iterations"),
        tolerance=as_positive(tolerance, "tolerance"),
        margin=as_margin(margin),
        effort=as_effort(effort),
        max_seconds=as_seconds(max_seconds, "max_seconds"),
    )
    native = _native.unwrap(positions.scaled, face_array, options, reference, as_threads(threads))
    return Job(native, partial(parametrization_from, positions=positions))


@solver_call
def auto_seams(
    vertices: Any,
    faces: Any,
    *,
    cuts: Any = None,
    stretch: float = STRETCH_BOUND,
    sharp_angle: float | None = None,
    weights: Any = None,
    uncuttable: Any = None,
    materials: Any = None,
    polygons: Any = None,
    max_seconds: float | None = None,
    threads: int | None = None,
    progress: Progress | None = None,
) -> Job[IntArray]:
    """Seams for ``unwrap``: short, few islands, and no more distortion than was asked for, as (k, 2) vertex pairs.

    ``unwrap`` with these edges as ``cuts`` stays within the bound and cuts nothing more. ``unwrap`` with ``seams="auto"``
    does both in less time.

    Args:
        vertices: (n, 3) float64. faces: (m, 3), any triangles, as for ``unwrap``.
        cuts: (s, 2) vertex pairs: seams that are there already. They stay, and are part of the result.
        stretch: factor by which lengths may change, about: the mean distortion (1 is none) of the islands of each
            connected part is at most the mean of the factor and its inverse, 1.025 for 1.25.
        sharp_angle: edges whose faces differ by more than this angle (radians) are seams; None is none of them.
        weights: (edges (k, 2), factors (k,)): how much a seam there costs, times its length. Below 1 is sought, above 1
            avoided, infinity taken only where no other edges open a closed part or a handle.
        uncuttable: (d, 2) vertex pairs that are never seams where there is another way, such as diagonals of polygons. A
            sphere that only they could open is opened along some of them, a handle is refused.
        materials: (m,) whole numbers: where more than two faces meet at an edge, those of one material rather go together.
        polygons: (m,) whole numbers: triangles of one polygon, whose corners have one UV each. They stay in one piece; a polygon
            that no cut can go around is an island of its own. Without it, ``uncuttable`` edges tell polygons.
        max_seconds: of the clock; None or 0 is no limit. The seams that were found by then come back.
        threads: None is all cores; the result is the same for every number, unless a limit of time is reached.
        progress: called with (stage, fraction) about 20 times per second; returning False cancels.

    Raises:
        InvalidInput, NotConverged, Cancelled.
    """
    face_array = as_indices(faces, "faces", 3)
    positions = as_vertices(vertices, face_array)
    weighted, factors = _as_weights(weights)
    options = dict(
        cuts=as_indices([] if cuts is None else cuts, "cuts", 2),
        uncuttable=as_indices([] if uncuttable is None else uncuttable, "uncuttable", 2),
        material=as_face_numbers(materials, "materials", len(face_array)),
        polygon=as_face_numbers(polygons, "polygons", len(face_array)),
        find_seams=True,
        stretch=as_stretch(stretch),
        sharp_angle=_as_sharp_angle(sharp_angle),
        weighted=weighted,
        weights=factors,
        max_seconds=as_seconds(max_seconds, "max_seconds"),
    )
    native = _native.auto_seams(positions.scaled, face_array, options, as_threads(threads))
    return Job(native, np.asarray)


def _as_sharp_angle(value: Any) -> float:
    if value is None:
        return 0.0
    angle = as_number(value, "sharp_angle")
    if not 0.0 < angle <= np.pi:
        raise InvalidInput(
            f"sharp_angle must lie in (0, pi], not {shown(value)}.", code="bad option"
        )
    return angle


def _as_weights(values: Any) -> tuple[IntArray, FloatArray]:
    if values is None:
        return np.zeros((0, 2), np.int32), np.zeros(0)
    try:
        edges, factors = values
    except Exception:  # whatever the object's own iteration raises
        raise InvalidInput(
            f"weights must be (edges, factors), not {shown(values)}.", code=BAD_SHAPE
        ) from None
    pairs, numbers = as_indices(edges, "weights", 2), as_floats(factors, "weights")
    if len(pairs) != len(numbers):
        raise InvalidInput(
            f"weights has {counted(len(pairs), 'edge')} and {counted(len(numbers), 'factor')}. Give one factor for each edge.",
            code=BAD_SHAPE,
        )
    return pairs, numbers
