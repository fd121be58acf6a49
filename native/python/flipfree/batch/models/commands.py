"""The commands of `python -m flipfree`: those that take any mesh (unwrap, improve, repair, pack, rectify, check) and those that
want a clean surface, which they make of what they get (embed, match, conformal, seamless, field, ...).

Solvers that want one connected surface get the parts one after the other; they are packed together at the end.
"""

import math
from dataclasses import replace
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np

import flipfree as ff

from ...calls.matching import edges_between_pins, held_by_pins
from ...checks import shown
from ...errors import bad_angles, bad_option, bad_pins
from ...points import split_edges
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
from ..plan import beside, field_files
from .model import (
    BOUND,
    Model,
    Solved,
    arguments,
    command,
    pins_of,
    read_model,
    refuse_unknown,
    taken,
)

#: As seams are where nobody asks for more than it takes to open a part.
_AS_GIVEN: dict[str, Any] = dict(
    seams="given", may_add_cuts=False, cut_extremities=False, effort=0.0
)

_FREE = "a boundary is free, as no map was found with one along the axes"
_ENLARGED = "parts too small beside the others for 32 bits are larger than in scale"
_MORE_QUADS = "whole numbers leave no mesh of so few quads: there are more"
# Edges at which a surface folds by more are sharp, where nobody says from where on.
_SHARP = math.radians(30.0)


@command(cure="--seams auto and a lower --stretch cut it further")
def unwrap(model: Model, options: dict[str, Any]) -> Solved:
    """islands onto the plane, packed

    --seams auto|given  auto: also where islands are closed, have handles, or would be stretched more than --stretch; given: no
        more than it takes to open them
    --stretch={stretch}  of automatic seams: lengths change by about this factor at most
    --keep-charts  cut where the file's charts end
    {overlaps}
    --no-new-cuts  crush islands that would lie on top of themselves rather than cut them
    --short-cuts  do not cut closed parts along legs and fingers
    {margin}
    {aspect}
    """
    found = model.call(
        ff.unwrap,
        cuts=model.seams if options["keep_charts"] else None,
        uncuttable=model.diagonals,
        polygons=model.file.polygons,
        **taken(options, "seams stretch bijective may_add_cuts cut_extremities margin"),
        effort=0.2 if options["aspect"] == 1.0 else 0.0,
    )
    if options["aspect"] != 1.0:  # as the texture shows the islands
        how = taken(options, "margin keep_bijective aspect")
        uv = found.uv / [options["aspect"], 1.0]
        packed = model.call(ff.pack, uv, scale_true=True, effort=0.2, **how)
        told = replace(packed.certificate, mends=found.certificate.mends)
        stats = {**found.stats, "fill": packed.stats["fill"]}
        found = found.at(packed, certificate=told, stats=stats)
    return Solved(found.certificate, found, figures={"islands": int(found.stats["charts"])})


@command()
def improve(model: Model, options: dict[str, Any]) -> Solved:
    """less distortion

    {overlaps}
    --iterations=200  most steps per island
    {aspect}
    """
    mesh = model.vertices, model.faces, model.uv()
    found = ff.improve(mesh, **taken(options, "keep_bijective iterations aspect"), **model.limits)
    return Solved(found.certificate, found)


@command()
def repair(model: Model, options: dict[str, Any]) -> Solved:
    """flips mended

    --overlaps cut|open|keep  what becomes of islands on themselves
    --stretched keep|improve  what becomes of islands drawn out much more than an unwrap of them is
    {margin}
    --move-apart  islands that lie on larger ones are put where there is room
    {aspect}
    """
    how = taken(options, "overlaps stretched margin aspect") | {"uncuttable": model.diagonals}
    uv = model.uv(whole=False)
    found = model.call(ff.repair, uv, disjoint=options["move_apart"], **how)
    told = {
        "islands": "charts",
        "stretched_islands": "stretched_charts",
        "improved_islands": "charts_improved",
        "islands_unwrapped_again": "charts_stretched_anew",
    }
    figures = {name: int(found.stats[stat]) for name, stat in told.items()}
    return Solved(found.certificate, found, figures=figures)


@command()
def pack(model: Model, options: dict[str, Any]) -> Solved:
    """islands nested into a tile

    {margin}
    --rotation straight|free|quarters|none
    --tile=1001  UDIM tile to pack into
    --tiles=1  UDIM tiles to spread islands over
    --effort=1  of the search
    --keep-sizes  islands keep their sizes relative to each other, not one texel density
    --stack-similar  islands of equal outline lie on top of each other
    --stack-mirrored  with it, mirror images too, mirrored
    {aspect}
    """
    names = "scale_true margin rotation stack_similar stack_mirrored tile tiles effort aspect"
    found = model.call(ff.pack, model.uv(), **taken(options, names))
    gap = f"The gap of {options['margin_pixels']:g} pixels (--margin-pixels) is not met everywhere."
    warnings = [] if found.stats.get("margin_met", 1) else [gap]
    return Solved(found.certificate, found, warnings, {"fill": float(found.stats["fill"])})


@command()
def rectify(model: Model, options: dict[str, Any]) -> Solved:
    """islands of quads as straight strips and grids

    {margin}
    {aspect}
    """
    uv = None if model.file.uv is None else model.uv()
    how = taken(options, "margin aspect")
    found = model.call(ff.rectify, uv, polygons=model.file.polygons, **how)
    return Solved(found.certificate, found, figures={"islands": int(found.stats["charts"])})


@command(writes=False)
def check(model: Model, options: dict[str, Any]) -> Solved:
    """the certificate of a map

    --allow-stacked  islands may lie on each other
    {aspect}
    """
    how = taken(options, "disjoint aspect")
    certificate = model.call(ff.certify, model.uv(), bijective=True, mirrored="islands", **how)
    return Solved(certificate)


def _judged(model: Model, clean: ff.SeparatedSurface, found: Any, **how: Any) -> Solved:
    """A map of the clean surface, judged as a whole, as one of the input."""
    told = ff.certify(found.vertices, found.faces, found.uv, threads=model.threads, **how)
    whole = clean.on_input(replace(found, certificate=told))
    return Solved(whole.certificate, whole)


@command(cure="--optimise, or a boundary more like the part's own")
def embed(model: Model, options: dict[str, Any]) -> Solved:
    """disks onto a convex polygon

    --boundary circle|square|triangle|pinned  pinned: straight between boundary points of the file with the pins
    --method ladder|progressive|tutte
    --optimise  lower the distortion, with the boundary held
    --no-pack  all parts lie around the origin
    {margin}
    """
    own = options["boundary"] == "pinned"
    clean = model.clean()
    points = pins_of(model, clean).points if own else {}

    def solve(vertices: FloatArray, faces: IntArray, used: IntArray) -> ff.Parametrization:
        how = taken(options, "boundary method optimise")
        if own:
            corners = {i: points[v] for i, v in enumerate(used.tolist()) if v in points}
            how |= dict(boundary="corners", corners=corners)
        return ff.embed(vertices, faces, **how, **model.limits)

    found = each_part(clean, solve)
    if not (own or options["no_pack"]):
        found = _packed(model, found, options, together=False)
    return _judged(model, clean, found, pins=points)


def _packed(
    model: Model, found: ff.Parametrization, options: dict[str, Any], *, together: bool
) -> ff.Parametrization:
    how = taken(options, "margin") | dict(together=together, scale_true=True)
    return found.at(model.call(ff.pack, found.uv, on=found, **how))


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
    vertices, vertex_origin = clean.vertices[origin], clean.vertex_origin[origin]
    cut = replace(clean, vertices=vertices, faces=faces, vertex_origin=vertex_origin)
    return cut, clean.vertex_origin[every]


def _refuse_split_cuts(
    clean: ff.SeparatedSurface, found: ff.Parametrization, cuts: IntArray
) -> None:
    """The two sides of a cut are mapped each by itself, so that a vertex added on one is missing on the other."""
    ends = split_edges(found, len(clean.vertices), clean.vertex_origin[clean.faces])
    split = ends[np.isin(edge_keys(ends), edge_keys(cuts))]
    if len(split):
        raise bad_pins(
            f"The pins cannot be met without splitting the cut edge {shown(split[0].tolist())} on one side only. Move pins away "
            "from it, or cut the part elsewhere yourself."
        )


@command(cure="move pins nearer to where their surroundings are")
def match(model: Model, options: dict[str, Any]) -> Solved:
    """pins met exactly

    {overlaps}
    --no-new-vertices  refuse pins that cannot be met by the mesh as it is
    --bend-lines  edges between two pins need not stay straight
    --cut-open  cut parts with pins that are closed or have handles
    --unwrap-rest  unwrap parts without pins, beside the others
    {aspect}
    """
    clean, cuts = model.clean(), np.zeros((0, 2), np.int32)
    pins = pins_of(model, clean)
    if options["cut_open"]:
        clean, cuts = _cut_open(model, clean, pins.points)
        pins = pins_of(model, clean)
    diagonals = edge_keys(clean.edges(model.diagonals))
    held: list[int] = []  # vertices of parts with pins

    def solve(vertices: FloatArray, faces: IntArray, used: IntArray) -> ff.Parametrization:
        own = pins.renumbered({v: i for i, v in enumerate(used.tolist())})
        if not (own.points or own.lines or own.outline):
            if options["unwrap_rest"]:
                rest = ff.unwrap(vertices, faces, **_AS_GIVEN, **model.limits)
                return replace(rest, uv=rest.uv / [options["aspect"], 1.0])
            where = clean.vertex_origin[used[0]]
            raise bad_pins(
                f"The part with vertex {where} has no pins. Give it some, or --unwrap-rest."
            )
        held.extend(used.tolist())
        if not options["bend_lines"]:
            place = own.points | own.outline
            edges = np.unique(np.sort(sides(faces), axis=1), axis=0)
            edges = edges[~np.isin(edge_keys(used[edges]), diagonals)]
            told_sides = {frozenset(side) for vs, _ in own.lines for side in pairwise(vs)}
            own.lines += [
                ([a, b], np.array([place[a], place[b]]))
                for a, b in edges_between_pins(faces, edges, list(place), list(own.outline))
                if {a, b} not in told_sides
            ]
        met = ff.match(
            vertices,
            faces,
            points=own.points,
            lines=own.lines,
            boundary_loop=list(own.outline) or None,
            boundary_uv=list(own.outline.values()) or None,
            paths=own.paths,
            movable=own.movable,
            bijective=options["bijective"] and not own.outline,
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
        pinned[[*own.points, *own.outline, *(v for vs, _ in own.lines for v in vs)]] = True
        pinned[own.movable] = False
        # With its shape on the texture as far as the held ones leave it open.
        how = taken(options, "keep_bijective aspect") | model.limits
        shaped = ff.improve(met, pins=held_by_pins(met, faces, pinned), repair=False, **how)
        measured = met.certificate.provenance_failures
        told = replace(shaped.certificate, provenance_failures=measured)
        return met.at(shaped, certificate=told)

    found = each_part(clean, solve)
    _refuse_split_cuts(clean, found, cuts)
    if len(held) < len(clean.vertices):
        of_held = np.isin(clean.faces[found.parent_face, 0], held)
        unmoved = np.flatnonzero(np.repeat(of_held, 3)).astype(np.int32)
        how = taken(options, "keep_bijective aspect") | dict(unmoved=unmoved, scale_true=True)
        found = found.at(model.call(ff.pack, found.uv, on=found, **how))
    kept = {v: uv for v, uv in pins.outline.items() if v not in pins.movable}
    bijective = options["bijective"] and not pins.outline
    how = dict(pins=pins.points | kept, bijective=bijective, aspect=options["aspect"])
    return _judged(model, clean, found, **how)


@command()
def transfer(model: Model, options: dict[str, Any]) -> Solved:
    """one surface in the shape of another, through their maps

    --source=''  model whose shape is taken, at the same places of its map
    """
    # The file's mesh with every vertex on the other surface (thesis 3.4.1).
    if not options["source"]:
        raise bad_option("--source names no model. Say whose shape is taken.")
    other = read_model(Path(options["source"]), merge=not options["no_merge"], **model.limits)
    there = ff.compose(*((m.vertices, m.faces, m.uv()) for m in (model, other)))
    face, weights = there.map_corners()
    places = np.einsum("mcw,mcwd->mcd", weights, other.vertices[other.faces[face]])
    vertices = model.vertices.copy()
    vertices[model.file.faces] = places
    return Solved(there.first.certificate, replace(model.file, vertices=vertices))


@command(cure="more cones even it out: --cones suggested with a lower --bound")
def conformal(model: Model, options: dict[str, Any]) -> Solved:
    """maps without shear

    --cones auto|suggested|none  auto: of the file beside the model, else suggested for closed parts
    --boundary free|straight|circle
    --refined-start auto|on|off  metric of a surface without needles
    --bound=4  of the scale, for suggested cones
    --precision=auto  bits of the metric's numbers, 53 to 4096, or auto
    {margin}
    """
    clean = model.clean()
    cones = _cones(model, clean) if options["cones"] == "auto" else {}
    precision, refined = options["precision"] or "auto", options["refined_start"]

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
            shape = options["boundary"]
            angles = ff.boundary_angles(vertices, faces, shape, cones=own, **model.limits)
        how = dict(precision=precision, intrinsic_refinement=refined) | model.limits
        return ff.conformal(vertices, faces, angles, **how)

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


@command()
def cones(model: Model, options: dict[str, Any]) -> Solved:
    """suggested cones, into a file beside the output

    --bound=4  of the scale
    --quarter-turns  angles in multiples of 90 degrees
    """
    clean = model.clean()
    found, ratio, holds = _suggested(model, clean, options["bound"], options["quarter_turns"])
    told = {str(clean.vertex_origin[v]): angle for v, angle in found.items()}
    warnings = [] if holds else [f"The bound {options['bound']:g} is not reached."]
    figures = {"cones": len(told), "scale_ratio": ratio}
    return Solved(None, model.file, warnings, figures, {"cones": told})


@command()
def cut(model: Model, options: dict[str, Any]) -> Solved:
    """closed surfaces cut into disks with right angles

    --follow cones|field  those of the file beside the model; or also the turns of the smoothest field with these, or of a
        signature there
    """
    clean = model.clean()
    quarters = _quarters(clean, _cones(model, clean))
    field = None
    if options["follow"] == "field":
        path = beside(model.source, "signature")
        wanted = ff.Signature.read(path) if path.exists() else ff.Signature(quarters, [])
        field = model.call(ff.cross_field, on=clean, signature=wanted)
    found = model.call(ff.admissible_cut, None if field else quarters, on=clean, field=field)
    told = {
        "branches": [branch.tolist() for branch in found.branches],
        "corners": found.corners.tolist(),
        "flat": found.flat.tolist(),
    }
    figures = {"branches": len(found.branches), "corners": len(found.corners)}
    return Solved(None, (found.vertices, found.faces), [], figures, {"cut": told})


def _numbers_at(model: Model, clean: ff.SeparatedSurface, kind: str, what: str) -> dict[int, float]:
    """{vertex: number} of the file of that kind beside the model, at all copies of the vertices."""
    try:
        numbers_at = {int(v): float(number) for v, number in (model.told(kind) or {}).items()}
    except (TypeError, ValueError):
        bad = bad_angles if kind == "cones" else bad_option
        words = f'The file with the {kind} must hold {{"vertex": {what}, ...}}. Correct it.'
        raise bad(words) from None
    refuse_unknown(clean, numbers_at)
    return clean.copies(numbers_at)


def _cones(model: Model, clean: ff.SeparatedSurface) -> dict[int, float]:
    """{vertex: angle} of the file beside the model, which has degrees."""
    told = _numbers_at(model, clean, "cones", "degrees")
    return {v: math.radians(angle) for v, angle in told.items()}


def _is_closed(faces: IntArray) -> bool:
    return bool(
        (np.unique(np.sort(sides(faces), axis=1), axis=0, return_counts=True)[1] == 2).all()
    )


@command(cure="more cones, in the file beside the model, even it out")
def seamless(model: Model, options: dict[str, Any]) -> Solved:
    """seams match by quarters

    --cones auto|suggested  auto: of the file beside the model, else suggested
    --bound={bound}  of the scale, for suggested cones
    {aligned}
    {placed}
    """
    clean = model.clean()
    quarters = _quarters(clean, _cones(model, clean) if options["cones"] == "auto" else {})
    if not quarters and options["bound"] != BOUND:
        suggested, _, _ = _suggested(model, clean, options["bound"], True)
        quarters = {v: round(angle / 90.0) for v, angle in suggested.items()}
    how = taken(options, "engine boundary optimise") | {"uncuttable": clean.edges(model.diagonals)}
    found = model.call(ff.seamless, quarters or None, on=clean, **how)
    freed = bool(found.stats.get("freed_boundaries", 0))
    return _placed(model, clean, found, options, freed)


def _quarters(clean: ff.SeparatedSurface, cones: dict[int, float]) -> dict[int, int]:
    quarters = {v: round(angle / (math.pi / 2)) for v, angle in cones.items()}
    for v, angle in cones.items():
        if abs(quarters[v] - angle / (math.pi / 2)) > 1e-9 or quarters[v] < 1:
            raise bad_angles(
                f"Vertex {clean.vertex_origin[v]} has a cone of {math.degrees(angle):g} degrees, no multiple of 90. Correct it."
            )
    return quarters


def _placed(
    model: Model, clean: ff.SeparatedSurface, found: ff.Parametrization, options: Any, freed: bool
) -> Solved:
    """In the unit square unless it is to stay; judged again as it is written then."""
    cones = dict(found.certificate.quarter_cones.tolist())
    warnings = [_FREE] * freed + [_ENLARGED] * bool(found.stats.get("enlarged_islands", 0))
    points = pins_of(model, clean).points if options["meet_pins"] else {}
    if not options["surface_scale"]:
        stored = in_unit_square(found.uv64).astype(np.float32)
        uv = stored.astype(np.float64)
        found = replace(found, uv=uv, uv64=uv, _uv32=stored)
    if points or options["surface_scale"]:
        found = found.with_pins(points, **model.limits) if points else found
        whole = clean.on_input(found)
        solved = Solved(whole.certificate, whole)
    else:
        angles = {v: k * math.pi / 2 for v, k in cones.items()}
        solved = _judged(model, clean, found, seamless=True, cones=angles)
    return replace(solved, warnings=warnings, figures={"cones": len(cones)})


def _along_field(
    model: Model, clean: ff.SeparatedSurface, options: dict[str, Any]
) -> tuple[ff.Parametrization, bool, Any]:
    """(map, whether its boundary is free though it was to be aligned, edges that shall be lines of it)."""
    wanted = options["field"]
    field_told = wanted in ("cones", "file", "signature")
    told = _told_field(model, clean, options) if field_told else None
    sharp = None
    if wanted == "edges":
        sharp = folds(clean.vertices, clean.faces, math.radians(options["sharp_from"]))
    elif wanted == "flow":
        sharp = _flow(model, clean)
    exact = options["edge_weight"] == 1.0 and options["optimise"] and not options["meet_pins"]
    features = sharp if wanted == "edges" and exact else None
    made: dict[str, Any] = dict(
        sharp_edges=sharp,
        edge_weight=options["edge_weight"],
        alignment=min(options["curvature"], 0.99) if wanted == "curvature" else 0.0,
        signature=told,
        simplify=not (options["keep_near_cones"] or field_told),
    )
    how = taken(options, "engine reroute optimise") | {"uncuttable": clean.edges(model.diagonals)}

    def follow(aligned: bool) -> ff.Parametrization:
        direction = told
        if not isinstance(told, ff.CrossField):
            direction = model.call(ff.cross_field, on=clean, boundary=aligned, **made)
        how["boundary"] = "aligned" if aligned else "free"
        return model.call(ff.field_aligned, on=clean, field=direction, features=features, **how)

    try:
        return follow(options["boundary"] != "free"), False, features
    except (ff.InvalidInput, ff.Infeasible, ff.NotConverged):
        if options["boundary"] != "aligned_or_free" or _is_closed(clean.faces):
            raise
    return follow(False), True, features


@command(cure="a finer mesh or another field follows the surface better")
def field(model: Model, options: dict[str, Any]) -> Solved:
    """seamless, along a field

    --field curvature|smooth|edges|flow|cones|file|signature  what the map's lines run along: edges at which the surface folds,
        the flow of quads; a field in a file beside the model (.rawfield, .ffield, .rotation); its cones, or its signature, of
        such a file
    --field-file=''  with field or signature, instead of that beside the model
    {along}
    --edge-weight=1  of edges, 0.01 to 1
    --keep-near-cones  that bend opposite ways
    --no-reroute  of padding: loops turn as they happen to
    {aligned}
    {placed}
    """
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


@command(cure="more tiles, or a finer mesh, follow the surface better")
def tiles(model: Model, options: dict[str, Any]) -> Solved:
    """textures that repeat run on through seams

    --tile-count=100  about how many cover the model
    --tile-size=0  length of a tile's side, instead
    --field curvature|smooth|edges|flow|map  what its lines run along; map: the file's own UVs, seamless, are fitted
    --no-prefer-translations  seams that turn stay, however long
    {along}
    {aligned}
    """
    clean = model.clean()
    options = arguments(options | _OF_FIELD)
    freed, features = False, None
    if options["field"] == "map":
        if model.file.uv is None:
            raise bad_option(f"{model.source} has no UVs. Choose another field.")
        given: Any = (clean.vertices, clean.faces, clean.corners(model.uv()))
    else:
        given, freed, features = _along_field(model, clean, options)
    a, b, c = clean.vertices[clean.faces].swapaxes(0, 1)
    area = 0.5 * float(np.linalg.norm(np.cross(b - a, c - a), axis=1).sum())
    side = options["tile_size"] or math.sqrt(area / options["tile_count"])
    how = taken(options, "prefer_translations") | model.limits
    found = ff.fit_tiles(given, tile=side, features=features, **how)
    solved = _placed(model, clean, found, options, freed)
    told = "tile tiles seams seams_quarter seams_half seams_matched"
    solved.figures.update(taken(found.stats, told))
    return solved


@command()
def quads(model: Model, options: dict[str, Any]) -> Solved:
    """a mesh of quads

    --target=2000  about how many quads
    --edge-length=0  of their sides, instead
    --field automatic|curvature|smooth|edges|flow  what the edges of quads run along
    --adaptive=0  0 to 100, how much denser quads are where the surface bends more
    --symmetry none|x|y|z  the half on the positive side of the axis becomes quads and is mirrored, along a field of its own or
        edges
    """
    clean = model.clean()
    wanted, symmetry = options["field"], options["symmetry"]
    told_density = _numbers_at(model, clean, "density", "number")
    density = np.ones(len(clean.vertices)) if told_density else None
    if density is not None:
        density[list(told_density)] = list(told_density.values())
    sharp = folds(clean.vertices, clean.faces, _SHARP) if wanted == "edges" else None
    followed = None
    if wanted not in ("automatic", "edges") and symmetry == "none":
        flow = _flow(model, clean) if wanted == "flow" else None
        alignment = 0.5 if wanted == "curvature" else 0.0
        how: dict[str, Any] = dict(sharp_edges=flow, alignment=alignment, sizing=density)
        followed = model.call(ff.cross_field, on=clean, simplify=True, **how)
    length = options["edge_length"] or None
    found = model.call(
        ff.quads,
        on=clean,
        target=None if length else options["target"],
        edge_length=length,
        field=followed,
        features=sharp,
        adaptive=options["adaptive"],
        sizing=density,
        symmetry=None if symmetry == "none" else symmetry,
    )
    count, told = len(found.quads), found.certificate
    halves = np.array([[0, 1, 2], [0, 2, 3]])
    faces = found.quads[:, halves].reshape(-1, 3).astype(np.int32)
    polygons = np.repeat(np.arange(count, dtype=np.int32), 2)
    corners = (4 * np.arange(count)[:, None, None] + halves).reshape(-1, 3).astype(np.int32)
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
    file = ff.MeshFile(found.vertices, faces, None, polygons, corners)
    return Solved(None, file, warnings, figures)


def _told_field(
    model: Model, clean: ff.SeparatedSurface, options: dict[str, Any]
) -> ff.CrossField | ff.Signature:
    """The field, or what it shall have, of files beside the model or that the command line names."""
    if options["field"] == "cones":
        return ff.Signature(_quarters(clean, _cones(model, clean)), [])
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
