"""Discretely conformally equivalent metrics with prescribed cone and boundary angles."""

from __future__ import annotations

from functools import partial
from typing import Any

from .. import _native
from ..arrays import as_floats, as_indices, as_lengths, as_vertices
from ..conversions import metric_from
from ..errors import InvalidInput
from ..job import Job, Progress, solver_call
from ..options import (
    as_choice,
    as_count,
    as_flag,
    as_positive,
    as_seconds,
    as_threads,
    shown,
)
from ..results import ConformalMetric

#: What ``precision`` may be.
LEAST_BITS, MOST_BITS = 53, 4096

#: What ``intrinsic_refinement`` may be.
REFINEMENT_CHOICES = ("auto", "on", "off")


def precision_bits(precision: int | str) -> int:
    """What the compiled module takes: mantissa bits, 0 for "auto"."""
    if isinstance(precision, str) and precision == "auto":
        return 0
    try:
        return as_count(precision, "precision", LEAST_BITS, MOST_BITS)
    except InvalidInput:
        raise InvalidInput(
            f"precision must be 'auto' or {LEAST_BITS} to {MOST_BITS} mantissa bits, not {shown(precision)}.",
            code="bad option",
        ) from None


@solver_call
def conformal_metric(
    vertices: Any,
    faces: Any,
    target_angles: Any,
    *,
    tolerance: float = 1e-10,
    precision: int | str = "auto",
    lengths: Any = None,
    iterations: int = 500,
    max_seconds: float | None = None,
    require_convergence: bool = True,
    intrinsic_refinement: str = "auto",
    threads: int | None = None,
    progress: Progress | None = None,
) -> Job[ConformalMetric]:
    """The metric with exactly these angles that is discretely conformally equivalent to the surface.

    It exists and is unique up to scale for all positive angles that satisfy Gauss-Bonnet, on closed surfaces of any
    genus and on surfaces with boundary; the triangulation changes by intrinsic flips on the way.

    Args:
        vertices: (n, 3) float64. faces: (m, 3), manifold, consistently oriented, connected, without unused vertices.
        target_angles: (n,) total angle at every vertex, > 0: 2 pi - curvature inside, pi - geodesic curvature on the
            boundary. Their sum must be pi m (Gauss-Bonnet).
        tolerance: largest angle error, radians. Below 1e-13 ask for more bits, or leave precision at "auto".
        precision: "auto" starts in double and adds bits only when rounding decides; or mantissa bits, 53 to 4096.
        lengths: (m, 3) edge lengths (corner k to k + 1) instead of those of the vertex positions.
        iterations: most Newton steps. max_seconds: of the clock; None or 0 is no limit. NotConverged (code "time limit
            reached") when they are over.
        require_convergence: False returns what was reached, with ``converged`` False, instead of raising NotConverged
            (which is raised still where there is no metric yet).
        intrinsic_refinement: "on" adds flat points to the surface until its intrinsic Delaunay triangulation has no
            needles; "auto" does so if the plain way fails; "off" never. The metric is then that of the refined surface:
            the angles are the same, but it belongs to another discrete conformal class.
        threads: None is all cores; the result has the same bits for every number.
        progress: called with (stage, fraction) about 20 times per second; returning False cancels.

    Raises:
        InvalidInput: the mesh, an angle, or a length; names the place. Infeasible: Gauss-Bonnet fails; names the
        remainder. NotConverged: says what was reached. Cancelled.
    """
    bits = precision_bits(precision)
    edge_lengths = None
    face_array = as_indices(faces, "faces", 3)
    positions = as_vertices(vertices, face_array)
    exponent = positions.exponent
    if lengths is not None:
        edge_lengths, exponent = as_lengths(lengths)
    options = dict(
        tolerance=as_positive(tolerance, "tolerance"),
        bits=bits,
        iterations=as_count(iterations, "iterations"),
        max_seconds=as_seconds(max_seconds, "max_seconds"),
        require_convergence=as_flag(require_convergence, "require_convergence"),
        intrinsic_refinement=as_choice(
            intrinsic_refinement, "intrinsic_refinement", REFINEMENT_CHOICES
        ),
    )
    native = _native.conformal_metric(
        positions.scaled,
        face_array,
        as_floats(target_angles, "target_angles"),
        options,
        edge_lengths,
        as_threads(threads),
    )
    return Job(native, partial(metric_from, exponent=exponent))
