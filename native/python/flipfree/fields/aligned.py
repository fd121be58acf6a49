"""Field-aligned seamless maps: exactly the topology of a cross field or of a signature."""

from __future__ import annotations

from functools import partial
from typing import Any

from .. import _native
from ..arrays import as_indices, as_vertices
from ..conversions import parametrization_from
from ..errors import InvalidInput
from ..job import Job, Progress, solver_call
from ..options import as_choice, as_count, as_flag, as_seconds, as_threads
from ..results import Parametrization
from .cross_fields import CrossField, Signature, arrays_of, as_signature, as_sizing

ENGINES = ("auto", "penner", "padding")
BOUNDARIES = ("aligned", "free")


@solver_call
def field_aligned(
    vertices: Any,
    faces: Any,
    *,
    field: CrossField | None = None,
    signature: Signature | None = None,
    sizing: Any = None,
    engine: str = "auto",
    boundary: str = "aligned",
    optimise: bool = True,
    exact: bool = True,
    uncuttable: Any = None,
    iterations: int = 200,
    max_seconds: float | None = None,
    threads: int | None = None,
    progress: Progress | None = None,
) -> Job[Parametrization]:
    """A seamless map with exactly the cones and turning numbers of a cross field, that follows it.

    Args:
        vertices: (n, 3) float64. faces: (m, 3), manifold, consistently oriented; any number of components.
        field: a field of this mesh; None: the smoothest, which follows the boundary if that is aligned, or the smoothest
            with the signature.
        signature: what the map shall have exactly, instead of a field: see :func:`cross_field`.
        sizing: (n,) positive: length in the map of a length 1 there, relative to the others. None: all alike. A field
            that is given should have been made for it (:func:`cross_field`); the one that is made here is.
        engine: "penner" changes lengths of edges until all angles fit; "padding" cuts into disks, along branches that are
            led around cones until all loops turn as the field does (closed surfaces only); "auto" takes padding where
            penner finds no map.
        boundary: where the surface is open. "aligned": it runs exactly along the axes, with corners where the field turns
            between its edges. "free": as near to the surface as the inside allows, turning in all as the field does.
        optimise: the map is brought to follow the field; without, it is the engine's, turned towards the field.
        exact: seams match exactly, in 64 and in 32 bits; without, up to rounding.
        uncuttable: (k, 2) edges that the cut avoids, diagonals of polygons.
        iterations: Newton steps of the engine. max_seconds: of the clock; None or 0 is no limit.
        threads: None is all cores; the result has the same bits for every number, unless a limit of time is reached.
        progress: called with (stage, fraction) about 20 times per second; returning False cancels.

    Returns:
        The certified map (G1, G2, G4, G5, G6, G7); G6 on loops that the engine has not seen. ``stats["angle_mean"]`` and
        ``stats["angle_p95"]`` say how far its isolines are from the field, radians, by area; ``stats["engine"]`` which engine
        it was, and of padding ``stats["reroutings.guided"]`` and ``stats["reroutings.fallback"]`` how many branches of its
        cut had to be rerouted.

    Raises:
        InvalidInput, Infeasible (signatures that no map has), NotConverged, Cancelled.
    """
    open_boundary = as_choice(boundary, "boundary", BOUNDARIES)
    if field is not None and signature is not None:
        raise InvalidInput(
            "Both field and signature are given. Give one of them: a field has a signature of its own.",
            code="bad option",
        )
    face_array = as_indices(faces, "faces", 3)
    positions = as_vertices(vertices, face_array)
    made: dict[str, object] = dict(boundary=open_boundary == "aligned")
    if signature is not None:
        cones, loops = as_signature(signature, face_array, len(positions.scaled))
        made.update(cones=cones, loops=loops)
    options = dict(
        uncuttable=as_indices([] if uncuttable is None else uncuttable, "uncuttable", 2),
        engine=as_choice(engine, "engine", ENGINES),
        engine_iterations=as_count(iterations, "iterations", 1),
        boundary=open_boundary,
        optimise=as_flag(optimise, "optimise"),
        exact=as_flag(exact, "exact"),
        max_seconds=as_seconds(max_seconds, "max_seconds"),
    )
    if sizing is not None:
        sizes = as_sizing(sizing, len(positions.scaled))
        options.update(sizing=sizes)
        made.update(sizing=sizes)
    native = _native.field_aligned(
        positions.scaled,
        face_array,
        None if field is None else arrays_of(field, face_array),
        made,
        options,
        as_threads(threads),
    )
    return Job(native, partial(parametrization_from, positions=positions))
