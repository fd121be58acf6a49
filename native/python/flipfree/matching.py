"""Hard constraints: pinned vertices, lines and whole boundaries met bit for bit, without a fold (thesis 3.3)."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from . import _native
from .arrays import as_floats, as_indices
from .errors import InvalidInput
from .job import Job, Progress, run
from .results import Parametrization, parametrization_from

Points = Mapping[int, tuple[float, float]]
Lines = Sequence[tuple[Sequence[int], Any]]

#: What ``engine`` may be: both in turn, or one of them alone (for tests and benchmarks).
ENGINES = ("auto", "first try", "outline", "matchmaker")


def start_match(
    vertices: Any,
    faces: Any,
    *,
    points: Points | None = None,
    lines: Lines | None = None,
    boundary_uv: Any = None,
    boundary_loop: Any = None,
    paths: Mapping[int, Sequence[int]] | None = None,
    optimise: bool = True,
    bijective: bool = False,
    iterations: int = 200,
    engine: str = "auto",
    threads: int = 2,
) -> Job[Parametrization]:
    """As :func:`match`, at once, on a thread."""
    if engine not in ENGINES:
        raise InvalidInput(f"engine must be one of {ENGINES}, not {engine!r}.", code="bad option")
    if iterations < 0 or threads < 1:
        raise InvalidInput(
            "iterations must not be negative, threads at least 1.", code="bad option"
        )
    pins = dict(points or {})
    targets = as_floats(list(pins.values()), "points", 2)
    native_lines = [
        (as_indices(chain, f"lines[{i}]"), as_floats(polyline, f"lines[{i}]", 2))
        for i, (chain, polyline) in enumerate(lines or [])
    ]
    native_paths = []
    for vertex, path in (paths or {}).items():
        chain = as_indices(path, f"paths[{vertex}]")
        if len(chain) == 0 or chain[0] != vertex:
            chain = np.concatenate([np.array([vertex], dtype=np.int32), chain])
        native_paths.append(chain)
    if boundary_uv is None and boundary_loop is not None:
        raise InvalidInput("boundary_loop is given without boundary_uv.", code="bad boundary")
    native = _native.match(
        as_floats(vertices, "vertices", 3),
        as_indices(faces, "faces", 3),
        as_indices(list(pins), "points"),
        targets,
        native_lines,
        as_indices([] if boundary_loop is None else boundary_loop, "boundary_loop"),
        as_floats([] if boundary_uv is None else boundary_uv, "boundary_uv", 2),
        native_paths,
        bool(optimise),
        bool(bijective),
        int(iterations),
        engine,
        int(threads),
    )
    return Job(native, parametrization_from)


def match(
    vertices: Any,
    faces: Any,
    *,
    points: Points | None = None,
    lines: Lines | None = None,
    boundary_uv: Any = None,
    boundary_loop: Any = None,
    paths: Mapping[int, Sequence[int]] | None = None,
    optimise: bool = True,
    bijective: bool = False,
    iterations: int = 200,
    engine: str = "auto",
    threads: int = 2,
    progress: Progress | None = None,
) -> Parametrization:
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
        optimise: lower the distortion with all constraints held. iterations: at most so many Newton steps.
        bijective: with a free boundary, one-to-one as a whole and not only locally.
        engine: "auto", or "first try" / "outline" / "matchmaker" alone.

    Returns:
        Parametrization: refined only where no map of the user's triangles was found; ``stats["added_vertices"]``,
        ``stats["engine"]``. Its certificate is ok.

    Raises:
        Infeasible: contradictory constraints, or a boundary that no disk has, with the reason and the vertices.
        InvalidInput, NotConverged, Cancelled.
    """
    job = start_match(
        vertices,
        faces,
        points=points,
        lines=lines,
        boundary_uv=boundary_uv,
        boundary_loop=boundary_loop,
        paths=paths,
        optimise=optimise,
        bijective=bijective,
        iterations=iterations,
        engine=engine,
        threads=threads,
    )
    return run(job, progress)
