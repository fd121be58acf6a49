"""Commands that want a clean surface, which they make of what they get: match, conformal, seamless, field."""

from __future__ import annotations

import argparse
import math
from dataclasses import replace
from typing import Any

import numpy as np
import numpy.typing as npt

from ...calls.certification import certify
from ...calls.conformal_map import conformal as conformal_map
from ...calls.matching import match as match_pins
from ...calls.packing import pack
from ...calls.seamless import seamless as seamless_map
from ...calls.target_angles import boundary_angles, suggest_cones
from ...errors import Infeasible, InvalidInput, NotConverged
from ...fields.aligned import field_aligned
from ...fields.cross_fields import cross_field
from ...results import Parametrization
from ...separated import SeparatedSurface
from ...shaped import held_by_pins
from .. import numbers
from . import texture
from .any_mesh import flags
from .model import Model, Solved
from .parts import IntArray, each_part

FloatArray = npt.NDArray[np.float64]

_FREE = "a boundary is free, as no map was found with one along the axes"
_ENLARGED = "parts too small beside the others for 32 bits are larger than in scale"


def match_arguments(parser: argparse.ArgumentParser) -> None:
    flags(parser, allow_overlaps="islands may overlap themselves")
    texture.argument(parser)


def match(model: Model, options: dict[str, Any]) -> Solved:
    told = model.told("pins")
    if told is None:
        raise InvalidInput(
            f"{model.source.name}.pins.json is missing: the pins, such as "
            '{"points": {"0": [0.0, 0.5]}, "lines": [{"vertices": [3, 4], "uv": [[0, 0], [1, 0]]}]}.',
            code="bad pins",
        )
    clean = model.clean()
    points, lines = _points(model, clean, told), _lines(model, clean, told)

    def solve(vertices: FloatArray, faces: IntArray, used: IntArray) -> Parametrization:
        number = {v: i for i, v in enumerate(used.tolist())}
        own = {number[v]: uv for v, uv in points.items() if v in number}
        own_lines = [([number[v] for v in vs], uv) for vs, uv in lines if vs[0] in number]
        if not own and not own_lines:
            where = clean.vertex_origin[used[0]]
            raise InvalidInput(
                f"The part with vertex {where} has no pins. Give it some.", code="bad pins"
            )
        met = match_pins(
            vertices,
            faces,
            points=own,
            lines=own_lines,
            bijective=not options["allow_overlaps"],
            **model.limits,
        )
        if options["aspect"] == 1.0:
            return met
        pinned = np.zeros(len(vertices), bool)
        pinned[[*own, *(v for vs, _ in own_lines for v in vs)]] = True
        return texture.of_pins(model, met, held_by_pins(met, faces, pinned), options)

    found = each_part(clean, solve)
    whole = clean.on_input(found)
    judged = certify(
        found.vertices,
        found.faces,
        found.uv,
        pins=points,
        bijective=not options["allow_overlaps"],
        aspect=options["aspect"],
        threads=model.threads,
    )
    return Solved(replace(judged, mends=clean.mends), whole)


def _points(
    model: Model, clean: SeparatedSurface, told: dict[str, Any]
) -> dict[int, tuple[float, float]]:
    given = told.get("points", {})
    try:
        points = {int(v): (float(uv[0]), float(uv[1])) for v, uv in given.items()}
    except (AttributeError, TypeError, ValueError, IndexError):
        raise InvalidInput(
            'points must be {"vertex": [u, v], ...}. Correct the file with the pins.',
            code="bad pins",
        ) from None
    _refuse_unknown(model, points)
    return clean.copies(points)


def _lines(
    model: Model, clean: SeparatedSurface, told: dict[str, Any]
) -> list[tuple[list[int], FloatArray]]:
    copy = np.full(len(model.vertices), -1)
    copy[clean.vertex_origin[::-1]] = np.arange(len(clean.vertices))[::-1]
    lines = []
    for line in told.get("lines", []):
        try:
            vertices, uv = (
                list(map(int, line["vertices"])),
                np.array(line["uv"], float).reshape(-1, 2),
            )
        except (KeyError, TypeError, ValueError):
            raise InvalidInput(
                'lines must be [{"vertices": [...], "uv": [[u, v], ...]}, ...]. Correct the file with the pins.',
                code="bad pins",
            ) from None
        _refuse_unknown(model, vertices)
        if len(vertices) < 2:
            raise InvalidInput("A line needs two vertices at least. Correct it.", code="bad pins")
        lines.append((copy[vertices].tolist(), uv))
    return lines


def _refuse_unknown(model: Model, vertices: Any) -> None:
    known = set(np.unique(model.faces).tolist())
    for v in vertices:
        if v not in known:
            raise InvalidInput(
                f"Vertex {v} is no face's (numbers from 0, the first of those in one place). Correct the file beside the model.",
                code="bad pins",
            )


def conformal_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "--cones",
        choices=("auto", "suggested", "none"),
        default="auto",
        help="auto: of the file beside the model, else suggested for closed parts",
    )
    parser.add_argument(
        "--bound", type=numbers.bound, default=4.0, help="of the scale, for suggested cones"
    )
    parser.add_argument("--boundary", choices=("free", "straight", "circle"), default="free")
    parser.add_argument(
        "--margin", type=numbers.margin, default=0.005, help="between packed islands"
    )


def conformal(model: Model, options: dict[str, Any]) -> Solved:
    clean = model.clean()
    cones = clean.copies(_cones(model)) if options["cones"] == "auto" else {}

    def solve(vertices: FloatArray, faces: IntArray, used: IntArray) -> Parametrization:
        own = {i: cones[v] for i, v in enumerate(used.tolist()) if v in cones}
        closed = _is_closed(faces)
        angles: Any
        if options["cones"] == "suggested" or (closed and not own and options["cones"] == "auto"):
            angles = suggest_cones(vertices, faces, bound=options["bound"], **model.limits)
        elif closed:
            angles = np.full(len(vertices), 2 * math.pi)
            angles[list(own)] = list(own.values())
        else:
            angles = boundary_angles(
                vertices, faces, options["boundary"], cones=own, **model.limits
            )
        return conformal_map(vertices, faces, angles, **model.limits)

    found = each_part(clean, solve)
    packed = pack(
        found.vertices,
        found.faces,
        found.uv,
        together=True,
        scale_true=True,
        margin=options["margin"],
        **model.limits,
    )
    placed = replace(
        found, uv=packed.uv, uv64=packed.uv64, _uv32=packed.uv32(), certificate=packed.certificate
    )
    whole = clean.on_input(placed)
    return Solved(whole.certificate, whole)


def _cones(model: Model) -> dict[int, float]:
    """{vertex: angle} of the file beside the model, which has degrees."""
    told = model.told("cones") or {}
    try:
        cones = {int(v): math.radians(float(angle)) for v, angle in told.items()}
    except (TypeError, ValueError):
        raise InvalidInput(
            'Cones must be {"vertex": degrees, ...}. Correct the file with the cones.',
            code="bad angles",
        ) from None
    _refuse_unknown(model, cones)
    return cones


def _is_closed(faces: IntArray) -> bool:
    sides = np.concatenate([faces[:, (k, (k + 1) % 3)] for k in range(3)])
    keys = np.sort(sides, axis=1).astype(np.int64) @ np.array([1 << 32, 1])
    return bool((np.unique(keys, return_counts=True)[1] == 2).all())


def seamless_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "--cones",
        choices=("auto", "suggested"),
        default="auto",
        help="auto: of the file beside the model, else suggested",
    )
    _seamless_arguments(parser, ("aligned_or_free", "aligned", "free"))
    parser.add_argument("--engine", choices=("auto", "penner", "padding"), default="auto")


def _seamless_arguments(parser: argparse.ArgumentParser, boundaries: tuple[str, ...]) -> None:
    """The first boundary is the default."""
    parser.add_argument("--boundary", choices=boundaries, default=boundaries[0])
    flags(
        parser,
        no_optimise="leave the distortion as the engine does",
        surface_scale="one UV unit is one unit of the model; otherwise the map fits the unit square",
    )


def seamless(model: Model, options: dict[str, Any]) -> Solved:
    clean = model.clean()
    cones = clean.copies(_cones(model)) if options["cones"] == "auto" else {}
    quarters = {v: round(angle / (math.pi / 2)) for v, angle in cones.items()}
    for v, angle in cones.items():
        if abs(quarters[v] - angle / (math.pi / 2)) > 1e-9 or quarters[v] < 1:
            raise InvalidInput(
                f"Vertex {clean.vertex_origin[v]} has a cone of {math.degrees(angle):g} degrees, no multiple of 90. Correct it.",
                code="bad angles",
            )
    found = seamless_map(
        clean.vertices,
        clean.faces,
        quarters or None,
        engine=options["engine"],
        boundary=options["boundary"],
        optimise=not options["no_optimise"],
        uncuttable=clean.edges(model.diagonals),
        **model.limits,
    )
    solved = _placed(model, clean, found, options)
    if found.stats.get("freed_boundaries", 0):
        solved.warnings.append(_FREE)
    if found.stats.get("enlarged_islands", 0):
        solved.warnings.append(_ENLARGED)
    return solved


def _placed(
    model: Model, clean: SeparatedSurface, found: Parametrization, options: dict[str, Any]
) -> Solved:
    """In the unit square unless it is to stay; judged again as it is written then."""
    certificate = found.certificate
    cones = {int(v): int(k) for v, k in certificate.quarter_cones}
    if not options["surface_scale"]:
        low = found.uv64.min(axis=(0, 1))
        extent = float((found.uv64.max(axis=(0, 1)) - low).max())
        uv = (found.uv64 - low) * 2.0 ** -math.ceil(
            math.log2(extent)
        )  # on a grid: nothing is rounded
        stored = uv.astype(np.float32)
        certificate = certify(
            found.vertices,
            found.faces,
            stored.astype(np.float64),
            seamless=True,
            cones={v: k * math.pi / 2 for v, k in cones.items()},
            threads=model.threads,
        )
        found = replace(found, uv=uv, uv64=uv, _uv32=stored)
    whole = clean.on_input(replace(found, certificate=certificate))
    return Solved(whole.certificate, whole, figures={"cones": len(cones)})


def field_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "--field",
        choices=("curvature", "smooth", "edges", "flow"),
        default="curvature",
        help="what the map's lines run along: edges at which the surface folds, the flow of quads",
    )
    parser.add_argument(
        "--curvature", type=numbers.real(0.0, 1.0), default=0.5, help="its weight, 0 to 1"
    )
    parser.add_argument(
        "--sharp-from", type=numbers.real(0.0, 180.0), default=30.0, help="degrees, for edges"
    )
    parser.add_argument("--keep-near-cones", action="store_true", help="that bend opposite ways")
    _seamless_arguments(parser, ("aligned_or_free", "aligned", "free"))


def field(model: Model, options: dict[str, Any]) -> Solved:
    clean = model.clean()
    sharp = None
    if options["field"] == "edges":
        sharp = _folds(clean, math.radians(options["sharp_from"]))
    elif options["field"] == "flow":
        sharp = clean.edges(_flow(model))
    freed = False
    try:
        found = _followed(model, clean, sharp, options, aligned=options["boundary"] != "free")
    except (InvalidInput, Infeasible, NotConverged):
        if options["boundary"] != "aligned_or_free" or not _is_open(clean):
            raise
        freed = True
        found = _followed(model, clean, sharp, options, aligned=False)
    solved = _placed(model, clean, found, options)
    solved.figures["degrees_off_field"] = math.degrees(found.stats["angle_mean"])
    if freed:
        solved.warnings.append(_FREE)
    if found.stats.get("enlarged_islands", 0):
        solved.warnings.append(_ENLARGED)
    return solved


def _followed(
    model: Model,
    clean: SeparatedSurface,
    sharp: IntArray | None,
    options: dict[str, Any],
    *,
    aligned: bool,
) -> Parametrization:
    direction = cross_field(
        clean.vertices,
        clean.faces,
        sharp_edges=sharp,
        alignment=min(options["curvature"], 0.99) if options["field"] == "curvature" else 0.0,
        boundary=aligned,
        simplify=not options["keep_near_cones"],
        **model.limits,
    )
    return field_aligned(
        clean.vertices,
        clean.faces,
        field=direction,
        boundary="aligned" if aligned else "free",
        optimise=not options["no_optimise"],
        uncuttable=clean.edges(model.diagonals),
        **model.limits,
    )


def _is_open(clean: SeparatedSurface) -> bool:
    sides = np.sort(np.concatenate([clean.faces[:, (k, (k + 1) % 3)] for k in range(3)]), axis=1)
    return bool((np.unique(sides, axis=0, return_counts=True)[1] == 1).any())


def _folds(clean: SeparatedSurface, angle: float) -> IntArray:
    """(s, 2) inner edges at which the surface folds by more."""
    corner = clean.vertices[clean.faces]
    normal = np.cross(corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0])
    normal /= np.maximum(np.linalg.norm(normal, axis=1, keepdims=True), 1e-300)
    sides = np.concatenate([clean.faces[:, (k, (k + 1) % 3)] for k in range(3)])
    face = np.tile(np.arange(len(clean.faces)), 3)
    pairs = np.sort(sides, axis=1)
    order = np.lexsort((pairs[:, 1], pairs[:, 0]))
    both = np.flatnonzero((pairs[order][1:] == pairs[order][:-1]).all(axis=1))
    left, right = order[both], order[both + 1]
    bent = np.einsum("ij,ij->i", normal[face[left]], normal[face[right]]) < math.cos(angle)
    return np.ascontiguousarray(pairs[left[bent]].astype(np.int32))


def _flow(model: Model) -> IntArray:
    """(s, 2) sides of the file's faces with four corners."""
    polygons = model.file.polygons
    quads = np.isin(polygons, np.flatnonzero(np.bincount(polygons) == 2))
    sides = np.concatenate([model.faces[quads][:, (k, (k + 1) % 3)] for k in range(3)])
    pairs = np.unique(np.sort(sides, axis=1), axis=0)
    inner = np.sort(model.diagonals, axis=1).astype(np.int64) @ np.array([1 << 32, 1])
    return pairs[~np.isin(pairs.astype(np.int64) @ np.array([1 << 32, 1]), inner)]
