# SPDX-License-Identifier: GPL-3.0-or-later
"""Writes a map whose solver had to subdivide some triangles: those faces are replaced, all others stay as they are.

A new vertex lies on an edge or in the interior of one of the user's triangles (design: guarantee G7). Everything the
mesh carries is interpolated there as the map is, linearly on the triangles that were mapped: vertex groups, shape keys, colours,
other UV maps, custom normals (as vectors). Where the two sides of an edge had one value at both its ends they have one value
on all of it, to the bit (writing/mixing.py). Pieces of an edge keep its seam, sharpness and crease; new faces keep their face's
material. Nothing else moves. What the user marked vertices with is theirs alone: new vertices are neither pinned nor in groups
of pins or cones.
"""

from dataclasses import dataclass

import bmesh
import bpy
import numpy as np

from .. import compat
from . import cones, labels, mesh_io, normals, selection, turns
from .writing import mixing

PIN_GROUP = "Pins"  # its vertices are pinned, as if their UVs were
MOVABLE_GROUP = "Movable"  # the targets of its vertices on an outline are only where they begin


@dataclass
class Plan:
    """What has to change. Vertices are numbered as in the result: the submesh's first, then the new ones."""

    kept: np.ndarray  # (k,) result triangles that are triangles of faces which stay
    children: dict  # face id -> result triangles that replace it
    supports: list  # per new vertex: the input vertices (submesh) between which it lies


def is_refined(snapshot: mesh_io.Snapshot, result) -> bool:
    return len(result.vertices) != len(snapshot.vertices) or len(result.faces) != len(
        snapshot.triangles
    )


def needs_new_faces(snapshot: mesh_io.Snapshot, result) -> bool:
    """Whether the result fits the mesh's own faces: no new vertices, one UV per corner of each face."""
    if is_refined(snapshot, result) or not np.array_equal(result.faces, snapshot.triangles):
        return True
    return len(mesh_io.torn_faces(snapshot, result.uv32())) > 0 or len(_split(snapshot, result)) > 0


def _split(snapshot: mesh_io.Snapshot, result) -> np.ndarray:
    """Faces with a cut along one of their diagonals, if these have to become edges."""
    if not getattr(result, "split_cuts", False):
        return np.zeros(0, np.int64)
    inner = np.isin(labels.edge_keys(result.cut_edges), labels.edge_keys(snapshot.diagonals))
    cut = labels.edge_keys(result.cut_edges[inner])
    sides = np.stack([snapshot.triangles, np.roll(snapshot.triangles, -1, axis=1)], axis=-1)
    at = np.isin(labels.edge_keys(sides.reshape(-1, 2)), cut).reshape(-1, 3)
    return np.unique(snapshot.triangle_face[at.any(axis=1)])


def plan(snapshot: mesh_io.Snapshot, result) -> Plan:
    triangles = len(snapshot.triangles)
    copies = np.bincount(result.parent_face, minlength=triangles)
    # A triangle with one child is that child, whatever its first corner.
    whole = copies == 1
    broken = set(np.unique(snapshot.triangle_face[~whole]).tolist())
    uv = result.uv32()
    aligned = np.zeros((triangles, 3, 2), np.float32)
    for child in np.flatnonzero(whole[result.parent_face]).tolist():
        parent = result.parent_face[child]
        if np.array_equal(result.faces[child], snapshot.triangles[parent]):
            aligned[parent] = uv[child]  # also where a vertex is used twice
            continue
        order = [_corner_of(snapshot.triangles[parent], v) for v in result.faces[child].tolist()]
        aligned[parent, order] = uv[child]
    broken |= set(mesh_io.torn_faces(snapshot, aligned).tolist())
    broken |= set(_split(snapshot, result).tolist())
    face_of = snapshot.triangle_face[result.parent_face]
    replaced = np.isin(face_of, list(broken))
    children = {}
    for child in np.flatnonzero(replaced).tolist():
        children.setdefault(int(face_of[child]), []).append(child)
    n = len(snapshot.vertices)
    supports = []
    for v in range(n, len(result.vertices)):
        weights = result.vertex_barycentric[v]
        corners = snapshot.triangles[result.vertex_parent[v]]
        supports.append(
            frozenset(int(c) for c, w in zip(corners, weights, strict=True) if w != 0.0)
        )
    return Plan(np.flatnonzero(~replaced), children, supports)


def check(snapshot: mesh_io.Snapshot, result) -> None:
    """Raises MeshProblem if Blender could not have the faces that the result needs: two polygons that share two sides in a row
    may both have the triangle of these, bent apart, and Blender has no two faces with the same vertices. `write` asks this
    itself; earlier is for those who write something else before."""
    _refuse_doubled(snapshot, result, plan(snapshot, result))


def _refuse_doubled(snapshot, result, todo: Plan) -> None:
    face_of: dict = {}  # vertices of a face to come, or of a triangle that the mesh has -> its polygon
    whole = np.flatnonzero(np.bincount(snapshot.triangle_face)[snapshot.triangle_face] == 1)
    for t in whole.tolist():
        face_of[frozenset(snapshot.triangles[t].tolist())] = int(snapshot.triangle_face[t])
    doubled: set[int] = set()
    for face, children in todo.children.items():
        for child in children:
            corners = frozenset(result.faces[child].tolist())
            if corners in face_of:  # of the same polygon, too, if that touches itself
                doubled |= {face, face_of[corners]}
            face_of[corners] = face
    if doubled:
        named = ", ".join(map(str, sorted(doubled)[:4]))
        raise mesh_io.MeshProblem(
            f"{snapshot.object_name}: faces {named} share two sides in a row and are bent there: with new vertices they would "
            "need two faces between the same corners, which Blender does not have. Select them and use Face > Poke Faces",
            "face",
            sorted(doubled),
        )


def _corner_of(triangle: np.ndarray, vertex: int) -> int:
    found = np.flatnonzero(triangle == vertex)
    if len(found) != 1:
        raise mesh_io.MeshProblem("the solver's triangles do not fit the mesh")
    return int(found[0])


def write(
    ob: bpy.types.Object,
    snapshot: mesh_io.Snapshot,
    result,
    *,
    mark_cuts: bool,
    cut_turns: np.ndarray | None = None,
) -> int:
    """Replaces the faces that need it and stores all UVs; returns the number of new vertices.

    mark_cuts: edges along which the map is cut become seams. cut_turns: quarter turns across each, for the attribute of
    turns.py. Raises MeshProblem, with nothing changed, if the mesh is no longer the one that was read, or as `check` does.
    """
    todo = plan(snapshot, result)
    _refuse_doubled(snapshot, result, todo)
    editing = ob.mode == "EDIT"
    custom = normals.take(ob)
    if editing:
        bm = bmesh.from_edit_mesh(ob.data)
    else:
        bm = bmesh.new()
        bm.from_mesh(ob.data)
        selection.carry(bm, ob.data)
    try:
        loops = sum(len(face.loops) for face in bm.faces)
        same = (len(bm.verts), len(bm.edges), loops, len(bm.faces)) == snapshot.counts
        if not (same and mesh_io.has_layer(bm.loops.layers.uv, snapshot)):
            raise mesh_io.MeshProblem(
                f"{ob.name}: the mesh was changed while its map was computed. Run the operator again"
            )
        if custom is not None:
            normals.put_into(bm, custom)
        new = _rebuild(bm, snapshot, result, todo, mark_cuts, cut_turns)
        _unmark(bm, new, marking_groups(ob))
        if editing:
            bmesh.update_edit_mesh(ob.data)
        else:
            selected = selection.carried(bm, new)
            bm.to_mesh(ob.data)
            selection.store(ob.data, *selected)
    finally:
        if not editing:
            bm.free()
    if custom is not None:
        normals.restore(ob)
    return len(todo.supports)


def marking_groups(ob) -> list[int]:
    found = [ob.vertex_groups.get(name) for name in (PIN_GROUP, MOVABLE_GROUP)]
    return [*cones.groups(ob), *(group.index for group in found if group is not None)]


def _unmark(bm, vertices, groups) -> None:
    """Takes interpolated pins and cones from new vertices: the next run would take them for the user's."""
    deform = bm.verts.layers.deform.active
    angle = bm.verts.layers.float.get(cones.ATTRIBUTE)
    for vertex in vertices:
        if deform is not None:
            for group in groups:
                if group in vertex[deform]:
                    del vertex[deform][group]
        if angle is not None:
            vertex[angle] = 0.0
        for loop in vertex.link_loops:
            for layer in bm.loops.layers.uv.values():
                if loop[layer].pin_uv:
                    loop[layer].pin_uv = False


def _rebuild(bm, snapshot, result, todo, mark_cuts, cut_turns) -> list:
    """Returns the new vertices."""
    turn_layer = turns.layer_of(bm) if cut_turns is not None else None
    layers = bm.loops.layers.uv
    layer = layers[snapshot.layer_name] if snapshot.layer_name else layers.new("UVMap")
    # Adding elements makes Blender's own index tables stale.
    old_vertices, old_faces = list(bm.verts), list(bm.faces)
    uv = result.uv32().astype(np.float64).tolist()
    faces = result.faces.tolist()

    points = [old_vertices[i] for i in snapshot.vertex_ids.tolist()]
    n = len(points)
    between = {}  # new vertex -> the old ones that it lies between, with their weights
    for v in range(n, len(result.vertices)):
        vertex, weights = _new_vertex(bm, snapshot, result, points, v)
        points.append(vertex)
        between[vertex] = weights
    mix = mixing.Corners(bm, between)

    for child in todo.kept.tolist():
        parent = int(result.parent_face[child])
        face = old_faces[int(snapshot.triangle_face[parent])]
        for corner, vertex in enumerate(faces[child]):
            _loop_at(face, points[vertex])[layer].uv = uv[child][corner]

    if mark_cuts:
        _mark(bm, points, result.cut_edges)  # pieces of these edges inherit the seam
    doomed, old_edges = [], set()
    neighbours = _outside_neighbours(bm, todo, points, old_faces, n)
    for face_id, children in todo.children.items():
        face = old_faces[face_id]
        doomed.append(face)
        old_edges.update(face.edges)
        for child in children:
            _make_pieces_of_edges(bm, faces[child], points, todo.supports, n)
            new = _new_face(bm, [points[v] for v in faces[child]], face, mix)
            for corner, loop in enumerate(new.loops):
                loop[layer].uv = uv[child][corner]
    for face, outline in neighbours:
        doomed.append(face)
        old_edges.update(face.edges)
        _new_face(bm, outline, face, mix)
    bmesh.ops.delete(bm, geom=doomed, context="FACES_ONLY")
    loose = [edge for edge in old_edges if edge.is_valid and not edge.link_faces]
    bmesh.ops.delete(bm, geom=loose, context="EDGES")
    if mark_cuts:
        _mark(bm, points, result.cut_edges)
    if turn_layer is not None:
        turns.write_bmesh(bm, turn_layer, points, result.cut_edges, cut_turns)
    bm.normal_update()
    return points[n:]


def _mark(bm, points, cut_edges) -> None:
    for a, b in cut_edges.tolist():
        edge = bm.edges.get((points[a], points[b]))
        if edge is not None:
            edge.seam = True


def _new_face(bm, outline, face, mix):
    """A face that lies in `face`, with what that carries: exactly at its own corners, interpolated elsewhere."""
    new = bm.faces.new(outline, face)
    if face.select:
        new.select = True
    old_loops = {loop.vert: loop for loop in face.loops}
    for loop in new.loops:
        old = old_loops.get(loop.vert)
        if old is None:
            compat.interpolate_loop(loop, face)  # what Python cannot reach
            mix.fill(loop, old_loops)
        else:
            loop.copy_from(old)
    return new


def _outside_neighbours(bm, todo, points, old_faces, n) -> list:
    """Faces that are not replaced beside an edge with new vertices (they were not selected), each with its outline once
    these are in it: [(face, vertices)]. Without them the mesh would come apart there."""
    on_edge: dict = {}
    for index, support in enumerate(todo.supports):
        if len(support) == 2:
            a, b = (points[i] for i in sorted(support))
            edge = bm.edges.get((a, b))
            if edge is not None:
                on_edge.setdefault(edge, []).append(points[n + index])
    replaced = {old_faces[face_id] for face_id in todo.children}
    outside = {face for edge in on_edge for face in edge.link_faces} - replaced
    result = []
    for face in sorted(outside, key=lambda face: face.index):
        outline = []
        for loop in face.loops:
            start = loop.vert.co
            new = on_edge.get(loop.edge, [])
            outline += [loop.vert, *sorted(new, key=lambda v: (v.co - start).length_squared)]
        result.append((face, outline))
    return result


def _new_vertex(bm, snapshot, result, points, v):
    """Vertex v of the result, with the weighted mean of what the corners of its triangle carry; these, and their weights."""
    corners = snapshot.triangles[result.vertex_parent[v]].tolist()
    shares = sorted(zip(corners, result.vertex_barycentric[v].tolist(), strict=True))
    weighted = [(w, points[c]) for c, w in shares if w > 0.0]
    vertex = bm.verts.new(_place(snapshot, result, corners, v))
    total, first = weighted[0]
    if len(weighted) == 1:
        vertex.copy_from_vert_interp((first, first), 0.0)
    for weight, corner in weighted[1:]:
        total += weight
        vertex.copy_from_vert_interp((first, corner), weight / total)
        first = vertex
    mixing.keep_whole(bm.verts.layers, vertex, max(weighted, key=lambda pair: pair[0])[1])
    return vertex, weighted


def _place(snapshot, result, corners, v) -> list[float]:
    """Of a new vertex, in the mesh as it is without modifiers: these move it as they do its neighbours."""
    if snapshot.unmodified is None:
        return result.vertices[v].tolist()
    own = snapshot.unmodified[snapshot.vertex_ids[corners]].astype(np.float64)
    return (result.vertex_barycentric[v] @ own).tolist()


def _loop_at(face, vertex):
    return next(loop for loop in face.loops if loop.vert == vertex)


def _make_pieces_of_edges(bm, vertices, points, supports, n) -> None:
    """Makes those edges of a coming face that lie on an old edge, with all that the old edge carries."""
    for k in range(3):
        a, b = vertices[k], vertices[(k + 1) % 3]
        if a < n and b < n:
            continue
        ends = (supports[a - n] if a >= n else {a}) | (supports[b - n] if b >= n else {b})
        if len(ends) != 2 or bm.edges.get((points[a], points[b])) is not None:
            continue
        i, j = ends
        old = bm.edges.get((points[i], points[j]))
        if old is not None:
            # Not edge.copy_from: it leaves Blender's own reference to the copy dangling.
            piece = bm.edges.new((points[a], points[b]), old)
            piece.seam, piece.smooth = old.seam, old.smooth
            if old.select:  # to take it away would take it from the ends, too
                piece.select = True
