# SPDX-License-Identifier: GPL-3.0-or-later
"""Cones in Blender's terms (design: section 5): vertex groups `Cone +1`, `Cone -1`, ... or the point attribute `cone_angle`.

A cone of c quarter turns has the angle 2 pi - c pi / 2 (on the boundary pi - c pi / 2): +1 is the corner of a cube, -1 a
saddle. `cone_angle` holds angles in radians; 0 means flat. Where both name a vertex, the attribute counts.
"""

import math
import re

import bmesh
import bpy
import numpy as np

from .. import compat
from . import labels, selection

ATTRIBUTE = "cone_angle"
_GROUP = re.compile(r"Cone ([+-]\d+)")


def group_name(quarter_turns: int) -> str:
    return f"Cone {quarter_turns:+d}"


def groups(ob: bpy.types.Object) -> dict[int, int]:
    """Index of each cone group -> its quarter turns."""
    found = {}
    for group in ob.vertex_groups:
        match = _GROUP.fullmatch(group.name)
        if match and int(match[1]) != 0:
            found[group.index] = int(match[1])
    return found


def read(ob: bpy.types.Object, mesh: bpy.types.Mesh, boundary: np.ndarray) -> dict[int, float]:
    """{vertex: total angle in radians} of the mesh's cones. `mesh` is outside edit mode (or a copy); boundary (n,) bool."""
    angles = {}
    turns = groups(ob)
    if turns:
        for vertex in mesh.vertices:
            for entry in vertex.groups:
                if entry.group in turns and entry.weight > 0.0:
                    flat = math.pi if boundary[vertex.index] else 2 * math.pi
                    angles[vertex.index] = flat - turns[entry.group] * math.pi / 2
    values = compat.attribute(mesh, ATTRIBUTE, "POINT", "FLOAT")
    if values is not None:
        for index in np.flatnonzero(values).tolist():
            angles[index] = float(values[index])
    return angles


def boundary_vertices(mesh: bpy.types.Mesh) -> np.ndarray:
    """(n,) bool: vertices of edges with one face. Loose vertices count as inside."""
    uses = np.bincount(compat.corner_edges(mesh), minlength=len(mesh.edges))
    result = np.zeros(len(mesh.vertices), bool)
    result[compat.edge_vertices(mesh)[uses == 1].ravel()] = True
    return result


def remainder(
    vertices: int, edges: int, faces: int, angles: dict[int, float], boundary: np.ndarray
) -> float:
    """Curvature that the cones still lack, in quarter turns: 0 where they fit the surface (Gauss-Bonnet).

    Sum over inner vertices of 2 pi - angle and over boundary vertices of pi - angle must be 2 pi chi. A boundary can bend,
    so with one the remainder is what it will take.
    """
    total = 2 * math.pi * (vertices - edges + faces)
    for index, angle in angles.items():
        total -= (math.pi if boundary[index] else 2 * math.pi) - angle
    return total / (math.pi / 2)


def balance(ob: bpy.types.Object) -> str:
    """What the cones of the whole mesh still lack, in words; every connected part has to fit by itself."""
    if ob.mode == "EDIT":
        ob.update_from_editmode()
    mesh = ob.data.copy()
    try:
        boundary = boundary_vertices(mesh)
        return balance_of(mesh, boundary, read(ob, mesh, boundary))
    finally:
        bpy.data.meshes.remove(mesh)


def balance_of(mesh: bpy.types.Mesh, boundary: np.ndarray, angles: dict[int, float]) -> str:
    """The same of a mesh outside edit mode with these cones and boundary vertices (n,)."""
    parts = _parts(mesh)
    found = []
    for vertices, edges, faces in parts:
        inside = set(vertices.tolist())
        own = {v: angle for v, angle in angles.items() if v in inside}
        missing = remainder(len(vertices), edges, faces, own, boundary)
        bends = bool(boundary[vertices].any())
        found.append((int(vertices[0]), bends, missing))
    if len(found) == 1:
        ((_, bends, missing),) = found
        if bends:
            return f"The boundary has to bend by {missing:+.3g} quarter turns"
        if abs(missing) < 1e-6:
            return "The cones fit the surface"
        return f"The cones still lack {missing:+.3g} quarter turns"
    wrong = [(v, missing) for v, bends, missing in found if not bends and abs(missing) >= 1e-6]
    if not wrong:
        return f"The cones fit all {len(found)} parts"
    texts = [f"the part of vertex {v}: {missing:+.3g} quarter turns" for v, missing in wrong[:3]]
    more = f", and {len(wrong) - 3} more parts" if len(wrong) > 3 else ""
    return f"The cones still lack, in {', in '.join(texts)}{more}"


def _parts(mesh: bpy.types.Mesh) -> list[tuple[np.ndarray, int, int]]:
    """(vertices, number of edges, number of faces) of each connected part that has faces, by its first vertex."""
    ends = compat.edge_vertices(mesh)
    label = labels.connected_components(len(mesh.vertices), ends[:, 0], ends[:, 1])
    first = compat.corner_vertices(mesh)[compat.face_starts(mesh)]
    faces = np.bincount(label[first], minlength=len(label))
    edges = np.bincount(label[ends[:, 0]], minlength=len(label))
    found = ((vertices, label[vertices[0]]) for vertices in labels.groups(label))
    return [
        (vertices, int(edges[root]), int(faces[root])) for vertices, root in found if faces[root]
    ]


def _remove_all(ob: bpy.types.Object, vertices: list[int]) -> None:
    """Outside edit mode: these vertices are no cones any more."""
    for index in groups(ob):
        ob.vertex_groups[index].remove(vertices)
    attribute = ob.data.attributes.get(ATTRIBUTE)
    if attribute is not None:
        for vertex in vertices:
            attribute.data[vertex].value = 0.0


def mark_selected(ob: bpy.types.Object, quarter_turns: int) -> int:
    """In edit mode: the selected vertices become cones of so many quarter turns, or none for 0. Returns their number."""
    bm = bmesh.from_edit_mesh(ob.data)
    bm.verts.index_update()
    chosen = [v.index for v in bm.verts if v.select and not v.hide]
    if chosen:
        replace(ob, chosen, dict.fromkeys(chosen if quarter_turns else (), quarter_turns))
    return len(chosen)


def add(ob: bpy.types.Object, curvature: dict[int, int]) -> None:
    """These vertices become cones of so many quarter turns of curvature, in either mode; other marks stay."""
    groups = ob.vertex_groups
    names = {quarter: group_name(quarter) for quarter in sorted(set(curvature.values()))}
    indices = {q: (groups.get(n) or groups.new(name=n)).index for q, n in names.items()}
    if ob.mode != "EDIT":
        for vertex, quarter in curvature.items():
            ob.vertex_groups[indices[quarter]].add([vertex], 1.0, "REPLACE")
        return
    bm = bmesh.from_edit_mesh(ob.data)
    deform = bm.verts.layers.deform.verify()
    bm.verts.ensure_lookup_table()
    for vertex, quarter in curvature.items():
        bm.verts[vertex][deform][indices[quarter]] = 1.0
    bmesh.update_edit_mesh(ob.data, loop_triangles=False, destructive=False)


def replace(ob: bpy.types.Object, vertices: list[int], curvature: dict[int, int]) -> None:
    """Of these vertices, in either mode, the ones in `curvature` become cones of so many quarter turns and the others none."""
    if ob.mode != "EDIT":
        _remove_all(ob, vertices)
    else:
        bm = bmesh.from_edit_mesh(ob.data)
        deform = bm.verts.layers.deform.verify()
        attribute = bm.verts.layers.float.get(ATTRIBUTE)
        bm.verts.ensure_lookup_table()
        for index in vertices:
            vertex = bm.verts[index]
            for group in groups(ob):
                if group in vertex[deform]:
                    del vertex[deform][group]
            if attribute is not None:
                vertex[attribute] = 0.0
    add(ob, curvature)


def clear(ob: bpy.types.Object) -> int:
    """No cones are left: in edit mode at the selected vertices, else anywhere. Returns how many there were."""
    editing = ob.mode == "EDIT"
    with selection.whole_mesh(ob) as mesh:
        marked = sorted(read(ob, mesh, np.zeros(len(mesh.vertices), bool)))
        if editing:
            shown = [v.select and not v.hide for v in mesh.vertices]
            marked = [v for v in marked if shown[v]]
    replace(ob, marked, {})
    if not editing:
        ob.data.update()
    return len(marked)


def write(ob: bpy.types.Object, angles: dict[int, tuple[float, bool]], *, as_groups: bool) -> None:
    """Replaces the object's cones by these: {vertex: (angle, on the boundary)}, in either mode."""
    flat = {v: math.pi if on_boundary else 2 * math.pi for v, (_, on_boundary) in angles.items()}
    turns = {v: round((flat[v] - angle) / (math.pi / 2)) for v, (angle, _) in angles.items()}
    with selection.in_object_mode(ob) as mesh:
        replace(ob, list(range(len(mesh.vertices))), {})
        if as_groups:
            add(ob, {vertex: turn for vertex, turn in turns.items() if turn})
        else:
            values = np.zeros(len(mesh.vertices), np.float32)
            values[list(angles)] = [angle for angle, _ in angles.values()]
            made = compat.made_attribute(mesh, ATTRIBUTE, "POINT", "FLOAT")
            made.data.foreach_set("value", values)
        mesh.update()
