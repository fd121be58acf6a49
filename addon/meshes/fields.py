# SPDX-License-Identifier: GPL-3.0-or-later
"""What fields follow and what they are, in Blender's terms: a 3D vector per face, sharp edges, the flow of quads, densities.

A field is a FLOAT_VECTOR attribute of faces: one of its four directions, in object coordinates; the others are it turned by
quarters about the face's normal. A face of several triangles has the mean of theirs.
"""

import bmesh
import numpy as np

from flipfree import separated

from .. import compat, scene
from . import labels, mesh_io
from .selection import weights, whole_mesh

NAME = "flipfree_field"
# Shorter, relative to its length, a vector's part in the plane of its face says nothing.
_ASKEW = 1e-3


def _unit(vectors: np.ndarray) -> np.ndarray:
    return vectors / np.maximum(np.linalg.norm(vectors, axis=1), 1e-300)[:, None]


# -- the field
# ------------------------------------------------------------------------------------------------------


def read(ob, snapshot: mesh_io.Snapshot, name: str) -> np.ndarray:
    """(#St, 3) unit vectors in the planes of the triangles. Raises MeshProblem: no such attribute, or faces without a
    direction."""
    with whole_mesh(ob) as mesh:
        values = compat.attribute(mesh, name, "FACE", "FLOAT_VECTOR")
        if values is None:
            known = [
                a.name
                for a in mesh.attributes
                if (a.domain, a.data_type) == ("FACE", "FLOAT_VECTOR")
            ]
            has = f"It has {', '.join(known)}" if known else "Take another source for the field"
            raise mesh_io.MeshProblem(
                f"{ob.name}: the mesh has no attribute '{name}' with a vector per face. {has}"
            )
    vectors = values[snapshot.triangle_face].astype(np.float64)
    normal = _unit(scene.normals(snapshot.vertices[snapshot.triangles]))
    flat = vectors - normal * np.einsum("ij,ij->i", vectors, normal)[:, None]
    length, whole = np.linalg.norm(flat, axis=1), np.linalg.norm(vectors, axis=1)
    bad = ~np.isfinite(whole) | ~(length > _ASKEW * whole)
    if bad.any():
        raise mesh_io.at_faces(
            snapshot,
            bad,
            f"has no direction in its plane in the attribute '{name}'. Give it a vector along the face, or take another source "
            "for the field",
        )
    return flat / length[:, None]


def of_faces(snapshot: mesh_io.Snapshot, directions: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Directions (#St, 3) of the triangles -> mesh faces (k,), float32 vector (k, 3) of each: the mean of its triangles'
    crosses by area, in the frame of the largest of them."""
    normal = scene.normals(snapshot.vertices[snapshot.triangles])
    area = np.linalg.norm(normal, axis=1)
    order = np.lexsort((area, snapshot.triangle_face))
    last = np.append(np.diff(snapshot.triangle_face[order]) != 0, True)
    faces = snapshot.triangle_face[order[last]]
    of_face = np.searchsorted(faces, snapshot.triangle_face)
    x = directions[order[last]]
    y = np.cross(_unit(normal[order[last]]), x)
    across = np.einsum("ij,ij->i", directions, y[of_face])
    along = np.einsum("ij,ij->i", directions, x[of_face])
    # In real numbers: numpy leaves the exponential of complex ones to the system, and not every Wine has it.
    quarter = 4 * np.arctan2(across, along)
    u, v = (np.bincount(of_face, area * part(quarter), len(faces)) for part in (np.cos, np.sin))
    angle = np.arctan2(v, u) / 4
    return faces, (x * np.cos(angle)[:, None] + y * np.sin(angle)[:, None]).astype(np.float32)


def write(ob, faces: np.ndarray, vectors: np.ndarray, name: str = NAME) -> None:
    """Stores the vectors of these mesh faces, in either mode; the attribute is made if there is none."""
    if ob.mode == "EDIT":
        bm = bmesh.from_edit_mesh(ob.data)
        layers = bm.faces.layers.float_vector
        layer = layers.get(name) or layers.new(name)
        bm.faces.ensure_lookup_table()
        for face, vector in zip(faces.tolist(), vectors.tolist(), strict=True):
            bm.faces[face][layer] = vector
        bmesh.update_edit_mesh(ob.data, loop_triangles=False, destructive=False)
        return
    mesh = ob.data
    attribute = compat.made_attribute(mesh, name, "FACE", "FLOAT_VECTOR")
    values = compat.values(attribute.data, "vector", np.float32, 3)
    values[faces] = vectors
    attribute.data.foreach_set("vector", values.ravel())
    mesh.update()


# -- what it follows
# ------------------------------------------------------------------------------------------------------


def edges(snapshot: mesh_io.Snapshot) -> np.ndarray:
    """(e, 2) submesh vertex pairs of the edges of the faces that are worked on, each once."""
    rows, corners = np.nonzero(~snapshot.inner_sides)
    ends = snapshot.triangles[rows[:, None], np.column_stack([corners, (corners + 1) % 3])]
    return np.unique(np.sort(ends, axis=1), axis=0).astype(np.int32)


def marked_sharp(ob, snapshot: mesh_io.Snapshot) -> np.ndarray:
    """(s, 2) submesh vertex pairs of the edges that are marked as sharp."""
    with whole_mesh(ob) as mesh:
        sharp = labels.edge_keys(snapshot.edges[compat.sharp_edges(mesh)])
    own = edges(snapshot)
    return own[np.isin(labels.edge_keys(snapshot.vertex_ids[own]), sharp)]


def sharper_than(snapshot: mesh_io.Snapshot, angle: float) -> np.ndarray:
    """(s, 2) submesh vertex pairs of the edges at which normals turn by more than `angle`, radians."""
    inside = labels.edge_keys(snapshot.diagonals)
    return separated.folds(snapshot.vertices, snapshot.triangles, angle, inside)


def flow(snapshot: mesh_io.Snapshot) -> np.ndarray:
    """(s, 2) submesh vertex pairs of the edges of faces with four corners."""
    inside = labels.edge_keys(snapshot.diagonals)
    return separated.edges_of_quads(snapshot.triangles, snapshot.triangle_face, inside)


# -- how dense the map shall be
# ------------------------------------------------------------------------------------------------------


def painted(
    ob, snapshot: mesh_io.Snapshot, group_name: str, ratio: float, what: str = "the density"
) -> np.ndarray:
    """(#Sv,) factors: 1 where the vertex group has no weight, `ratio` where it is full."""
    group = ob.vertex_groups.get(group_name)
    if group is None:
        raise mesh_io.MeshProblem(
            f"{ob.name}: there is no vertex group '{group_name}' to take {what} from. Paint one in Weight Paint mode, "
            "or name another"
        )
    with whole_mesh(ob) as mesh:
        return ratio ** weights(mesh, group)[0, snapshot.vertex_ids]


def densities(ob, snapshot: mesh_io.Snapshot, name: str) -> np.ndarray:
    """(#Sv,) of a float attribute of points or of faces, whose vertices then have the geometric mean by area."""
    with whole_mesh(ob) as mesh:
        attribute = mesh.attributes.get(name)
        if (
            attribute is None
            or attribute.data_type != "FLOAT"
            or attribute.domain not in {"POINT", "FACE"}
        ):
            raise mesh_io.MeshProblem(
                f"{ob.name}: the mesh has no attribute '{name}' with a number per point or face to take the density from. "
                "Name one that it has, or take another density"
            )
        on_points = attribute.domain == "POINT"
        values = compat.values(attribute.data, "value", np.float32)
    values = values[snapshot.vertex_ids if on_points else snapshot.triangle_face].astype(float)
    bad = ~(np.isfinite(values) & (values > 0))
    if bad.any():
        problem_at = mesh_io.at_vertices if on_points else mesh_io.at_faces
        raise problem_at(
            snapshot,
            bad,
            f"has no positive number in the attribute '{name}'. Give it the length in the map of a length 1 there, relative to "
            "the others",
        )
    if on_points:
        return values
    normals = scene.normals(snapshot.vertices[snapshot.triangles])
    area = np.repeat(np.linalg.norm(normals, axis=1), 3)
    at, count = snapshot.triangles.ravel(), len(snapshot.vertices)
    logs = np.bincount(at, area * np.repeat(np.log(values), 3), count)
    return np.exp(logs / np.maximum(np.bincount(at, area, count), 1e-300))
