# SPDX-License-Identifier: GPL-3.0-or-later
"""Blender meshes to the solver's arrays and back.

    object --read--> Snapshot (arrays; holds no Blender data) --solver--> UV per triangle corner --write--> object

The solver sees a submesh: the chosen faces only, triangulated as Blender itself triangulates them, vertices renumbered.
A vertex where faces touch only in that point becomes one vertex per fan of faces: UVs are stored per face corner, so
nothing is lost, and "selected faces only" often leaves such points.
"""

from dataclasses import dataclass, field, replace

import bmesh
import bpy
import numpy as np

import flipfree

from .. import compat
from . import labels, modifiers, selection
from .writing import edit_mode, per_loop


class MeshProblem(Exception):
    """Something about a user's mesh that stops the work. `kind` and `elements` say what to select."""

    def __init__(self, message: str, kind: str = "none", elements=()):
        super().__init__(message)
        self.kind = kind  # "vertex", "edge", "face" or "none"
        self.elements = np.asarray(elements, dtype=np.int64)  # ids in the Blender mesh


class NothingSelected(MeshProblem):
    """No face of the object is selected in edit mode, or all are hidden."""


@dataclass
class Snapshot:
    """What the solver needs of one mesh, and what is needed to put its answer back. #S = submesh."""

    object_name: str
    layer_name: str  # "" if the mesh has no UV map yet
    vertices: np.ndarray  # (#Sv, 3) float64, object coordinates
    triangles: np.ndarray  # (#St, 3) int32
    cuts: np.ndarray  # (s, 2) int32, seams as submesh vertex pairs
    vertex_ids: np.ndarray  # (#Sv,) mesh vertex of each
    triangle_loops: np.ndarray  # (#St, 3) mesh loops
    triangle_face: np.ndarray  # (#St,) mesh face
    materials: np.ndarray  # (#St,) slot of the face's material
    inner_sides: np.ndarray  # (#St, 3) bool: the side from corner k to the next lies inside a face
    uv: np.ndarray  # (#loops, 2) float32; zeros without a UV map
    pinned: np.ndarray  # (#loops,) bool
    seams: np.ndarray  # (#edges,) bool
    edges: np.ndarray  # (#edges, 2) mesh vertices of each edge
    # (k, 3) mesh loops of the triangles that are not worked on.
    other_loops: np.ndarray = field(default_factory=lambda: np.zeros((0, 3), np.int32))
    # (#mesh vertices, 3): where the mesh has its vertices, if `vertices` are where modifiers have put them.
    unmodified: np.ndarray | None = None
    counts: tuple = field(default=())  # to notice that the mesh was changed meanwhile
    # Of a snapshot that was made a clean surface (separated.py): what it was, and flipfree.SeparatedSurface.
    whole: "Snapshot | None" = None
    clean: object = None

    @property
    def corner_uv(self) -> np.ndarray:
        """(#St, 3, 2) float32: the UVs as they were."""
        return self.uv[self.triangle_loops]

    @property
    def diagonals(self) -> np.ndarray:
        """(d, 2) submesh vertex pairs: edges of triangles inside faces. A map cannot be cut there, as a face's corner has
        one UV."""
        start, end = self.triangles, np.roll(self.triangles, -1, axis=1)
        once = self.inner_sides & (start < end)  # a face has its diagonals in both directions
        pairs = np.column_stack([start[once], end[once]])
        pairs = pairs[
            ~labels.members(labels.edge_keys(self.vertex_ids[pairs]), labels.edge_keys(self.edges))
        ]
        keys = np.sort(labels.edge_keys(pairs))
        keys = keys[np.append(True, keys[1:] != keys[:-1])[: len(keys)]]
        return np.column_stack([keys >> 32, keys & 0xFFFFFFFF]).astype(np.int32)

    def part(self, triangles: np.ndarray) -> tuple["Snapshot", np.ndarray]:
        """These triangles as a snapshot of their own, and the (#part,) submesh vertex of each of its vertices."""
        corners = self.triangles[triangles]
        used, compact = np.unique(corners, return_inverse=True)
        number = np.full(len(self.vertices), -1, np.int32)
        number[used] = np.arange(len(used))
        ends = np.concatenate([corners[:, e] for e in ((0, 1), (1, 2), (2, 0))])
        cuts = self.cuts[np.isin(labels.edge_keys(self.cuts), labels.edge_keys(ends))]
        part = replace(
            self,
            vertices=self.vertices[used],
            triangles=compact.reshape(-1, 3).astype(np.int32),
            cuts=number[cuts],
            vertex_ids=self.vertex_ids[used],
            triangle_loops=self.triangle_loops[triangles],
            triangle_face=self.triangle_face[triangles],
            materials=self.materials[triangles],
            inner_sides=self.inner_sides[triangles],
        )
        return part, used

    def without(self, triangles: np.ndarray) -> "Snapshot":
        """A snapshot of the other triangles, which leaves these where they are."""
        rest, _ = self.part(np.setdiff1d(np.arange(len(self.triangles)), triangles))
        kept = np.concatenate([self.other_loops, self.triangle_loops[triangles]])
        return replace(rest, other_loops=kept)


def _get(collection, name: str, count: int, dtype, width: int = 1) -> np.ndarray:
    values = np.empty(count * width, dtype=dtype)
    collection.foreach_get(name, values)
    return values.reshape(count, width) if width > 1 else values


def _counts(mesh) -> tuple:
    return len(mesh.vertices), len(mesh.edges), len(mesh.loops), len(mesh.polygons)


def counts(ob: bpy.types.Object) -> tuple:
    """Numbers of vertices, edges, loops and faces, in either mode."""
    if ob.mode != "EDIT":
        return _counts(ob.data)
    bm = bmesh.from_edit_mesh(ob.data)
    return len(bm.verts), len(bm.edges), sum(len(f.loops) for f in bm.faces), len(bm.faces)


def read(
    ob: bpy.types.Object,
    *,
    only_selected: bool,
    uv_selection: bool = False,
    only_visible: bool = False,
    use_modifiers: bool = False,
) -> Snapshot:
    """Reads the faces of `ob` that are to be unwrapped.

    only_selected: in edit mode, the visible selected ones; of those, with uv_selection, only faces that are selected in the UV
    editor as well. only_visible: in object mode, those that are not hidden in edit mode. use_modifiers: with the positions that
    modifiers and shape keys give them.
    Raises MeshProblem if there is nothing to work on or coordinates are not finite.
    """
    if ob.mode == "EDIT":
        ob.update_from_editmode()  # attribute arrays are empty during editing, those of a copy are not
        mesh = ob.data.copy()
        try:
            chosen = selection.selected_faces(mesh, uv_selection) if only_selected else None
            shape = _modified(ob, mesh) if use_modifiers else None
            return of_mesh(ob.name, mesh, chosen, "no faces are selected. Select some", shape)
        finally:
            bpy.data.meshes.remove(mesh)
    chosen = ~selection.hidden_faces(ob.data) if only_visible else None
    shape = _modified(ob, ob.data) if use_modifiers else None
    return of_mesh(
        ob.name, ob.data, chosen, "all faces are hidden. Alt H in Edit Mode reveals them", shape
    )


def _modified(ob, mesh) -> np.ndarray:
    found = modifiers.positions(ob, mesh)
    if isinstance(found, str):
        raise MeshProblem(found)
    return found


def of_mesh(
    name: str, mesh, chosen: np.ndarray | None = None, none_chosen="", shape=None
) -> Snapshot:
    """Of a mesh that is not in edit mode. chosen: (#faces,) bool, None for all; none_chosen: the error if these are none; shape:
    (#vertices, 3), other positions than its own."""
    active = mesh.uv_layers.active
    layer_name = active.name if active else ""
    if len(mesh.polygons) == 0:
        raise MeshProblem(f"{name}: the mesh has no faces. Nothing to unwrap")

    positions = compat.positions(mesh) if shape is None else shape
    mesh.calc_loop_triangles()
    loops = _get(mesh.loop_triangles, "loops", len(mesh.loop_triangles), np.int32, 3)
    faces = compat.triangle_faces(mesh)
    corners = compat.corner_vertices(mesh)[loops]
    inner = _inner_sides(mesh, loops, faces)

    other_loops = loops[:0]
    if chosen is not None:
        if not chosen.any():
            raise NothingSelected(f"{name}: {none_chosen}")
        keep = chosen[faces]
        other_loops = loops[~keep]
        corners, loops, faces, inner = corners[keep], loops[keep], faces[keep], inner[keep]

    finite = np.isfinite(positions).all(axis=1)
    if not finite.all():
        bad = np.setdiff1d(np.flatnonzero(~finite), _unused(corners, len(positions)))
        if len(bad):
            raise MeshProblem(
                f"{name}: vertex {bad[0]}{more(bad)} has a coordinate that is no number. Delete it",
                "vertex",
                bad,
            )

    edges = compat.edge_vertices(mesh)
    seams = compat.seam_edges(mesh)
    triangles, vertex_ids = split_fans(corners)
    return Snapshot(
        object_name=name,
        layer_name=layer_name,
        vertices=positions[vertex_ids].astype(np.float64),
        triangles=triangles,
        cuts=_cuts(corners, triangles, edges[seams]),
        vertex_ids=vertex_ids,
        triangle_loops=loops,
        triangle_face=faces,
        materials=compat.face_materials(mesh)[faces],
        inner_sides=inner,
        uv=compat.uv_values(mesh, layer_name)
        if layer_name
        else np.zeros((len(mesh.loops), 2), np.float32),
        pinned=compat.pinned_loops(mesh, layer_name)
        if layer_name
        else np.zeros(len(mesh.loops), bool),
        seams=seams,
        edges=edges,
        other_loops=other_loops,
        unmodified=None if shape is None else compat.positions(mesh),
        counts=_counts(mesh),
    )


def more(elements) -> str:
    return f" (and {len(elements) - 1} more)" if len(elements) > 1 else ""


def _cuts(corners: np.ndarray, triangles: np.ndarray, seam_vertices: np.ndarray) -> np.ndarray:
    """Seams inside the submesh as (s, 2) submesh vertex pairs."""
    if not len(seam_vertices):
        return np.zeros((0, 2), np.int32)
    near = np.zeros(max(int(corners.max()), int(seam_vertices.max())) + 1, bool)
    near[seam_vertices] = True
    flags = near[corners]
    rows, sides = np.nonzero(flags & np.roll(flags, -1, axis=1))
    following = (sides + 1) % 3
    in_mesh = np.column_stack([corners[rows, sides], corners[rows, following]])
    in_submesh = np.column_stack([triangles[rows, sides], triangles[rows, following]])
    on_seam = labels.members(labels.edge_keys(in_mesh), labels.edge_keys(seam_vertices))
    pairs = np.sort(in_submesh[on_seam], axis=1)
    return np.unique(pairs, axis=0).astype(np.int32)


def _unused(corners: np.ndarray, count: int) -> np.ndarray:
    used = np.zeros(count, bool)
    used[corners] = True
    return np.flatnonzero(~used)


def _inner_sides(mesh, loops: np.ndarray, faces: np.ndarray) -> np.ndarray:
    """(#triangles, 3) bool: sides that are diagonals of their face. A face's loops follow each other."""
    if len(loops) == len(mesh.polygons):
        return np.zeros(loops.shape, bool)  # triangles only
    first = _get(mesh.polygons, "loop_start", len(mesh.polygons), np.int32)
    last = first + _get(mesh.polygons, "loop_total", len(mesh.polygons), np.int32) - 1
    following = np.where(loops == last[faces][:, None], first[faces][:, None], loops + 1)
    return following != np.roll(loops, -1, axis=1)


def split_fans(
    corners: np.ndarray, cuts: np.ndarray | None = None
) -> tuple[np.ndarray, np.ndarray]:
    """Renumbers triangles so that every fan of edge-connected triangles around a point has its own vertex.

    corners (m, 3) mesh vertices -> triangles (m, 3) int32, vertex_ids (n,) mesh vertex of each new vertex; see
    flipfree.split_fans. Edges in `cuts` (s, 2) connect nothing.
    """
    return flipfree.split_fans(corners, cuts=cuts)


def torn_faces(snapshot: Snapshot, corner_uv: np.ndarray) -> np.ndarray:
    """Faces of which a corner would need different UVs in different triangles."""
    return np.unique(
        snapshot.triangle_face[per_loop.result_of(per_loop.steps(snapshot, corner_uv))[2] // 3]
    )


def loop_values(snapshot: Snapshot, corner_uv: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """(#St, 3, 2) per triangle corner -> loops (k,), float32 values (k, 2): one per loop.

    A face's corner shared by several of its triangles must have one value in all of them, bit for bit; otherwise the
    map is torn inside a face and MeshProblem names it.
    """
    return per_loop.result_of(storing(snapshot, corner_uv))


def storing(snapshot: Snapshot, corner_uv: np.ndarray):
    """loop_values() as a generator."""
    loops, values, torn = yield from per_loop.steps(snapshot, corner_uv)
    if len(torn):
        faces = np.unique(snapshot.triangle_face[torn // 3])
        raise MeshProblem(
            f"{snapshot.object_name}: the map is cut through face {faces[0]}{more(faces)}, which has one UV per corner. "
            "Mark seams that open the surface along its edges, or triangulate the face",
            "face",
            faces,
        )
    return loops, values


def write_uv(
    ob: bpy.types.Object,
    snapshot: Snapshot,
    loops: np.ndarray,
    values: np.ndarray,
    new_seams: np.ndarray | None = None,
) -> None:
    """Stores UVs of these loops in the active UV map (made if there is none) and marks further edges as seams.

    values (k, 2) float32 are stored bit for bit. new_seams: ids of edges. Raises MeshProblem, with nothing changed, if the
    mesh is no longer the one that was read.
    """
    for _ in writing_uv(ob, snapshot, loops, values, new_seams):
        pass


def writing_uv(ob, snapshot, loops, values, new_seams=None):
    """write_uv() as a generator: the same in steps, between which a window goes on. Closed before its end, it leaves the mesh
    as it was read."""
    changed = MeshProblem(
        f"{ob.name}: the mesh was changed while its map was computed. Run the operator again"
    )
    if ob.mode == "EDIT":
        yield from edit_mode.writing(ob, snapshot, loops, values, new_seams, changed)
        return
    mesh = ob.data
    if _counts(mesh) != snapshot.counts:
        raise changed
    name = snapshot.layer_name or mesh.uv_layers.new(name="UVMap").name
    stored = compat.uv_values(mesh, name)
    if len(loops) == len(stored):
        stored = values
    else:
        stored[loops] = values
    compat.set_uv_values(mesh, name, stored)
    if new_seams is not None and len(new_seams):
        seams = compat.seam_edges(mesh)
        seams[new_seams] = True
        compat.set_seam_edges(mesh, seams)
    mesh.update()


def edge_ids(snapshot: Snapshot, submesh_pairs: np.ndarray) -> np.ndarray:
    """Ids of the mesh's edges between these submesh vertices; pairs that are no edge (diagonals) are left out."""
    if not len(submesh_pairs):
        return np.zeros(0, np.int64)
    pairs = snapshot.vertex_ids[np.asarray(submesh_pairs, dtype=np.int64).reshape(-1, 2)]
    return np.flatnonzero(labels.members(labels.edge_keys(snapshot.edges), labels.edge_keys(pairs)))


def triangles_at(snapshot: Snapshot, kind: str, elements) -> np.ndarray:
    """The snapshot's triangles at elements that the solver names (see flipfree.errors), those it does not know left out."""
    ids = np.asarray(elements, dtype=np.int64).ravel()
    if kind in ("vertex", "edge"):
        return np.flatnonzero(np.isin(snapshot.triangles, ids).any(axis=1))
    if kind in ("face", "corner"):
        faces = ids // 3 if kind == "corner" else ids
        return np.unique(faces[faces < len(snapshot.triangles)])
    return np.zeros(0, np.int64)


def to_mesh_elements(snapshot: Snapshot, kind: str, elements) -> tuple[str, np.ndarray]:
    """The solver's ids (see flipfree.errors) as ids of the Blender mesh: ("vertex" | "edge" | "face", ids)."""
    elements = np.asarray(elements, dtype=np.int64).ravel()
    if kind == "vertex":
        return kind, np.unique(snapshot.vertex_ids[elements])
    if kind == "edge":
        found = edge_ids(snapshot, elements)
        if len(found):
            return "edge", found
        pairs = elements.reshape(-1, 2)
        return "vertex", np.unique(snapshot.vertex_ids[pairs])
    if kind == "face":
        return kind, np.unique(snapshot.triangle_face[elements])
    if kind == "corner":
        return "face", np.unique(snapshot.triangle_face[elements // 3])
    return "none", np.zeros(0, np.int64)
