# SPDX-License-Identifier: GPL-3.0-or-later
"""The solver package as the extension uses it: the version handshake and the calls that start jobs."""

import math
import tomllib
from pathlib import Path

import numpy as np

import flipfree
from flipfree.distortion import STRETCH_BOUND

from . import preferences
from .preferences import threads
from .runs.processes import jobs

# Effort of the packing that follows an unwrap, as that of ff.unwrap itself.
QUICK_PACKING = 0.2


def _limits() -> dict:
    """What the preferences allow every solver."""
    return {"threads": threads(), "max_seconds": preferences.max_seconds()}


def check_version() -> None:
    """Wheels of all extensions share one folder, so another flipfree may have been found. Raises ImportError."""
    manifest = tomllib.loads(Path(__file__).with_name("blender_manifest.toml").read_text("utf-8"))
    if flipfree.__version__ != manifest["version"]:
        raise ImportError(
            f"Flipfree UV {manifest['version']} found version {flipfree.__version__} of its solver. "
            "Install the extension again and restart Blender"
        )


def certify(snapshot, uv, *, pins=None, bijective=False, disjoint=False, aspect=1.0):
    """Starts the certificate of uv (m, 3, 2) on the snapshot's triangles; returns the job. aspect: of the texture on which
    distortion is measured, here and below."""
    return jobs.certify(
        snapshot.vertices,
        snapshot.triangles,
        uv,
        pins=pins,
        bijective=bijective,
        disjoint=disjoint,
        aspect=aspect,
        threads=threads(),
    )


def certify_arrays(vertices, faces, uv, *, bijective):
    """Starts the certificate of any map; vertices that no face uses are left out."""
    used, compact = np.unique(faces, return_inverse=True)
    return jobs.certify(
        vertices[used],
        compact.reshape(-1, 3).astype(np.int32),
        uv,
        bijective=bijective,
        threads=threads(),
    )


def auto_seams(snapshot, *, cuts, stretch, sharp_angle, weights=None):
    """Starts looking for seams beyond `cuts` (submesh vertex pairs, or None) and edges sharper than the angle (or None).
    weights: as of ff.auto_seams."""
    return jobs.auto_seams(
        snapshot.vertices,
        snapshot.triangles,
        cuts=cuts,
        stretch=stretch,
        sharp_angle=sharp_angle,
        weights=weights,
        uncuttable=snapshot.diagonals,
        materials=snapshot.materials,
        polygons=snapshot.triangle_face,
        **_limits(),
    )


def unwrap(
    snapshot,
    *,
    pins,
    bijective,
    may_add_cuts,
    cut_extremities,
    margin,
    keep_places,
    seams,
    stretch=STRETCH_BOUND,
    effort=QUICK_PACKING,
):
    """Starts the unwrap of a snapshot. keep_places: islands stay where they were if that is a usable layout; otherwise all
    are packed. seams: given, or auto, as many more as `stretch` needs. effort: of the packing, 0 where a layout follows."""
    old = snapshot.corner_uv if keep_places and snapshot.layer_name else None
    return jobs.unwrap(
        snapshot.vertices,
        snapshot.triangles,
        cuts=snapshot.cuts,
        seams=seams,
        stretch=stretch,
        uncuttable=snapshot.diagonals,
        materials=snapshot.materials,
        polygons=snapshot.triangle_face,
        pins=pins or None,
        bijective=bijective,
        may_add_cuts=may_add_cuts,
        cut_extremities=cut_extremities,
        margin=margin,
        effort=effort,
        place_like=old,
        **_limits(),
    )


def unwrap_island(island, *, bijective):
    """Starts the unwrap of one island without pins."""
    return jobs.unwrap(
        island.vertices,
        island.faces,
        seams="given",
        bijective=bijective,
        may_add_cuts=False,
        **_limits(),
    )


def settle(island, uv, pins, *, bijective, aspect):
    """Starts rounding and certifying a map of one island that meets its pins {(face, corner): (u, v)} already."""
    return jobs.improve(
        (island.vertices, island.faces, uv),
        pins=pins,
        keep_bijective=bijective,
        repair=False,
        iterations=0,
        aspect=aspect,
        threads=threads(),
    )


def improve_refined(result, *, held, bijective, aspect, max_seconds):
    """Starts lowering the distortion of a result on its own triangles; vertices of the mask `held` stay where they are."""
    uv = np.empty((len(result.vertices), 2))
    uv[result.faces] = result.uv32()
    vertices = np.flatnonzero(held).tolist()
    return jobs.improve(
        (result.vertices, result.faces, result.uv),
        pins=dict(zip(vertices, map(tuple, uv[vertices].tolist()), strict=True)),
        keep_bijective=bijective,
        repair=False,
        aspect=aspect,
        max_seconds=_shorter(max_seconds, preferences.max_seconds()),
        threads=threads(),
    )


def pull(part, uv, pins, *, iterations, seconds, aspect):
    """Starts pulling pins {(face, corner): (u, v)} to their places in a map (m, 3, 2) that has them elsewhere."""
    return jobs.improve(
        (part.vertices, part.triangles, uv),
        pins=pins,
        iterations=iterations,
        max_seconds=seconds,
        aspect=aspect,
        threads=threads(),
    )


def improve(snapshot, *, pins, bijective, iterations, aspect=1.0, uv=None):
    """Starts lowering the distortion of the snapshot's own map, or of another one."""
    return jobs.improve(
        (snapshot.vertices, snapshot.triangles, snapshot.corner_uv if uv is None else uv),
        pins=pins or None,
        keep_bijective=bijective,
        iterations=iterations,
        aspect=aspect,
        **_limits(),
    )


def repair(snapshot, *, pins, overlaps, stretched, disjoint, margin, aspect):
    """Starts mending the snapshot's own map."""
    return jobs.repair(
        snapshot.vertices,
        snapshot.triangles,
        snapshot.corner_uv,
        cuts=snapshot.cuts,
        uncuttable=snapshot.diagonals,
        pins=pins or None,
        overlaps=overlaps,
        stretched=stretched,
        disjoint=disjoint,
        margin=margin,
        aspect=aspect,
        threads=threads(),
    )


def pack(
    vertices,
    faces,
    uv,
    *,
    margin,
    keep_bijective=True,
    together=False,
    scale_true=False,
    rotation="straight",
    stack_similar=False,
    tile=1001,
    tiles=1,
    aspect=1.0,
    effort=QUICK_PACKING,
    unmoved=None,
    obstacles=None,
    density=None,
    place_like=None,
):
    """Starts moving the islands of a map into the unit square; see flipfree.pack."""
    return jobs.pack(
        vertices,
        faces,
        uv,
        margin=margin,
        keep_bijective=keep_bijective,
        together=together,
        scale_true=scale_true,
        rotation=rotation,
        stack_similar=stack_similar,
        tile=tile,
        tiles=tiles,
        aspect=aspect,
        effort=effort,
        unmoved=unmoved,
        obstacles=obstacles,
        density=density,
        place_like=place_like,
        threads=threads(),
    )


def boundary_angles(snapshot, *, boundary, cones, corners):
    """Starts computing the target angles: flat but for `cones` {submesh vertex: angle}, on the boundary as asked.

    corners: boundary vertices, for a straight boundary.
    """
    return jobs.boundary_angles(
        snapshot.vertices,
        snapshot.triangles,
        boundary,
        cones=cones,
        corners=corners if boundary == "straight" else None,
        threads=threads(),
    )


def conformal(snapshot, angles, refined_start):
    """Starts the conformal map with these (n,) total angles; `refined_start` is auto, on or off."""
    return jobs.conformal(
        snapshot.vertices,
        snapshot.triangles,
        angles,
        cuts=snapshot.cuts,
        uncuttable=snapshot.diagonals,
        intrinsic_refinement=refined_start,
        precision=preferences.precision(),
        **_limits(),
    )


def suggest_cones(snapshot, *, bound, quarter_turns):
    """Starts looking for cones that keep the scale within a ratio of `bound`."""
    return jobs.suggest_cones(
        snapshot.vertices,
        snapshot.triangles,
        bound=bound,
        quarter_turns=quarter_turns,
        **_limits(),
    )


def seamless(snapshot, quarters, *, engine, boundary, optimise):
    """Starts the seamless map of all parts with these cones {submesh vertex: quarter turns of its angle}; `boundary`:
    aligned, aligned_or_free or free."""
    return jobs.seamless(
        snapshot.vertices,
        snapshot.triangles,
        quarters,
        engine=engine,
        boundary=boundary,
        optimise=optimise,
        uncuttable=snapshot.diagonals,
        **_limits(),
    )


def cross_field(
    snapshot, *, edges, edge_weight, curvature, boundary, simplify, sizing=None, cones=None
):
    """Starts the field that follows `edges` (submesh vertex pairs), curvature and, if asked, the boundary; or, with `cones`
    {submesh vertex: quarter turns of its angle}, the smoothest with these; for a map of `sizing`, per submesh vertex."""
    return jobs.cross_field(
        snapshot.vertices,
        snapshot.triangles,
        sharp_edges=edges,
        edge_weight=edge_weight,
        alignment=curvature,
        boundary=boundary,
        simplify=simplify,
        sizing=sizing,
        signature=None if cones is None else flipfree.Signature(cones, []),
        **_limits(),
    )


def field_aligned(snapshot, field, *, sizing, boundary, optimise):
    """Starts the seamless map of all parts that follows the field; `sizing`: per submesh vertex, or None; `boundary`: aligned
    or free."""
    return jobs.field_aligned(
        snapshot.vertices,
        snapshot.triangles,
        field=field,
        sizing=sizing,
        boundary=boundary,
        optimise=optimise,
        uncuttable=snapshot.diagonals,
        **_limits(),
    )


def certify_seamless(result, quarters):
    """Starts the certificate of what will be stored of a seamless map, with its cones."""
    return jobs.certify(
        result.vertices,
        result.faces,
        result.uv32(),
        cones={v: k * math.pi / 2 for v, k in quarters.items()},
        seamless=True,
        threads=threads(),
    )


def embed(island, *, boundary, corners, method, optimise):
    """Starts the map of one island, a disk, onto a convex polygon: a shape by its name, or, with the name "corners", that of
    boundary vertices {vertex: (u, v)}."""
    return jobs.embed(
        island.vertices,
        island.faces,
        boundary=boundary,
        corners=corners,
        method=method,
        optimise=optimise,
        **_limits(),
    )


def match(island, *, points, lines, boundary_loop, boundary_uv, bijective, max_seconds):
    """Starts the map of one island that meets `points` {vertex: (u, v)}, `lines` and, if given, its whole outline."""
    return jobs.match(
        island.vertices,
        island.faces,
        points=points or None,
        lines=lines or None,
        boundary_loop=boundary_loop,
        boundary_uv=boundary_uv,
        bijective=bijective,
        max_seconds=_shorter(max_seconds, preferences.max_seconds()),
        threads=threads(),
    )


def _shorter(seconds: float, limit: float | None) -> float:
    """The lower of two limits of time; 0 and None are none."""
    return min(seconds or math.inf, limit or math.inf) if seconds or limit else 0.0
