# SPDX-License-Identifier: GPL-3.0-or-later
"""What users mark for Match Pins and for fields, besides pins and cones: lines and paths of edges, rings of faces.

flipfree_chains   INT of edges: 1 part of a line, 2 part of a path
Loop +1           INT of faces: their place in a ring along which the field makes one quarter turn to the left; `Loop +1.001`
                  is another such ring
"""

import re

import bmesh
import numpy as np

from .. import compat
from . import labels, mesh_io
from .selection import whole_mesh

CHAINS = "flipfree_chains"
KINDS = {"line": 1, "path": 2}
_LOOP = re.compile(r"Loop ([+-]\d+)(?:\.\d+)?")


def mark_chain(ob, kind: str) -> int:
    """In Edit Mode: the selected edges are part of a line or path, or of neither for "none". Returns their number."""
    bm = bmesh.from_edit_mesh(ob.data)
    layers = bm.edges.layers.int
    layer = layers.get(CHAINS) or layers.new(CHAINS)
    chosen = [edge for edge in bm.edges if edge.select and not edge.hide]
    for edge in chosen:
        edge[layer] = KINDS.get(kind, 0)
    bmesh.update_edit_mesh(ob.data, loop_triangles=False, destructive=False)
    return len(chosen)


def mark_loop(ob, quarter_turns: int) -> int:
    """In Edit Mode: the selected faces, a closed ring, are a loop along which a field turns so. It runs from its first face
    towards that one's neighbour with the smaller number. Returns their number. Raises MeshProblem."""
    bm = bmesh.from_edit_mesh(ob.data)
    bm.faces.index_update()
    chosen = {face for face in bm.faces if face.select and not face.hide}
    near = {
        face: [f for edge in face.edges for f in edge.link_faces if f in chosen and f is not face]
        for face in chosen
    }
    wrong = sorted(face.index for face, others in near.items() if len(set(others)) != 2)
    if wrong or len(chosen) < 3:
        raise mesh_io.MeshProblem(
            f"{ob.name}: the selected faces make no closed ring, each with two neighbours. Select a face loop (Alt click)",
            "face",
            wrong,
        )
    ring = [min(chosen, key=lambda face: face.index)]
    ring.append(min(near[ring[0]], key=lambda face: face.index))
    while True:
        following = next(face for face in near[ring[-1]] if face is not ring[-2])
        if following is ring[0]:
            break
        ring.append(following)
    if len(ring) < len(chosen):
        raise mesh_io.MeshProblem(f"{ob.name}: more than one ring is selected. Mark one at a time")
    clear_loops(bm, set(ring))
    layers, name = bm.faces.layers.int, f"Loop {quarter_turns:+d}"
    free = [name, *(f"{name}.{i:03d}" for i in range(1, 1000))]
    indices = [face.index for face in ring]
    layer = layers.new(next(n for n in free if layers.get(n) is None))
    bm.faces.ensure_lookup_table()
    for place, index in enumerate(indices, start=1):
        bm.faces[index][layer] = place
    bmesh.update_edit_mesh(ob.data, loop_triangles=False, destructive=False)
    return len(ring)


def clear_loops(bm, faces) -> int:
    """Rings whose faces are all among these are marked no more. Returns how many there were."""
    layers = bm.faces.layers.int
    indices = {face.index for face in faces}
    doomed = []
    for name in [name for name in layers.keys() if _LOOP.fullmatch(name)]:
        ring = {face.index for face in bm.faces if face[layers[name]] > 0}
        if ring <= indices:
            doomed.append(name)
    for name in doomed:
        layers.remove(layers[name])
    return len(doomed)


def clear(ob) -> int:
    """In Edit Mode: the selected edges are part of no line and no path, and the selected rings no loops."""
    bm = bmesh.from_edit_mesh(ob.data)
    layer = bm.edges.layers.int.get(CHAINS)
    marked = layer is not None and any(edge.select and edge[layer] for edge in bm.edges)
    count = mark_chain(ob, "none") if marked else 0
    count += clear_loops(bm, [face for face in bm.faces if face.select and not face.hide])
    bmesh.update_edit_mesh(ob.data, loop_triangles=False, destructive=False)
    return count


def chain_keys(ob, snapshot: mesh_io.Snapshot, kind: str) -> np.ndarray:
    """Sorted keys (labels.edge_keys) of the mesh's edges that are marked as part of a line or path."""
    with whole_mesh(ob) as mesh:
        values = compat.attribute(mesh, CHAINS, "EDGE", "INT")
    if values is None:
        return np.zeros(0, np.int64)
    return np.sort(labels.edge_keys(snapshot.edges[values == KINDS[kind]]))


def loops(ob, snapshot: mesh_io.Snapshot) -> list[tuple[np.ndarray, int]]:
    """[(triangles of the snapshot, quarter turns)] of the marked rings. Raises MeshProblem if one was taken apart."""
    found = []
    with whole_mesh(ob) as mesh:
        for attribute in mesh.attributes:
            name = _LOOP.fullmatch(attribute.name)
            if name is None or (attribute.domain, attribute.data_type) != ("FACE", "INT"):
                continue
            place = compat.values(attribute.data, "value", np.int32)[snapshot.triangle_face]
            if (place > 0).any():
                groups = [np.flatnonzero(place == i) for i in range(1, int(place.max()) + 1)]
                found.append((_strip(ob.name, attribute.name, snapshot, groups), int(name[1])))
    return found


def _strip(name: str, loop: str, snapshot, groups: list[np.ndarray]) -> np.ndarray:
    """Triangles of a closed strip through the groups of triangles, one after the other."""

    def sides(triangles):
        return {
            frozenset((int(corners[k]), int(corners[(k + 1) % 3]))): int(t)
            for t, corners in zip(triangles, snapshot.triangles[triangles], strict=True)
            for k in range(3)
        }

    own = [sides(group) for group in groups]
    doors = [own[i].keys() & own[(i + 1) % len(own)].keys() for i in range(len(own))]
    if not all(doors):
        raise mesh_io.MeshProblem(
            f"{name}: the faces of '{loop}' are no ring any more. Mark it again"
        )
    doors = [min(door, key=sorted) for door in doors]
    strip: list[int] = []
    for i, group in enumerate(groups):
        strip += _way(snapshot, group, own[i][doors[i - 1]], own[i][doors[i]])
    return np.array(strip, np.int32)


def _way(snapshot, group, start: int, end: int) -> list[int]:
    """Neighbouring triangles of a connected group, from one to another."""
    before, waiting = {start: start}, [start]
    corners = {int(t): set(snapshot.triangles[t].tolist()) for t in group}
    for t in waiting:
        for other in corners:
            if other not in before and len(corners[t] & corners[other]) == 2:
                before[other] = t
                waiting.append(other)
    way = [end]
    while way[-1] != start and end in before:
        way.append(before[way[-1]])
    return way[::-1]
