"""The certificate of any map, ours or not."""

from __future__ import annotations

from collections.abc import Mapping
from functools import partial
from typing import Any

import numpy as np
import numpy.typing as npt

from .. import _native
from ..arrays import (
    as_corner_uv,
    as_floats,
    as_indices,
    as_items,
    as_vertex_map,
    as_vertices,
    refuse_beyond_storage,
)
from ..conversions import certificate_from
from ..errors import InvalidInput
from ..fields.cross_fields import Signature, as_signature
from ..job import Job, Progress, solver_call
from ..options import as_aspect, as_flag, as_number, as_seconds, as_threads, shown, whole_number
from ..results import Certificate

Pins = Mapping[Any, tuple[float, float]]


def pins_to_corners(
    pins: Pins | None, faces: npt.NDArray[np.int32], name: str = "pins"
) -> tuple[npt.NDArray[np.int32], npt.NDArray[np.float64]]:
    """{vertex or (face, corner): (u, v)} as corner ids 3 f + k and their targets; a vertex pins all its corners."""
    corners: list[int] = []
    targets: list[tuple[float, float]] = []
    by_vertex: dict[int, tuple[float, float]] = {}
    meaning = "{vertex or (face, corner): (u, v)}"
    for key, value in as_items(pins, name, meaning, "bad pins"):
        place_name = f"{name}[{shown(key)}]"
        target = as_floats(value, place_name)
        if target.shape != (2,) or not np.isfinite(target).all():
            raise InvalidInput(f"{place_name} must be two finite numbers (u, v).", code="bad pins")
        refuse_beyond_storage(target, place_name)
        place = (float(target[0]), float(target[1]))
        pair = isinstance(key, tuple) and len(key) == 2
        corner = whole_number(key[1] if pair else key)
        face = whole_number(key[0]) if pair else None
        if corner is None or (pair and face is None):
            raise InvalidInput(
                f"{name} has the key {shown(key)}, which is neither a vertex nor a pair (face, corner).",
                code="bad pins",
            )
        if face is None:
            by_vertex[corner] = place
        elif 0 <= face < len(faces) and 0 <= corner < 3:
            corners.append(3 * face + corner)
            targets.append(place)
        else:
            raise InvalidInput(
                f"{name} names corner {shown(corner)} of face {shown(face)}, which does not exist.",
                code="bad pins",
            )
    if by_vertex:
        flat = faces.reshape(-1)
        missing = set(by_vertex) - set(np.unique(flat).tolist())
        if missing:
            largest = int(flat.max(initial=-1))  # beyond it, nobody here knows whether they exist
            raise InvalidInput(
                f"{name} names vertex {shown(min(missing))}, which belongs to no face.",
                code="bad pins",
                kind="vertex",
                elements=[v for v in sorted(missing) if 0 <= v <= largest][:1000],
            )
        for found in np.flatnonzero(np.isin(flat, list(by_vertex))).tolist():
            corners.append(found)
            targets.append(by_vertex[int(flat[found])])
    return as_indices(corners, name), as_floats(targets, name, 2)


@solver_call
def certify(
    vertices: Any,
    faces: Any,
    uv: Any,
    *,
    pins: Pins | None = None,
    cones: Mapping[int, float] | None = None,
    signature: Signature | None = None,
    seamless: bool = False,
    parent: tuple[Any, ...] | None = None,
    bijective: bool = False,
    disjoint: bool = False,
    aspect: float = 1.0,
    max_seconds: float | None = None,
    threads: int | None = None,
    progress: Progress | None = None,
) -> Job[Certificate]:
    """Measures a map with exact predicates, on the given values and on their rounding to 32 bits.

    Args:
        vertices: (n, 3) float64. faces: (m, 3), any triangles; where they are no oriented surface, what joins them in the map
            decides how they are read (``mends``). uv: (m, 3, 2), one UV per face corner.
        pins: {vertex or (face, corner): (u, v)}; G3 demands them bit for bit.
        cones: {vertex: total angle in radians}; G5 demands these angles, and 2 pi at every other interior vertex.
        seamless: G4 demands that every cut is an exact quarter turn and translation.
        parent: (vertices, faces, parent_face, vertex_parent, vertex_barycentric) of the input that this mesh
            refines; G7 demands a subdivision.
        signature: a :class:`Signature` on these faces; demands G4, its cones instead of ``cones``, and G6: that the map
            turns along its loops as it says, counted exactly.
        bijective: overlaps of a chart with itself are a failure, not only a figure.
        disjoint: so are overlaps between charts.
        aspect: width over height of the texture that the unit square shows; distortion is measured in its pixels.
        max_seconds: of the clock; None or 0 is no limit. NotConverged (code "time limit reached") when they are over.
        threads: None is all cores; the result has the same bits for every number.
        progress: called with (stage, fraction) about 20 times per second; returning False cancels.

    Returns:
        Certificate: ``ok``, the counts, ``failures`` in words, energy. A map that fails is no error.

    Raises:
        InvalidInput (a mesh that is none, arrays of the wrong shape), NotConverged (time is over), Cancelled.
    """
    face_array = as_indices(faces, "faces", 3)
    pin_corners, pin_uv = pins_to_corners(pins, face_array)
    cone_angles = as_vertex_map(cones, "cones", "angle")
    positions = as_vertices(vertices, face_array)
    must_be_seamless, loops = as_flag(seamless, "seamless"), None
    if signature is not None:
        if cones is not None:
            raise InvalidInput(
                "Both cones and signature are given. Give one of them: a signature has cones of its own.",
                code="bad option",
            )
        turns, given = as_signature(signature, face_array, len(positions.scaled))
        must_be_seamless, loops = True, given or []
        cone_angles = {int(v): turns[v] * (np.pi / 2) for v in signature.cones}
    corner_uv = as_corner_uv(uv, "uv", len(face_array))
    parent_parts = None
    if parent is not None:
        if not isinstance(parent, (tuple, list)) or len(parent) != 5:
            raise InvalidInput(
                "parent must be (vertices, faces, parent_face, vertex_parent, vertex_barycentric): "
                "the input mesh and the map's provenance arrays.",
                code="bad option",
            )
        parent_faces = as_indices(parent[1], "parent faces", 3)
        parent_parts = (
            as_vertices(parent[0], parent_faces, "parent vertices", positions.exponent).scaled,
            parent_faces,
            as_indices(parent[2], "parent_face"),
            as_indices(parent[3], "vertex_parent"),
            as_floats(parent[4], "vertex_barycentric", 3),
        )
    texture = as_aspect(aspect)
    native = _native.certify(
        positions.scaled,
        face_array,
        corner_uv,
        pin_corners=pin_corners,
        pin_uv=pin_uv,
        cone_vertices=as_indices(list(cone_angles), "cones"),
        cone_angles=as_floats(
            [as_number(a, f"cones[{v}]") for v, a in cone_angles.items()], "cones"
        ),
        loops=loops,
        parent=parent_parts,
        require_bijective=as_flag(bijective, "bijective"),
        require_disjoint=as_flag(disjoint, "disjoint"),
        require_seamless=must_be_seamless,
        aspect=texture,
        max_seconds=as_seconds(max_seconds, "max_seconds"),
        threads=as_threads(threads),
    )
    with np.errstate(over="ignore"):
        stored = corner_uv.astype(np.float32)
    convert = partial(
        certificate_from,
        vertices=positions.scaled,
        faces=face_array,
        uv32=stored,
        exponent=positions.exponent,
        aspect=texture,
    )
    return Job(native, convert)
