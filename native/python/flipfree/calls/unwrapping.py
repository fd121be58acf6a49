"""Unwrap Flip-Free: seam islands onto the plane."""

from __future__ import annotations

from functools import partial
from typing import Any

from .. import _native
from ..arrays import as_corner_uv, as_indices, as_materials, as_vertices
from ..conversions import parametrization_from
from ..job import Job, Progress, solver_call
from ..options import as_count, as_flag, as_margin, as_positive, as_seconds, as_threads, filled
from ..results import Parametrization
from .certification import Pins, pins_to_corners


@solver_call
def unwrap(
    vertices: Any,
    faces: Any,
    *,
    cuts: Any = None,
    uncuttable: Any = None,
    materials: Any = None,
    pins: Pins | None = None,
    bijective: bool = True,
    may_add_cuts: bool = True,
    cut_extremities: bool = True,
    iterations: int = 200,
    tolerance: float = 1e-4,
    margin: float = 0.005,
    place_like: Any = None,
    max_seconds: float | None = None,
    threads: int | None = None,
    progress: Progress | None = None,
) -> Job[Parametrization]:
    """One flip-free chart per seam island, free boundary, low distortion, on the given triangulation.

    All charts have one scale (the same area per area of their surface) and are packed into the unit square. Charts with
    pins stay; the others keep clear of them and take their scale if there is room.

    Closed islands and islands with handles are cut along a short cut graph (``cut_edges`` has it,
    ``stats["added_cuts"]`` counts it); islands with holes keep them.

    Args:
        vertices: (n, 3) float64. faces: (m, 3), any triangles. What keeps them from being an oriented
            surface is separated first and listed in ``certificate.mends``.
        cuts: (s, 2) vertex pairs: seam edges.
        uncuttable: (d, 2) vertex pairs that automatic cuts must avoid, such as diagonals of polygons.
        materials: (m,) whole numbers: where more than two faces meet at an edge, those of one material rather go together.
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
    options = filled(
        _native.UnwrapOptions(),
        cuts=as_indices([] if cuts is None else cuts, "cuts", 2),
        uncuttable=as_indices([] if uncuttable is None else uncuttable, "uncuttable", 2),
        material=as_materials(materials, len(face_array)),
        pins=(pin_corners, pin_uv),
        bijective=as_flag(bijective, "bijective"),
        may_add_cuts=as_flag(may_add_cuts, "may_add_cuts"),
        cut_extremities=as_flag(cut_extremities, "cut_extremities"),
        iterations=as_count(iterations, "iterations"),
        tolerance=as_positive(tolerance, "tolerance"),
        margin=as_margin(margin),
        max_seconds=as_seconds(max_seconds, "max_seconds"),
    )
    native = _native.unwrap(positions.scaled, face_array, options, reference, as_threads(threads))
    return Job(native, partial(parametrization_from, positions=positions))
