"""Rectify: islands of quads onto grids, whose rows and columns are straight and as wide as they are on the surface."""

from __future__ import annotations

from typing import Any

from .. import _native
from ..checks import as_corner_uv, as_face_numbers, as_mesh, checked
from ..job import Job, Progress, StagedJob, Stages, job_of, solver_call, start_job
from ..results import Parametrization
from .unwrapping import pack


@solver_call
def rectify(
    vertices: Any,
    faces: Any,
    uv: Any = None,
    *,
    polygons: Any = None,
    cuts: Any = None,
    margin: float = 0.005,
    aspect: float = 1.0,
    max_seconds: float | None = None,
    threads: int | None = None,
    progress: Progress | None = None,
) -> Job[Parametrization]:
    """Islands of quads as straight strips and grids, packed: every row and every column of faces has one width, the mean of its
    edges. Islands that close up, such as tubes and rings, are cut along one row. O(m log m).

    Args:
        vertices: (n, 3) float64. faces: (m, 3), consistently oriented. uv: (m, 3, 2), one per face corner: islands end where it
            differs on the two sides of an edge, but for those that are grids without their seams, such as tubes, which get a
            straight one. None: at cuts and boundaries alone.
        polygons: (m,) whole numbers: the two triangles of a quad have the same one. Triangles that are alone are taken as quads
            in pairs, across what is the longest side of both.
        cuts: (s, 2) vertex pairs: seams, where islands end as well.
        margin: space between islands, in units of the unit square.
        aspect: width over height of the texture that the unit square shows; widths are those in its pixels.
        max_seconds: of the clock; None or 0 is no limit. NotConverged (code "time limit reached") when they are over.
        threads: None is all cores; the result has the same bits for every number.
        progress: called with (stage, fraction) about 20 times per second; returning False cancels.

    Returns:
        A certified map; its energy says what straightening costs.

    Raises:
        InvalidInput (codes "no quad"; "no grid": where three or five quads meet inside, or an island lies on itself; a face of
        each place is named), NotConverged, Cancelled.
    """
    mesh = as_mesh(vertices, faces)
    options = checked(locals(), "cuts margin aspect max_seconds")
    finding = {"cuts": options["cuts"]}
    if polygons is not None:
        finding["polygons"] = as_face_numbers(polygons, "polygons", len(mesh.faces))
    if uv is not None:
        finding["uv"] = as_corner_uv(uv, "uv", len(mesh.faces))

    def stages() -> Stages[Parametrization]:
        job = start_job(_native.rectify, mesh, finding, threads, lambda data, _mesh: data)
        straight = yield job, 0.3
        placed = job_of(pack)(
            vertices,
            faces,
            straight.reshape(-1, 3, 2) / [options["aspect"], 1.0],
            margin=options["margin"],
            aspect=options["aspect"],
            rotation="quarters",
            scale_true=True,
            effort=0.2,
            max_seconds=max_seconds,
            threads=threads,
        )
        found: Parametrization = yield placed, 1.0
        return found

    return StagedJob(stages())
