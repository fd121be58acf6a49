"""Seamless maps: cones in quarter turns, seams that match by quarter turns and translations."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np

from .. import _native
from ..arrays import Positions, as_indices, as_vertex_map, as_vertices
from ..conversions import parametrization_from
from ..errors import InvalidInput
from ..job import Job, Progress, ours_only, solver_call
from ..options import (
    as_choice,
    as_count,
    as_flag,
    as_seconds,
    as_threads,
    shown,
    whole_number,
)
from ..results import IntArray, Parametrization

ENGINES = ("auto", "penner", "padding")
BOUNDARIES = ("aligned", "aligned_or_free", "free")


@dataclass(frozen=True)
class SeamBranch:
    """A chain of cut edges between two nodes, or around.

    Attributes:
        halfedges: (k,) 3 f + c: from corner c of face f of the map to the next one, head to tail; their faces are the
            first side.
        quarter_turns, translation: uv on the second side = turned uv on the first side + translation.
    """

    halfedges: IntArray
    quarter_turns: int
    translation: tuple[float, float]


@dataclass(frozen=True)
class SeamlessMap:
    """What an engine found.

    Attributes:
        map: valid in 64 bits; its certificate says whether its rounding to 32 bits is.
        branches: its seams.
        loops: (half-edges 3 f + c of the input, quarter turns to the left): closed strips of faces that generate the
            homology; each half-edge is crossed from its own face.
        seam_error: largest distance between the two sides of a seam, in the units of uv.
        not_stored: why 32 bits do not hold the map, if they do not.
    """

    map: Parametrization
    branches: list[SeamBranch]
    loops: list[tuple[IntArray, int]]
    seam_error: float
    not_stored: str | None


def _map_from(data: dict[str, Any], positions: Positions) -> SeamlessMap:
    return SeamlessMap(
        parametrization_from(data["map"], positions),
        [SeamBranch(*branch) for branch in data["branches"]],
        data["loops"],
        data["seam_error"],
        data["not_stored"],
    )


def _quarter_turns(cones: Any, count: int) -> IntArray:
    turns = np.zeros(count, np.int32)  # 0: not given
    for vertex, value in as_vertex_map(cones, "cones", "quarter turns").items():
        if not 0 <= vertex < count:
            raise InvalidInput(
                f"cones names vertex {shown(vertex)}, which does not exist (the mesh has {count}). Leave it out.",
                code="index out of range",
            )
        number = whole_number(value)
        if number is None or not 1 <= number < 2**20:
            raise InvalidInput(
                f"cones[{vertex}] must be a whole number of quarter turns, 1 or more, not {shown(value)}. "
                "Give 3 for the corner of a cube, 4 for flat, 5 for a saddle.",
                code="bad angles",
                kind="vertex",
                elements=[vertex],
            )
        turns[vertex] = number
    return turns


@ours_only
def start_penner(
    vertices: Any,
    faces: Any,
    cones: Any,
    *,
    engine: str = "auto",
    loops: Sequence[tuple[Any, int]] | None = None,
    uncuttable: Any = None,
    max_iterations: int = 200,
    relaxation: int | None = None,
    max_seconds: float | None = None,
    threads: int | None = None,
) -> Job[SeamlessMap]:
    """The map of the engine "penner", at once, on a thread.

    ``loops`` as in :class:`SeamlessMap`, None: chosen. ``relaxation``: steps towards the input's metric, which lower
    the energy and cost refinement; None: only where the energy would be large.
    """
    as_choice(engine, "engine", ENGINES[:2])
    face_array = as_indices(faces, "faces", 3)
    positions = as_vertices(vertices, face_array)
    native = _native.seamless_penner(
        positions.scaled,
        face_array,
        _quarter_turns(cones, len(positions.scaled)),
        None if loops is None else [(np.asarray(h, np.int32), int(turns)) for h, turns in loops],
        as_indices([] if uncuttable is None else uncuttable, "uncuttable", 2),
        1e-10,
        as_count(max_iterations, "max_iterations", 1),
        -1 if relaxation is None else as_count(relaxation, "relaxation"),
        as_seconds(max_seconds, "max_seconds"),
        as_threads(threads),
    )
    return Job(native, partial(_map_from, positions=positions))


@solver_call
def seamless(
    vertices: Any,
    faces: Any,
    cones: Any = None,
    *,
    engine: str = "auto",
    boundary: str = "aligned",
    optimise: bool = True,
    exact: bool = True,
    uncuttable: Any = None,
    max_iterations: int = 200,
    max_seconds: float | None = None,
    threads: int | None = None,
    progress: Progress | None = None,
) -> Job[Parametrization]:
    """A seamless map of a surface with these cones: its seams match exactly, in 64 and in 32 bits.

    Across every cut edge the map turns by whole quarters and moves, so that a grid, a checker or any texture with fourfold
    symmetry runs on. Every connected part is a surface and a chart of its own; all are at the scale of the surface, but for
    parts so small beside the others that 32 bits would lose them, which are larger and counted in
    ``stats["enlarged_islands"]``; each is turned so that the mesh's edges run along the axes as well as they can.

    Args:
        vertices: (n, 3) float64. faces: (m, 3), manifold, consistently oriented, without unused vertices.
        cones: {vertex: k}: total angle k pi / 2; all others are flat. On every closed connected part of genus g the sum of
            4 - k is 8 - 8 g; with an aligned boundary the sum of 4 - k inside and 2 - k at the boundary is 4 times the
            Euler characteristic. None: those of ``suggest_cones`` with ``quarter_turns`` and the bound 2.
        engine: "penner" changes lengths of edges until all angles fit; "padding" cuts into disks with right-angled borders
            and pads them until they fit (closed surfaces; it finds less often a map, and refines more); "auto" takes the
            first that finds a map.
        boundary: "aligned": curves of the boundary run exactly along the axes, with corners of whole quarter turns: the
            boundary vertices in ``cones`` (1: a convex corner, 3: a reflex one; all others are straight), or, if it names
            none, where that bends the boundary least: at its sharp corners, not at the teeth of a jagged one, and as many as
            Gauss-Bonnet asks for. "free": as near to the surface as the inside allows. "aligned_or_free": free on connected
            parts that find no map with an aligned boundary and have no corners in ``cones``; ``stats["freed_boundaries"]``
            counts these parts.
        optimise: lowers the distortion under the seams' constraints.
        exact: False leaves the seams as exact as rounding does, which may serve where 24 bits are too few for the grid.
        uncuttable: (k, 2) edges that the cut avoids where there is another way, diagonals of polygons; they do not count for
            the direction of the map.
        max_iterations: Newton steps of the engine (NotConverged when they are over), and of the optimiser, whose map is
            then taken as it is.
        max_seconds: of the clock; None or 0 is no limit. NotConverged (code "time limit reached") if there is no map by
            then; one that could still be optimised is returned, with ``stats["time_limit_reached"]`` 1.
        threads: None is all cores; the result has the same bits for every number.
        progress: called with (stage, fraction) about 20 times per second; returning False cancels.

    Returns:
        The certified map (G1, G2, G4, G5, G7) with ``transitions`` per cut edge, all exact: for an edge (a, b) from the
        face that has a before b to the other one. ``certificate.quarter_cones`` are its cones; ``stats`` has "engine",
        "iterations", "distortion.iterations", "added_vertices", "energy.engine", "energy.optimised".

    Raises:
        InvalidInput (the mesh; a cone; names the place), Infeasible (Gauss-Bonnet, with what is missing; cones that no
        surface of this genus has), NotConverged, Cancelled.
    """
    face_array = as_indices(faces, "faces", 3)
    positions = as_vertices(vertices, face_array)
    options = dict(
        engine=as_choice(engine, "engine", ENGINES),
        boundary=as_choice(boundary, "boundary", BOUNDARIES),
        optimise=as_flag(optimise, "optimise"),
        exact=as_flag(exact, "exact"),
        uncuttable=as_indices([] if uncuttable is None else uncuttable, "uncuttable", 2),
        engine_iterations=as_count(max_iterations, "max_iterations", 1),
        max_iterations=as_count(max_iterations, "max_iterations", 1),
        max_seconds=as_seconds(max_seconds, "max_seconds"),
    )
    native = _native.seamless(
        positions.scaled,
        face_array,
        None if cones is None else _quarter_turns(cones, len(positions.scaled)),
        options,
        as_threads(threads),
    )
    return Job(native, partial(parametrization_from, positions=positions))
