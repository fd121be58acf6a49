"""Auto Unwrap: seam islands onto the plane, the seams for it, and the packing of charts.

Textures that are no squares are packed in their pixels, of which the unit square has one shape only: the longer side has
length 1 in the texture's own plane, where islands turn and gaps are measured; what lies beside it in the unit square is an
obstacle. The way back to UVs is one factor for u or v, a rounding, and a certificate of what that left.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any, Unpack

import numpy as np

from .. import _native, checks
from ..checks import Pins
from ..distortion import STRETCH_BOUND
from ..errors import NotConverged, bad_option, bad_shape, require
from ..job import Job, Limits, StagedJob, Stages, job_of, solver_call, start_job, start_map
from ..results import FloatArray, IntArray, Mesh, Parametrization, parametrization_from
from ..texts import counted
from .certification import certify

#: Where islands end unless a caller says otherwise.
SEAMS = "auto"


@solver_call
def unwrap(
    vertices: Any,
    faces: Any,
    *,
    cuts: Any = None,
    seams: str = SEAMS,
    stretch: float = STRETCH_BOUND,
    uncuttable: Any = None,
    materials: Any = None,
    polygons: Any = None,
    pins: Pins | None = None,
    bijective: bool = True,
    may_add_cuts: bool = True,
    cut_extremities: bool = True,
    iterations: int = 200,
    tolerance: float = 1e-4,
    margin: float = 0.005,
    effort: float = 0.2,
    place_like: Any = None,
    **limits: Unpack[Limits],
) -> Job[Parametrization]:
    """One flip-free chart per seam island, free boundary, low distortion, on the given triangulation.

    All charts have one scale (the same area per area of their surface) and are packed into the unit square. Charts with
    pins stay; the others keep clear of them and take their scale if there is room.

    Islands end at ``cuts``, and by default at the seams that are found where one is closed, has handles, or would end above the
    stretch bound; all others stay whole, with their holes (``cut_edges`` has the cuts, ``stats["added_cuts"]`` counts those
    that opened something).

    Args:
        vertices: (n, 3) float64. faces: (m, 3), any triangles. What keeps them from being an oriented
            surface is separated first and listed in ``certificate.mends``.
        cuts: (s, 2) vertex pairs: seam edges.
        seams: "auto": the cuts, and whatever it takes to stay within ``stretch``, as ``auto_seams`` finds it; "given": the cuts
            and no more than a short cut graph of what is closed or has handles. So it is with pins, whatever is asked for.
        stretch: with automatic seams, the factor by which lengths may change, about; see ``auto_seams``.
        uncuttable: (d, 2) vertex pairs that automatic cuts avoid, such as diagonals of polygons. Where they leave no way to
            open a closed part or a handle, that is refused; with automatic seams a sphere is opened along some of them.
        materials: (m,) whole numbers: where more than two faces meet at an edge, those of one material rather go together.
        polygons: (m,) whole numbers: triangles of one polygon, whose corners have one UV each. They stay in one piece; a polygon
            that no cut can go around is an island of its own. Edges inside one are ``uncuttable``; without it, these tell
            polygons.
        pins: {vertex or (face, corner): (u, v)}, met bit for bit. A pin that cannot be reached without a flip on
            this triangulation raises NotConverged; ``match`` refines the mesh instead.
        bijective: charts do not overlap themselves.
        may_add_cuts: with ``bijective``, a chart without pins that cannot be laid out without overlap at a distortion
            near that of its free map is cut further (``stats["overlap_cuts"]`` edges, part of ``cut_edges``) instead of
            crushed.
        cut_extremities: closed islands, which have to be cut open anyway, are also slit to their legs, fingers, and
            whatever else a flat map would have to shrink many times. Off: one short cut. Not done if there are pins.
        iterations: most optimiser iterations per chart. tolerance: share of the energy that a step must promise.
        margin: space between charts, in units of the unit square.
        effort: of the search for a dense layout, see ``pack``; 0 where another layout follows.
        place_like: (m, 3, 2) former UVs, whose places are kept if that leaves a usable layout: every island without pins
            was a flip-free island there and, turned and moved to fit at one common scale, lies in the unit square on
            top of no other. Then ``stats["kept_places"]`` is 1; otherwise all islands without pins are packed.
        max_seconds: of the clock; None or 0 is no limit. What was gained by then is kept, and
            ``stats["time_limit_reached"]`` is 1; NotConverged (code "time limit reached") if there is no map yet.
        threads: None is all cores; the result has the same bits for every number, unless a limit of time is reached.
        progress: called with (stage, fraction) about 20 times per second; returning False cancels.

    Raises:
        InvalidInput, Infeasible, NotConverged, Cancelled.
    """
    mesh, options = _options(locals())
    find = checks.as_choice(seams, "seams", ("given", "auto")) == "auto"
    options["seams.find"] = find and not len(options["pins"][0])
    return start_map(_native.unwrap, mesh, options, limits)


@solver_call
def auto_seams(
    vertices: Any,
    faces: Any,
    *,
    cuts: Any = None,
    stretch: float = STRETCH_BOUND,
    sharp_angle: float | None = None,
    weights: Any = None,
    uncuttable: Any = None,
    materials: Any = None,
    polygons: Any = None,
    **limits: Unpack[Limits],
) -> Job[IntArray]:
    """Seams for ``unwrap``: short, few islands, and no more distortion than was asked for, as (k, 2) vertex pairs.

    ``unwrap`` with these edges as ``cuts`` stays within the bound and cuts nothing more. ``unwrap`` with ``seams="auto"``
    does both in less time.

    Args:
        vertices: (n, 3) float64. faces: (m, 3), any triangles, as for ``unwrap``.
        cuts: (s, 2) vertex pairs: seams that are there already. They stay, and are part of the result.
        stretch: factor by which lengths may change, about: the mean distortion (1 is none) of the islands of each
            connected part is at most the mean of the factor and its inverse, 1.025 for 1.25.
        sharp_angle: edges whose faces differ by more than this angle (radians) are seams; None is none of them.
        weights: (edges (k, 2), factors (k,)): how much a seam there costs, times its length. Below 1 is sought, above 1
            avoided, infinity taken only where no other edges open a closed part or a handle.
        uncuttable: (d, 2) vertex pairs that are never seams where there is another way, such as diagonals of polygons. A
            sphere that only they could open is opened along some of them, a handle is refused.
        materials: (m,) whole numbers: where more than two faces meet at an edge, those of one material rather go together.
        polygons: (m,) whole numbers: triangles of one polygon, whose corners have one UV each. They stay in one piece; a polygon
            that no cut can go around is an island of its own. Edges inside one are ``uncuttable``; without it, these tell
            polygons.
        max_seconds: of the clock; None or 0 is no limit. The seams that were found by then come back.
        threads: None is all cores; the result is the same for every number, unless a limit of time is reached.
        progress: called with (stage, fraction) about 20 times per second; returning False cancels.

    Raises:
        InvalidInput, NotConverged, Cancelled.
    """
    mesh, options = _options(locals())
    options |= {"seams.find": True, **_as_weights(weights)}
    return start_job(_native.auto_seams, mesh, options, limits, lambda data, _mesh: data)


def _options(given: dict[str, Any]) -> tuple[Mesh, dict[str, Any]]:
    """Mesh and options of unwrap and auto_seams."""
    mesh, options = checks.checked(given)
    if "polygon" in options:
        inside = _edges_inside(options["polygon"], mesh.faces)
        given_edges = options.get("uncuttable", inside[:0])
        options["uncuttable"] = np.concatenate([given_edges, inside])
    return mesh, options


def _edges_inside(polygons: IntArray, faces: IntArray) -> IntArray:
    """Vertex pairs (k, 2) that two triangles of one polygon share."""
    edges = np.sort(np.stack([faces, np.roll(faces, -1, axis=1)], axis=-1), axis=-1).reshape(-1, 2)
    rows = np.column_stack([edges, np.repeat(polygons, 3)])
    found, count = np.unique(rows, axis=0, return_counts=True)
    return found[count > 1, :2].astype(np.int32)


def _as_weights(values: Any) -> dict[str, Any]:
    if values is None:
        return {}
    try:
        edges, factors = values
    except Exception:  # whatever the object's own iteration raises
        raise bad_shape(f"weights must be (edges, factors), not {checks.shown(values)}.") from None
    pairs, numbers = checks.as_indices(edges, "weights", 2), checks.as_floats(factors, "weights")
    if len(pairs) != len(numbers):
        raise bad_shape(
            f"weights has {counted(len(pairs), 'edge')} and {counted(len(numbers), 'factor')}. Give one factor for each edge."
        )
    return {"seams.weighted": pairs, "seams.weights": numbers}


@dataclass(frozen=True)
class Texture:
    """aspect: width over height. column, row: of its UDIM tile."""

    aspect: float
    column: int = 0
    row: int = 0

    @property
    def _scale(self) -> FloatArray:
        return np.array([min(self.aspect, 1.0), min(1.0 / self.aspect, 1.0)])

    def in_pixels(self, uv: FloatArray) -> FloatArray:
        """UVs (..., 2) in the texture's plane."""
        return (uv - (self.column, self.row)) * self._scale

    def in_uv(self, points: FloatArray) -> FloatArray:
        return points / self._scale + (self.column, self.row)

    def beside(self) -> FloatArray:
        """(6, 2), two triangles: what the unit square has beyond the texture."""
        low = np.where(self._scale < 1.0, self._scale, 0.0)
        a, b, c, d = low, np.array([1.0, low[1]]), np.array([1.0, 1.0]), np.array([low[0], 1.0])
        return np.array([a, b, c, a, c, d])


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
    layouts: Any = None,
    share_tile: bool = False,
    stack_similar: bool = False,
    stack_mirrored: bool = False,
    tile: int = 1001,
    tiles: int = 1,
    aspect: float = 1.0,
    effort: float = 1.0,
    unmoved: Any = None,
    obstacles: Any = None,
    density: float | None = None,
    place_like: Any = None,
    **limits: Unpack[Limits],
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
        layouts, share_tile: (m,) one number per face: charts of one number (their faces' highest) have a layout of their own,
            each as large as its tile allows: in one tile after the other from ``tile`` on, in the order of the numbers, or
            with ``share_tile`` all in the first, on top of each other. Neither with several ``tiles`` nor with ``together``.
        stack_similar: charts of equal outline lie on top of each other; ``stats["stacked"]`` counts them.
        stack_mirrored: with ``stack_similar``, charts that are mirror images as well, mirrored, so that all of their triangles
            are negative; the certificate judges them as mirrored and counts them. Those that are mirrored in ``uv``, whole
            charts that move, are turned over first.
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
    size = checks.whole(1)(texture_size, "texture_size")
    if margin_pixels is not None:
        in_pixels = checks.real(f"of {size} pixels of texture_size", least=0.0, below=size / 2)
        margin = in_pixels(margin_pixels, "margin_pixels") / size
    mesh, options = checks.checked(locals())
    corner_uv, keep_clear_of = options["uv"], options.get("obstacles", np.zeros((0, 2)))
    first = checks.whole(1001, 1100)(tile, "tile") - 1001
    options["first_tile"] = first
    if density is not None:
        options["density"] = _times_power(checks.as_positive(density, "density"), mesh.exponent)
    texture = Texture(options.pop("aspect"), first % 10, first // 10)
    if texture.aspect != 1.0:
        if options["tiles"] > 1 or not (layouts is None or options["share_tile"]):
            raise bad_option(
                "Charts are spread over several tiles only where these are squares. Pack into one tile, or leave aspect out."
            )
        for name in {"uv", "place_like"} & set(options):
            options[name] = texture.in_pixels(options[name])
        options["obstacles"] = np.concatenate([texture.in_pixels(keep_clear_of), texture.beside()])
        options["first_tile"] = 0
    job = start_job(_native.pack, mesh, options, limits, _packed_from)

    def stages() -> Stages[Parametrization]:
        try:
            packed: Parametrization = yield job, 1.0 if texture.aspect == 1.0 else 0.8
        except NotConverged as error:
            if density is not None and error.code == "rounding to 32 bits flips triangles":
                error.args = (
                    f"{str(error).partition('. ')[0]}. The density asked for is {float(density):g}: give a larger one, "
                    "or none, which makes the charts as large as there is room for.",
                )
            raise
        if texture.aspect == 1.0:
            return packed
        found = _in_uv(packed, corner_uv.reshape(-1, 3, 2), texture)
        mirrored = np.zeros(len(found.faces), np.int32)
        mirrored[packed.certificate.mirrored_faces] = 1
        alone = not (len(options.get("unmoved", ())) or stack_similar or groups is not None)
        how: dict[str, Any] = dict(mirrored=mirrored, disjoint=alone and layouts is None, **limits)
        judging = job_of(certify)(vertices, faces, found.uv, aspect=texture.aspect, **how)
        certificate = yield judging, 1.0
        cure = "Leave aspect out, or pack fewer faces at once."
        require(certificate, "The packed map failed its check", cure)
        return replace(found, certificate=certificate)

    return StagedJob(stages())


def _in_uv(packed: Parametrization, before: FloatArray, texture: Texture) -> Parametrization:
    """before: (m, 3, 2), UVs before the packing; what did not move has them again."""
    if packed.stats["tile"] != 0:
        raise bad_option(
            "What stays leaves no room in the texture's tile. Pack into another tile, or leave aspect out."
        )
    stays = (packed.uv == texture.in_pixels(before)).all(axis=2, keepdims=True)
    uv = np.where(stays, before, texture.in_uv(packed.uv))
    stats = {**packed.stats, "tile": texture.column + 10 * texture.row}
    stats["fill"] *= max(texture.aspect, 1.0 / texture.aspect)
    return replace(packed, uv=uv, uv64=uv, _uv32=uv.astype(np.float32), stats=stats)


def _packed_from(data: dict[str, Any], mesh: Mesh) -> Parametrization:
    packed = parametrization_from(data, mesh)
    packed.stats["density"] = _times_power(packed.stats["density"], -mesh.exponent)
    return packed


def _times_power(number: float, exponent: int) -> float:
    """``number`` times 2 to the exponent; beyond the range of doubles infinity, or the least number above zero."""
    with np.errstate(over="ignore", under="ignore"):
        result = float(np.ldexp(number, exponent))
    return result if result > 0.0 or not number > 0.0 else 5e-324
