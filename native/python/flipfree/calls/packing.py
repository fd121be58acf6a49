"""Pack: an existing map's charts into the unit square, clear of what lies there."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import Any

import numpy as np

from .. import _native
from ..arrays import Positions, as_corner_uv, as_indices, as_triangles, as_vertices
from ..conversions import parametrization_from
from ..errors import InvalidInput, NotConverged
from ..job import Job, Progress, job_of, solver_call
from ..options import (
    as_aspect,
    as_choice,
    as_count,
    as_effort,
    as_flag,
    as_margin,
    as_number,
    as_positive,
    as_seconds,
    as_threads,
    shown,
)
from ..results import Parametrization
from ..shaped import ShapedJob, Texture, refuse_tiles
from .certification import certify


@solver_call
def pack(
    vertices: Any,
    faces: Any,
    uv: Any,
    *,
    margin: float = 0.005,
    margin_pixels: float | None = None,
    texture_size: int = 1024,
    rotation: str = "straight",
    together: bool = False,
    scale_true: bool = False,
    keep_bijective: bool = True,
    groups: Any = None,
    stack_similar: bool = False,
    tile: int = 1001,
    tiles: int = 1,
    aspect: float = 1.0,
    effort: float = 1.0,
    unmoved: Any = None,
    obstacles: Any = None,
    density: float | None = None,
    place_like: Any = None,
    max_seconds: float | None = None,
    threads: int | None = None,
    progress: Progress | None = None,
) -> Job[Parametrization]:
    """Moves the charts of a flip-free map into the unit square, as ``unwrap`` does; only turns, shifts and scales.

    Outlines are nested, holes are used. As stored in 32 bits no chart overlaps another, and any two are at least the margin
    apart. ``stats["fill"]`` is the share of the tiles that the charts cover; ``stats["margin_met"]`` is 0 where a
    gap, or half of one to the border, is below the margin as stored.

    The map is cut where the UVs on the two sides of an edge differ. Where pinned charts and obstacles leave less than an
    eighth of the scale that the empty unit square allows, the next free tile is taken, in the order of UDIM:
    ``stats["tile"]`` is 1 for the tile on the right, 10 for the one above. ``stats["density"]`` is what came out.

    Args:
        vertices: (n, 3) float64. faces: (m, 3), any triangles. uv: (m, 3, 2), one per face corner.
        margin: least space between charts, in units of the unit square; half of it to the square's border. Lowered to
            0.9 / (ceil(sqrt(n)) + 1) for n charts.
        margin_pixels: the same in pixels of the texture; ``margin`` is not used then.
        texture_size: pixels to a side, by which ``margin_pixels`` is measured.
        rotation: "free"; "straight" (charts whose outlines run in two directions at a right angle, rectangles and the like,
            stay along the axes, others are free); "quarters" (turns by 90 degrees only) or "none".
        together: charts of one connected component turn and scale together, so that cuts whose sides are related by
            a rotation and a shift stay so, with the same rotation. Otherwise every chart turns on its own.
        scale_true: components (charts, if not together) get the size of their surface; otherwise scales keep their ratio.
        keep_bijective: charts that do not overlap themselves go on not to, once rounded to 32 bits.
        groups: (m,) one number per face: charts with faces of equal number keep their places relative to each other and
            move as one; -1 is alone. Not with ``together``.
        stack_similar: charts of equal outline lie on top of each other; ``stats["stacked"]`` counts them.
        tile: UDIM number, 1001 to 1100, of the first tile to be considered.
        tiles: how many, from that one on in the order of UDIM, the charts are spread over: of about equal area, at one
            scale, which is the largest that the fullest allows. ``stats["tiles"]``: how many were taken.
        aspect: width over height of the texture that the unit square shows. Charts turn, and gaps and distortion are measured,
            in its pixels, the longer side being the unit of margins and densities and of ``texture_size``. In one tile only.
        effort: of the search for a dense layout, at most: 0 puts boxes side by side, 1 is about a second of processor for 300
            charts.
            Below 0.5 more than 300 charts are put as boxes too.
        unmoved: corners 3 face + corner that stay bit for bit, and their charts with them. The others keep clear of
            them, and with scale_true take their area-weighted density if there is room.
        obstacles: (k, 3, 2) triangles to keep clear of as well, of either orientation.
        density: length in the plane per length of the surface, over all charts that move: taken if there is room for
            it. Otherwise, and by default, the largest that there is room for.
        place_like: (m, 3, 2) former UVs. If every chart that moves was a flip-free island of them, and if all of them
            turned and moved to there, at one common scale, lie in the unit square on top of nothing, they stay there:
            ``stats["kept_places"]`` is 1. Otherwise everything is packed. Not with ``together``.
        max_seconds: of the clock; None or 0 is no limit. NotConverged (code "time limit reached") when they are over.
        threads: None is all cores; the result has the same bits for every number.
        progress: called with (stage, fraction) about 20 times per second; returning False cancels.

    Raises:
        InvalidInput (also for a map with flipped triangles, which are named), NotConverged, Cancelled.
    """
    face_array = as_indices(faces, "faces", 3)
    positions = as_vertices(vertices, face_array)
    corner_uv = as_corner_uv(uv, "uv", len(face_array))
    wanted = 0.0 if density is None else as_positive(density, "density")
    size = as_count(texture_size, "texture_size", least=1)
    if margin_pixels is not None:
        margin = _as_pixels(margin_pixels, size) / size
    first, many = (
        as_count(tile, "tile", least=1001, most=1100) - 1001,
        as_count(tiles, "tiles", least=1, most=100),
    )
    ratio = as_aspect(aspect)
    refuse_tiles(ratio, many)
    square = ratio == 1.0
    texture = Texture(1.0) if square else Texture(ratio, first % 10, first // 10)
    given = as_triangles([] if obstacles is None else obstacles, "obstacles")
    places = None if place_like is None else as_corner_uv(place_like, "place_like", len(face_array))
    stays = as_indices([] if unmoved is None else unmoved, "unmoved")
    if not square:
        given = np.concatenate([texture.in_pixels(given), texture.beside().reshape(-1, 2)])
        places = None if places is None else texture.in_pixels(places)
    options = dict(
        margin=as_margin(margin),
        rotation=as_choice(rotation, "rotation", ("free", "straight", "quarters", "none")),
        groups=as_indices([] if groups is None else groups, "groups"),
        stack=as_flag(stack_similar, "stack_similar"),
        first_tile=first if square else 0,
        tiles=many,
        effort=as_effort(effort),
        together=as_flag(together, "together"),
        scale_true=as_flag(scale_true, "scale_true"),
        keep_bijective=as_flag(keep_bijective, "keep_bijective"),
        unmoved=stays,
        obstacles=given,
        density=_times_power(wanted, positions.exponent),
    )
    native = _native.pack(
        positions.scaled,
        face_array,
        corner_uv if square else texture.in_pixels(corner_uv),
        options,
        places,
        as_seconds(max_seconds, "max_seconds"),
        as_threads(threads),
    )
    convert = partial(_packed_from, positions=positions)
    job = Job(native, convert) if density is None else _OfDensity(native, convert, wanted)
    if square:
        return job
    apart = not (len(stays) or stack_similar or groups is not None)
    judge = partial(job_of(certify), vertices, faces, disjoint=apart, threads=threads)
    return ShapedJob(job, corner_uv.reshape(-1, 3, 2), texture, judge)


class _OfDensity(Job[Parametrization]):
    """Charts that 32 bits cannot store at the density asked for are told so, not to be smaller."""

    def __init__(self, native: Any, convert: Callable[[Any], Parametrization], density: float):
        super().__init__(native, convert)
        self._density = density

    def result(self) -> Parametrization:
        try:
            return super().result()
        except NotConverged as error:
            if error.code == "rounding to 32 bits flips triangles":
                error.args = (
                    f"{str(error).partition('. ')[0]}. The density asked for is {self._density:g}: give a larger one, "
                    "or none, which makes the charts as large as there is room for.",
                )
            raise


def _as_pixels(value: Any, size: int) -> float:
    pixels = as_number(value, "margin_pixels")
    if not 0.0 <= pixels < size / 2:
        raise InvalidInput(
            f"margin_pixels must be at least 0 and below half of the {size} pixels of texture_size, not {shown(value)}.",
            code="bad option",
        )
    return pixels


def _packed_from(data: dict[str, Any], positions: Positions) -> Parametrization:
    packed = parametrization_from(data, positions)
    packed.stats["density"] = _times_power(packed.stats["density"], -positions.exponent)
    return packed


def _times_power(number: float, exponent: int) -> float:
    """``number`` times 2 to the exponent; beyond the range of doubles infinity, or the least number above zero."""
    with np.errstate(over="ignore", under="ignore"):
        result = float(np.ldexp(number, exponent))
    return result if result > 0.0 or not number > 0.0 else 5e-324
