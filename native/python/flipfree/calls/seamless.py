"""Seamless maps, whose seams match by quarter turns and translations; cross fields, four directions in every face, a quarter
turn apart; maps with exactly the cones and turning numbers of these; the cuts into disks with right angles that padding starts
from (thesis 5.2.1, 6.5); and files of fields: .rawfield (Directional), .ffield
(Myles, Pietroni, Zorin 2014), and rotation forms."""

from __future__ import annotations

import gzip
import json
import os
from dataclasses import dataclass, fields
from typing import Any, NamedTuple, Unpack

import numpy as np

from .. import _native, checks
from ..errors import bad_angles, bad_file, bad_option, bad_shape, out_of_range
from ..job import Job, Limits, ours_only, solver_call, start_job, start_map
from ..results import FloatArray, IntArray, Mesh, Parametrization, ReadOnly, frozen
from ..texts import counted
from .mesh_files import as_path, content_of, not_accessible, write_whole

#: Quarter turns are whole numbers below this, either way.
_MOST_TURNS = 2**20


#: What .ffield files have for a period jump that is not known.
UNSET = 999999


class FieldArrays(NamedTuple):
    """Directions (m, 3), rotation (3 m,), quarters (3 m,) as the solver takes them; empty where there are none."""

    directions: FloatArray = np.zeros((0, 3))
    rotation: FloatArray = np.zeros(0)
    quarters: IntArray = np.zeros(0, np.int32)


@dataclass(frozen=True, eq=False, repr=False)
class CrossField(ReadOnly):
    """A cross field on the faces of a mesh. Its arrays are read-only.

    Attributes:
        directions: (m, 3) float64, one of the four directions of each face; others are it turned by quarters.
        matching: (m, 3) int32: across edge k of face f, from corner k to k + 1, its direction goes with that of the
            neighbour turned counter-clockwise by so many quarter turns, 0 to 3. 0 on the boundary. None: with the nearest.
        rotation: (m, 3) float64: by how much the field turns from the neighbour to face f, radians: the angle from the edge
            to the field here, less that there. It tells whole turns, which ``matching`` does not. None: within half a turn.
        stats: of :func:`cross_field`.
    """

    directions: FloatArray
    matching: IntArray | None = None
    rotation: FloatArray | None = None
    stats: dict[str, Any] | None = None

    def __post_init__(self) -> None:
        directions = checks.as_floats(self.directions, "directions", 3).copy()
        object.__setattr__(self, "directions", directions)
        for name, convert in (("matching", checks.as_indices), ("rotation", checks.as_floats)):
            given = getattr(self, name)
            if given is None:
                continue
            array = convert(given, name, 3)
            if len(array) != len(directions):
                raise bad_shape(
                    f"{name} has {counted(len(array), 'row')}, directions {len(directions)}. Give one for each face."
                )
            object.__setattr__(self, name, array.copy())
        super().__post_init__()

    def __repr__(self) -> str:
        return f"<CrossField: {counted(len(self.directions), 'face')}>"

    @staticmethod
    @ours_only
    def from_rotation(vertices: Any, faces: Any, rotation: Any) -> CrossField:
        """The field of a rotation form (m, 3): radians by which the field turns from the neighbour across each edge to the
        face, as seen from the edge. On a closed mesh it says all but one turn of all directions.

        Raises:
            InvalidInput: the mesh; a form that is not antisymmetric, or not that of a cross field, within 1e-6.
        """
        mesh = checks.as_mesh(vertices, faces)
        turned = checks.as_floats(rotation, "rotation", 3)
        if len(turned) == 0 or len(turned) != len(mesh.faces):
            raise bad_shape(
                f"rotation must have shape ({len(mesh.faces)}, 3), one number for each half-edge."
            )
        return _field_from(_described(mesh, FieldArrays(rotation=turned.ravel())))

    @staticmethod
    @ours_only
    def read(path: str | os.PathLike[str], vertices: Any, faces: Any) -> CrossField:
        """The field of a file, on the mesh that it was made for.

        Args:
            path: ``.rawfield`` (Directional: 4 vectors a face; each goes with the nearest across an edge), ``.ffield`` (Myles,
                Pietroni, Zorin 2014: angles and period jumps), or any other name, with ``.gz`` too: a rotation form, one
                number per half-edge and line.
            vertices, faces: the mesh.
        """
        mesh = checks.as_mesh(vertices, faces)
        return _field_from(_described(mesh, read_field_file(path, mesh.scaled, mesh.faces)))

    @ours_only
    def write(self, path: str | os.PathLike[str], vertices: Any, faces: Any) -> None:
        """The same formats, chosen by the name."""
        mesh = checks.as_mesh(vertices, faces)
        arrays = _described(mesh, arrays_of(self, mesh.faces))
        write_field_file(path, mesh.scaled, mesh.faces, arrays)


@dataclass(frozen=True, eq=False)
class Signature:
    """What is topological about a cross field or a seamless map, in quarter turns.

    Attributes:
        cones: {vertex: k}: total angle k pi / 2, where k is not 4 (on the boundary: not 2, the angle between its edges).
        loops: [(face ids, quarter turns)]: closed strips of faces, each sharing an edge with the next one and the last with
            the first, that generate the homology, then those along each boundary loop; and by how much each turns to the
            left. Of a signature that is asked for, all or some.
    """

    cones: dict[int, int]
    loops: list[tuple[IntArray, int]]

    @staticmethod
    @ours_only
    def read(path: str | os.PathLike[str]) -> Signature:
        """Of a JSON file: ``{"cones": {"12": 3}, "loops": [{"faces": [4, 7, 9], "turns": 1}]}``, both optional."""
        place = as_path(path)
        content = content_of(place)
        try:
            told = json.loads(content)
            cones = {int(v): int(k) for v, k in told.get("cones", {}).items()}
            loops = [
                (checks.as_indices(loop["faces"], "faces"), int(loop["turns"]))
                for loop in told.get("loops", [])
            ]
        except (AttributeError, KeyError, TypeError, ValueError) as error:
            raise bad_file(f"{place}: it holds no signature: {error!r}.") from None
        return Signature(cones, loops)

    @ours_only
    def write(self, path: str | os.PathLike[str]) -> None:
        """To such a file."""
        loops = [{"faces": np.asarray(ids).tolist(), "turns": int(k)} for ids, k in self.loops]
        told = {"cones": {str(v): k for v, k in self.cones.items()}, "loops": loops}
        write_whole(as_path(path), json.dumps(told).encode() + b"\n")


def _described(mesh: Mesh, arrays: FieldArrays) -> FieldArrays:
    """All three arrays of a field of which some may be empty."""
    return FieldArrays(*_native.read_field(mesh.scaled, mesh.faces, arrays))


def _field_from(data: FieldArrays, stats: dict[str, Any] | None = None) -> CrossField:
    directions, rotation, quarters = data
    return CrossField(directions, quarters.reshape(-1, 3), rotation.reshape(-1, 3), stats)


def arrays_of(field: Any, faces: IntArray) -> FieldArrays:
    """Directions, rotation and quarters as the solver takes them, empty where there are none."""
    if not isinstance(field, CrossField):
        raise bad_option(
            f"field must be a CrossField, not {checks.shown(field)}. Make one by CrossField(directions)."
        )
    if len(field.directions) != len(faces) or len(faces) == 0:
        raise bad_shape(
            f"field has {counted(len(field.directions), 'direction')}, but the mesh has "
            f"{counted(len(faces), 'face')}. Give the mesh that the "
            "field was made for."
        )
    known = {"rotation": field.rotation, "quarters": field.matching}
    told: dict[str, Any] = {
        name: array.ravel() for name, array in known.items() if array is not None
    }
    return FieldArrays(field.directions, **told)


def halfedges_of_strip(faces: IntArray, strip: Any, name: str) -> IntArray:
    """The half-edges across which a closed strip of faces is left; the first one that two faces share."""
    ids = checks.as_indices(strip, name)
    if len(ids) == 0 or ids.min() < 0 or ids.max() >= len(faces):
        raise out_of_range(
            f"{name} must name faces of the mesh, which has {len(faces)}, and at least one."
        )
    corners, following = faces[ids], np.roll(faces[ids], -1, axis=1)
    others, beyond = np.roll(corners, -1, axis=0), np.roll(following, -1, axis=0)
    shared = (corners[:, :, None] == beyond[:, None, :]) & (
        following[:, :, None] == others[:, None, :]
    )
    meets = shared.any(axis=2)
    if not meets.any(axis=1).all():
        place = int(np.flatnonzero(~meets.any(axis=1))[0])
        raise bad_option(
            f"{name}: face {ids[place]} at place {place} shares no edge with the next one. Give a closed strip of faces.",
            "face",
            [int(ids[place])],
        )
    return np.asarray(3 * ids + meets.argmax(axis=1), np.int32)


def as_quarter_turns(
    values: Any, name: str, count: int, usual: int | IntArray, least: int
) -> IntArray:
    """{vertex: quarter turns} as (count,), ``usual`` elsewhere."""
    turns = np.full(count, usual, np.int32)
    for vertex, value in checks.as_vertex_map(values, name, "quarter turns").items():
        if not 0 <= vertex < count:
            raise out_of_range(
                f"{name} names vertex {checks.shown(vertex)}, which does not exist (the mesh has {count}). Leave it out."
            )
        number = checks.whole_number(value)
        if number is None or not least <= number < _MOST_TURNS:
            more = ", 1 or more" if least == 1 else ""
            raise bad_angles(
                f"{name}[{vertex}] must be a whole number of quarter turns{more}, not {checks.shown(value)}. "
                "Give 3 for the corner of a cube, 4 for flat, 5 for a saddle.",
                "vertex",
                [vertex],
            )
        turns[vertex] = number
    return turns


def as_signature(value: Any, mesh: Mesh) -> tuple[IntArray, Any]:
    """A :class:`Signature` as cones (n,) and loops of half-edges with their turns, None without any."""
    if not isinstance(value, Signature):
        raise bad_option(
            f"signature must be a Signature, not {checks.shown(value)}. Make one by Signature(cones, loops)."
        )
    count = len(mesh.scaled)
    known = not mesh.faces.size or (mesh.faces.min() >= 0 and mesh.faces.max() < count)
    usual = _regular(mesh.faces, count) if known else np.full(count, 4, np.int32)
    cones = as_quarter_turns(value.cones, "signature.cones", count, usual, -_MOST_TURNS)
    loops = []
    for i, item in enumerate(checks.as_list(value.loops, "signature.loops", "a list of loops")):
        name = f"signature.loops[{i}]"
        pair = checks.as_list(item, name, "a pair (face ids, quarter turns)")
        turns = checks.whole_number(pair[1]) if len(pair) == 2 else None
        if turns is None or abs(turns) >= _MOST_TURNS:
            raise bad_shape(
                f"{name} must be a pair (face ids, quarter turns), not {checks.shown(item)}."
            )
        loops.append((halfedges_of_strip(mesh.faces, pair[0], name), turns))
    return cones, loops or None


def _of_signature(signature: Any, mesh: Mesh) -> dict[str, Any]:
    """The options of a field that is made."""
    if signature is None:
        return {}
    cones, loops = as_signature(signature, mesh)
    return {"cones": cones, "loops": loops}


@solver_call
def cross_field(
    vertices: Any,
    faces: Any,
    *,
    sharp_edges: Any = None,
    alignment: float = 0.0,
    boundary: bool = True,
    edge_weight: float = 1.0,
    signature: Signature | None = None,
    sizing: Any = None,
    simplify: bool = False,
    **limits: Unpack[Limits],
) -> Job[CrossField]:
    """The smoothest cross field, following what it is asked to follow; or the smoothest with a given signature.

    Args:
        vertices: (n, 3) float64. faces: (m, 3), manifold, consistently oriented; any number of components.
        sharp_edges: (s, 2) vertex pairs: edges that the field follows.
        alignment: to the principal curvatures, from 0 to less than 1: 0 not at all, 0.5 as much as smoothness over a tenth
            of the surface's extent. Where the surface bends equally in all directions it has no say.
        boundary: the field follows the boundary, if there is one.
        edge_weight: how much edges and boundary count, on the scale of ``alignment``; 1: the field follows them exactly.
        signature: cones, and turns of loops of a homology basis, that the field shall have exactly; of what the loops leave
            open, all of it without any (``Signature(cones, [])``), turns that need little rotation are chosen. On an
            open surface the corners along a boundary count by their sum; the directions follow it, with ``boundary``, as far
            as the turns let them. Nothing else that the field should follow has a say then.
        sizing: (n,) positive: length in the map of a length 1 there, relative to the others: the field turns, and has its
            cones, where a map of such sizes needs it. None: all alike.
        simplify: near pairs of cones of opposite sign are merged, and cones of one quarter turn share their curvature with
            a vertex near by. ``stats["cancelled"]`` and ``stats["spread"]`` say how many quarter turns were moved.
        max_seconds: of the clock; None or 0 is no limit. NotConverged (code "time limit reached") when they are over.
        threads: None is all cores; the result has the same bits for every number.
        progress: called with (stage, fraction) about 20 times per second; returning False cancels.

    Returns:
        The field, with ``stats``: "cones" inside the surface, "sharp_cones" of one quarter turn or less, "seconds".

    Raises:
        InvalidInput, Infeasible (cones that do not add up), NotConverged, Cancelled.
    """
    mesh, options = checks.checked(locals(), "simplify alignment edge_weight sizing")
    options |= dict(
        let_go=options["simplify"],
        edges=checks.as_optional_indices(sharp_edges, "sharp_edges", 2),
        boundary=checks.as_flag(boundary, "boundary"),
        **_of_signature(signature, mesh),
    )
    return start_job(
        _native.cross_field, mesh, options, limits, lambda data, _mesh: _field_from(*data)
    )


def _regular(faces: IntArray, count: int) -> IntArray:
    """(n,) quarter turns of a regular vertex: 2 on the boundary, else 4."""
    ends = np.stack([faces, np.roll(faces, -1, axis=1)], -1).reshape(-1, 2).astype(np.int64)
    key, back = ends[:, 0] * count + ends[:, 1], ends[:, 1] * count + ends[:, 0]
    usual = np.full(count, 4, np.int32)
    usual[ends[~np.isin(key, back)].ravel()] = 2
    return usual


@solver_call
def signature(
    vertices: Any, faces: Any, field: CrossField, **limits: Unpack[Limits]
) -> Job[Signature]:
    """The cones of a cross field, and how much it turns along the loops of a homology basis: exact, in whole quarters.

    Args:
        vertices: (n, 3) float64. faces: (m, 3), manifold, consistently oriented; any number of components.
        field: of this mesh.
        max_seconds: of the clock; None or 0 is no limit. NotConverged (code "time limit reached") when they are over.
        threads: as elsewhere. progress: called with (stage, fraction); returning False cancels.

    Raises:
        InvalidInput, NotConverged, Cancelled.
    """
    mesh = checks.as_mesh(vertices, faces)
    options = dict(field=arrays_of(field, mesh.faces))
    return start_job(_native.field_signature, mesh, options, limits, _signature_from)


def _signature_from(data: tuple[IntArray, list[tuple[IntArray, int]]], mesh: Mesh) -> Signature:
    cones, loops = data
    places = np.flatnonzero(cones != _regular(mesh.faces, len(mesh.scaled)))
    return Signature(
        {int(v): int(cones[v]) for v in places},
        [(frozen(halfedges // 3), turns) for halfedges, turns in loops],
    )


@solver_call
def field_aligned(
    vertices: Any,
    faces: Any,
    *,
    field: CrossField | None = None,
    signature: Signature | None = None,
    sizing: Any = None,
    features: Any = None,
    engine: str = "auto",
    boundary: str = "aligned",
    optimise: bool = True,
    exact: bool = True,
    reroute: bool = True,
    uncuttable: Any = None,
    iterations: int = 200,
    **limits: Unpack[Limits],
) -> Job[Parametrization]:
    """A seamless map with exactly the cones and turning numbers of a cross field, that follows it.

    Args:
        vertices: (n, 3) float64. faces: (m, 3), manifold, consistently oriented; any number of components.
        field: a field of this mesh; None: the smoothest, which follows the boundary if that is aligned, or the smoothest
            with the signature.
        signature: what the map shall have exactly, instead of a field: see :func:`cross_field`.
        sizing: (n,) positive: length in the map of a length 1 there, relative to the others. None: all alike. A field
            that is given should have been made for it (:func:`cross_field`); the one that is made here is.
        features: (k, 2) edges that shall be isolines exactly as stored (G8): sharp ones, borders of materials. The field that
            is made here runs along them; one that is given should (:func:`cross_field`, ``sharp_edges``). What the field or
            other features forbid is left as it is and named: ``certificate.features_missed``. Where the field that is
            made here misses some, edges between features are halved if that misses less: ``stats["divided_between"]``.
        engine: "penner" changes lengths of edges until all angles fit; "padding" cuts into disks, along branches that are
            led around cones until all loops turn as the field does (closed surfaces only); "auto" takes padding where
            penner finds no map.
        reroute: False: loops of padding's cut turn as they happen to, so that the map has the field's cones alone (thesis
            table 6.2).
        boundary: where the surface is open. "aligned": it runs exactly along the axes, with corners where the field turns
            between its edges. "free": as near to the surface as the inside allows, turning in all as the field does.
        optimise: the map is brought to follow the field; without, it is the engine's, turned towards the field.
        exact: seams match exactly, in 64 and in 32 bits; without, up to rounding.
        uncuttable: (k, 2) edges that the cut avoids, diagonals of polygons.
        iterations: Newton steps of the engine. max_seconds: of the clock; None or 0 is no limit.
        threads: None is all cores; the result has the same bits for every number, unless a limit of time is reached.
        progress: called with (stage, fraction) about 20 times per second; returning False cancels.

    Returns:
        The certified map (G1, G2, G4, G5, G6, G7); G6 on loops that the engine has not seen. ``stats["angle_mean"]`` and
        ``stats["angle_p95"]`` say how far its isolines are from the field, radians, by area; ``stats["engine"]`` which engine
        it was, and of padding ``stats["reroutings.guided"]`` and ``stats["reroutings.fallback"]`` how many branches of its
        cut had to be rerouted.

    Raises:
        InvalidInput, Infeasible (signatures that no map has), NotConverged, Cancelled.
    """
    checks.as_choice(boundary, "boundary", ("aligned", "free"))
    if field is not None and signature is not None:
        raise bad_option(
            "Both field and signature are given. Give one of them: a field has a signature of its own."
        )
    mesh, options = checks.checked(locals())
    options["max_iterations"] = checks.whole(1)(iterations, "iterations")
    made = _of_signature(signature, mesh) | dict(boundary=boundary == "aligned")
    if sizing is not None:
        made["sizing"] = options["sizing"]
    if features is not None:
        if not options["optimise"]:
            raise bad_option("features need the map to follow the field. Set optimise=True.")
        if signature is None:
            made |= dict(edges=options["features"], let_go=True)
    options["made"] = made
    if field is not None:
        options["field"] = arrays_of(field, mesh.faces)
    return start_map(_native.field_aligned, mesh, options, limits)


@solver_call
def seamless(
    vertices: Any,
    faces: Any,
    cones: Any = None,
    *,
    engine: str = "auto",
    boundary: str = "aligned",
    optimise: bool = True,
    exact: bool = True,
    uncuttable: Any = None,
    max_iterations: int = 200,
    **limits: Unpack[Limits],
) -> Job[Parametrization]:
    """A seamless map of a surface with these cones: its seams match exactly, in 64 and in 32 bits.

    Across every cut edge the map turns by whole quarters and moves, so that a grid, a checker or any texture with fourfold
    symmetry runs on. Every connected part is a surface and a chart of its own; all are at the scale of the surface, but for
    parts so small beside the others that 32 bits would lose them, which are larger and counted in
    ``stats["enlarged_islands"]``; each is turned so that the mesh's edges run along the axes as well as they can.

    Args:
        vertices: (n, 3) float64. faces: (m, 3), manifold, consistently oriented, without unused vertices.
        cones: {vertex: k}: total angle k pi / 2; all others are flat. On every closed connected part of genus g the sum of
            4 - k is 8 - 8 g; with an aligned boundary the sum of 4 - k inside and 2 - k at the boundary is 4 times the
            Euler characteristic. None: those of ``suggest_cones`` with ``quarter_turns`` and the bound 2.
        engine: "penner" changes lengths of edges until all angles fit; "padding" cuts into disks with right-angled borders
            and pads them until they fit (closed surfaces; it finds less often a map, and refines more); "auto" takes the
            first that finds a map.
        boundary: "aligned": curves of the boundary run exactly along the axes, with corners of whole quarter turns: the
            boundary vertices in ``cones`` (1: a convex corner, 3: a reflex one; all others are straight), or, if it names
            none, where that bends the boundary least: at its sharp corners, not at the teeth of a jagged one, and as many as
            Gauss-Bonnet asks for. "free": as near to the surface as the inside allows. "aligned_or_free": free on connected
            parts that find no map with an aligned boundary and have no corners in ``cones``; ``stats["freed_boundaries"]``
            counts these parts.
        optimise: lowers the distortion under the seams' constraints.
        exact: False leaves the seams as exact as rounding does, which may serve where 24 bits are too few for the grid.
        uncuttable: (k, 2) edges that the cut avoids where there is another way, diagonals of polygons; they do not count for
            the direction of the map.
        max_iterations: Newton steps of the engine (NotConverged when they are over), and of the optimiser, whose map is
            then taken as it is.
        max_seconds: of the clock; None or 0 is no limit. NotConverged (code "time limit reached") if there is no map by
            then; one that could still be optimised is returned, with ``stats["time_limit_reached"]`` 1.
        threads: None is all cores; the result has the same bits for every number.
        progress: called with (stage, fraction) about 20 times per second; returning False cancels.

    Returns:
        The certified map (G1, G2, G4, G5, G7) with ``transitions`` per cut edge, all exact: for an edge (a, b) from the
        face that has a before b to the other one. ``certificate.quarter_cones`` are its cones; ``stats`` has "engine",
        "iterations", "distortion.iterations", "added_vertices", "energy.engine", "energy.optimised".

    Raises:
        InvalidInput (the mesh; a cone; names the place), Infeasible (Gauss-Bonnet, with what is missing; cones that no
        surface of this genus has), NotConverged, Cancelled.
    """
    mesh, options = checks.checked(locals())
    if cones is not None:
        options["cones"] = as_quarter_turns(cones, "cones", len(mesh.scaled), 0, 1)
    return start_map(_native.seamless, mesh, options, limits)


@dataclass(frozen=True, eq=False, repr=False)
class AdmissibleCut(ReadOnly):
    """A closed surface cut along branches that meet at right angles. Its arrays are read-only.

    Every component of what is left is a disk, of which ``len(corners in it) == 4 + sum(k - 4 for its cones)`` (thesis
    Definition 5.4). Nodes have four branches, all of whose sectors are corners, or three, one of whose sectors is flat.

    Attributes:
        vertices: (n', 3), the input's first. faces: (m', 3), refined where branches needed room.
        parent_face: (m',) input face that contains each. vertex_parent: (n',) input face with each vertex.
        vertex_barycentric: (n', 3) its place there.
        branches: vertex ids along each, from node to node; disjoint but for their ends, none through a cone.
        corners: (c, 2) right angles: the node, and the first face of the sector counter-clockwise.
        flat: (t, 2) the same of the flat sectors of nodes with three branches.
        stats: with a field, "loops", "quarters", "guided" and "fallback": how branches were rerouted to turn as it does.
    """

    vertices: FloatArray
    faces: IntArray
    parent_face: IntArray
    vertex_parent: IntArray
    vertex_barycentric: FloatArray
    branches: list[IntArray]
    corners: IntArray
    flat: IntArray
    stats: dict[str, Any]

    def __repr__(self) -> str:
        branches = counted(len(self.branches), "branch", "branches")
        return f"<AdmissibleCut: {branches}, {counted(len(self.corners), 'corner')}>"

    @property
    def cut_edges(self) -> IntArray:
        """(s, 2) vertex pairs of all branches."""
        pairs = [np.column_stack([branch[:-1], branch[1:]]) for branch in self.branches]
        return np.concatenate([np.zeros((0, 2), np.int32), *pairs])


def _cut_from(data: Any, mesh: Mesh) -> AdmissibleCut:
    names = (field.name for field in fields(AdmissibleCut))
    found = dict(zip(names, data, strict=True))
    found["vertices"] = mesh.restored(found["vertices"])
    frozen(found["branches"])
    for name in ("corners", "flat"):
        found[name] = np.array(found[name], np.int32).reshape(-1, 2)
    return AdmissibleCut(**found)


@solver_call
def admissible_cut(
    vertices: Any,
    faces: Any,
    cones: Any = None,
    *,
    field: CrossField | None = None,
    reroute: bool = True,
    **limits: Unpack[Limits],
) -> Job[AdmissibleCut]:
    """The cut that the engine "padding" of ``seamless`` and ``field_aligned`` starts from.

    Args:
        vertices: (n, 3) float64. faces: (m, 3), manifold, consistently oriented, closed; any number of components.
        cones: {vertex: k}: total angle k pi / 2, as for ``seamless``; all others are flat. None with a field.
        field: cones are the field's, and loops of the cut turn as it does. reroute: False: as they happen to.
        max_seconds: of the clock; None or 0 is no limit. NotConverged (code "time limit reached") when they are over.
        threads: as elsewhere. progress: called with (stage, fraction); returning False cancels.

    Returns:
        The cut; a sphere has none.

    Raises:
        InvalidInput (the mesh, open ones too; a cone), Infeasible (Gauss-Bonnet; cones that no surface of this genus has),
        NotConverged, Cancelled.
    """
    if field is not None and cones is not None:
        raise bad_option(
            "Both cones and field are given. Give one of them: a field has cones of its own."
        )
    mesh, options = checks.checked(locals(), "reroute")
    if field is not None:
        options["field"] = arrays_of(field, mesh.faces)
    else:
        options["cones"] = as_quarter_turns(cones, "cones", len(mesh.scaled), 4, 1)
    return start_job(_native.admissible_cut, mesh, options, limits, _cut_from)


def read_field_file(path: Any, vertices: FloatArray, faces: IntArray) -> FieldArrays:
    """The field that the file holds for this mesh."""
    place = as_path(path)
    raw = content_of(place)
    try:
        raw = gzip.decompress(raw) if place.suffix == ".gz" else raw
    except (OSError, EOFError) as error:
        raise not_accessible(place, "read", error) from None
    read, _ = _FORMATS.get(place.suffix.lower(), _ROTATION)
    try:
        return read(raw.decode("latin-1"), vertices, faces)
    except ValueError as error:
        raise bad_file(f"{place}: {error}") from None


def _need(holds: Any, what: str) -> None:
    """Of a file's content."""
    if not holds:
        raise ValueError(what)


def _numbers(words: list[str]) -> FloatArray:
    numbers = np.array(words, np.float64)
    _need(np.isfinite(numbers).all(), "it has numbers that are not finite.")
    return numbers


def _read_rotation(text: str, _vertices: FloatArray, faces: IntArray) -> FieldArrays:
    numbers, count = _numbers(text.split()), faces.size
    found = counted(len(numbers), "number")
    _need(len(numbers) == count, f"{found} instead of {count}, one for each half-edge.")
    return FieldArrays(rotation=numbers)


def _rotation(_vertices: FloatArray, _faces: IntArray, data: FieldArrays) -> str:
    return "".join(f"{value!r}\n" for value in data.rotation.tolist())


def _read_rawfield(text: str, _vertices: FloatArray, faces: IntArray) -> FieldArrays:
    numbers = _numbers(text.split())
    begins = len(numbers) > 1 and numbers[0] == 4
    _need(begins, "it does not begin with 4, the number of vectors of a cross.")
    _need(
        numbers[1] == len(faces) and len(numbers) == 2 + 12 * len(faces),
        f"it has {counted(len(numbers) - 2, 'number')} for a count of faces of {numbers[1]:g}; "
        f"the mesh has {len(faces)}, which take 12 each.",
    )
    return FieldArrays(directions=numbers[2:].reshape(-1, 4, 3)[:, 0].copy())


def _read_ffield(text: str, vertices: FloatArray, faces: IntArray) -> FieldArrays:
    lines = [line.split() for line in text.splitlines() if line.strip()]
    names = {line[0]: i for i, line in reversed(list(enumerate(lines)))}
    _need("crossfield_angles" in names, "it has no crossfield_angles.")
    row = names["crossfield_angles"] + 1
    angles = _numbers(lines[row] if row < len(lines) else [])
    of_faces = f"for {counted(len(faces), 'face')}."
    _need(len(angles) == len(faces), f"{counted(len(angles), 'angle')} {of_faces}")
    directions = _turned(vertices, faces, angles)
    signs = {"MI_matchings": 1, "matchings": -1}
    for name, sign in signs.items():
        for found in (name, name + "_and_sharp"):
            if found not in names:
                continue
            rows = [line[:6] for line in lines[names[found] + 1 :][: len(faces)]]
            few = f"{counted(len(rows), 'line')} of matchings {of_faces}"
            _need(len(rows) == len(faces), few)
            short = any(len(line) < 6 for line in rows)
            _need(not short, "a line of matchings has fewer than 6 numbers.")
            jumps = _period_jumps(_numbers([word for line in rows for word in line]), faces)
            if (jumps == UNSET).any():
                return FieldArrays(directions)
            # A period jump p makes the rotation (angle here) + (frames) - (angle there) + p pi / 2.
            return FieldArrays(directions, quarters=np.asarray(-sign * jumps % 4, np.int32).ravel())
    return FieldArrays(directions)


def _period_jumps(numbers: FloatArray, faces: IntArray) -> IntArray:
    table, jumps = numbers.reshape(-1, 6), np.full(faces.shape, UNSET, np.int32)
    for k in range(3):
        # The half-edge that ends at the vertex with this id.
        ends = np.roll(faces, -1, axis=1) == table[:, k, None]
        wrong = np.flatnonzero(ends.sum(axis=1) != 1)[:1].tolist()
        _need(not wrong, f"the matchings of face {wrong} are of other vertices.")
        jumps[ends] = table[:, 3 + k]
    return jumps


def _frames(vertices: FloatArray, faces: IntArray) -> tuple[FloatArray, FloatArray]:
    """Of each face the unit vector from its last to its first corner, and that to the left of it."""
    a, b, c = (vertices[faces[:, k]] for k in range(3))
    along = a - c
    along = along / np.linalg.norm(along, axis=1, keepdims=True)
    left = np.cross(np.cross(b - a, c - a), along)
    return along, left / np.linalg.norm(left, axis=1, keepdims=True)


def _turned(vertices: FloatArray, faces: IntArray, angles: FloatArray) -> FloatArray:
    if faces.min(initial=0) < 0 or faces.max(initial=-1) >= len(vertices):
        return np.zeros((len(faces), 3))  # the mesh is refused by name where the field is read
    with np.errstate(all="ignore"):
        along, left = _frames(vertices, faces)
        return np.asarray(np.cos(angles)[:, None] * along + np.sin(angles)[:, None] * left)


def write_field_file(path: Any, vertices: FloatArray, faces: IntArray, data: FieldArrays) -> None:
    """The field, all three arrays, to a file of the kind that its name says."""
    place = as_path(path)
    kind = place.suffix.lower()
    _, text = _FORMATS.get(kind, _ROTATION)
    content = text(vertices, faces, data).encode()
    write_whole(place, gzip.compress(content) if kind == ".gz" else content)


def _rawfield(vertices: FloatArray, faces: IntArray, data: FieldArrays) -> str:
    directions = data.directions
    a, b, c = (vertices[faces[:, k]] for k in range(3))
    normal = np.cross(b - a, c - a)
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    left = np.cross(normal, directions)
    rows = np.concatenate([directions, left, -directions, -left], axis=1).tolist()
    lines = (" ".join(map(repr, row)) for row in rows)
    return "\n".join([f"4 {len(faces)}", *lines, ""])


def _ffield(vertices: FloatArray, faces: IntArray, data: FieldArrays) -> str:
    directions, _, quarters = data
    along, left = _frames(vertices, faces)
    angles = np.arctan2((directions * left).sum(axis=1), (directions * along).sum(axis=1))
    jumps = (-quarters % 4).reshape(-1, 3)
    lines = ["# 1", "target_frame", str(len(faces)), "k1 k2 k1v_x k1v_y k1v_z k2v_x k2v_y k2v_z"]
    second = np.cross(np.cross(along, left), directions)
    for one, two in zip(directions.tolist(), second.tolist(), strict=True):
        lines.append(" ".join(map(repr, [1.0, 1.0, *one, *two])))
    lines += ["crossfield_angles", " ".join(map(repr, angles.tolist())), "fixed 0", "MI_matchings"]
    ends = np.roll(faces, -1, axis=1)
    lines += [" ".join(map(str, row)) for row in np.concatenate([ends, jumps], axis=1).tolist()]
    return "\n".join([*lines, ""])


_ROTATION = _read_rotation, _rotation
#: Ending of a file that is no rotation form -> how it is read, and what is written.
_FORMATS = {".rawfield": (_read_rawfield, _rawfield), ".ffield": (_read_ffield, _ffield)}
