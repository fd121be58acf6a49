"""Cross fields: four directions in every face, a quarter turn apart, and the cones and turning numbers that they have."""

from __future__ import annotations

import os
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np

from .. import _native
from ..arrays import (
    BAD_SHAPE,
    Positions,
    as_floats,
    as_indices,
    as_list,
    as_vertex_map,
    as_vertices,
)
from ..errors import InvalidInput
from ..job import Job, Progress, ours_only, solver_call
from ..options import (
    as_flag,
    as_number,
    as_seconds,
    as_threads,
    shown,
    whole_number,
)
from ..results import FloatArray, IntArray, frozen
from ..texts import counted
from .field_files import read_field_file, write_field_file


@dataclass(frozen=True, eq=False, repr=False)
class CrossField:
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
        directions = frozen(as_floats(self.directions, "directions", 3).copy())
        object.__setattr__(self, "directions", directions)
        for name, convert in (("matching", as_indices), ("rotation", as_floats)):
            given = getattr(self, name)
            if given is None:
                continue
            array = convert(given, name, 3)
            if len(array) != len(directions):
                raise InvalidInput(
                    f"{name} has {counted(len(array), 'row')}, directions {len(directions)}. Give one for each face.",
                    code=BAD_SHAPE,
                )
            object.__setattr__(self, name, frozen(array.copy()))

    def __repr__(self) -> str:
        return f"<CrossField: {counted(len(self.directions), 'face')}>"

    def __setstate__(self, state: dict[str, Any]) -> None:
        self.__dict__.update(state)  # copies and pickles forget that arrays are read-only
        for value in state.values():
            if isinstance(value, np.ndarray):
                frozen(value)

    @staticmethod
    @ours_only
    def from_rotation(vertices: Any, faces: Any, rotation: Any) -> CrossField:
        """The field of a rotation form (m, 3): radians by which the field turns from the neighbour across each edge to the
        face, as seen from the edge. On a closed mesh it says all but one turn of all directions.

        Raises:
            InvalidInput: the mesh; a form that is not antisymmetric, or not that of a cross field, within 1e-6.
        """
        face_array = as_indices(faces, "faces", 3)
        positions = as_vertices(vertices, face_array)
        turned = as_floats(rotation, "rotation", 3)
        if len(turned) == 0 or len(turned) != len(face_array):
            raise InvalidInput(
                f"rotation must have shape ({len(face_array)}, 3), one number for each half-edge.",
                code=BAD_SHAPE,
            )
        return _field_from(
            _native.read_field(
                positions.scaled, face_array, np.zeros((0, 3)), turned.ravel(), _NO_QUARTERS
            )
        )

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
        face_array = as_indices(faces, "faces", 3)
        positions = as_vertices(vertices, face_array)
        data = read_field_file(path, positions.scaled, face_array)
        return _field_from(
            _native.read_field(
                positions.scaled, face_array, data.directions, data.rotation, data.quarters
            )
        )

    @ours_only
    def write(self, path: str | os.PathLike[str], vertices: Any, faces: Any) -> None:
        """The same formats, chosen by the name."""
        face_array = as_indices(faces, "faces", 3)
        positions = as_vertices(vertices, face_array)
        data = _native.read_field(positions.scaled, face_array, *arrays_of(self, face_array))
        write_field_file(path, positions.scaled, face_array, *data)


@dataclass(frozen=True, eq=False)
class Signature:
    """What is topological about a cross field or a seamless map, in quarter turns.

    Attributes:
        cones: {vertex: k}: total angle k pi / 2, where k is not 4 (on the boundary: not 2, the angle between its edges).
        loops: [(face ids, quarter turns)]: closed strips of faces, each sharing an edge with the next one and the last with
            the first, that generate the homology, then those along each boundary loop; and by how much each turns to the
            left.
    """

    cones: dict[int, int]
    loops: list[tuple[IntArray, int]]


_NO_QUARTERS = np.zeros(0, np.int32)


def _field_from(data: tuple[Any, Any, Any], stats: dict[str, Any] | None = None) -> CrossField:
    directions, rotation, quarters = data
    return CrossField(directions, quarters.reshape(-1, 3), rotation.reshape(-1, 3), stats)


def arrays_of(field: Any, faces: IntArray) -> tuple[FloatArray, FloatArray, IntArray]:
    """Directions, rotation and quarters as the solver takes them, empty where there are none."""
    if not isinstance(field, CrossField):
        raise InvalidInput(
            f"field must be a CrossField, not {shown(field)}. Make one by CrossField(directions).",
            code="bad option",
        )
    if len(field.directions) != len(faces) or len(faces) == 0:
        raise InvalidInput(
            f"field has {counted(len(field.directions), 'direction')}, but the mesh has "
            f"{counted(len(faces), 'face')}. Give the mesh that the "
            "field was made for.",
            code=BAD_SHAPE,
        )
    rotation = np.zeros(0) if field.rotation is None else field.rotation.ravel()
    quarters = _NO_QUARTERS if field.matching is None else field.matching.ravel()
    return field.directions, rotation, quarters


def faces_of_loop(halfedges: IntArray) -> IntArray:
    """The strip of faces of a loop of half-edges 3 f + k, each left across it."""
    faces: IntArray = frozen(np.asarray(halfedges // 3, np.int32))
    return faces


def halfedges_of_strip(faces: IntArray, strip: Any, name: str) -> IntArray:
    """The half-edges across which a closed strip of faces is left; the first one that two faces share."""
    ids = as_indices(strip, name)
    if len(ids) == 0 or ids.min() < 0 or ids.max() >= len(faces):
        raise InvalidInput(
            f"{name} must name faces of the mesh, which has {len(faces)}, and at least one.",
            code="index out of range",
        )
    corners, following = faces[ids], np.roll(faces[ids], -1, axis=1)
    others, beyond = np.roll(corners, -1, axis=0), np.roll(following, -1, axis=0)
    shared = (corners[:, :, None] == beyond[:, None, :]) & (
        following[:, :, None] == others[:, None, :]
    )
    meets = shared.any(axis=2)
    if not meets.any(axis=1).all():
        place = int(np.flatnonzero(~meets.any(axis=1))[0])
        raise InvalidInput(
            f"{name}: face {ids[place]} at place {place} shares no edge with the next one. Give a closed strip of faces.",
            code="bad option",
            kind="face",
            elements=[int(ids[place])],
        )
    return np.asarray(3 * ids + meets.argmax(axis=1), np.int32)


def as_quarter_turns(values: Any, name: str, count: int, least: int = -(2**20)) -> IntArray:
    """{vertex: quarter turns} as (count,), 4 elsewhere."""
    turns = np.full(count, 4, np.int32)
    for vertex, value in as_vertex_map(values, name, "quarter turns").items():
        if not 0 <= vertex < count:
            raise InvalidInput(
                f"{name} names vertex {vertex}, which does not exist (the mesh has {count}).",
                code="index out of range",
            )
        number = whole_number(value)
        if number is None or not least <= number < 2**20:
            raise InvalidInput(
                f"{name}[{vertex}] must be a whole number of quarter turns, not {shown(value)}.",
                code="bad angles",
            )
        turns[vertex] = number
    return turns


def as_sizing(value: Any, count: int) -> FloatArray:
    """One number per vertex."""
    sizes = as_floats(value, "sizing")
    if len(sizes) == 0 or len(sizes) != count:
        raise InvalidInput(
            f"sizing must have shape ({count},), one number per vertex.",
            code=BAD_SHAPE,
        )
    return sizes


def as_signature(value: Any, faces: IntArray, count: int) -> tuple[IntArray, Any]:
    """A :class:`Signature` as cones (n,) and loops of half-edges with their turns, None without any."""
    if not isinstance(value, Signature):
        raise InvalidInput(
            f"signature must be a Signature, not {shown(value)}. Make one by Signature(cones, loops).",
            code="bad option",
        )
    cones = as_quarter_turns(value.cones, "signature.cones", count)
    loops = []
    given = (
        [] if value.loops is None else as_list(value.loops, "signature.loops", "a list of loops")
    )
    for i, item in enumerate(given):
        pair = as_list(item, f"signature.loops[{i}]", "a pair (face ids, quarter turns)")
        turns = whole_number(pair[1]) if len(pair) == 2 else None
        if turns is None or abs(turns) >= 2**20:
            raise InvalidInput(
                f"signature.loops[{i}] must be a pair (face ids, quarter turns), not {shown(item)}.",
                code=BAD_SHAPE,
            )
        loops.append((halfedges_of_strip(faces, pair[0], f"signature.loops[{i}]"), turns))
    return cones, loops or None


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
    max_seconds: float | None = None,
    threads: int | None = None,
    progress: Progress | None = None,
) -> Job[CrossField]:
    """The smoothest cross field, following what it is asked to follow; or the smoothest with a given signature.

    Args:
        vertices: (n, 3) float64. faces: (m, 3), manifold, consistently oriented; any number of components.
        sharp_edges: (s, 2) vertex pairs: edges that the field follows.
        alignment: to the principal curvatures, from 0 to less than 1: 0 not at all, 0.5 as much as smoothness over a tenth
            of the surface's extent. Where the surface bends equally in all directions it has no say.
        boundary: the field follows the boundary, if there is one.
        edge_weight: how much edges and boundary count, on the scale of ``alignment``; 1: the field follows them exactly.
        signature: cones, and turns of the loops of a homology basis, that the field shall have exactly; without loops
            (``Signature(cones, [])``) turns that need little rotation are chosen. Closed surfaces only; what the field
            should follow has no say then.
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
    face_array = as_indices(faces, "faces", 3)
    positions = as_vertices(vertices, face_array)
    options = dict(
        alignment=as_number(alignment, "alignment"),
        edges=as_indices([] if sharp_edges is None else sharp_edges, "sharp_edges", 2),
        boundary=as_flag(boundary, "boundary"),
        edge_weight=as_number(edge_weight, "edge_weight"),
        simplify=as_flag(simplify, "simplify"),
        max_seconds=as_seconds(max_seconds, "max_seconds"),
    )
    if sizing is not None:
        options.update(sizing=as_sizing(sizing, len(positions.scaled)))
    if signature is not None:
        cones, loops = as_signature(signature, face_array, len(positions.scaled))
        options.update(cones=cones, loops=loops)
    native = _native.cross_field(positions.scaled, face_array, options, as_threads(threads))
    return Job(native, lambda data: _field_from(*data))


def _signature_from(
    data: tuple[IntArray, list[tuple[IntArray, int]]], usual: IntArray
) -> Signature:
    cones, loops = data
    places = np.flatnonzero(cones != usual)
    return Signature(
        {int(v): int(cones[v]) for v in places},
        [(faces_of_loop(halfedges), turns) for halfedges, turns in loops],
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
    vertices: Any,
    faces: Any,
    field: CrossField,
    *,
    max_seconds: float | None = None,
    threads: int | None = None,
    progress: Progress | None = None,
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
    face_array = as_indices(faces, "faces", 3)
    positions = as_vertices(vertices, face_array)
    arrays = arrays_of(field, face_array)
    limit = as_seconds(max_seconds, "max_seconds")
    native = _native.field_signature(
        positions.scaled, face_array, *arrays, limit, as_threads(threads)
    )
    convert: Callable[[Any], Signature] = partial(
        _to_signature, faces=face_array, positions=positions
    )
    return Job(native, convert)


def _to_signature(data: Any, faces: IntArray, positions: Positions) -> Signature:
    return _signature_from(data, _regular(faces, len(positions.scaled)))
