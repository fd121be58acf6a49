"""Pack: an existing map's charts into the unit square."""

from __future__ import annotations

from functools import partial
from typing import Any

from . import _native
from .arrays import as_corner_uv, as_indices, as_vertices
from .job import Job, Progress, run
from .options import as_count, as_flag, as_margin
from .results import Parametrization, parametrization_from


def start_pack(
    vertices: Any,
    faces: Any,
    uv: Any,
    *,
    margin: float = 0.005,
    together: bool = False,
    scale_true: bool = False,
    keep_bijective: bool = True,
    unmoved: Any = None,
    threads: int = 2,
) -> Job[Parametrization]:
    """As :func:`pack`, at once, on a thread."""
    face_array = as_indices(faces, "faces", 3)
    positions, exponent = as_vertices(vertices)
    native = _native.pack(
        positions,
        face_array,
        as_corner_uv(uv, "uv", len(face_array)),
        as_margin(margin),
        as_flag(together, "together"),
        as_flag(scale_true, "scale_true"),
        as_flag(keep_bijective, "keep_bijective"),
        as_indices([] if unmoved is None else unmoved, "unmoved"),
        as_count(threads, "threads", 1),
    )
    return Job(native, partial(parametrization_from, exponent=exponent))


def pack(
    vertices: Any,
    faces: Any,
    uv: Any,
    *,
    margin: float = 0.005,
    together: bool = False,
    scale_true: bool = False,
    keep_bijective: bool = True,
    unmoved: Any = None,
    threads: int = 2,
    progress: Progress | None = None,
) -> Parametrization:
    """Moves the charts of a flip-free map into the unit square, as ``unwrap`` does; only turns, shifts and scales.

    The map is cut where the UVs on the two sides of an edge differ.

    Args:
        vertices: (n, 3) float64. faces: (m, 3). uv: (m, 3, 2), one per face corner.
        margin: space between charts, in units of the unit square.
        together: charts of one connected component turn and scale together, so that cuts whose sides are related by
            a rotation and a shift stay so, with the same rotation. Otherwise every chart turns on its own.
        scale_true: components (charts, if not together) get the size of their surface; otherwise scales keep their ratio.
        keep_bijective: charts that do not overlap themselves go on not to, once rounded to 32 bits.
        unmoved: corners 3 face + corner whose charts stay where they are.
        threads: the result has the same bits for every number.
        progress: called with (stage, fraction) about 20 times per second; returning False cancels.

    Raises:
        InvalidInput (also for a map with flipped triangles, which are named), NotConverged, Cancelled.
    """
    job = start_pack(
        vertices,
        faces,
        uv,
        margin=margin,
        together=together,
        scale_true=scale_true,
        keep_bijective=keep_bijective,
        unmoved=unmoved,
        threads=threads,
    )
    return run(job, progress)
