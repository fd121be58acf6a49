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

from . import compat


class MeshProblem(Exception):
    """Something about a user's mesh that stops the work. `kind` and `elements` say what to select."""

    def __init__(self, message: str, kind: str = "none", elements=()):
        super().__init__(message)
        self.kind = kind  # "vertex", "edge", "face" or "none"
        self.elements = np.asarray(elements, dtype=np.int64)  # ids in the Blender mesh


class NothingSelected(MeshProblem):
    """In edit mode no face of the object is selected."""


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
    uv: np.ndarray  # (#loops, 2) float32; zeros without a UV map
    pinned: np.ndarray  # (#loops,) bool
    seams: np.ndarray  # (#edges,) bool
    edges: np.ndarray  # (#edges, 2) mesh vertices of each edge
    # (k, 3) mesh loops of the triangles that are not worked on.
    other_loops: np.ndarray = field(default_factory=lambda: np.zeros((0, 3), np.int32))
    counts: tuple = field(default=())  # to notice that the mesh was changed meanwhile

    @property
    def corner_uv(self) -> np.ndarray:
        """(#St, 3, 2) float32: the UVs as they were."""
        return self.uv[self.triangle_loops]

    @property
    def diagonals(self) -> np.ndarray:
        """(d, 2) submesh vertex pairs: edges of triangles inside faces. A map cannot be cut there, as a face's corner has
        one UV."""
        ends = np.concatenate([self.triangles[:, e] for e in ((0, 1), (1, 2), (2, 0))])
        inside = ~np.isin(edge_keys(self.vertex_ids[ends]), edge_keys(self.edges))
        return np.unique(np.sort(ends[inside], axis=1), axis=0).astype(np.int32)

    def part(self, triangles: np.ndarray) -> tuple["Snapshot", np.ndarray]:
        """These triangles as a snapshot of their own, and the (#part,) submesh vertex of each of its vertices."""
        corners = self.triangles[triangles]
        used, compact = np.unique(corners, return_inverse=True)
        number = np.full(len(self.vertices), -1, np.int32)
        number[used] = np.arange(len(used))
        ends = np.concatenate([corners[:, e] for e in ((0, 1), (1, 2), (2, 0))])
        cuts = self.cuts[np.isin(edge_keys(self.cuts), edge_keys(ends))]
        part = replace(
            self,
            vertices=self.vertices[used],
            triangles=compact.reshape(-1, 3).astype(np.int32),
            cuts=number[cuts],
            vertex_ids=self.vertex_ids[used],
            triangle_loops=self.triangle_loops[triangles],
            triangle_face=self.triangle_face[triangles],
        )
        return part, used


def _get(collection, name: str, count: int, dtype, width: int = 1) -> np.ndarray:
    values = np.empty(count * width, dtype=dtype)
    collection.foreach_get(name, values)
    return values.reshape(count, width) if width > 1 else values


def _counts(mesh) -> tuple:
    return len(mesh.vertices), len(mesh.edges), len(mesh.loops), len(mesh.polygons)


def read(ob: bpy.types.Object, *, only_selected: bool, uv_selection: bool = False) -> Snapshot:
    """Reads the faces of `ob` that are to be unwrapped; in edit mode the visible selected ones.

    uv_selection: of those, only faces that are selected in the UV editor as well.
    Raises MeshProblem if there is nothing to work on or coordinates are not finite.
    """
    if ob.mode == "EDIT":
        # Attribute arrays are empty during editing, those of a copy are not.
        ob.update_from_editmode()
        mesh = ob.data.copy()
        try:
            return _read(ob.name, mesh, only_selected, uv_selection)
        finally:
            bpy.data.meshes.remove(mesh)
    return _read(ob.name, ob.data, False, False)


def _read(name: str, mesh, only_selected: bool, uv_selection: bool) -> Snapshot:
    active = mesh.uv_layers.active
    layer_name = active.name if active else ""
    if len(mesh.polygons) == 0:
        raise MeshProblem(f"{name}: the mesh has no faces. Nothing to unwrap")

    positions = _get(mesh.vertices, "co", len(mesh.vertices), np.float32, 3)
    mesh.calc_loop_triangles()
    count = len(mesh.loop_triangles)
    corners = _get(mesh.loop_triangles, "vertices", count, np.int32, 3)
    loops = _get(mesh.loop_triangles, "loops", count, np.int32, 3)
    faces = _get(mesh.loop_triangles, "polygon_index", count, np.int32)

    other_loops = loops[:0]
    if only_selected:
        chosen = _get(mesh.polygons, "select", len(mesh.polygons), bool)
        chosen &= ~_get(mesh.polygons, "hide", len(mesh.polygons), bool)
        if uv_selection and layer_name:
            chosen &= compat.uv_selected_faces(mesh, layer_name)
        if not chosen.any():
            raise NothingSelected(f"{name}: no faces are selected. Select the faces to work on")
        keep = chosen[faces]
        other_loops = loops[~keep]
        corners, loops, faces = corners[keep], loops[keep], faces[keep]

    used = np.unique(corners)
    bad = used[~np.isfinite(positions[used]).all(axis=1)]
    if len(bad):
        raise MeshProblem(
            f"{name}: vertex {bad[0]}{more(bad)} has a coordinate that is no number. Delete it",
            "vertex",
            bad,
        )

    edges = _get(mesh.edges, "vertices", len(mesh.edges), np.int32, 2)
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
        uv=compat.uv_values(mesh, layer_name)
        if layer_name
        else np.zeros((len(mesh.loops), 2), np.float32),
        pinned=compat.pinned_loops(mesh, layer_name)
        if layer_name
        else np.zeros(len(mesh.loops), bool),
        seams=seams,
        edges=edges,
        other_loops=other_loops,
        counts=_counts(mesh),
    )


def more(elements) -> str:
    return f" (and {len(elements) - 1} more)" if len(elements) > 1 else ""


def edge_keys(pairs: np.ndarray) -> np.ndarray:
    """One int64 per vertex pair, the same for both directions."""
    pairs = pairs.astype(np.int64)
    return np.minimum(pairs[:, 0], pairs[:, 1]) << 32 | np.maximum(pairs[:, 0], pairs[:, 1])


def _cuts(corners: np.ndarray, triangles: np.ndarray, seam_vertices: np.ndarray) -> np.ndarray:
    """Seams inside the submesh as (s, 2) submesh vertex pairs."""
    if not len(seam_vertices):
        return np.zeros((0, 2), np.int32)
    ends = ((0, 1), (1, 2), (2, 0))
    in_mesh = np.concatenate([corners[:, e] for e in ends])
    in_submesh = np.concatenate([triangles[:, e] for e in ends])
    on_seam = np.isin(edge_keys(in_mesh), edge_keys(seam_vertices))
    pairs = np.sort(in_submesh[on_seam], axis=1)
    return np.unique(pairs, axis=0).astype(np.int32)


def split_fans(
    corners: np.ndarray, cuts: np.ndarray | None = None
) -> tuple[np.ndarray, np.ndarray]:
    """Renumbers triangles so that every fan of edge-connected triangles around a point has its own vertex.

    corners (m, 3) mesh vertices -> triangles (m, 3) int32, vertex_ids (n,) mesh vertex of each new vertex. Vertices keep the
    mesh's order, fans of one vertex the order of their triangles. All triangles of an edge count as connected, however
    many they are and whichever way they run: the solver's validation shall name such an edge and nothing else. Edges in
    `cuts` (s, 2) connect nothing.
    """
    m = len(corners)
    start = corners.ravel().astype(np.int64)
    end = np.roll(corners, -1, axis=1).ravel().astype(np.int64)
    half_edges = np.arange(3 * m)  # 3 t + k runs from corner k of triangle t to its next corner
    following = half_edges // 3 * 3 + (half_edges + 1) % 3
    low = np.where(start < end, half_edges, following)
    high = np.where(start < end, following, half_edges)
    key = edge_keys(np.column_stack([start, end]))
    order = np.argsort(key, kind="stable")
    joined = key[order][1:] == key[order][:-1]
    if cuts is not None and len(cuts):
        joined &= ~np.isin(key[order][1:], edge_keys(cuts))
    same = np.flatnonzero(joined)
    a, b = order[same], order[same + 1]
    links_a, links_b = np.concatenate([low[a], high[a]]), np.concatenate([low[b], high[b]])
    label = connected_components(3 * m, links_a, links_b)
    # Order fans by (mesh vertex, first corner).
    roots = np.flatnonzero(label == np.arange(3 * m))
    roots = roots[np.lexsort((roots, start[roots]))]
    number = np.empty(3 * m, dtype=np.int32)
    number[roots] = np.arange(len(roots), dtype=np.int32)
    return number[label].reshape(m, 3), start[roots]


def connected_components(n: int, a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """(n,) smallest member of each element's component under the links a[i] - b[i]. O((n + #links) log n)."""
    label = np.arange(n)
    while len(a):
        low, high = np.minimum(label[a], label[b]), np.maximum(label[a], label[b])
        differ = low != high
        if not differ.any():
            break
        a, b, low, high = a[differ], b[differ], low[differ], high[differ]
        np.minimum.at(label, high, low)
        while True:
            up = label[label]
            if np.array_equal(up, label):
                break
            label = up
    return label


def face_components(triangles: np.ndarray) -> np.ndarray:
    """(m,) smallest triangle of each triangle's component; triangles are joined by common edges."""
    m = len(triangles)
    key = edge_keys(np.concatenate([triangles[:, e] for e in ((0, 1), (1, 2), (2, 0))]))
    order = np.argsort(key, kind="stable")
    same = np.flatnonzero(key[order][1:] == key[order][:-1])
    return connected_components(m, order[same] % m, order[same + 1] % m)


def _edge_ends(triangles: np.ndarray):
    """Corners at both ends of every inner edge, in one triangle and in the other: (low, other low, high, other high)."""
    m = len(triangles)
    low_corner, high_corner = [], []
    for k in range(3):
        here, there = 3 * np.arange(m) + k, 3 * np.arange(m) + (k + 1) % 3
        up = triangles[:, k] < triangles[:, (k + 1) % 3]
        low_corner.append(np.where(up, here, there))
        high_corner.append(np.where(up, there, here))
    low, high = np.concatenate(low_corner), np.concatenate(high_corner)
    vertex = triangles.ravel().astype(np.int64)
    key = vertex[low] << 32 | vertex[high]
    order = np.argsort(key, kind="stable")
    same = np.flatnonzero(key[order][1:] == key[order][:-1])
    a, b = order[same], order[same + 1]
    return low[a], low[b], high[a], high[b]


def count_islands(triangles: np.ndarray, uv: np.ndarray) -> int:
    """Islands of the map uv (m, 3, 2): triangles belong together if they share an edge and its UVs, bit for bit."""
    low, other_low, high, other_high = _edge_ends(triangles)
    flat = uv.reshape(-1, 2)
    joined = (flat[low] == flat[other_low]).all(axis=1) & (flat[high] == flat[other_high]).all(
        axis=1
    )
    label = connected_components(len(triangles), low[joined] // 3, other_low[joined] // 3)
    return len(np.unique(label))


def nearly_joined(triangles: np.ndarray, uv: np.ndarray) -> int:
    """Edges whose UVs on the two sides differ, but only in the last bits that 32-bit floats have: never meant to be cuts."""
    low, other_low, high, other_high = _edge_ends(triangles)
    flat = uv.reshape(-1, 2).astype(np.float64)
    apart = np.concatenate([flat[low] - flat[other_low], flat[high] - flat[other_high]], axis=1)
    size = np.maximum(np.abs(flat[low]), np.abs(flat[high])).max(axis=1, initial=1.0)
    gap = np.abs(apart).max(axis=1)
    last_bits = 4 * np.finfo(np.float32).eps * np.maximum(size, 1.0)
    return int(np.count_nonzero((gap > 0) & (gap <= last_bits)))


def _per_loop(snapshot: Snapshot, corner_uv: np.ndarray):
    """(loops, row of `values` that holds each loop's value, values (3 #St, 2) float32, rows that disagree)."""
    values = np.asarray(corner_uv, dtype=np.float32).reshape(-1, 2)
    loops, first, inverse = np.unique(
        snapshot.triangle_loops.ravel(), return_index=True, return_inverse=True
    )
    torn = np.flatnonzero((values != values[first][inverse]).any(axis=1))
    return loops, first, values, torn


def torn_faces(snapshot: Snapshot, corner_uv: np.ndarray) -> np.ndarray:
    """Faces of which a corner would need different UVs in different triangles."""
    return np.unique(snapshot.triangle_face[_per_loop(snapshot, corner_uv)[3] // 3])


def loop_values(snapshot: Snapshot, corner_uv: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """(#St, 3, 2) per triangle corner -> loops (k,), float32 values (k, 2): one per loop.

    A face's corner shared by several of its triangles must have one value in all of them, bit for bit; otherwise the
    map is torn inside a face and MeshProblem names it.
    """
    loops, first, values, torn = _per_loop(snapshot, corner_uv)
    if len(torn):
        faces = np.unique(snapshot.triangle_face[torn // 3])
        raise MeshProblem(
            f"{snapshot.object_name}: the map is cut through face {faces[0]}{more(faces)}, which has one UV per corner. "
            "Mark seams that open the surface along its edges, or triangulate the face",
            "face",
            faces,
        )
    return loops, values[first]


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
    mesh = ob.data
    if ob.mode == "EDIT":
        _write_edit_mode(ob, snapshot, loops, values, new_seams)
        return
    if _counts(mesh) != snapshot.counts:
        raise MeshProblem(
            f"{ob.name}: the mesh was changed while its map was computed. Run the operator again"
        )
    name = snapshot.layer_name or mesh.uv_layers.new(name="UVMap").name
    stored = compat.uv_values(mesh, name)
    stored[loops] = values
    compat.set_uv_values(mesh, name, stored)
    if new_seams is not None and len(new_seams):
        seams = compat.seam_edges(mesh)
        seams[new_seams] = True
        compat.set_seam_edges(mesh, seams)
    mesh.update()


def _write_edit_mode(ob, snapshot, loops, values, new_seams) -> None:
    mesh = ob.data
    bm = bmesh.from_edit_mesh(mesh)
    counts = len(bm.verts), len(bm.edges), sum(len(f.loops) for f in bm.faces), len(bm.faces)
    if counts != snapshot.counts:
        raise MeshProblem(
            f"{ob.name}: the mesh was changed while its map was computed. Run the operator again"
        )
    layers = bm.loops.layers.uv
    layer = layers[snapshot.layer_name] if snapshot.layer_name else layers.new("UVMap")
    new = np.full(snapshot.counts[2], -1, dtype=np.int64)
    new[loops] = np.arange(len(loops))
    new = new.tolist()  # lists of Python numbers are read several times faster than numpy rows
    uv = np.asarray(values, dtype=np.float64).tolist()
    index = 0
    for face in bm.faces:
        for loop in face.loops:
            row = new[index]
            if row >= 0:
                loop[layer].uv = uv[row]
            index += 1
    if new_seams is not None and len(new_seams):
        bm.edges.ensure_lookup_table()
        for edge in new_seams.tolist():
            bm.edges[edge].seam = True
    bmesh.update_edit_mesh(mesh, loop_triangles=False, destructive=False)


def edge_ids(snapshot: Snapshot, submesh_pairs: np.ndarray) -> np.ndarray:
    """Ids of the mesh's edges between these submesh vertices; pairs that are no edge (diagonals) are left out."""
    pairs = snapshot.vertex_ids[np.asarray(submesh_pairs, dtype=np.int64).reshape(-1, 2)]
    return np.flatnonzero(np.isin(edge_keys(snapshot.edges), edge_keys(pairs)))


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


def select_only(ob: bpy.types.Object, kind: str, elements: np.ndarray) -> None:
    """Selects these elements and nothing else, in the select mode that shows them. No-op for kind "none"."""
    if kind == "none" or len(elements) == 0:
        return
    mesh = ob.data
    if ob.mode == "EDIT":
        bm = bmesh.from_edit_mesh(mesh)
        bm.select_mode = {{"vertex": "VERT", "edge": "EDGE", "face": "FACE"}[kind]}
        bpy.context.tool_settings.mesh_select_mode = (
            kind == "vertex",
            kind == "edge",
            kind == "face",
        )
        for sequence in (bm.verts, bm.edges, bm.faces):
            for element in sequence:
                element.select = False
        sequence = {"vertex": bm.verts, "edge": bm.edges, "face": bm.faces}[kind]
        sequence.ensure_lookup_table()
        for index in elements.tolist():
            if not sequence[index].hide:
                sequence[index].select_set(True)
        bm.select_flush_mode()
        bmesh.update_edit_mesh(mesh, loop_triangles=False, destructive=False)
        return
    chosen = {
        "vertex": np.zeros(len(mesh.vertices), bool),
        "edge": np.zeros(len(mesh.edges), bool),
        "face": np.zeros(len(mesh.polygons), bool),
    }
    chosen[kind][elements] = True
    # Larger elements carry their smaller ones, as Blender itself keeps them.
    if kind == "face":
        loop_vertices = _get(mesh.loops, "vertex_index", len(mesh.loops), np.int32)
        loop_edges = _get(mesh.loops, "edge_index", len(mesh.loops), np.int32)
        totals = _get(mesh.polygons, "loop_total", len(mesh.polygons), np.int32)
        in_face = np.repeat(chosen["face"], totals)
        chosen["vertex"][loop_vertices[in_face]] = True
        chosen["edge"][loop_edges[in_face]] = True
    elif kind == "edge":
        edges = _get(mesh.edges, "vertices", len(mesh.edges), np.int32, 2)
        chosen["vertex"][edges[chosen["edge"]].ravel()] = True
    mesh.vertices.foreach_set("select", chosen["vertex"])
    mesh.edges.foreach_set("select", chosen["edge"])
    mesh.polygons.foreach_set("select", chosen["face"])
    mesh.update()
