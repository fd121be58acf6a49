# SPDX-License-Identifier: GPL-3.0-or-later
"""Surfaces as they stand in the scene: sizes are measured there, objects may be scaled, and not alike in all directions."""

import bpy
import numpy as np

# Scales of an object that differ by less are one scale.
_UNEVEN = 1e-3


def matrix(ob: bpy.types.Object | None) -> np.ndarray:
    """(3, 3) what turns and scales the object into the scene; the identity if that leaves nothing of it."""
    if ob is None:
        return np.eye(3)
    found = np.array(ob.matrix_world.to_3x3(), np.float64)
    return found if np.isfinite(found).all() and found.any() else np.eye(3)


def placed(points: np.ndarray, ob: bpy.types.Object | None) -> np.ndarray:
    """(..., 3) float64 points of the object, turned and scaled into the scene, not moved there."""
    return points.astype(np.float64) @ matrix(ob).T


def uneven(ob: bpy.types.Object | None) -> bool:
    """Whether the object is scaled more in one direction than in another one."""
    sizes = np.linalg.svd(matrix(ob), compute_uv=False)
    return bool(sizes[0] - sizes[-1] > _UNEVEN * sizes[0])


def normals(corners: np.ndarray) -> np.ndarray:
    """(k, 3) of triangles (k, 3, 3): twice the area long."""
    return np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])


def placed_vertices(
    vertices: np.ndarray, triangles: np.ndarray, ob: bpy.types.Object | None
) -> np.ndarray:
    """(n, 3) of a surface of the object, turned and scaled into the scene; as they are, if no face has an area there."""
    points = placed(vertices, ob)
    if np.linalg.det(matrix(ob)) != 0.0 and np.isfinite(points).all():
        return points  # what has an area has one there
    found = normals(points[triangles])
    return points if np.isfinite(found).all() and found.any() else vertices
