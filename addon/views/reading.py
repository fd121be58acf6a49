# SPDX-License-Identifier: GPL-3.0-or-later
"""A mesh as the views want it: arrays that are read when they are first asked for."""

from contextlib import contextmanager
from functools import cached_property

import bmesh
import bpy
import numpy as np

from .. import compat
from ..meshes import cones, mesh_io, selection, turns


class Read:
    """Of one object, in either mode; valid as long as its context. Faces that are hidden in edit mode are left out."""

    def __init__(self, ob, mesh):
        self.ob = ob
        self.mesh = mesh
        layer = mesh.uv_layers.active
        self.layer = layer.name if layer else ""

    @cached_property
    def points(self) -> np.ndarray:
        """(n, 3) float32."""
        return compat.positions(self.mesh)

    @property
    def extent(self) -> float:
        return float(np.linalg.norm(np.ptp(self.points, axis=0))) if len(self.points) else 0.0

    @cached_property
    def _triangles(self) -> tuple[np.ndarray, np.ndarray]:
        mesh = self.mesh
        mesh.calc_loop_triangles()
        loops = compat.values(mesh.loop_triangles, "loops", np.int32, 3)
        faces = compat.triangle_faces(mesh)
        shown = ~selection.hidden_faces(mesh)[faces]
        return loops[shown], faces[shown]

    @property
    def loops(self) -> np.ndarray:
        """(t, 3) of the triangles."""
        return self._triangles[0]

    @property
    def faces(self) -> np.ndarray:
        """(t,) of the triangles."""
        return self._triangles[1]

    @cached_property
    def corner_points(self) -> np.ndarray:
        """(t, 3, 3) float32."""
        return self.points[compat.corner_vertices(self.mesh)[self.loops]]

    @cached_property
    def uv(self) -> np.ndarray:
        """(#loops, 2) float32, of the active UV map; zeros without one."""
        return compat.uv_values(self.mesh, self.layer)

    @cached_property
    def boundary(self) -> np.ndarray:
        """(n,) bool."""
        return cones.boundary_vertices(self.mesh)

    @cached_property
    def cones(self) -> dict[int, float]:
        """{vertex: angle in radians}"""
        return cones.read(self.ob, self.mesh, self.boundary)

    @cached_property
    def seam_turns(self) -> tuple[np.ndarray, np.ndarray]:
        """(k,) edges that are seams or have turns, (k,) their turns as turns.py stores them, 0 where there are none."""
        values = compat.attribute(self.mesh, turns.NAME, "EDGE", "INT")
        values = np.zeros(len(self.mesh.edges), np.int32) if values is None else values
        edges = np.flatnonzero(compat.seam_edges(self.mesh) | (values > 0))
        return edges, values[edges]

    def snapshot(self) -> mesh_io.Snapshot:
        """As solvers see them. Raises MeshProblem."""
        shown = ~selection.hidden_faces(self.mesh)
        return mesh_io.of_mesh(self.ob.name, self.mesh, shown, "all faces are hidden")


@contextmanager
def reading(ob):
    """Leaves an edited mesh alone: `update_from_editmode` would make Blender think that it changed, and look again."""
    if ob.mode != "EDIT":
        yield Read(ob, ob.data)
        return
    mesh = bpy.data.meshes.new(ob.name)
    try:
        bmesh.from_edit_mesh(ob.data).to_mesh(mesh)
        yield Read(ob, mesh)
    finally:
        bpy.data.meshes.remove(mesh)
