"""Commands that want a clean surface, which they make of what they get: embed, match, conformal, seamless, field.

Solvers that want one connected surface get the parts one after the other; they are packed together at the end.
"""

from __future__ import annotations

import math
from dataclasses import replace
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np

import flipfree as ff

from ...calls.matching import edges_between_pins, held_by_pins
from ...errors import bad_option, bad_pins
from ...results import FloatArray, IntArray
from ...separated import (
    each_part,
    edge_keys,
    edges_of_quads,
    folds,
    in_unit_square,
    parts_of,
    sides,
)
from ...texts import counted
from ..results import beside, field_files
from .any_mesh import with_aspect_of_pins
from .model import Model, Solved, arguments, read_model, taken
from .pins import lines_told, outline_told, pins_of, points_told, refuse_split_cuts, refuse_unknown

#: As seams are where nobody asks for more than it takes to open a part.
_AS_GIVEN: dict[str, Any] = dict(
    seams="given", may_add_cuts=False, cut_extremities=False, effort=0.0
)

#: Of the scale, in what ``seamless`` suggests.
BOUND = 2.0

_FREE = "a boundary is free, as no map was found with one along the axes"
_ENLARGED = "parts too small beside the others for 32 bits are larger than in scale"
_MORE_QUADS = "whole numbers leave no mesh of so few quads: there are more"
# Edges at which a surface folds by more are sharp, where nobody says from where on.
_SHARP = math.radians(30.0)


def embed(model: Model, options: dict[str, Any]) -> Solved:
    own = options["boundary"] == "pinned"
    clean = model.clean()
    points = points_told(model, clean, pins_of(model)) if own else {}

    def solve(vertices: FloatArray, faces: IntArray, used: IntArray) -> ff.Parametrization:
        how = taken(options, "boundary method optimise")
        if own:
            corners = {i: points[v] for i, v in enumerate(used.tolist()) if v in points}
            how |= dict(boundary="corners", corners=corners)
        return ff.embed(vertices, faces, **how, **model.limits)

    found = each_part(clean, solve)
    if not (own or options["no_pack"]):
        found = _packed(model, found, options, together=False)
    whole = clean.on_input(found)
    judged = ff.certify(found.vertices, found.faces, found.uv, pins=points, threads=model.threads)
    return Solved(replace(judged, mends=clean.mends), whole)


def _packed(
    model: Model, found: ff.Parametrization, options: dict[str, Any], *, together: bool
) -> ff.Parametrization:
    how = taken(options, "margin") | model.limits
    mesh = found.vertices, found.faces, found.uv
    return found.at(ff.pack(*mesh, together=together, scale_true=True, **how))


def _cut_open(
    model: Model, clean: ff.SeparatedSurface, points: dict[int, tuple[float, float]]
) -> tuple[ff.SeparatedSurface, IntArray]:
    """With parts that have pins, and are closed or have handles, cut; and (s, 2) the cuts, as vertex pairs of the input."""
    diagonals = clean.edges(model.diagonals)
    cuts = [np.zeros((0, 2), np.int32)]
    for _, used, own in parts_of(clean):
        if not np.isin(used, list(points)).any():
            continue
        whole = np.searchsorted(used, diagonals[np.isin(diagonals, used).all(axis=1)])
        how = _AS_GIVEN | model.limits
        opened = ff.unwrap(clean.vertices[used], own, uncuttable=whole, **how)
        cuts.append(used[opened.cut_edges].astype(np.int32))
    every = np.concatenate(cuts)
    faces, origin = ff.split_fans(clean.faces, cuts=every)
    cut = replace(
        clean,
        vertices=clean.vertices[origin],
        faces=faces,
        vertex_origin=clean.vertex_origin[origin],
    )
    return cut, clean.vertex_origin[every]


def match(model: Model, options: dict[str, Any]) -> Solved:
    told = pins_of(model)
    clean, cuts = model.clean(), np.zeros((0, 2), np.int32)
    if options["cut_open"]:
        clean, cuts = _cut_open(model, clean, points_told(model, clean, told))
    points, lines = points_told(model, clean, told), lines_told(model, clean, told)
    outline, paths, movable = outline_told(model, clean, told)
    diagonals = edge_keys(clean.edges(model.diagonals))
    held: list[int] = []  # vertices of parts with pins

    def solve(vertices: FloatArray, faces: IntArray, used: IntArray) -> ff.Parametrization:
        number = {v: i for i, v in enumerate(used.tolist())}
        own = {number[v]: uv for v, uv in points.items() if v in number}
        own_lines = [([number[v] for v in vs], uv) for vs, uv in lines if vs[0] in number]
        own_loop = [number[v] for v in outline if v in number]
        if not own and not own_lines and not own_loop:
            if options["unwrap_rest"]:
                rest = ff.unwrap(vertices, faces, **_AS_GIVEN, **model.limits)
                return replace(rest, uv=rest.uv / [options["aspect"], 1.0])
            where = clean.vertex_origin[used[0]]
            raise bad_pins(
                f"The part with vertex {where} has no pins. Give it some, or --unwrap-rest."
            )
        held.extend(used.tolist())
        if not options["bend_lines"]:
            place = own | {number[v]: uv for v, uv in outline.items() if v in number}
            edges = np.unique(np.sort(sides(faces), axis=1), axis=0)
            edges = edges[~np.isin(edge_keys(used[edges]), diagonals)]
            told_sides = {frozenset(side) for vs, _ in own_lines for side in pairwise(vs)}
            own_lines += [
                ([a, b], np.array([place[a], place[b]]))
                for a, b in edges_between_pins(faces, edges, list(place), own_loop)
                if {a, b} not in told_sides
            ]
        met = ff.match(
            vertices,
            faces,
            points=own,
            lines=own_lines,
            boundary_loop=own_loop or None,
            boundary_uv=[outline[v] for v in outline if v in number] if own_loop else None,
            paths={
                number[v]: [number[w] for w in path] for v, path in paths.items() if v in number
            },
            movable=[number[v] for v in movable if v in number],
            bijective=options["bijective"] and not own_loop,
            **model.limits,
        )
        added = len(met.vertices) - len(vertices)
        if added and options["no_new_vertices"]:
            raise bad_pins(
                f"The pins cannot be met without {counted(added, 'new vertex', 'new vertices')}. Allow them, or move pins "
                "nearer to where their surroundings are."
            )
        if options["aspect"] == 1.0:
            return met
        pinned = np.zeros(len(vertices), bool)
        pinned[[*own, *own_loop, *(v for vs, _ in own_lines for v in vs)]] = True
        pinned[[number[v] for v in movable if v in number]] = False
        return with_aspect_of_pins(model, met, held_by_pins(met, faces, pinned), options)

    found = each_part(clean, solve)
    refuse_split_cuts(clean, found, cuts)
    if len(held) < len(clean.vertices):
        of_held = np.isin(clean.faces[found.parent_face, 0], held)
        beside_held = ff.pack(
            found.vertices,
            found.faces,
            found.uv,
            unmoved=np.flatnonzero(np.repeat(of_held, 3)).astype(np.int32),
            scale_true=True,
            **taken(options, "keep_bijective aspect"),
            **model.limits,
        )
        found = found.at(beside_held)
    whole = clean.on_input(found)
    judged = ff.certify(
        found.vertices,
        found.faces,
        found.uv,
        pins={**points, **{v: uv for v, uv in outline.items() if v not in movable}},
        bijective=options["bijective"] and not outline,
        aspect=options["aspect"],
        threads=model.threads,
    )
    return Solved(replace(judged, mends=clean.mends), whole)


def transfer(model: Model, options: dict[str, Any]) -> Solved:
    """The file's mesh with every vertex on the other surface (thesis 3.4.1)."""
    if not options["source"]:
        raise bad_option("--source names no model. Say whose shape is taken.")
    other = read_model(Path(options["source"]), merge=not options["no_merge"], **model.limits)
    there = ff.compose(*((m.vertices, m.faces, m.uv()) for m in (model, other)))
    face, weights = there.map_corners()
    places = np.einsum("mcw,mcwd->mcd", weights, other.vertices[other.faces[face]])
    vertices = model.vertices.copy()
    vertices[model.file.faces] = places
    return Solved(there.first.certificate, replace(model.file, vertices=vertices))


def conformal(model: Model, options: dict[str, Any]) -> Solved:
    clean = model.clean()
    cones = clean.copies(_cones(model)) if options["cones"] == "auto" else {}

    def solve(vertices: FloatArray, faces: IntArray, used: IntArray) -> ff.Parametrization:
        own = {i: cones[v] for i, v in enumerate(used.tolist()) if v in cones}
        closed = _is_closed(faces)
        angles: Any
        if options["cones"] == "suggested" or (closed and not own and options["cones"] == "auto"):
            angles = ff.suggest_cones(vertices, faces, bound=options["bound"], **model.limits)
        elif closed:
            angles = np.full(len(vertices), 2 * math.pi)
            angles[list(own)] = list(own.values())
        else:
            angles = ff.boundary_angles(
                vertices, faces, options["boundary"], cones=own, **model.limits
            )
        return ff.conformal(
            vertices,
            faces,
            angles,
            precision=options["precision"] or "auto",
            intrinsic_refinement=options["refined_start"],
            **model.limits,
        )

    found = each_part(clean, solve)
    whole = clean.on_input(_packed(model, found, options, together=True))
    return Solved(whole.certificate, whole)


def _suggested(
    model: Model, clean: ff.SeparatedSurface, bound: float, quarter_turns: bool
) -> tuple[dict[int, float], float, bool]:
    """{vertex of the clean surface: degrees} over all parts, the largest ratio of scales of one, and whether the bound holds."""
    found: dict[int, float] = {}
    ratio, holds = 1.0, True
    wanted: dict[str, Any] = dict(bound=bound, quarter_turns=quarter_turns)
    for _, used, faces in parts_of(clean):
        angles = ff.suggest_cones(clean.vertices[used], faces, **wanted, **model.limits)
        degrees = np.degrees(angles[angles.cones])
        if quarter_turns:
            degrees = 90.0 * np.rint(degrees / 90.0)
        found |= dict(zip(used[angles.cones].tolist(), degrees.tolist(), strict=True))
        ratio, holds = max(ratio, angles.scale_ratio), holds and angles.bound_holds
    return found, ratio, holds


def cones(model: Model, options: dict[str, Any]) -> Solved:
    clean = model.clean()
    found, ratio, holds = _suggested(model, clean, options["bound"], options["quarter_turns"])
    told = {str(clean.vertex_origin[v]): angle for v, angle in found.items()}
    warnings = [] if holds else [f"The bound {options['bound']:g} is not reached."]
    figures = {"cones": len(told), "scale_ratio": ratio}
    return Solved(None, model.file, warnings, figures, {"cones": told})


def cut(model: Model, options: dict[str, Any]) -> Solved:
    clean = model.clean()
    quarters = _quarters(clean, clean.copies(_cones(model)))
    field = None
    if options["follow"] == "field":
        path = beside(model.source, "signature")
        wanted = ff.Signature.read(path) if path.exists() else ff.Signature(quarters, [])
        field = ff.cross_field(clean.vertices, clean.faces, signature=wanted, **model.limits)
    found = ff.admissible_cut(
        clean.vertices, clean.faces, None if field else quarters, field=field, **model.limits
    )
    told = {
        "branches": [branch.tolist() for branch in found.branches],
        "corners": found.corners.tolist(),
        "flat": found.flat.tolist(),
    }
    figures = {"branches": len(found.branches), "corners": len(found.corners)}
    return Solved(None, (found.vertices, found.faces), [], figures, {"cut": told})


def _numbers_at(model: Model, kind: str, what: str) -> dict[int, float]:
    """{vertex: number} of the file of that kind beside the model."""
    try:
        numbers_at = {int(v): float(number) for v, number in (model.told(kind) or {}).items()}
    except (TypeError, ValueError):
        raise ff.InvalidInput(
            f'The file with the {kind} must hold {{"vertex": {what}, ...}}. Correct it.',
            code="bad angles" if kind == "cones" else "bad option",
        ) from None
    refuse_unknown(model, numbers_at)
    return numbers_at


def _cones(model: Model) -> dict[int, float]:
    """{vertex: angle} of the file beside the model, which has degrees."""
    return {v: math.radians(angle) for v, angle in _numbers_at(model, "cones", "degrees").items()}


def _density(model: Model, clean: ff.SeparatedSurface) -> FloatArray | None:
    """Per vertex, 1 where the file beside the model says nothing; None where there is none."""
    told = clean.copies(_numbers_at(model, "density", "number"))
    density = np.ones(len(clean.vertices))
    density[list(told)] = list(told.values())
    return density if told else None


def _is_closed(faces: IntArray) -> bool:
    return bool(
        (np.unique(np.sort(sides(faces), axis=1), axis=0, return_counts=True)[1] == 2).all()
    )


def seamless(model: Model, options: dict[str, Any]) -> Solved:
    clean = model.clean()
    cones = clean.copies(_cones(model)) if options["cones"] == "auto" else {}
    quarters = _quarters(clean, cones)
    if not quarters and options["bound"] != BOUND:
        suggested, _, _ = _suggested(model, clean, options["bound"], True)
        quarters = {v: round(angle / 90.0) for v, angle in suggested.items()}
    found = ff.seamless(
        clean.vertices,
        clean.faces,
        quarters or None,
        **taken(options, "engine boundary optimise"),
        uncuttable=clean.edges(model.diagonals),
        **model.limits,
    )
    freed = bool(found.stats.get("freed_boundaries", 0))
    return _placed(model, clean, found, options, freed)


def _quarters(clean: ff.SeparatedSurface, cones: dict[int, float]) -> dict[int, int]:
    quarters = {v: round(angle / (math.pi / 2)) for v, angle in cones.items()}
    for v, angle in cones.items():
        if abs(quarters[v] - angle / (math.pi / 2)) > 1e-9 or quarters[v] < 1:
            raise ff.InvalidInput(
                f"Vertex {clean.vertex_origin[v]} has a cone of {math.degrees(angle):g} degrees, no multiple of 90. Correct it.",
                code="bad angles",
            )
    return quarters


def _placed(
    model: Model, clean: ff.SeparatedSurface, found: ff.Parametrization, options: Any, freed: bool
) -> Solved:
    """In the unit square unless it is to stay; judged again as it is written then."""
    certificate = found.certificate
    cones = {int(v): int(k) for v, k in certificate.quarter_cones}
    enlarged = bool(found.stats.get("enlarged_islands", 0))
    points = points_told(model, clean, pins_of(model)) if options["meet_pins"] else {}
    if not options["surface_scale"]:
        uv = in_unit_square(found.uv64)
        stored = uv.astype(np.float32)
        found = replace(found, uv=uv, uv64=uv, _uv32=stored)
    if points:
        found = found.with_pins(points, **model.limits)
        certificate = found.certificate
    elif not options["surface_scale"]:
        certificate = ff.certify(
            found.vertices,
            found.faces,
            stored.astype(np.float64),
            seamless=True,
            cones={v: k * math.pi / 2 for v, k in cones.items()},
            threads=model.threads,
        )
    whole = clean.on_input(replace(found, certificate=certificate))
    warnings = [_FREE] * freed + [_ENLARGED] * enlarged
    return Solved(whole.certificate, whole, warnings, {"cones": len(cones)})


def _along_field(
    model: Model, clean: ff.SeparatedSurface, options: dict[str, Any]
) -> tuple[ff.Parametrization, bool, Any]:
    """(map, whether its boundary is free though it was to be aligned, edges that shall be lines of it)."""
    field_told = options["field"] in ("cones", "file", "signature")
    told = _told_field(model, clean, options) if field_told else None
    sharp = None
    if options["field"] == "edges":
        angle = math.radians(options["sharp_from"])
        sharp = folds(clean.vertices, clean.faces, angle)
    elif options["field"] == "flow":
        sharp = _flow(model, clean)

    exact = options["edge_weight"] == 1.0 and options["optimise"] and not options["meet_pins"]
    features = sharp if options["field"] == "edges" and exact else None

    def follow(aligned: bool) -> ff.Parametrization:
        direction = (
            told
            if isinstance(told, ff.CrossField)
            else ff.cross_field(
                clean.vertices,
                clean.faces,
                sharp_edges=sharp,
                edge_weight=options["edge_weight"],
                alignment=min(options["curvature"], 0.99)
                if options["field"] == "curvature"
                else 0.0,
                boundary=aligned,
                signature=told,
                simplify=not (options["keep_near_cones"] or field_told),
                **model.limits,
            )
        )
        return ff.field_aligned(
            clean.vertices,
            clean.faces,
            field=direction,
            boundary="aligned" if aligned else "free",
            **taken(options, "engine reroute optimise"),
            features=features,
            uncuttable=clean.edges(model.diagonals),
            **model.limits,
        )

    freed = False
    try:
        found = follow(options["boundary"] != "free")
    except (ff.InvalidInput, ff.Infeasible, ff.NotConverged):
        if options["boundary"] != "aligned_or_free" or _is_closed(clean.faces):
            raise
        freed = True
        found = follow(False)
    return found, freed, features


def field(model: Model, options: dict[str, Any]) -> Solved:
    clean = model.clean()
    found, freed, features = _along_field(model, clean, options)
    solved = _placed(model, clean, found, options, freed)
    if features is not None:
        solved.figures["sharp_edges"] = found.certificate.feature_edges
        solved.figures["sharp_edges_missed"] = len(found.certificate.features_missed)
    solved.figures["degrees_off_field"] = math.degrees(found.stats["angle_mean"])
    return solved


#: Options of a map along a field that tiles do not have.
_OF_FIELD: dict[str, Any] = {
    **dict.fromkeys(("keep_near_cones", "meet_pins", "no_optimise", "no_reroute"), False),
    **dict(edge_weight=1.0, engine="auto", field_file="", surface_scale=True),
}


def tiles(model: Model, options: dict[str, Any]) -> Solved:
    clean = model.clean()
    options = arguments(options | _OF_FIELD)
    freed, features = False, None
    if options["field"] == "map":
        if model.file.uv is None:
            raise bad_option(f"{model.source} has no UVs. Choose another field.")
        given: Any = (clean.vertices, clean.faces, clean.corners(model.uv()))
    else:
        given, freed, features = _along_field(model, clean, options)
    corner = clean.vertices[clean.faces]
    twice = np.linalg.norm(
        np.cross(corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0]), axis=1
    )
    side = options["tile_size"] or math.sqrt(0.5 * float(twice.sum()) / options["tile_count"])
    how = taken(options, "prefer_translations") | model.limits
    found = ff.fit_tiles(given, tile=side, features=features, **how)
    solved = _placed(model, clean, found, options, freed)
    told = ("tile", "tiles", "seams", "seams_quarter", "seams_half", "seams_matched")
    solved.figures.update({name: found.stats[name] for name in told})
    return solved


def quads(model: Model, options: dict[str, Any]) -> Solved:
    clean = model.clean()
    wanted = options["field"]
    followed = None
    density = _density(model, clean)
    sharp = folds(clean.vertices, clean.faces, _SHARP) if wanted == "edges" else None
    symmetry = None if options["symmetry"] == "none" else options["symmetry"]
    if wanted not in ("automatic", "edges") and symmetry is None:
        followed = ff.cross_field(
            clean.vertices,
            clean.faces,
            sharp_edges=_flow(model, clean) if wanted == "flow" else None,
            alignment=0.5 if wanted == "curvature" else 0.0,
            sizing=density,
            simplify=True,
            **model.limits,
        )
    length = options["edge_length"] or None
    found = ff.quads(
        clean.vertices,
        clean.faces,
        target=None if length else options["target"],
        edge_length=length,
        field=followed,
        features=sharp,
        adaptive=options["adaptive"],
        sizing=density,
        symmetry=symmetry,
        **model.limits,
    )
    count = len(found.quads)
    halves = np.array([[0, 1, 2], [0, 2, 3]])
    file = ff.MeshFile(
        found.vertices,
        found.quads[:, halves].reshape(-1, 3).astype(np.int32),
        None,
        np.repeat(np.arange(count, dtype=np.int32), 2),
        (4 * np.arange(count)[:, None, None] + halves).reshape(-1, 3).astype(np.int32),
    )
    told = found.certificate
    figures = {
        "quads": count,
        "irregular": len(told.irregular),
        "turned_quads": len(told.turned),
        "hausdorff": told.hausdorff,
    }
    if sharp is not None:
        figures["sharp_edges"] = len(sharp)
        figures["sharp_edges_missed"] = found.stats["features_missed"]
    warnings = [_MORE_QUADS] * bool(found.stats.get("count_raised", 0))
    return Solved(None, file, warnings, figures)


def _told_field(
    model: Model, clean: ff.SeparatedSurface, options: dict[str, Any]
) -> ff.CrossField | ff.Signature:
    """The field, or what it shall have, of files beside the model or that the command line names."""
    if options["field"] == "cones":
        return ff.Signature(_quarters(clean, clean.copies(_cones(model))), [])
    if clean.mends:
        raise bad_option(
            f"{model.source} is no clean surface ({clean.mends[0].what}), and the file is about its own triangles. Clean it."
        )
    of_signature = options["field"] == "signature"
    places = [beside(model.source, "signature")] if of_signature else field_files(model.source)
    found = options["field_file"] or next(filter(Path.exists, places), None)
    if found is None:
        names = ", ".join(place.name for place in places)
        raise bad_option(
            f"{names}: nothing of that name lies beside the model. Give it a {options['field']}."
        )
    if of_signature:
        return ff.Signature.read(found)
    return ff.CrossField.read(found, model.vertices, model.faces)


def _flow(model: Model, clean: ff.SeparatedSurface) -> IntArray:
    """(s, 2) sides of the file's faces with four corners."""
    inside = edge_keys(model.diagonals)
    return clean.edges(edges_of_quads(model.faces, model.file.polygons, inside))
