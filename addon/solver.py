# SPDX-License-Identifier: GPL-3.0-or-later
"""The solver package as the extension uses it: the version handshake and the calls that start jobs."""

import functools
import math
import tomllib
from pathlib import Path

import numpy as np

import flipfree

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


# What follows starts a call of flipfree.jobs, of the same name unless it is said, and returns the job. Options that are not named
# here are those of that call. `aspect`: of the texture on which distortion is measured.


def certify(snapshot, uv, **options):
    """The certificate of uv (m, 3, 2) on the snapshot's triangles."""
    return jobs.certify(snapshot.vertices, snapshot.triangles, uv, threads=threads(), **options)


def certify_arrays(vertices, faces, uv, *, bijective):
    """The certificate of any map; vertices that no face uses are left out."""
    used, compact = np.unique(faces, return_inverse=True)
    return jobs.certify(
        vertices[used],
        compact.reshape(-1, 3).astype(np.int32),
        uv,
        bijective=bijective,
        threads=threads(),
    )


def certify_seamless(result, quarters, pins):
    """The certificate of what will be stored of a seamless map, with its cones and pins {submesh vertex: (u, v)}."""
    return jobs.certify(
        result.vertices,
        result.faces,
        result.uv32(),
        cones={v: k * math.pi / 2 for v, k in quarters.items()},
        seamless=True,
        pins=pins or None,
        threads=threads(),
    )


def with_pins(found, pins):
    """A seamless map with pins {submesh vertex: (u, v)}."""
    return jobs.with_pins(found, pins, **_limits())


def _on(name: str, *given: str, **taken: str):
    """The call of that name for a snapshot or an island, within the limits of the preferences. given: attributes of it that come
    first; taken: {option: attribute}. Further arguments and options are the caller's."""

    def start(mesh, *more, **options):
        values = {option: getattr(mesh, attribute) for option, attribute in taken.items()}
        first = (getattr(mesh, attribute) for attribute in ("vertices", *given))
        return getattr(jobs, name)(*first, *more, **values, **_limits(), **options)

    return start


# What solvers that cut want to know of the mesh's faces.
_POLYGONS = {"uncuttable": "diagonals", "materials": "materials", "polygons": "triangle_face"}

auto_seams = _on("auto_seams", "triangles", **_POLYGONS)
boundary_angles = _on("boundary_angles", "triangles")
_conformal = _on("conformal", "triangles", cuts="cuts", uncuttable="diagonals")
cross_field = _on("cross_field", "triangles")
embed = _on("embed", "faces")
field_aligned = _on("field_aligned", "triangles", uncuttable="diagonals")
quads = _on("quads", "triangles")
rectify = _on("rectify", "triangles", "corner_uv", cuts="cuts", polygons="triangle_face")
# Of the snapshot's own map.
repair = _on("repair", "triangles", "corner_uv", cuts="cuts", uncuttable="diagonals")
seamless = _on("seamless", "triangles", uncuttable="diagonals")
suggest_cones = _on("suggest_cones", "triangles")
_admissible_cut = _on("admissible_cut", "triangles")
_unwrap = _on("unwrap", "triangles", cuts="cuts", **_POLYGONS)


def unwrap(snapshot, *, pins, keep_places, effort=QUICK_PACKING, **options):
    """keep_places: islands stay where they were if that is a usable layout; otherwise all are packed. effort: of the packing,
    0 where a layout follows."""
    places = snapshot.corner_uv if keep_places and snapshot.layer_name else None
    return _unwrap(snapshot, pins=pins or None, effort=effort, place_like=places, **options)


unwrap_island = functools.partial(_on("unwrap", "faces"), seams="given", may_add_cuts=False)


def improve(mesh, *, pins, bijective=True, max_seconds=0.0, **options):
    """Less distortion of a map (vertices, faces, uv) with pins {vertex or (face, corner): (u, v)}. max_seconds: where the
    preferences allow more."""
    return jobs.improve(
        mesh,
        pins=pins or None,
        keep_bijective=bijective,
        max_seconds=_shorter(max_seconds, preferences.max_seconds()),
        threads=threads(),
        **options,
    )


def pack(vertices, faces, uv, *, effort=QUICK_PACKING, **options):
    return jobs.pack(vertices, faces, uv, effort=effort, threads=threads(), **options)


def conformal(snapshot, angles, refined_start, precision):
    """precision: bits, 0 for what the preferences have."""
    precision = precision or preferences.precision() or "auto"
    return _conformal(snapshot, angles, intrinsic_refinement=refined_start, precision=precision)


def admissible_cut(snapshot, quarters, field):
    """With these cones, or with those of a field, and its turns."""
    return _admissible_cut(snapshot, None if field is not None else quarters, field=field)


def fit_tiles(found, **options):
    """Of a solver's map, or of (vertices, faces, uv)."""
    return jobs.fit_tiles(found, **_limits(), **options)


def match(island, *, max_seconds, **options):
    return jobs.match(
        island.vertices,
        island.faces,
        max_seconds=_shorter(max_seconds, preferences.max_seconds()),
        threads=threads(),
        **options,
    )


def _shorter(seconds: float, limit: float | None) -> float:
    """The lower of two limits of time; 0 and None are none."""
    return min(seconds or math.inf, limit or math.inf) if seconds or limit else 0.0
