"""Discretely conformally equivalent metrics with prescribed cone and boundary angles."""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np
import numpy.typing as npt

from . import _native
from .arrays import as_floats, as_indices, as_lengths, as_vertices
from .errors import InvalidInput
from .job import Job, Progress, ours_only, run
from .options import as_choice, as_count, as_flag, as_positive, as_seconds, as_threads, shown

#: What ``precision`` may be.
LEAST_BITS, MOST_BITS = 53, 4096

#: What ``intrinsic_refinement`` may be.
REFINEMENT_CHOICES = ("auto", "on", "off")

#: Names of the symmetric flip types in the order of ``ConformalMetric.flip_counts`` (faces left and right of the edge).
FLIP_TYPES = (
    "(1,1,1)",
    "(1,par,2)",
    "(t,perp,t)",
    "(1,1,t)",
    "(t,perp,q)",
    "(1,1,q)",
    "(q,perp,q)",
)


@dataclass(frozen=True, eq=False)
class ConformalMetric:
    """A metric that is discretely conformally equivalent to the input, with the prescribed angles.

    Attributes:
        scale_factors: (n,) natural logarithms u of the scale factors, mean 0. Where no edge was flipped, the new length
            of edge (i, j) is the old one times exp((u_i + u_j) / 2).
        angles: (n,) total angle reached at every vertex. angle_error: the largest distance from the targets, radians,
            measured in the precision of the run.
        flips: Ptolemy flips from the Delaunay triangulation of the input to the final one; flip_counts: by type, see
            FLIP_TYPES. euclidean_flips: flips that made the input Delaunay first.
        iterations: Newton steps. bits: mantissa of the lengths. error_history: largest angle error at the start and
            after every step.
        scale_range: max u - min u. converged: angle_error is within the tolerance.
        faces, log_lengths: (k, 3) final intrinsic triangulation and logarithms of its lengths (corner j to j + 1). For a
            surface with boundary these are the faces of its symmetric double cover, both copies of a vertex bearing its
            number, with face_labels 0 = this copy, 1 = the mirrored one, 2 and 3 = symmetric triangle and (half of a)
            quadrilateral.
        symmetric: the double cover was used. stats: seconds and counts; "intrinsic_refinement" is the number of
            vertices added.
        added_scale_factors, added_parent, added_barycentric: (a,), (a,), (a, 3) of vertices added by intrinsic
            refinement, numbered from n on in ``faces``: u, the input face in which each lies, and its weights there.
    """

    scale_factors: npt.NDArray[np.float64]
    angles: npt.NDArray[np.float64]
    angle_error: float
    scale_range: float
    flips: int
    euclidean_flips: int
    flip_counts: tuple[int, ...]
    iterations: int
    bits: int
    converged: bool
    error_history: npt.NDArray[np.float64]
    symmetric: bool
    added_scale_factors: npt.NDArray[np.float64]
    added_parent: npt.NDArray[np.int32]
    added_barycentric: npt.NDArray[np.float64]
    faces: npt.NDArray[np.int32]
    log_lengths: npt.NDArray[np.float64]
    face_labels: npt.NDArray[np.int8]
    stats: dict[str, Any]


def metric_from(data: dict[str, Any], exponent: int = 0) -> ConformalMetric:
    """The dataclass from what the compiled module returns for lengths in units of 2 to the exponent."""
    metric = ConformalMetric(**{**data, "flip_counts": tuple(data["flip_counts"])})
    if exponent:
        metric.log_lengths[...] += exponent * np.log(2.0)
    return metric


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


@ours_only
def start_conformal_metric(
    vertices: Any,
    faces: Any,
    target_angles: Any,
    *,
    tolerance: float = 1e-10,
    precision: int | str = "auto",
    lengths: Any = None,
    max_iterations: int = 500,
    max_seconds: float | None = None,
    require_convergence: bool = True,
    intrinsic_refinement: str = "auto",
    threads: int = 2,
) -> Job[ConformalMetric]:
    """As :func:`conformal_metric`, at once, on a thread."""
    bits = precision_bits(precision)
    edge_lengths = None
    face_array = as_indices(faces, "faces", 3)
    positions = as_vertices(vertices, face_array)
    exponent = positions.exponent
    if lengths is not None:
        edge_lengths, exponent = as_lengths(lengths)
    native = _native.conformal_metric(
        positions.scaled,
        face_array,
        as_floats(target_angles, "target_angles"),
        as_positive(tolerance, "tolerance"),
        bits,
        as_count(max_iterations, "max_iterations"),
        as_seconds(max_seconds, "max_seconds"),
        as_flag(require_convergence, "require_convergence"),
        as_choice(intrinsic_refinement, "intrinsic_refinement", REFINEMENT_CHOICES),
        edge_lengths,
        as_threads(threads),
    )
    return Job(native, partial(metric_from, exponent=exponent))


def conformal_metric(
    vertices: Any,
    faces: Any,
    target_angles: Any,
    *,
    tolerance: float = 1e-10,
    precision: int | str = "auto",
    lengths: Any = None,
    max_iterations: int = 500,
    max_seconds: float | None = None,
    require_convergence: bool = True,
    intrinsic_refinement: str = "auto",
    threads: int = 2,
    progress: Progress | None = None,
) -> ConformalMetric:
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
        max_iterations: of Newton. max_seconds: of the clock; None or 0 is no limit. NotConverged (code "time limit
            reached") when they are over.
        require_convergence: False returns what was reached, with ``converged`` False, instead of raising NotConverged
            (which is raised still where there is no metric yet).
        intrinsic_refinement: "on" adds flat points to the surface until its intrinsic Delaunay triangulation has no
            needles; "auto" does so if the plain way fails; "off" never. The metric is then that of the refined surface:
            the angles are the same, but it belongs to another discrete conformal class.
        threads: the result has the same bits for every number.
        progress: called with (stage, fraction) about 20 times per second; returning False cancels.

    Raises:
        InvalidInput: the mesh, an angle, or a length; names the place. Infeasible: Gauss-Bonnet fails; names the
        remainder. NotConverged: says what was reached. Cancelled.
    """
    job = start_conformal_metric(
        vertices,
        faces,
        target_angles,
        tolerance=tolerance,
        precision=precision,
        lengths=lengths,
        max_iterations=max_iterations,
        max_seconds=max_seconds,
        require_convergence=require_convergence,
        intrinsic_refinement=intrinsic_refinement,
        threads=threads,
    )
    return run(job, progress)
