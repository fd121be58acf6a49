"""Disks onto convex polygons (thesis 3.2); pinned vertices, lines and whole boundaries met bit for bit (thesis 3.3)."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any, Unpack

import numpy as np

from .. import _native, checks, errors
from ..job import Job, Limits, StagedJob, Stages, job_of, solver_call, start_map
from ..points import of_pieces, split_edges
from ..results import Array, Flags, FloatArray, IntArray, Mesh, Parametrization
from ..separated import (
    SeparatedSurface,
    boundary_loops,
    combined,
    edge_keys,
    named_on_input,
    parts_of,
    sides,
    split_fans,
)
from .certification import certify
from .improving import improve

Points = Mapping[int, tuple[float, float]]
Lines = Sequence[tuple[Sequence[int], Any]]

SHAPES = ("circle", "square", "triangle", "corners")


def _on_polygon(mesh: Mesh, corners: Any) -> tuple[IntArray, FloatArray]:
    """The boundary's vertices in order, the surface on the left, and their places: corners {vertex: (u, v)} where they are
    given, the others on straight sides between these, by length."""
    given = checks.as_vertex_places(corners, "corners")
    if len(given) < 3:
        raise errors.bad_boundary("corners must name three vertices of the boundary at least.")
    if mesh.faces.min(initial=0) < 0 or mesh.faces.max(initial=-1) >= len(mesh.scaled):
        return np.zeros(0, np.int32), np.zeros((0, 2))  # refused by name where the mesh is
    first = next(iter(given))
    loop = next((found for found in boundary_loops(mesh.faces) if first in found), [])
    lost = sorted(given.keys() - set(loop))
    if lost:
        raise errors.bad_boundary(
            f"corners names vertex {checks.shown(lost[0])}, which is not on the boundary that the others are on. Leave it out.",
            "vertex",
            lost[:1],
        )
    loop = loop[loop.index(first) :] + loop[: loop.index(first)]
    points = mesh.scaled[loop]
    along = np.append(0.0, np.cumsum(np.linalg.norm(np.roll(points, -1, axis=0) - points, axis=1)))
    places = [i for i, v in enumerate(loop) if v in given]
    targets = np.array([given[loop[i]] for i in [*places, places[0]]])
    at = along[[*places, len(loop)]]
    uv = np.stack([np.interp(along[:-1], at, targets[:, k]) for k in (0, 1)], axis=1)
    # Along u or v a side stays where its ends are, which may have more digits than are stored.
    along_axis = np.stack([np.isin(uv[:, k], targets[:, k]) for k in (0, 1)], axis=1)
    uv = np.where(along_axis, uv, uv.astype(np.float32))
    uv[places] = targets[:-1]
    return np.array(loop, np.int32), uv


@solver_call
def embed(
    vertices: Any,
    faces: Any,
    *,
    boundary: Any = "circle",
    boundary_loop: Any = None,
    corners: Any = None,
    initial_uv: Any = None,
    method: str = "ladder",
    start: str = "tutte",
    optimise: bool = False,
    iterations: int = 200,
    tolerance: float = 1e-4,
    **limits: Unpack[Limits],
) -> Job[Parametrization]:
    """A disk onto a convex polygon without flips, in 64 bits and as stored in 32.

    Inner edges between two points of one straight side of the polygon are split (``stats["added_vertices"]``);
    everything else keeps the given triangulation.

    Args:
        vertices: (n, 3) float64. faces: (m, 3), one disk, consistently oriented.
        boundary: "circle" (radius 1), "square" ([-1, 1]^2) or "triangle" (equilateral, circumradius 1), all around
            the origin, by arc length; "corners"; or (b, 2) positions of a convex polygon, kept bit for bit.
        boundary_loop: (b,) the boundary's vertex ids in order; default: from the smallest id, surface on the left.
        corners: for "corners": {boundary vertex: (u, v)}, three at least, that make a convex polygon; they are kept bit for
            bit, and the boundary runs straight between them, by arc length.
        initial_uv: (n, 2) start, may be invalid or random; boundary rows are ignored.
        method: "ladder" (Tutte, or the start that is given; where that flips by exact test, progressive embedding),
            "progressive" (the thesis' algorithm alone) or "tutte" (raises NotConverged if it flips).
        start: with method "progressive" and no initial_uv: "tutte" or "nothing".
        optimise: lower the distortion with the boundary fixed. iterations, tolerance: of that optimisation.
        max_seconds: of the clock; None or 0 is no limit. What was gained by then is kept, and
            ``stats["time_limit_reached"]`` is 1; NotConverged (code "time limit reached") if there is no map yet.
        threads: None is all cores; the result has the same bits for every number, unless a limit of time is reached.
        progress: called with (stage, fraction) about 20 times per second; returning False cancels.

    Returns:
        A certified map; ``stats["rung"]`` says which step of the ladder made it.

    Raises:
        InvalidInput, Infeasible (the polygon has no room in these numbers), NotConverged, Cancelled.
    """
    mesh, options = checks.checked(locals(), "optimise iterations tolerance method")
    loop = checks.as_optional_indices(boundary_loop, "boundary_loop")
    if corners is not None and not (isinstance(boundary, str) and boundary == "corners"):
        raise errors.bad_option(
            f"corners are for boundary='corners', not {checks.shown(boundary)}. Give one of them."
        )
    if isinstance(boundary, str):
        shape = checks.as_choice(boundary, "boundary", SHAPES, ", or an array of positions")
        if shape == "corners":
            loop, options["polygon"] = _on_polygon(mesh, corners)
        else:
            options["shape"] = shape
    else:
        options["polygon"] = checks.as_places(boundary, "boundary")
    if initial_uv is not None:
        options["initial"] = checks.as_floats(initial_uv, "initial_uv", 2)
    options |= dict(
        loop=loop,
        start_from_tutte=checks.as_choice(start, "start", ("tutte", "nothing")) == "tutte",
    )
    return start_map(_native.embed, mesh, options, limits)


def _lines(lines: Lines | None) -> list[tuple[IntArray, FloatArray]]:
    of, result = "a pair (vertices, polyline)", []
    for i, line in enumerate(checks.as_list(lines, "lines", f"a list, each {of}")):
        name = f"lines[{i}]"
        pair = checks.as_list(line, name, of)
        if len(pair) != 2:
            raise errors.bad_shape(f"{name} must be {of}.")
        result.append((checks.as_indices(pair[0], name), checks.as_places(pair[1], name)))
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
    **limits: Unpack[Limits],
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
    targets = checks.as_vertex_places(points, "points")
    chains = []
    for vertex, path in checks.as_vertex_map(paths, "paths", "[vertices to the boundary]").items():
        chain = checks.as_indices(path, f"paths[{checks.shown(vertex)}]")
        if len(chain) == 0 or chain[0] != vertex:
            chain = np.concatenate([checks.as_indices([vertex], "paths"), chain])
        chains.append(chain)
    if boundary_uv is None and boundary_loop is not None:
        raise errors.bad_boundary("boundary_loop is given without boundary_uv.")
    mesh, options = checks.checked(locals())
    options |= dict(
        points=(
            checks.as_indices(list(targets), "points"),
            np.array([*targets.values()]).reshape(-1, 2),
        ),
        lines=_lines(lines),
        boundary_loop=checks.as_optional_indices(boundary_loop, "boundary_loop"),
        boundary_uv=checks.as_places([] if boundary_uv is None else boundary_uv, "boundary_uv"),
        paths=chains,
    )
    return start_map(_native.match, mesh, options, limits)


def held_by_pins(
    found: Parametrization, faces: IntArray, pinned: Flags
) -> dict[int, tuple[float, float]]:
    """Of a map that met pins: its vertices that may not move any more, as pins. They are the pinned ones of the input, whose
    faces these are, and new ones on edges between two of them, which may be a line or a part of the boundary."""
    n = len(pinned)
    weights, corners = found.vertex_barycentric[n:], pinned[faces[found.vertex_parent[n:]]]
    between = ((weights == 0.0) | corners).all(axis=1) & (weights == 0.0).any(axis=1)
    held = np.flatnonzero(np.concatenate([pinned, between])).tolist()
    places = np.empty((len(found.vertices), 2))
    places[found.faces] = found.uv
    return dict(zip(held, map(tuple, places[held].tolist()), strict=True))


def edges_between_pins(
    faces: IntArray, edges: Array, pinned: Sequence[int], outline: Sequence[int]
) -> list[list[int]]:
    """Of these (s, 2) edges, as lists, those between two pinned vertices that are to stay straight where triangles beside them
    are subdivided: not those of triangles with three pins, which have no room to bend, and not those between two vertices of
    the outline, which may have to be subdivided for it."""
    fixed = np.zeros(int(faces.max()) + 1, bool)
    fixed[list(pinned)] = True
    solid = faces[fixed[faces].all(axis=1)]
    chosen = edges[fixed[edges].all(axis=1)]
    chosen = chosen[~np.isin(edge_keys(chosen), edge_keys(sides(solid)))]
    rim = set(outline)
    found: list[list[int]] = chosen.tolist()
    return [edge for edge in found if not rim.issuperset(edge)]


@solver_call
def with_pins(
    found: Parametrization, points: Points, **limits: Unpack[Limits]
) -> Job[Parametrization]:
    """See :meth:`Parametrization.with_pins`."""
    return StagedJob(_moved_to_pins(found, points, limits))


def _moved_to_pins(
    found: Parametrization, points: Points, limits: Limits
) -> Stages[Parametrization]:
    pins = {v: (u, w) for v, (u, w) in checks.as_vertex_places(points, "points").items()}
    faces, origin = split_fans(found.faces, cuts=found.cut_edges)
    stored = np.empty((len(origin), 2))
    stored[faces] = found.uv32()
    held = np.zeros(len(origin), bool)
    held[[v for loop in boundary_loops(faces) for v in loop]] = True
    copy = {int(o): v for v, o in enumerate(origin) if not held[v]}
    for v, target in pins.items():
        rows = np.flatnonzero(origin == v)
        if v not in copy and not (
            len(rows) and (stored[rows] == np.array(target, np.float32)).all()
        ):
            raise errors.bad_pins(
                f"Vertex {checks.shown(v)} lies on a cut or on the boundary, which stay where they are, or is none of the map. "
                "Pin vertices inside.",
                "vertex",
                [v],
            )
    inside = {copy[v]: target for v, target in pins.items() if v in copy}
    for v, target in inside.items():
        stored[v], held[v] = target, True
    corners = {
        (f, k): tuple(stored[faces[f, k]].tolist()) for f, k in np.argwhere(held[faces]).tolist()
    }
    try:
        moved = yield job_of(improve)(found, pins=corners, keep_bijective=False, **limits), 0.4
        moved = found.at(moved)
    except (errors.Infeasible, errors.NotConverged):
        cut = SeparatedSurface(
            vertices=found.vertices[origin],
            faces=faces,
            vertex_origin=origin,
            face_origin=np.arange(len(faces), dtype=np.int32),
            turned=np.zeros(len(faces), bool),
            collapsed=np.zeros(0, np.int32),
            mends=(),
            input_vertices=found.vertices,
            input_faces=found.faces,
        )
        moved = yield from _moved_by_match(found, cut, stored, inside, limits)
    turned = bool(len(found.transitions.quarter_turns))
    cones = {v: k * np.pi / 2 for v, k in found.certificate.quarter_cones.tolist() if k != 4}
    how: dict[str, Any] = dict(pins=pins, cones=cones if turned else None, seamless=turned)
    judging = job_of(certify)(moved.vertices, moved.faces, moved.uv, **how, **limits)
    certificate = yield judging, 1.0
    errors.require(certificate, "The pins are met, but the map is not valid")
    return replace(moved, certificate=certificate)


def _slits(
    faces: IntArray, uv: FloatArray, outline: Sequence[int], pins: set[int]
) -> dict[int, list[int]]:
    """{inner vertex without a pin: its edge to the outline}, one at each vertex of the outline around which a map has a whole
    turn or more. Held where they are they say which of the disks with this outline is meant: in others other vertices have it."""
    places = uv[faces] @ np.array([1, 1j])
    ahead, back = (np.roll(places, k, axis=1) - places for k in (-1, 1))
    angle = np.angle(back / ahead)
    whole = np.bincount(faces.ravel(), angle.ravel(), len(uv))
    taken = pins.union(outline)
    found = {}
    for v in (v for v in outline if whole[v] >= 2.0 * np.pi):
        rows, k = np.nonzero(faces == v)
        after = {
            int(a): (int(b), t)
            for a, b, t in zip(
                faces[rows, (k + 1) % 3], faces[rows, (k + 2) % 3], angle[rows, k], strict=True
            )
        }
        end, turned = next(iter(after.keys() - {b for b, _ in after.values()})), 0.0
        while end in after:
            end, step = after[end]
            turned += step
            if end not in taken and max(turned, whole[v] - turned) < 2.0 * np.pi:
                found[end] = [end, v]
                taken.add(end)
                break
    return found


def _moved_by_match(
    found: Parametrization, cut: SeparatedSurface, places: FloatArray, pins: Points, limits: Limits
) -> Stages[Parametrization]:
    """The same with vertices added; places and pins of the surface that is cut."""
    pieces = []
    for own, used, part in parts_of(cut):
        number = {int(v): i for i, v in enumerate(used)}
        outer, *holes = sorted(boundary_loops(part), key=len, reverse=True)
        at = places[used]
        mine = {number[v]: uv for v, uv in pins.items() if v in number}
        mine |= {v: (at[v, 0], at[v, 1]) for hole in holes for v in hole}
        slits = _slits(part, at, outer, {*mine})
        mine |= {v: (at[v, 0], at[v, 1]) for v in slits}
        outline: dict[str, Any] = dict(boundary_loop=outer, boundary_uv=at[outer], paths=slits)
        with named_on_input(cut.vertex_origin[used], own):
            matching = job_of(match)(cut.vertices[used], part, points=mine, **outline, **limits)
            pieces.append((own, used, (yield matching, 0.9)))
    moved = cut.on_input(combined(cut, pieces))
    split = split_edges(moved, len(found.vertices), found.faces)
    rim = np.concatenate(
        [np.column_stack([loop, np.roll(loop, -1)]) for loop in boundary_loops(cut.faces)]
    )
    split = split[np.isin(edge_keys(split), edge_keys(cut.vertex_origin[rim]))]
    if len(split):
        raise errors.NotConverged(
            f"The pins were met only with a vertex on the edge {checks.shown(split[0].tolist())}, which is a cut or the boundary "
            "and stays. Move them away from it.",
            code="bad pins",
            kind="edge",
            elements=split[0],
        )
    whole = of_pieces(found, moved)
    return replace(whole, cut_edges=found.cut_edges, transitions=found.transitions)
