"""Discretely conformal metrics and maps with prescribed cone and boundary angles, and angles for them."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from functools import partial
from typing import Any, Unpack

import numpy as np

from .. import _native, checks, results
from ..errors import NotConverged
from ..job import Job, Limits, solver_call, start_job
from ..results import ConformalMetric, FloatArray, IntArray, Mesh, Parametrization

#: What ``precision`` may be.
LEAST_BITS, MOST_BITS = 53, 4096


def _of_angles(given: Mapping[str, Any]) -> tuple[Mesh, dict[str, Any], int]:
    """What metric and map have in common: mesh, options, and the exponent of the metric's unit."""
    mesh, options = checks.checked(given)
    exponent = mesh.exponent
    if given["lengths"] is not None:
        options["lengths"], exponent = checks.as_lengths(given["lengths"])
    options["target_angles"] = checks.as_floats(given["target_angles"], "target_angles")
    if not isinstance(given["precision"], str) or given["precision"] != "auto":
        bits = checks.whole(LEAST_BITS, MOST_BITS, "'auto' or mantissa bits, a whole number")
        options["bits"] = bits(given["precision"], "precision")
    return mesh, options, exponent


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
    require_convergence: bool = True,
    intrinsic_refinement: str = "auto",
    **limits: Unpack[Limits],
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
            needles; "off" and "auto" do not. The metric is then that of the refined surface: the angles are the same,
            but it belongs to another discrete conformal class. Where it is not reached, the plain one is.
        threads: None is all cores; the result has the same bits for every number.
        progress: called with (stage, fraction) about 20 times per second; returning False cancels.

    Raises:
        InvalidInput: the mesh, an angle, or a length; names the place. Infeasible: Gauss-Bonnet fails; names the
        remainder. NotConverged: says what was reached. Cancelled.
    """
    mesh, options, exponent = _of_angles(locals())
    convert = partial(results.metric_from, exponent=exponent)
    return start_job(_native.conformal_metric, mesh, options, limits, convert)


def _result_from(data: dict[str, Any], mesh: Mesh, metric_exponent: int) -> Parametrization:
    error = data["error"]
    if error is None:
        parametrization = results.parametrization_from(data["map"], mesh)
        parametrization.stats.update(data["figures"])
        weights = data["log_weight"]
        return replace(parametrization, log_weight=weights if len(weights) else None)
    failure = NotConverged(**error)
    if len(data["map"]["faces"]):
        best = results.parametrization_from(data["map"], mesh)
        failure.parametrization = best
        failure.certificate = best.certificate
    failure.metric = results.metric_from(data["metric"], mesh, metric_exponent)
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
    lengths: Any = None,
    original_triangles: bool | str = "auto",
    intrinsic_refinement: str = "auto",
    **limits: Unpack[Limits],
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
        intrinsic_refinement: of the metric, see ``conformal_metric``: "on", "off", or "auto", which is "off". The
            vertices that it adds are not written, only the map on the input's triangles.
        threads: None is all cores; the result has the same bits for every number.
        progress: called with (stage, fraction) about 20 times per second; returning False cancels.

    Raises:
        InvalidInput, Infeasible, Cancelled; NotConverged if the metric was not reached, or if 32-bit UVs cannot
        hold the map (then ``error.metric`` has the metric, ``error.parametrization`` the best map).
    """
    refinement = "auto"
    if not (isinstance(original_triangles, str) and original_triangles == "auto"):
        never = checks.as_flag(original_triangles, "original_triangles", ", or 'auto'")
        refinement = "never" if never else "full"
    mesh, options, exponent = _of_angles(locals())
    options["refinement"] = refinement
    convert = partial(_result_from, metric_exponent=exponent)
    return start_job(_native.conformal, mesh, options, limits, convert)


class SuggestedAngles(np.ndarray):
    """(n,) target angles, with ``cones`` (vertex ids in order of placement), ``scale_ratio``, ``bound_holds``."""

    cones: IntArray = np.zeros(0, np.int32)
    scale_ratio: float = float("nan")
    bound_holds: bool = False

    @property
    def quarter_turns(self) -> dict[int, int]:
        """{cone: k}, the angles to the next multiple k pi / 2: what ``seamless`` takes, from a suggestion with
        ``quarter_turns``."""
        turns = np.rint(np.asarray(self)[self.cones] / (np.pi / 2)).astype(int)
        return dict(zip(self.cones.tolist(), turns.tolist(), strict=True))

    def __array_finalize__(self, parent: Any) -> None:
        self.__dict__.update(getattr(parent, "__dict__", {}))

    def __reduce__(self) -> Any:
        """Arrays that are pickled or copied forget attributes of their own."""
        return _suggestion, ((np.asarray(self), self.cones, self.scale_ratio, self.bound_holds),)

    def __deepcopy__(self, _memo: Any) -> SuggestedAngles:
        return _suggestion((np.array(self), self.cones.copy(), self.scale_ratio, self.bound_holds))


def _suggestion(
    data: tuple[FloatArray, IntArray, float, bool], _mesh: Mesh | None = None
) -> SuggestedAngles:
    angles = np.asarray(data[0]).view(SuggestedAngles)
    angles.cones, angles.scale_ratio, angles.bound_holds = data[1], data[2], data[3]
    return angles


@solver_call
def suggest_cones(
    vertices: Any,
    faces: Any,
    *,
    bound: float = 4.0,
    max_cones: int = 200,
    quarter_turns: bool = False,
    least_angle: float = np.pi / 6,
    **limits: Unpack[Limits],
) -> Job[SuggestedAngles]:
    """Cones that keep the scale distortion of the conformal map within a bound, as (n,) target angles.

    Greedy: the next cone is where the scale factor is most extreme with the present ones. The boundary is free
    (u = 0).

    Args:
        vertices: (n, 3) float64. faces: (m, 3), manifold, consistently oriented, connected.
        bound: largest allowed ratio between the largest and the smallest scale over all vertices.
        max_cones: stop there even if the bound does not hold (``result.bound_holds`` says so).
        quarter_turns: cone angles are multiples of pi / 2, as seamless maps want them. They are searched for, more
            than otherwise where the bound needs it; tight bounds cannot always be met with them.
        least_angle: no suggested cone is sharper.
        max_seconds: of the clock; None or 0 is no limit. When they are over, the best cones that were measured come
            back (``result.bound_holds`` says what they keep); NotConverged (code "time limit reached") if there are none.
        threads: None is all cores; the result has the same bits for every number, unless a limit of time is reached.
        progress: called with (stage, fraction) about 20 times per second; returning False cancels.

    Raises:
        InvalidInput, NotConverged (no positive angles with so few cones), Cancelled.
    """
    mesh, options = checks.checked(locals())
    options["quantum"] = np.pi / 2 if checks.as_flag(quarter_turns, "quarter_turns") else 0.0
    return start_job(_native.suggest_cones, mesh, options, limits, _suggestion)


@solver_call
def boundary_angles(
    vertices: Any,
    faces: Any,
    boundary: str = "free",
    *,
    cones: Mapping[int, float] | None = None,
    corners: Any = None,
    **limits: Unpack[Limits],
) -> Job[FloatArray]:
    """(n,) target angles that are flat inside except at ``cones``, for a boundary of this shape.

    Args:
        vertices: (n, 3) float64. faces: (m, 3), manifold, consistently oriented, connected.
        boundary: "free" (no scaling on the boundary, least area distortion), "straight" (angle pi except at the
            corners, which share what is left) or "circle" (constant geodesic curvature; further loops turn the other
            way).
        cones: {interior vertex: total angle}. corners: boundary vertices, for "straight".
        max_seconds: of the clock; None or 0 is no limit. NotConverged (code "time limit reached") when they are over.
        threads: None is all cores; the result has the same bits for every number.
        progress: called with (stage, fraction) about 20 times per second; returning False cancels.

    Raises:
        InvalidInput, Infeasible (Gauss-Bonnet; names the remainder), NotConverged, Cancelled.
    """
    mesh, options = checks.checked(locals())
    options["cones"] = checks.as_angles(cones)
    return start_job(_native.boundary_angles, mesh, options, limits, lambda data, _mesh: data)
