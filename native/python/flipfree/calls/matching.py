"""Hard constraints: pinned vertices, lines and whole boundaries met bit for bit, without a fold (thesis 3.3)."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import partial
from typing import Any

import numpy as np
import numpy.typing as npt

from .. import _native
from ..arrays import as_floats, as_indices, as_list, as_place, as_places, as_vertex_map, as_vertices
from ..conversions import parametrization_from
from ..errors import InvalidInput
from ..job import Job, Progress, solver_call
from ..options import as_choice, as_count, as_flag, as_seconds, as_threads, shown
from ..results import Parametrization

Points = Mapping[int, tuple[float, float]]
Lines = Sequence[tuple[Sequence[int], Any]]

#: What ``engine`` may be: both in turn, or one of them alone (for tests and benchmarks).
ENGINES = ("auto", "first try", "outline", "arms", "matchmaker")


def _lines(lines: Lines | None) -> list[tuple[npt.NDArray[np.int32], npt.NDArray[np.float64]]]:
    result = []
    for i, line in enumerate(
        () if lines is None else as_list(lines, "lines", "a list of pairs (vertices, polyline)")
    ):
        pair = as_list(line, f"lines[{i}]", "a pair (vertices, polyline)")
        if len(pair) != 2:
            raise InvalidInput(
                f"lines[{i}] must be a pair (vertices, polyline).", code="array of the wrong shape"
            )
        result.append((as_indices(pair[0], f"lines[{i}]"), as_places(pair[1], f"lines[{i}]")))
    return result


@solver_call
def match(
    vertices: Any,
    faces: Any,
    *,
    points: Points | None = None,
    lines: Lines | None = None,
    boundary_uv: Any = None,
    boundary_loop: Any = None,
    paths: Mapping[int, Sequence[int]] | None = None,
    movable: Sequence[int] | None = None,
    optimise: bool = True,
    bijective: bool = False,
    iterations: int = 200,
    engine: str = "auto",
    max_seconds: float | None = None,
    threads: int | None = None,
    progress: Progress | None = None,
) -> Job[Parametrization]:
    """Maps a disk, or a piece with holes, so that every constraint is met bit for bit and no triangle folds.

    Args:
        vertices: (n, 3) float64. faces: (m, 3), connected, of genus 0, with a boundary. Of several boundary loops the
            longest counts as the outer one, or the one that boundary_loop names; the others are holes.
        points: {vertex: (u, v)}.
        lines: [(vertices along mesh edges, (k, 2) polyline)]; with as many points as vertices they correspond one to
            one, otherwise ends to ends and inner points to the nearest vertices by length.
        boundary_uv: (b, 2) targets of the whole boundary; the polygon may overlap itself. Without it the boundary is
            free. boundary_loop: (b,) its vertices in order (default: from the smallest id, surface on the left).
        paths: {vertex: vertices from it along mesh edges to the boundary}: on which sheet of an overlapping target a
            pinned vertex lies, or which of several disks with this boundary is meant.
        movable: boundary vertices whose targets are only where they begin: the optimisation may move them.
        optimise: lower the distortion with all constraints held. iterations: at most so many Newton steps.
        bijective: with a free boundary, one-to-one as a whole and not only locally.
        engine: "auto", or "first try" / "outline" / "arms" / "matchmaker" alone.
        max_seconds: of the clock; None or 0 is no limit. A map that meets all constraints by then is returned, however
            little time there was to take its refinement back and to lower its distortion:
            ``stats["time_limit_reached"]`` is 1 then. If there is none, NotConverged (code "time limit reached").
        threads: None is all cores; the result has the same bits for every number, unless a limit of time is reached.
        progress: called with (stage, fraction) about 20 times per second; returning False cancels.

    Returns:
        Parametrization: refined only where no map of the user's triangles was found; ``stats["added_vertices"]``,
        ``stats["engine"]``. Its certificate is ok.

    Raises:
        Infeasible: contradictory constraints, or a boundary that no disk has, with the reason and the vertices.
        InvalidInput, NotConverged, Cancelled.
    """
    pins = as_vertex_map(points, "points", "(u, v)")
    targets = [as_place(value, f"points[{shown(v)}]") for v, value in pins.items()]
    native_paths = []
    for vertex, path in as_vertex_map(paths, "paths", "[vertices to the boundary]").items():
        chain = as_indices(path, f"paths[{shown(vertex)}]")
        if len(chain) == 0 or chain[0] != vertex:
            chain = np.concatenate([as_indices([vertex], "paths"), chain])
        native_paths.append(chain)
    if boundary_uv is None and boundary_loop is not None:
        raise InvalidInput("boundary_loop is given without boundary_uv.", code="bad boundary")
    face_array = as_indices(faces, "faces", 3)
    positions = as_vertices(vertices, face_array)
    request = dict(
        points=(as_indices(list(pins), "points"), as_floats(targets, "points", 2)),
        lines=_lines(lines),
        boundary_loop=as_indices([] if boundary_loop is None else boundary_loop, "boundary_loop"),
        boundary_uv=as_places([] if boundary_uv is None else boundary_uv, "boundary_uv"),
        paths=native_paths,
        movable=as_indices([] if movable is None else movable, "movable"),
    )
    options = dict(
        optimise=as_flag(optimise, "optimise"),
        bijective=as_flag(bijective, "bijective"),
        iterations=as_count(iterations, "iterations"),
        engine=as_choice(engine, "engine", ENGINES),
        max_seconds=as_seconds(max_seconds, "max_seconds"),
    )
    native = _native.match(positions.scaled, face_array, request, options, as_threads(threads))
    return Job(native, partial(parametrization_from, positions=positions))
