# SPDX-License-Identifier: GPL-3.0-or-later
"""Cones of the parts of an object: where they are marked, and whether they sum to what each part needs (Gauss-Bonnet)."""

import math

import bpy
import numpy as np

from ..meshes import cones, labels, mesh_io, selection
from . import common


def marked(snapshot) -> tuple[dict[int, float], np.ndarray]:
    """({submesh vertex: angle}, (#Sv,) bool boundary of the submesh). A mesh vertex with several fans marks each."""
    boundary, ob = submesh_boundary(snapshot), bpy.data.objects[snapshot.object_name]
    with selection.whole_mesh(ob) as mesh:
        whole = np.zeros(len(mesh.vertices), bool)
        whole[snapshot.vertex_ids[boundary]] = True
        angles = cones.read(ob, mesh, whole)
    found = {i: angles[v] for i, v in enumerate(snapshot.vertex_ids.tolist()) if v in angles}
    return found, boundary


def submesh_boundary(snapshot) -> np.ndarray:
    """(#Sv,) bool: vertices on edges with one triangle."""
    result = np.zeros(len(snapshot.vertices), bool)
    edges, uses = labels.edges_of(snapshot.triangles)
    result[edges[uses == 1]] = True
    return result


def curvature_left(part, angles: np.ndarray, boundary: np.ndarray) -> float:
    """2 pi chi minus the curvature of these total angles, which Gauss-Bonnet wants to be zero; radians."""
    edges = len(labels.edges_of(part.triangles)[0])
    euler = len(part.vertices) - edges + len(part.triangles)
    return 2 * math.pi * euler - float(np.sum(np.where(boundary, math.pi, 2 * math.pi) - angles))


def part_name(snapshot, triangles) -> str:
    """How messages call a part."""
    name = snapshot.object_name
    if len(triangles) == len(snapshot.triangles):
        return name
    faces = np.unique(snapshot.triangle_face[triangles])
    return f"{name}, the part of face {faces[0]} ({common.plural(len(faces), 'face')})"


def refuse_unbalanced(snapshot, parts, suggest: str = "Suggest Cones") -> None:
    """All parts whose cones do not sum to what their shape needs, each with its remainder. parts: [(triangles, curvature
    that is missing, radians)]. suggest: what places cones that would do. Raises MeshProblem."""
    wrong, faces = [], []
    for triangles, left in parts:
        missing = left / (math.pi / 2)
        if abs(missing) > 1e-6:
            wrong.append(f"{part_name(snapshot, triangles)}: {missing:+.6g} quarter turns")
            faces.append(np.unique(snapshot.triangle_face[triangles]))
    if wrong:
        raise mesh_io.MeshProblem(
            "The cones do not sum to what the shape needs. Still missing:\n"
            + "\n".join(wrong)
            + f"\n{suggest} places them, Mark Cone adds and removes single ones",
            "face",
            np.concatenate(faces),
        )
