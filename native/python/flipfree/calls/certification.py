"""The certificate of any map, ours or not."""

from __future__ import annotations

from collections.abc import Mapping
from functools import partial
from typing import Any

import numpy as np

from .. import _native
from ..checks import (
    as_angles,
    as_corner_uv,
    as_floats,
    as_indices,
    as_items,
    as_mesh,
    checked,
    refuse_beyond_storage,
    shown,
    whole_number,
)
from ..errors import InvalidInput, bad_option, bad_pins
from ..job import Job, Progress, solver_call, start_job
from ..results import Certificate, FloatArray, IntArray, certificate_from
from .seamless import Signature, as_signature

Pins = Mapping[Any, tuple[float, float]]


def pins_to_corners(pins: Pins | None, faces: IntArray) -> tuple[IntArray, FloatArray]:
    """{vertex or (face, corner): (u, v)} as corner ids 3 f + k and their targets; a vertex pins all its corners."""
    targets: list[tuple[int, FloatArray]] = []
    by_vertex: dict[int, FloatArray] = {}
    for key, value in as_items(pins, "pins", "{vertex or (face, corner): (u, v)}", "bad pins"):
        name = f"pins[{shown(key)}]"
        place = as_floats(value, name)
        if place.shape != (2,) or not np.isfinite(place).all():
            raise bad_pins(f"{name} must be two finite numbers (u, v).")
        refuse_beyond_storage(place, name)
        is_pair = isinstance(key, tuple) and len(key) == 2
        face, corner = map(whole_number, key if is_pair else (0, key))
        if face is None or corner is None:
            raise bad_pins(
                f"pins has the key {shown(key)}, which is neither a vertex nor a pair (face, corner)."
            )
        if not is_pair:
            by_vertex[corner] = place
        elif 0 <= face < len(faces) and 0 <= corner < 3:
            targets.append((3 * face + corner, place))
        else:
            raise bad_pins(
                f"pins names corner {shown(corner)} of face {shown(face)}, which does not exist."
            )
    flat = faces.reshape(-1)
    missing = by_vertex.keys() - set(np.unique(flat).tolist() if by_vertex else ())
    if missing:
        largest = int(flat.max(initial=-1))  # beyond it, nobody here knows whether they exist
        raise InvalidInput(
            f"pins names vertex {shown(min(missing))}, which belongs to no face.",
            code="bad pins",
            kind="vertex",
            elements=[v for v in sorted(missing) if 0 <= v <= largest][:1000],
        )
    pinned = np.flatnonzero(np.isin(flat, list(by_vertex))).tolist() if by_vertex else ()
    targets += [(corner, by_vertex[int(flat[corner])]) for corner in pinned]
    corners, places = [corner for corner, _ in targets], [place for _, place in targets]
    return as_indices(corners, "pins"), as_floats(places, "pins", 2)


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
    features: Any = None,
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
        features: (k, 2) edges (of ``parent``, if there is one); G8 demands that they are isolines.
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
    mesh = as_mesh(vertices, faces)
    options = checked(locals(), "seamless features bijective disjoint aspect max_seconds")
    angles = as_angles(cones)
    if signature is not None:
        if cones is not None:
            raise bad_option(
                "Both cones and signature are given. Give one of them: a signature has cones of its own."
            )
        turns, loops = as_signature(signature, mesh)
        angles = [(int(v), float(turns[v] * (np.pi / 2))) for v in signature.cones]
        options |= dict(seamless=True, loops=loops or [])
    if parent is not None:
        if not isinstance(parent, (tuple, list)) or len(parent) != 5:
            raise bad_option(
                "parent must be (vertices, faces, parent_face, vertex_parent, vertex_barycentric): "
                "the input mesh and the map's provenance arrays."
            )
        whole = as_mesh(parent[0], parent[1], "parent ", mesh.exponent)
        options["parent"] = (
            whole.scaled,
            whole.faces,
            as_indices(parent[2], "parent_face"),
            as_indices(parent[3], "vertex_parent"),
            as_floats(parent[4], "vertex_barycentric", 3),
        )
    corner_uv = as_corner_uv(uv, "uv", len(mesh.faces))
    options |= dict(uv=corner_uv, cones=angles, pins=pins_to_corners(pins, mesh.faces))
    with np.errstate(over="ignore"):
        stored = corner_uv.astype(np.float32)
    convert = partial(certificate_from, uv32=stored, aspect=options["aspect"])
    return start_job(_native.certify, mesh, options, threads, convert)
