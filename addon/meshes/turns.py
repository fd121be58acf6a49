# SPDX-License-Identifier: GPL-3.0-or-later
"""Quarter turns across seams, as an integer edge attribute.

0: the map is not cut there. 1 to 4: going across the edge, from the face in which its first vertex comes before its second one to
the other, UVs turn counter-clockwise by so many quarters; 4 is a seam that only moves.
"""

import bmesh
import numpy as np

from .. import compat
from . import labels

NAME = "seam_turns"


def _value(turns, forward):
    """What the edge stores: `turns` along the cut edge, seen in its own direction if it runs the same way."""
    return (np.where(forward, turns, -np.asarray(turns)) - 1) % 4 + 1


def layer_of(bm):
    """The layer, made if there is none: this makes references to elements stale."""
    layers = bm.edges.layers.int
    return layers.get(NAME) or layers.new(NAME)


def write_bmesh(bm, layer, points, cut_edges, turns) -> None:
    """points: the BMVert of each vertex of the map; edges between these are 0 if they are not cut."""
    known = set(points)
    for edge in bm.edges:
        if edge.verts[0] in known and edge.verts[1] in known:
            edge[layer] = 0
    for (a, b), quarter in zip(cut_edges.tolist(), turns.tolist(), strict=True):
        edge = bm.edges.get((points[a], points[b]))
        if edge is not None:
            edge[layer] = int(_value(quarter, edge.verts[0] == points[a]))


def write(ob, snapshot, cut_edges: np.ndarray, turns: np.ndarray) -> None:
    """For a map on the mesh's own faces, in either mode. cut_edges: (s, 2) submesh vertices."""
    if ob.mode == "EDIT":
        bm = bmesh.from_edit_mesh(ob.data)
        layer = layer_of(bm)
        bm.verts.ensure_lookup_table()
        points = [bm.verts[i] for i in snapshot.vertex_ids.tolist()]
        write_bmesh(bm, layer, points, cut_edges, turns)
        bmesh.update_edit_mesh(ob.data, loop_triangles=False, destructive=False)
        return
    mesh = ob.data
    attribute = compat.made_attribute(mesh, NAME, "EDGE", "INT")
    values = compat.values(attribute.data, "value", np.int32)
    known = np.zeros(len(mesh.vertices), bool)
    known[snapshot.vertex_ids] = True
    values[known[snapshot.edges].all(axis=1)] = 0
    pairs = snapshot.vertex_ids[cut_edges]
    order = np.argsort(labels.edge_keys(pairs))
    keys = labels.edge_keys(pairs)[order]
    own = labels.edge_keys(snapshot.edges)
    at = np.minimum(np.searchsorted(keys, own), max(len(keys) - 1, 0))
    found = np.flatnonzero(keys[at] == own) if len(keys) else np.zeros(0, np.int64)
    cut = order[at[found]]
    values[found] = _value(turns[cut], pairs[cut, 0] == snapshot.edges[found, 0])
    attribute.data.foreach_set("value", values)
    mesh.update()
