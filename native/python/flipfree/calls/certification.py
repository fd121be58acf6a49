"""The certificate of any map, ours or not."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any, Unpack

import numpy as np

from .. import _native
from ..checks import Pins, as_angles, as_choice, as_floats, as_indices, as_mesh, checked
from ..errors import bad_option
from ..job import Job, Limits, solver_call, start_job
from ..results import Certificate, IntArray, Mesh, certificate_from
from ..texts import counted
from .seamless import Signature, as_signature


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
    tiled: bool = False,
    parent: tuple[Any, ...] | None = None,
    bijective: bool = False,
    disjoint: bool = False,
    mirrored: Any = None,
    aspect: float = 1.0,
    **limits: Unpack[Limits],
) -> Job[Certificate]:
    """Measures a map with exact predicates, on the given values and on their rounding to 32 bits.

    Args:
        vertices: (n, 3) float64. faces: (m, 3), any triangles; where they are no oriented surface, what joins them in the map
            decides how they are read (``mends``). uv: (m, 3, 2), one UV per face corner.
        pins: {vertex or (face, corner): (u, v)}; G3 demands them bit for bit.
        cones: {vertex: total angle in radians}; G5 demands these angles, and 2 pi at every other interior vertex.
        seamless: G4 demands that every cut is an exact quarter turn and translation.
        features: (k, 2) edges (of ``parent``, if there is one); G8 demands that they are isolines.
        tiled: demands G4, and G9: transitions, cones, corners where the border runs along the axes, and those features of this
            mesh that are isolines lie on whole numbers, as stored: textures that repeat run on through the seams.
        parent: (vertices, faces, parent_face, vertex_parent, vertex_barycentric) of the input that this mesh
            refines; G7 demands a subdivision.
        signature: a :class:`Signature` on these faces; demands G4, its cones instead of ``cones``, and G6: that the map
            turns along its loops as it says, counted exactly.
        bijective: overlaps of a chart with itself are a failure, not only a figure.
        disjoint: so are overlaps between charts.
        mirrored: (m,) whole numbers, not 0 for faces of charts that are mirror images on purpose: there each triangle must be
            strictly negative, and everything else is judged on the mirror image of that; "islands" are all charts that are
            so as stored. ``mirrored_islands`` counts them. Not with G4.
        aspect: width over height of the texture that the unit square shows; distortion is measured in its pixels.
        max_seconds: of the clock; None or 0 is no limit. NotConverged (code "time limit reached") when they are over.
        threads: None is all cores; the result has the same bits for every number.
        progress: called with (stage, fraction) about 20 times per second; returning False cancels.

    Returns:
        Certificate: ``ok``, the counts, ``failures`` in words, energy. A map that fails is no error.

    Raises:
        InvalidInput (a mesh that is none, arrays of the wrong shape), NotConverged (time is over), Cancelled.
    """
    names = "uv pins tiled seamless features bijective disjoint aspect"
    find_mirrored = isinstance(mirrored, str)
    mesh, options = checked(locals(), names if find_mirrored else f"{names} mirrored")
    is_tiled = options.pop("tiled")
    options["require_seamless"] = options.pop("seamless") or is_tiled
    angles = as_angles(cones)
    if signature is not None:
        if cones is not None:
            raise bad_option(
                "Both cones and signature are given. Give one of them: a signature has cones of its own."
            )
        turns, loops = as_signature(signature, mesh)
        angles = [(int(v), float(turns[v] * (np.pi / 2))) for v in signature.cones]
        options |= dict(require_seamless=True, loops=loops or [])
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
    if find_mirrored:
        options["find_mirrored"] = bool(as_choice(mirrored, "mirrored", ("islands",)))
    options["cone_angles"] = angles
    with np.errstate(over="ignore"):
        stored = options["uv"].astype(np.float32)

    def convert(data: dict[str, Any], given: Mesh) -> Certificate:
        found = certificate_from(data, given, stored, options["aspect"])
        if not is_tiled:
            return found
        return with_tiles(
            found, given.faces, stored, options.get("features", ()) if parent is None else ()
        )

    return start_job(_native.certify, mesh, options, limits, convert)


def with_tiles(found: Certificate, faces: IntArray, stored: Any, features: Any = ()) -> Certificate:
    """The certificate with G9 judged, on the stored values alone: (m, 3, 2) or (3 m, 2) float32. Fractions of floats, and
    their differences where these are 0, 1 or -1, are exact."""
    uv = np.asarray(stored, np.float64).reshape(-1, 2)
    counts = dict.fromkeys(("seam edge", "cone", "corner of the border", "feature"), 0)
    if found.flips32 == 0 and found.seam_failures == 0:
        counts = _off_tiles(faces, uv[:, 0] + 1j * uv[:, 1], np.asarray(features).reshape(-1, 2))
    elif found.ok:
        return found
    text = ", ".join(counted(count, what) for what, count in counts.items() if count)
    total = sum(counts.values())
    return replace(
        found,
        ok=found.ok and total == 0,
        tile_failures=total,
        failures=found.failures + ([f"G9: {text} not on whole numbers"] if total else []),
    )


def _is_whole(z: Any, w: Any = 0.0) -> Any:
    """Whether z and w differ by whole numbers."""
    off = [
        np.fmod(a, 1.0) - np.fmod(b, 1.0) for a, b in ((z.real, np.real(w)), (z.imag, np.imag(w)))
    ]
    return ((off[0] == 0) | (abs(off[0]) == 1)) & ((off[1] == 0) | (abs(off[1]) == 1))


def _off_tiles(faces: IntArray, z: Any, features: Any) -> dict[str, int]:
    start = faces.ravel().astype(np.int64)
    ahead = np.arange(len(start)).reshape(-1, 3)[:, [1, 2, 0]].ravel()
    back = ahead[ahead]
    size = int(start.max(initial=0)) + 1
    keys, others = start * size + start[ahead], start[ahead] * size + start
    known, first, count = np.unique(keys, return_index=True, return_counts=True)
    at = np.minimum(np.searchsorted(known, others), len(known) - 1)
    # Of edges that more faces share, each is a border here.
    inner = (known[at] == others) & (count[at] == 1) & (count[np.searchsorted(known, keys)] == 1)
    h, o = np.flatnonzero(inner), first[at][inner]
    vector, across = z[ahead] - z, z[o] - z[ahead[o]]
    turned = np.stack([vector[h] * 1j**k for k in range(4)])
    turn = (turned == across).argmax(axis=0)
    seam = ~_is_whole(z[ahead[o]], z[h] * np.array([1, 1j, -1, -1j])[turn])
    angle = np.bincount(start, np.angle((z[back] - z) / vector), minlength=size)
    quarters = np.rint(angle / (np.pi / 2)).astype(int)
    along = (vector.real == 0) | (vector.imag == 0)
    rim, oblique = np.zeros(size, bool), np.zeros(size, bool)
    for mask, edges in ((rim, ~inner), (oblique, ~inner & ~along)):
        mask[start[edges]] = mask[start[ahead[edges]]] = True
    cone = ~rim & (quarters != 4)
    corner = rim & ~oblique & (quarters != 2)
    off = ~_is_whole(z)
    pairs = np.sort(features, axis=1).astype(np.int64)
    wanted = np.isin(np.minimum(keys, others), pairs[:, 0] * size + pairs[:, 1])
    level = np.where(vector.real == 0, z.real, z.imag)
    return {
        "seam edge": int((seam & (h < o)).sum()),
        "cone": len(np.unique(start[off & cone[start]])),
        "corner of the border": len(np.unique(start[off & corner[start]])),
        "feature": len(
            np.unique(np.minimum(keys, others)[wanted & along & (np.fmod(level, 1) != 0)])
        ),
    }
