"""What one call may do: return something certified, or raise one of the package's exceptions that names what exists."""

from __future__ import annotations

from typing import Any

import numpy as np

import flipfree as ff

from judges.any_triangles import judge_any
from judges.exact import flips
from random_meshes import Mesh


class Finding(Exception):
    """A promise that was broken, in words."""


def _check_certificate(certificate: ff.Certificate) -> None:
    if certificate.ok:
        figures = [certificate.energy, certificate.max_energy]
        if not np.isfinite(figures).all():
            raise Finding(f"the certificate is ok with the energies {figures}")
        if certificate.failures:
            raise Finding(f"the certificate is ok, and lists {certificate.failures}")
    elif not certificate.failures:
        raise Finding("the certificate is not ok and does not say why")


def _check_map(result: ff.Parametrization, arguments: dict[str, Any]) -> None:
    _check_certificate(result.certificate)
    if not result.certificate.ok:
        raise Finding(f"a map came back that failed: {result.certificate.failures}")
    mirrored = np.isin(np.arange(len(result.faces)), result.certificate.mirrored_faces)
    sides = np.where(mirrored[:, None, None], [-1.0, 1.0], 1.0)
    for name, uv in (("uv", result.uv), ("uv64", result.uv64)):
        if result.certificate.mends:
            # Windings may contradict each other, and some faces may have no triangle.
            wrong = judge_any(result.faces, uv, disjoint=False)
        else:
            wrong = [f"{count} flips"] if (count := flips(uv * sides)) else []
        if wrong:
            raise Finding(f"{name} has {wrong}")
    if not np.array_equal(result.uv.astype(np.float32), result.uv32()):
        raise Finding("uv does not round to uv32()")
    # A cone of two whole turns needs no cut: it is one where it is said to be one only.
    turns = result.certificate.quarter_cones.tolist()
    cones = {v: k * np.pi / 2 for v, k in turns} or None
    again = ff.certify(
        result.vertices,
        result.faces,
        result.uv,
        cones=cones,
        seamless=cones is not None,
        mirrored=mirrored.astype(int) if mirrored.any() else None,
    )
    # Where lengths are the metric, positions may have no area to measure distortion against.
    unmeasured = result.certificate.energy == -1.0
    if unmeasured and arguments.get("lengths") is None and not result.certificate.mends:
        raise Finding("the distortion was not measured")
    expected = "The distortion is not a finite number"
    # Where seams are not exact nothing but the call itself says which vertices are cones.
    inexact = arguments.get("exact") is False and all(f.startswith("G2") for f in again.failures)
    if (
        not again.ok
        and not inexact
        and not (unmeasured and len(again.failures) == 1 and again.failures[0].startswith(expected))
    ):
        raise Finding(f"certified again, uv fails: {again.failures}")
    if "vertices" in arguments:
        given = np.asarray(arguments["vertices"], float)
        if not np.array_equal(result.vertices[: len(given)], given, equal_nan=True):
            raise Finding("the first vertices are not those that were given")
    pins = arguments.get("pins") or arguments.get("points") or {}
    for key, place in pins.items():
        at = [key] if isinstance(key, tuple) else np.argwhere(result.faces == key)
        for f, k in at:
            if tuple(result.uv64[f, k]) != tuple(place):
                raise Finding(f"pin {key} is at {result.uv64[f, k]}, not at {place}")
            if tuple(result.uv32()[f, k]) != tuple(np.asarray(place, np.float32)):
                raise Finding(f"pin {key} is stored at {result.uv32()[f, k]}, not at {place}")


def _check_signature(result: ff.Signature, arguments: dict[str, Any]) -> None:
    """The cones of a closed surface add up to its Euler characteristic."""
    faces = np.asarray(arguments["faces"])
    edges = _edges(faces)
    if 2 * len(edges) != 3 * len(faces):
        return
    euler = len(np.unique(faces)) - len(edges) + len(faces)
    if sum(4 - k for k in result.cones.values()) != 4 * euler:
        raise Finding(f"the cones {result.cones} do not fit the Euler characteristic {euler}")


def _check_quads(result: ff.QuadMesh, arguments: dict[str, Any]) -> None:
    if not result.certificate.ok:
        raise Finding(f"a mesh of quads without a certificate: {result.certificate.failures}")
    quads = result.quads
    if (np.sort(quads, axis=1)[:, 1:] == np.sort(quads, axis=1)[:, :-1]).any():
        raise Finding("a quad has a vertex twice")
    sides = np.stack([quads, np.roll(quads, -1, axis=1)], axis=-1).reshape(-1, 2)
    if len(np.unique(sides, axis=0)) != len(sides):
        raise Finding("two quads have one side in the same direction")
    if not np.isfinite(result.vertices).all() or quads.max() >= len(result.vertices):
        raise Finding("a mesh of quads names vertices that are not there")


def check_result(name: str, result: Any, arguments: dict[str, Any]) -> None:
    """Raises Finding for a result that breaks a promise."""
    if isinstance(result, ff.Parametrization):
        _check_map(result, arguments)
    elif isinstance(result, ff.Certificate):
        _check_certificate(result)
    elif isinstance(result, ff.CrossField):
        if not np.allclose(np.linalg.norm(result.directions, axis=1), 1.0, atol=1e-6):
            raise Finding("a field has directions that are no unit vectors")
    elif isinstance(result, ff.Signature):
        _check_signature(result, arguments)
    elif isinstance(result, ff.ConformalMetric):
        parts = [result.scale_factors, result.angles, result.log_lengths]
        if result.converged and not all(np.isfinite(part).all() for part in parts):
            raise Finding("a metric converged with numbers that are not finite")
    elif isinstance(result, ff.QuadMesh):
        _check_quads(result, arguments)
    elif isinstance(result, ff.AdmissibleCut):
        if not all(
            len(branch) > 1 and max(branch) < len(result.vertices) for branch in result.branches
        ):
            raise Finding("an admissible cut has a branch that is none")
    elif not np.isfinite(result).all():
        raise Finding(f"{name} returned angles that are not finite")


def _edges(faces: np.ndarray) -> set[frozenset[int]]:
    return {frozenset((int(f[k]), int(f[(k + 1) % 3]))) for f in faces for k in range(3)}


def _check_elements(error: ff.FlipfreeError, vertex_count: int, faces: np.ndarray) -> None:
    elements = error.elements
    limit = {"vertex": vertex_count, "edge": vertex_count, "face": len(faces)}
    limit |= {"corner": 3 * len(faces), "none": 0}
    if any(not 0 <= e < limit[error.kind] for e in elements):
        raise Finding(f"{error.kind} {elements[:6]} does not exist: {error}")
    if error.kind == "edge":
        known = _edges(faces)
        for a, b in zip(elements[::2], elements[1::2], strict=True):
            if frozenset((a, b)) not in known:
                raise Finding(f"{a}-{b} is no edge: {error}")


def check_error(error: ff.FlipfreeError, mesh: Mesh, arguments: dict[str, Any]) -> None:
    """Raises Finding for an exception of ours that explains nothing, or names what the user does not have."""
    if len(str(error)) < 20 or not error.code:
        raise Finding(f"an error without an explanation: {error!r}")
    if error.code in ("internal error", "out of memory"):
        raise Finding(f"{error.code}: {error}")
    if "Please report" in str(error):
        raise Finding(f"asks to be reported: {error}")
    ours = all(arguments.get(key) is getattr(mesh, key) for key in ("vertices", "faces"))
    if ours or "map_or_arrays" in arguments:
        _check_elements(error, len(mesh.vertices), mesh.faces)
    if isinstance(error, ff.Infeasible) and not error.witness:
        raise Finding(f"Infeasible without a witness: {error}")
