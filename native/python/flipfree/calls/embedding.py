"""Disks onto convex polygons, flip-free (thesis 3.2)."""

from __future__ import annotations

from functools import partial
from typing import Any

from .. import _native
from ..arrays import as_floats, as_indices, as_places, as_vertices
from ..conversions import parametrization_from
from ..job import Job, Progress, solver_call
from ..options import as_choice, as_count, as_flag, as_positive, as_seconds, as_threads
from ..results import Parametrization

SHAPES = ("circle", "square", "triangle")
STARTS = ("tutte", "nothing")
METHODS = ("ladder", "schnyder", "progressive", "tutte")


@solver_call
def embed(
    vertices: Any,
    faces: Any,
    *,
    boundary: Any = "circle",
    boundary_loop: Any = None,
    initial_uv: Any = None,
    method: str = "ladder",
    start: str = "tutte",
    low_distortion: bool = False,
    optimise: bool = False,
    iterations: int = 200,
    tolerance: float = 1e-4,
    max_seconds: float | None = None,
    threads: int | None = None,
    progress: Progress | None = None,
) -> Job[Parametrization]:
    """A disk onto a convex polygon without flips, in 64 bits and as stored in 32.

    Inner edges between two points of one straight side of the polygon are split (``stats["added_vertices"]``);
    everything else keeps the given triangulation.

    Args:
        vertices: (n, 3) float64. faces: (m, 3), one disk, consistently oriented.
        boundary: "circle" (radius 1), "square" ([-1, 1]^2) or "triangle" (equilateral, circumradius 1), all around
            the origin, by arc length; or (b, 2) positions of a convex polygon, kept bit for bit.
        boundary_loop: (b,) the boundary's vertex ids in order; default: from the smallest id, surface on the left.
        initial_uv: (n, 2) start, may be invalid or random; boundary rows are ignored.
        method: "ladder" (Tutte, Schnyder-weighted Tutte, repair, progressive embedding; the first that is flip-free by
            exact test), "schnyder" (the ladder without Tutte), "progressive" (the thesis' algorithm alone) or "tutte"
            (raises NotConverged if it flips).
        start: with method "progressive" and no initial_uv: "tutte" or "nothing".
        low_distortion: where Tutte fails, go to progressive embedding at once: about twice the time, and energies that are
            a thousand times smaller. Implied by optimise.
        optimise: lower the distortion with the boundary fixed. iterations, tolerance: of that optimisation.
        max_seconds: of the clock; None or 0 is no limit. What was gained by then is kept, and
            ``stats["time_limit_reached"]`` is 1; NotConverged (code "time limit reached") if there is no map yet.
        threads: None is all cores; the result has the same bits for every number, unless a limit of time is reached.
        progress: called with (stage, fraction) about 20 times per second; returning False cancels.

    Returns:
        A certified map; ``stats["rung"]`` says which step of the ladder made it.

    Raises:
        InvalidInput, Infeasible (the polygon has no room in these numbers), NotConverged, Cancelled.
    """
    options: dict[str, object] = {}
    if isinstance(boundary, str):
        options["shape"] = as_choice(boundary, "boundary", SHAPES, ", or an array of positions")
    else:
        options["polygon"] = as_places(boundary, "boundary")
    face_array = as_indices(faces, "faces", 3)
    positions = as_vertices(vertices, face_array)
    if boundary_loop is not None:
        options["loop"] = as_indices(boundary_loop, "boundary_loop")
    if initial_uv is not None:
        options["initial"] = as_floats(initial_uv, "initial_uv", 2)
    options.update(
        method=as_choice(method, "method", METHODS),
        start_from_tutte=as_choice(start, "start", STARTS) == "tutte",
        low_distortion=as_flag(low_distortion, "low_distortion"),
        optimise=as_flag(optimise, "optimise"),
        iterations=as_count(iterations, "iterations"),
        tolerance=as_positive(tolerance, "tolerance"),
        max_seconds=as_seconds(max_seconds, "max_seconds"),
    )
    native = _native.embed(positions.scaled, face_array, options, as_threads(threads))
    return Job(native, partial(parametrization_from, positions=positions))
