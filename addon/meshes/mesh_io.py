# SPDX-License-Identifier: GPL-3.0-or-later
"""Blender meshes to the solver's arrays and back.

    object --read--> Snapshot (arrays; holds no Blender data) --solver--> UV per triangle corner --write--> object

The solver sees a submesh: the chosen faces only, triangulated as Blender itself triangulates them, vertices renumbered.
A vertex where faces touch only in that point becomes one vertex per fan of faces: UVs are stored per face corner, so
nothing is lost, and "selected faces only" often leaves such points.
"""

from dataclasses import dataclass, field, replace
from functools import cached_property

import bmesh
import bpy
import numpy as np

import flipfree

from .. import compat
from ..runs import steps
from . import labels, modifiers, selection
from .reading import arrays
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

    @cached_property
    def diagonals(self) -> np.ndarray:
        """(d, 2) submesh vertex pairs: edges of triangles inside faces. A map cannot be cut there, as a face's corner has
        one UV."""
        return steps.result_of(self._finding_diagonals())

    def finding_diagonals(self):
        """The same for later, in steps."""
        self.diagonals = yield from self._finding_diagonals()

    def _finding_diagonals(self):
        start, end = self.triangles, np.roll(self.triangles, -1, axis=1)
        once = self.inner_sides & (start < end)  # a face has its diagonals in both directions
        pairs = np.column_stack([start[once], end[once]])
        yield
        keys = labels.edge_keys(self.vertex_ids[pairs])
        edges = labels.edge_keys(self.edges)
        yield
        pairs = pairs[~labels.members(keys, edges)]
        yield
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


def counts(ob: bpy.types.Object) -> tuple:
    """Numbers of vertices, edges, loops and faces, in either mode."""
    if ob.mode != "EDIT":
        return arrays.counts(ob.data)
    bm = bmesh.from_edit_mesh(ob.data)
    return len(bm.verts), len(bm.edges), sum(len(f.loops) for f in bm.faces), len(bm.faces)


def read(ob: bpy.types.Object, **options) -> Snapshot:
    """Reads the faces of `ob` that are to be unwrapped; options as of reading()."""
    return steps.result_of(reading(ob, **options))


def reading(
    ob: bpy.types.Object,
    *,
    only_selected: bool,
    uv_selection: bool = False,
    only_visible: bool = False,
    use_modifiers: bool = False,
):
    """read() as a generator, of which only the first step looks at Blender's data.

    only_selected: in edit mode, the visible selected ones; of those, with uv_selection, only faces that are selected in the UV
    editor as well. only_visible: in object mode, those that are not hidden in edit mode. use_modifiers: with the positions that
    modifiers and shape keys give them.
    Raises MeshProblem if there is nothing to work on or coordinates are not finite.
    """
    none_chosen = "all faces are hidden. Alt H in Edit Mode reveals them"
    if ob.mode == "EDIT":
        none_chosen = "no faces are selected. Select some"
        ob.update_from_editmode()  # attribute arrays are empty during editing, those of a copy are not
        mesh = ob.data.copy()
        try:
            chosen = selection.selected_faces(mesh, uv_selection) if only_selected else None
            shape = _modified(ob, mesh) if use_modifiers else None
            taken = _taken(ob.name, mesh, chosen, shape)
        finally:
            bpy.data.meshes.remove(mesh)
    else:
        chosen = ~selection.hidden_faces(ob.data) if only_visible else None
        shape = _modified(ob, ob.data) if use_modifiers else None
        taken = _taken(ob.name, ob.data, chosen, shape)
    yield
    return (yield from _assembled(taken, none_chosen))


def _modified(ob, mesh) -> np.ndarray:
    found = modifiers.positions(ob, mesh)
    if isinstance(found, str):
        raise MeshProblem(found)
    return found


def of_mesh(name: str, mesh, chosen: np.ndarray | None = None, none_chosen="") -> Snapshot:
    """Of a mesh that is not in edit mode. chosen: (#faces,) bool, None for all; none_chosen: the error if these are none."""
    return steps.result_of(_assembled(_taken(name, mesh, chosen), none_chosen))


def _taken(name: str, mesh, chosen=None, shape=None) -> arrays.Taken:
    if len(mesh.polygons) == 0:
        raise MeshProblem(f"{name}: the mesh has no faces. Nothing to unwrap")
    return arrays.take(name, mesh, chosen, shape)


def _assembled(taken: arrays.Taken, none_chosen: str):
    """Steps that make the snapshot."""
    name, chosen = taken.name, taken.chosen
    loops, faces = taken.loops, taken.faces
    corners = taken.corner_vertices[loops]
    inner = arrays.inner_sides(taken)
    yield
    other_loops = loops[:0]
    if chosen is not None and not chosen.all():
        if not chosen.any():
            raise NothingSelected(f"{name}: {none_chosen}")
        keep = chosen[faces]
        other_loops = loops[~keep]
        corners, loops, faces, inner = corners[keep], loops[keep], faces[keep], inner[keep]
        yield
    bad = arrays.not_finite(taken.positions, corners)
    if len(bad):
        raise MeshProblem(
            f"{name}: vertex {bad[0]}{more(bad)} has a coordinate that is no number. Delete it",
            "vertex",
            bad,
        )
    triangles, vertex_ids = split_fans(corners)
    yield
    return Snapshot(
        object_name=name,
        layer_name=taken.layer_name,
        vertices=taken.positions[vertex_ids].astype(np.float64),
        triangles=triangles,
        cuts=arrays.cuts(corners, triangles, taken.edges[taken.seams]),
        vertex_ids=vertex_ids,
        triangle_loops=loops,
        triangle_face=faces,
        materials=taken.materials[faces],
        inner_sides=inner,
        uv=taken.uv,
        pinned=taken.pinned,
        seams=taken.seams,
        edges=taken.edges,
        other_loops=other_loops,
        unmodified=taken.unmodified,
        counts=taken.counts,
    )


def more(elements) -> str:
    return f" (and {len(elements) - 1} more)" if len(elements) > 1 else ""


def at_vertices(snapshot: Snapshot, vertices, text: str) -> MeshProblem:
    """To be raised. text: what is wrong with these vertices of the submesh, after "OBJECT: vertex 3 (and 2 more) "."""
    return _at(snapshot, "vertex", snapshot.vertex_ids[vertices], text)


def at_faces(snapshot: Snapshot, triangles, text: str) -> MeshProblem:
    """The same of the faces of these triangles."""
    return _at(snapshot, "face", np.unique(snapshot.triangle_face[triangles]), text)


def _at(snapshot: Snapshot, kind: str, ids, text: str) -> MeshProblem:
    return MeshProblem(f"{snapshot.object_name}: {kind} {ids[0]}{more(ids)} {text}", kind, ids)


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
        snapshot.triangle_face[steps.result_of(per_loop.steps(snapshot, corner_uv))[2] // 3]
    )


def loop_values(snapshot: Snapshot, corner_uv: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """(#St, 3, 2) per triangle corner -> loops (k,), float32 values (k, 2): one per loop.

    A face's corner shared by several of its triangles must have one value in all of them, bit for bit; otherwise the
    map is torn inside a face and MeshProblem names it.
    """
    return steps.result_of(storing(snapshot, corner_uv))


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


def write_uv(ob, snapshot: Snapshot, loops: np.ndarray, values: np.ndarray) -> None:
    """writing_uv(), all at once."""
    steps.result_of(writing_uv(ob, snapshot, loops, values))


def writing_uv(ob, snapshot, loops, values, new_seams=None):
    """Stores UVs of these loops in the active UV map (made if there is none) and marks further edges as seams. A generator: in
    steps, between which a window goes on; closed before its end, it leaves the mesh as it was read.

    values (k, 2) float32 are stored bit for bit. new_seams: ids of edges. Raises MeshProblem, with nothing changed, if the
    mesh is no longer the one that was read.
    """
    changed = MeshProblem(
        f"{ob.name}: the mesh was changed while its map was computed. Run the operator again"
    )
    if ob.mode == "EDIT":
        yield from edit_mode.writing(ob, snapshot, loops, values, new_seams, changed)
        return
    mesh = ob.data
    if arrays.counts(mesh) != snapshot.counts or not has_layer(mesh.uv_layers, snapshot):
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


def has_layer(layers, snapshot: Snapshot) -> bool:
    """Whether the UV map that was read still has its name among these, of a mesh or of one in Edit Mode."""
    return not snapshot.layer_name or layers.get(snapshot.layer_name) is not None


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
