"""Conformal maps with prescribed cone and boundary angles."""

from __future__ import annotations

from functools import partial
from typing import Any

from .. import _native
from ..arrays import Positions, as_floats, as_indices, as_lengths, as_vertices
from ..conversions import metric_from, parametrization_from
from ..errors import InvalidInput, NotConverged
from ..job import Job, Progress, solver_call
from ..options import as_choice, as_flag, as_positive, as_seconds, as_threads, shown
from ..results import Parametrization
from .conformal import REFINEMENT_CHOICES, precision_bits


def _result_from(
    data: dict[str, Any], positions: Positions, metric_exponent: int
) -> Parametrization:
    error = data["error"]
    if error is None:
        parametrization = parametrization_from(data["map"], positions)
        parametrization.stats.update(data["figures"])
        return parametrization
    failure = NotConverged(
        error["message"], code=error["code"], kind=error["kind"], elements=error["elements"]
    )
    if len(data["map"]["faces"]):
        best = parametrization_from(data["map"], positions)
        failure.parametrization = best
        failure.certificate = best.certificate
    failure.metric = metric_from(data["metric"], metric_exponent)
    raise failure


@solver_call
def conformal(
    vertices: Any,
    faces: Any,
    target_angles: Any,
    *,
    cuts: Any = None,
    uncuttable: Any = None,
    tolerance: float = 1e-10,
    precision: int | str = "auto",
    max_seconds: float | None = None,
    lengths: Any = None,
    original_triangles: bool | str = "auto",
    intrinsic_refinement: str = "auto",
    threads: int | None = None,
    progress: Progress | None = None,
) -> Job[Parametrization]:
    """The conformal map with exactly these angles, as a locally injective, certified map.

    The discrete metric that is conformally equivalent to the surface and has the prescribed angles (see
    ``conformal_metric``) is laid out in the plane, cut along a short graph through all cones, and written on the
    input's triangles. Where one of them would be flipped, points are added on input edges, where these cross the
    final triangulation.

    Args:
        vertices: (n, 3) float64. faces: (m, 3), manifold, consistently oriented, connected.
        target_angles: (n,) total angle at every vertex: 2 pi - curvature inside, pi - geodesic curvature on the
            boundary. They must add up (Gauss-Bonnet).
        cuts: (s, 2) vertex pairs: seam edges. More are added only where cones or handles need them.
        uncuttable: (d, 2) vertex pairs that added cuts avoid where there is another way, such as diagonals of polygons.
        tolerance: largest angle error of the metric, radians. precision: "auto", or mantissa bits.
        max_seconds: of the clock, for metric and map; None or 0 is no limit. NotConverged (code "time limit reached")
            when they are over, with ``error.metric`` if only the map is missing.
        lengths: (m, 3) edge lengths (corner k to k + 1) to be used instead of those of the vertex positions, which may
            be anything then. Energies are still measured against the positions: -1 where these have no area.
        original_triangles: "auto" adds points only where a triangle would flip; True never does and raises
            NotConverged instead; False writes the common refinement with the final triangulation.
        intrinsic_refinement: of the metric, see ``conformal_metric``: "on", "off", or "auto", if the metric or the map
            fails otherwise. The vertices that it adds are not written, only the map on the input's triangles.
        threads: None is all cores; the result has the same bits for every number.
        progress: called with (stage, fraction) about 20 times per second; returning False cancels.

    Raises:
        InvalidInput, Infeasible, Cancelled; NotConverged if the metric was not reached, or if 32-bit UVs cannot
        hold the map (then ``error.metric`` has the metric, ``error.parametrization`` the best map).
    """
    if isinstance(original_triangles, str) and original_triangles == "auto":
        refinement = "auto"
    else:
        try:
            refinement = "never" if as_flag(original_triangles, "original_triangles") else "full"
        except InvalidInput:
            raise InvalidInput(
                f"original_triangles must be 'auto', True or False, not {shown(original_triangles)}.",
                code="bad option",
            ) from None
    face_array = as_indices(faces, "faces", 3)
    positions = as_vertices(vertices, face_array)
    edge_lengths, metric_exponent = None, positions.exponent
    if lengths is not None:
        edge_lengths, metric_exponent = as_lengths(lengths)
    options = dict(
        tolerance=as_positive(tolerance, "tolerance"),
        bits=precision_bits(precision),
        max_seconds=as_seconds(max_seconds, "max_seconds"),
        cuts=as_indices([] if cuts is None else cuts, "cuts", 2),
        uncuttable=as_indices([] if uncuttable is None else uncuttable, "uncuttable", 2),
        refinement=refinement,
        intrinsic_refinement=as_choice(
            intrinsic_refinement, "intrinsic_refinement", REFINEMENT_CHOICES
        ),
    )
    native = _native.conformal(
        positions.scaled,
        face_array,
        as_floats(target_angles, "target_angles"),
        options,
        edge_lengths,
        as_threads(threads),
    )
    return Job(native, partial(_result_from, positions=positions, metric_exponent=metric_exponent))
