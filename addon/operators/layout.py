# SPDX-License-Identifier: GPL-3.0-or-later
"""One layout for all objects of a run: their maps are packed together before any is written.

    tasks that ended well --joint--> JointLayout: one pack job over all islands, then each object's certificate anew

All islands get one scale, measured on the surfaces as they stand in the scene: objects that are scaled, in whatever way, count
with their areas there. Faces of edited meshes that are not worked on are obstacles.
"""

import functools

import bpy
import numpy as np

import flipfree

from .. import modal, scene, solver, texture, watch
from ..meshes import mesh_io
from . import common


def following(context, tasks):
    """For modal.Run: the layout of these tasks, clear of what else the edited meshes have in UV space."""
    snapshots = [task.snapshot for task in tasks]
    found = [s.uv[s.other_loops] for s in snapshots if s.layer_name]
    if context.mode == "EDIT_MESH":
        names = {s.object_name for s in snapshots}
        for ob in common.meshes(context):
            if ob.name not in names and ob.data.uv_layers.active is not None:
                found.append(_map_of(ob))
    obstacles = np.concatenate([np.zeros((0, 3, 2), np.float32), *found]).astype(np.float64)
    return of_tasks(tasks, _laid_out(obstacles))


def of_tasks(tasks, obstacles=None):
    """For modal.Run: the layout of these tasks. Their solvers are told that one follows: packing each object's islands first
    took longer than all the rest of a scene of many small ones."""
    packing = [task for task in tasks if getattr(task, "packs", False)]
    # A solver knows the surface without the scale of its object.
    alone = len(packing) == 1 and (obstacles is None or not len(obstacles))
    alone = alone and not scene.uneven(bpy.data.objects.get(packing[0].snapshot.object_name))
    for task in packing:
        task.packs_alone = task.packs_alone and alone
    return functools.partial(joint, obstacles=obstacles)


def joint(done: list, obstacles=None) -> "JointLayout | None":
    """The task that lays out what these tasks found; None if their solver has done so, or none wants it."""
    tasks = [task for task in done if getattr(task, "packs", False)]
    kept = [task.snapshot.uv[task.snapshot.other_loops] for task in tasks if task.leaves_out]
    if kept:
        known = [] if obstacles is None else [obstacles]
        obstacles = _laid_out(np.concatenate([*known, *kept]).astype(np.float64))
    if not tasks:
        return looking(done)
    alone = len(tasks) == 1 and tasks[0].packs_alone
    return None if alone else JointLayout(done, tasks, obstacles)


def _map_of(ob) -> np.ndarray:
    """(k, 3, 2) UVs of an edited object of which no face is selected."""
    try:
        return mesh_io.read(ob, only_selected=False).corner_uv
    except mesh_io.MeshProblem:  # no faces, or places that are no numbers: nothing to keep clear of
        return np.zeros((0, 3, 2), np.float32)


def _laid_out(triangles: np.ndarray) -> np.ndarray:
    """Without triangles that were never laid out: points, and several faces that fill the whole square each, as those of a
    new UV map do."""
    triangles = triangles[np.isfinite(triangles).all(axis=(1, 2))]
    low, high = triangles.min(axis=1), triangles.max(axis=1)
    whole = (low == 0.0).all(axis=1) & (high == 1.0).all(axis=1)
    one_quad = np.count_nonzero(whole) <= 2
    return triangles[(low != high).any(axis=1) & (~whole | one_quad)]


def pack_beside(snapshot, triangles: np.ndarray, result, pieces: list, *, aspect=1.0):
    """Starts moving a map of some of the snapshot's triangles to where they were or, if it does not fit there, to where there
    is room beside these pieces (islands.Piece), which stay; returns the job. In the pieces' density if it can be. aspect: of
    the texture for which the pieces are made."""
    ob = bpy.data.objects.get(snapshot.object_name)
    density = _density([piece.result for piece in pieces], ob)
    if density is not None:  # of the texture, whose longer side is 1
        density *= np.sqrt(min(aspect, 1.0 / aspect))
    return solver.pack(
        scene.placed(result.vertices, ob),
        result.faces,
        result.uv / [aspect, 1.0],
        margin=texture.margin(),
        scale_true=True,
        aspect=aspect,
        obstacles=np.concatenate(
            [_laid_out(snapshot.uv[snapshot.other_loops].astype(np.float64))]
            + [piece.result.uv32().astype(np.float64) for piece in pieces]
        ),
        density=density,
        place_like=snapshot.corner_uv[triangles],
    )


def _density(maps: list, ob) -> float | None:
    """Length in UV space per length of the object in the scene, over all of these; None if that is no number."""
    surface = plane = 0.0
    for found in maps:
        at, uv = scene.placed(found.vertices, ob)[found.faces], found.uv
        surface += float(np.linalg.norm(scene.normals(at), axis=1).sum())
        sides = np.stack([uv[:, 1] - uv[:, 0], uv[:, 2] - uv[:, 0]], axis=-1)
        plane += float(np.abs(np.linalg.det(sides)).sum())
    density = np.sqrt(plane / surface) if surface > 0.0 else 0.0
    return float(density) if np.isfinite(density) and density > 0.0 else None


def _joined(arrays: list) -> np.ndarray:
    """One below the other. Of a single mesh nothing is copied: a window stands still meanwhile."""
    return arrays[0] if len(arrays) == 1 else np.concatenate(arrays)


class JointLayout(modal.StagedTask):
    """Packs the islands of several tasks. Without those that cannot be laid out, if there are such."""

    writes = False

    def __init__(self, done: list, tasks: list, obstacles):
        super().__init__(tasks[0].snapshot)
        self.done = done  # of the run: a task that fails here is taken out
        self.tasks = tasks
        self.obstacles = obstacles
        surfaces = [task.surface() for task in tasks]
        self.first_vertex = np.cumsum([0] + [len(vertices) for vertices, _ in surfaces])
        self.first_face = np.cumsum([0] + [len(triangles) for _, triangles in surfaces])
        self.failed = list(tasks)

    def stages(self):
        tasks = self.tasks
        snapshots = [task.snapshot for task in tasks]
        keep = tasks[0].keep_placement and all(s.layer_name for s in snapshots)
        there = watch.objects_by_name()
        placed = []
        for task in tasks:
            ob = there.get(task.snapshot.object_name)
            placed.append(scene.placed_vertices(*task.surface(), ob))
            yield modal.Pause()
        triangles = _numbered([task.surface()[1] for task in tasks], self.first_vertex)
        yield modal.Pause()
        uv = _joined([task.uv_on_texture() for task in tasks])
        yield modal.Pause()
        unmoved = self._pinned_corners()
        places = _joined([s.corner_uv for s in snapshots]) if keep else None
        yield modal.Pause()
        packed = yield solver.pack(
            _joined(placed),
            triangles,
            uv,
            unmoved=unmoved,
            obstacles=self.obstacles,
            place_like=places,
            **self._options(),
        )
        stored = packed.uv32()
        yield modal.Pause()
        names = "kept_places tile tiles fill stacked margin_met enlarged_islands".split()
        stats = {name: packed.stats[name] for name in names}
        mirrored = np.zeros(len(triangles), np.int32)
        mirrored[packed.certificate.mirrored_faces] = 1
        for i, task in enumerate(tasks):
            own = slice(self.first_face[i], self.first_face[i + 1])
            self._blame(i)
            yield from task.lay_out(packed.uv[own], stored[own], stats, mirrored[own])
        note_overlaps(tasks, packed.certificate.island_overlaps)

    def _options(self) -> dict:
        """How the first task wants it packed; quickly, unless it says otherwise."""
        first = self.tasks[0]
        quick = {"margin": first.margin, "scale_true": True, "effort": solver.QUICK_PACKING}
        quick["aspect"] = first.aspect
        quick |= getattr(first, "pack_options", {})
        names = [task.groups() for task in self.tasks if hasattr(task, "groups")]
        if names and names[0] is not None:
            quick["layouts"] = np.unique(np.concatenate(names), return_inverse=True)[1]
        return quick

    def _pinned_corners(self) -> np.ndarray:
        corners = [
            3 * (first + t) + k
            for task, first in zip(self.tasks, self.first_face.tolist(), strict=False)
            for t, k in task.pins()
        ]
        return np.array(corners, np.int32)

    def _blame(self, i: int):
        self.snapshot = self.tasks[i].snapshot
        self.failed = [self.tasks[i]]

    def explain(self, error):
        """Ids of all objects together as those of the first one that is named."""
        if len(self.failed) == 1 or not len(error.elements):
            return
        shape = {"vertex": (self.first_vertex, 1), "edge": (self.first_vertex, 1)}
        shape |= {"face": (self.first_face, 1), "corner": (self.first_face, 3)}
        first, width = shape[error.kind]
        ids = np.asarray(error.elements, np.int64)
        limits = width * first
        i = int(np.searchsorted(limits, ids.ravel()[0], side="right")) - 1
        inside = (ids >= limits[i]) & (ids < limits[i + 1])
        error.kind, error.elements = self.tasks[i].in_snapshot(error.kind, ids[inside] - limits[i])
        self._blame(i)

    def instead(self):
        """The same without the objects that failed."""
        for task in self.failed:
            self.done.remove(task)
        return joint(self.done, self.obstacles)


def _numbered(triangles: list, first_vertex: np.ndarray) -> np.ndarray:
    """Of several surfaces, in the numbers of all their vertices one after the other."""
    firsts = first_vertex.tolist()
    return _joined([t + np.int32(n) if n else t for t, n in zip(triangles, firsts, strict=False)])


def looking(done: list) -> "LookBetween | None":
    """For modal.Run, where nothing is laid out: how many islands of different objects lie on each other."""
    maps = [(task, task.stored_map()) for task in done if hasattr(task, "stored_map")]
    found = [(task, stored) for task, stored in maps if stored is not None]
    return LookBetween(found) if len(found) > 1 else None


class LookBetween(modal.StagedTask):
    """Counts pairs of islands of different objects that share area. Changes nothing, and if it fails nothing was counted."""

    writes = False

    def __init__(self, maps: list):
        """maps: [(task, (vertices, triangles, uv (m, 3, 2)))]"""
        super().__init__(maps[0][0].snapshot)
        self.maps = maps

    def stages(self):
        surfaces = [stored for _, stored in self.maps]
        first = np.cumsum([0] + [len(vertices) for vertices, _, _ in surfaces])
        try:
            found = yield solver.certify_arrays(
                np.concatenate([vertices for vertices, _, _ in surfaces]),
                _numbered([triangles for _, triangles, _ in surfaces], first),
                np.concatenate([uv for _, _, uv in surfaces]),
                bijective=False,
            )
        except flipfree.NotConverged:
            return
        note_overlaps([task for task, _ in self.maps], found.island_overlaps)


def note_overlaps(tasks: list, pairs: int) -> None:
    """pairs: of islands on each other in all their maps together. What lies on what within one object was counted with it."""
    own = sum(common.own_overlaps(task) for task in tasks)
    for task in tasks:
        task.object_overlaps = max(pairs - own, 0) if pairs >= 0 else -1
