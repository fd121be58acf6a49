"""Target angles for conformal maps: suggested cones, and boundaries that are free, straight or round."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
import numpy.typing as npt

from .. import _native
from ..arrays import as_floats, as_indices, as_vertex_map, as_vertices
from ..errors import InvalidInput
from ..job import Job, Progress, solver_call
from ..options import as_choice, as_count, as_flag, as_number, as_seconds, as_threads

BOUNDARIES = ("free", "straight", "circle")

FloatArray = npt.NDArray[np.float64]


class SuggestedAngles(np.ndarray):
    """(n,) target angles, with ``cones`` (vertex ids in order of placement), ``scale_ratio``, ``bound_holds``."""

    cones: npt.NDArray[np.int32]
    scale_ratio: float
    bound_holds: bool

    @property
    def quarter_turns(self) -> dict[int, int]:
        """{cone: k}, the angles to the next multiple k pi / 2: what ``seamless`` takes, from a suggestion with
        ``quarter_turns``."""
        turns = np.rint(np.asarray(self)[self.cones] / (np.pi / 2)).astype(int)
        return dict(zip(self.cones.tolist(), turns.tolist(), strict=True))

    def __array_finalize__(self, parent: Any) -> None:
        self.cones = getattr(parent, "cones", np.zeros(0, np.int32))
        self.scale_ratio = getattr(parent, "scale_ratio", float("nan"))
        self.bound_holds = getattr(parent, "bound_holds", False)

    def __reduce__(self) -> Any:
        """Arrays that are pickled or copied forget attributes of their own."""
        return _suggestion, ((np.asarray(self), self.cones, self.scale_ratio, self.bound_holds),)

    def __deepcopy__(self, _memo: Any) -> SuggestedAngles:
        return _suggestion((np.array(self), self.cones.copy(), self.scale_ratio, self.bound_holds))


def _suggestion(data: tuple[FloatArray, npt.NDArray[np.int32], float, bool]) -> SuggestedAngles:
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
    max_seconds: float | None = None,
    threads: int | None = None,
    progress: Progress | None = None,
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
    bound, least_angle = as_number(bound, "bound"), as_number(least_angle, "least_angle")
    if not bound > 1.0:
        raise InvalidInput(f"bound must be larger than 1, not {bound}.", code="bad option")
    if not 0.0 < least_angle < 2 * np.pi:
        raise InvalidInput(
            f"least_angle must lie in (0, 2 pi), not {least_angle}.", code="bad option"
        )
    face_array = as_indices(faces, "faces", 3)
    positions = as_vertices(vertices, face_array)
    native = _native.suggest_cones(
        positions.scaled,
        face_array,
        bound=bound,
        max_cones=as_count(max_cones, "max_cones", 1),
        quantum=np.pi / 2 if as_flag(quarter_turns, "quarter_turns") else 0.0,
        least_angle=least_angle,
        max_seconds=as_seconds(max_seconds, "max_seconds"),
        threads=as_threads(threads),
    )
    return Job(native, _suggestion)


@solver_call
def boundary_angles(
    vertices: Any,
    faces: Any,
    boundary: str = "free",
    *,
    cones: Mapping[int, float] | None = None,
    corners: Any = None,
    max_seconds: float | None = None,
    threads: int | None = None,
    progress: Progress | None = None,
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
    cone_angles = as_vertex_map(cones, "cones", "angle")
    face_array = as_indices(faces, "faces", 3)
    positions = as_vertices(vertices, face_array)
    native = _native.boundary_angles(
        positions.scaled,
        face_array,
        shape=as_choice(boundary, "boundary", BOUNDARIES),
        cone_vertices=as_indices(list(cone_angles), "cones"),
        cone_angles=as_floats(
            [as_number(a, f"cones[{v}]") for v, a in cone_angles.items()], "cones"
        ),
        corners=as_indices([] if corners is None else corners, "corners"),
        max_seconds=as_seconds(max_seconds, "max_seconds"),
        threads=as_threads(threads),
    )
    return Job(native, np.asarray)
