# SPDX-License-Identifier: GPL-3.0-or-later
"""Cones, seams with their quarter turns, pins: read arrays -> shapes for both editors."""

import math

import numpy as np

from .. import compat
from ..meshes import cones, labels, mesh_io
from ..operators import common
from . import shapes

CORNER_COLOUR = (0.83, 0.15, 0.11, 1.0)
SADDLE_COLOUR = (0.12, 0.62, 0.23, 1.0)
# Of seams by what is stored across them (meshes/turns.py): nothing, a quarter either way, a half turn, none.
SEAM_COLOURS = {
    0: (1.0, 0.35, 0.2, 1.0),
    1: (1.0, 0.75, 0.1, 1.0),
    3: (1.0, 0.75, 0.1, 1.0),
    2: (0.75, 0.35, 0.95, 1.0),
    4: (0.35, 0.75, 1.0, 1.0),
}
_SEAM_TEXTS = {
    0: "no turns stored",
    1: "a quarter turn",
    2: "a half turn",
    4: "moves only",
}
PIN_COLOUR = (0.2, 0.6, 1.0, 1.0)
BAD_PIN_COLOUR = (1.0, 0.1, 0.1, 1.0)
_CONE = 0.012  # an octahedron, of the mesh's size
_MOST_TEXTS = 300


# -- cones
# ----------------------------------------------------------------------------------------------------------


def draw_cones(read, drawing: shapes.Drawing) -> None:
    found = read.cones
    drawing.notes.append(((0, 0, 0, 0), f"{read.ob.name}: {common.plural(len(found), 'cone')}"))
    drawing.notes.append(((0, 0, 0, 0), cones.balance_of(read.mesh, read.boundary, read.cones)))
    if not found:
        return
    vertices = np.array(list(found))
    flat = np.where(read.boundary[vertices], math.pi, 2 * math.pi)
    bends = (flat - np.array(list(found.values()))) / (math.pi / 2)
    places = read.points[vertices]
    for colour, chosen in ((CORNER_COLOUR, bends > 0), (SADDLE_COLOUR, bends <= 0)):
        if chosen.any():
            solid = _octahedra(places[chosen], _CONE * read.extent)
            drawing.shapes.append(shapes.Shape(shapes.SURFACE, "TRIS", solid, colour))
    shown = range(min(len(vertices), _MOST_TEXTS))
    texts = [f"{bend:+.3g}" for bend in bends.tolist()]
    drawing.marks += [
        shapes.Mark(
            shapes.SURFACE,
            tuple(places[i].tolist()),
            (0, 0, 0, 0),
            texts[i],
            tuple(read.mesh.vertices[int(vertices[i])].normal),
        )
        for i in shown
    ]
    if read.layer:
        drawing.marks += _cones_in_map(read, vertices, bends, texts)


def _cones_in_map(read, vertices, bends, texts) -> list[shapes.Mark]:
    """At every place that the map gives a cone."""
    corner = compat.corner_vertices(read.mesh)
    loops = np.flatnonzero(np.isin(corner, vertices))
    index = {v: i for i, v in enumerate(vertices.tolist())}
    places = {}
    for vertex, (u, v) in zip(corner[loops].tolist(), read.uv[loops].tolist(), strict=True):
        places.setdefault((vertex, u, v), index[vertex])
    return [
        shapes.Mark(
            shapes.MAP, (u, v, 0.0), CORNER_COLOUR if bends[i] > 0 else SADDLE_COLOUR, texts[i]
        )
        for (_, u, v), i in list(places.items())[:_MOST_TEXTS]
        if math.isfinite(u) and math.isfinite(v)
    ]


def _octahedra(places: np.ndarray, radius: float) -> np.ndarray:
    tips = radius * np.concatenate([np.eye(3), -np.eye(3)])
    corners = [(a, b, c) for a in (0, 3) for b in (1, 4) for c in (2, 5)]
    one = tips[np.array(corners).ravel()]
    return (places[:, None, :] + one).reshape(-1, 3).astype(np.float32)


# -- seams
# ----------------------------------------------------------------------------------------------------------


def draw_seams(read, drawing: shapes.Drawing) -> None:
    edges, values = read.seam_turns
    for kind, text in _SEAM_TEXTS.items():
        count = int(np.isin(values, (1, 3) if kind == 1 else (kind,)).sum())
        if count or (kind == 0 and not len(edges)):
            drawing.notes.append(
                (SEAM_COLOURS[kind], f"{common.plural(count, 'seam edge')}: {text}")
            )
    if not len(edges):
        return
    table = np.array([SEAM_COLOURS[k] for k in range(5)], np.float32)
    colours = np.repeat(table[np.clip(values, 0, 4)], 2, axis=0)
    ends = compat.edge_vertices(read.mesh)[edges]
    pos = read.points[ends].reshape(-1, 3)
    drawing.shapes.append(shapes.Shape(shapes.SURFACE, "LINES", pos, colours, raised=True))
    if not read.layer:
        return
    of_edge = np.full(len(read.mesh.edges), -1)
    of_edge[edges] = values
    at = of_edge[compat.corner_edges(read.mesh)]
    loops = np.flatnonzero(at >= 0)
    pair = read.uv[np.column_stack([loops, compat.following(read.mesh)[loops]])]
    drawing.shapes.append(
        shapes.Shape(
            shapes.MAP,
            "LINES",
            shapes.in_plane(pair),
            np.repeat(table[np.clip(at[loops], 0, 4)], 2, axis=0),
        )
    )


# -- pins
# ----------------------------------------------------------------------------------------------------------


def draw_pins(read, drawing: shapes.Drawing) -> None:
    if not read.layer:
        return
    try:
        snapshot = read.snapshot()
    except mesh_io.MeshProblem as problem:
        drawing.notes.append((BAD_PIN_COLOUR, str(problem)))
        return
    vertex, uv, bad = contradictions(snapshot)
    drawing.notes.append((PIN_COLOUR, common.plural(len(vertex), "pin")))
    if bad.any():
        drawing.notes.append(
            (BAD_PIN_COLOUR, f"{common.plural(int(bad.sum()), 'pin')} cannot be met together")
        )
    points = snapshot.vertices[vertex]
    for i in range(len(vertex)):
        colour = BAD_PIN_COLOUR if bad[i] else PIN_COLOUR
        if np.isfinite(uv[i]).all():
            drawing.marks.append(shapes.Mark(shapes.MAP, (*map(float, uv[i]), 0.0), colour))
        drawing.marks.append(shapes.Mark(shapes.SURFACE, tuple(map(float, points[i])), colour))


def contradictions(snapshot) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Pinned places: (k,) vertices of the snapshot's surface cut along its seams, (k, 2) their targets, (k,) bool whether no map
    without flips meets all of them: no number, one vertex with several targets, several vertices of an island with one."""
    cut, original = mesh_io.split_fans(snapshot.triangles, cuts=snapshot.cuts)
    rows, corners = np.nonzero(snapshot.pinned[snapshot.triangle_loops])
    uv = snapshot.corner_uv[rows, corners]
    both = np.concatenate([cut[:, [0, 1]], cut[:, [1, 2]]])
    island = labels.connected_components(len(original), both[:, 0], both[:, 1])
    pins = {}
    for vertex, (u, v) in zip(cut[rows, corners].tolist(), uv.tolist(), strict=True):
        pins.setdefault((vertex, u, v) if u == u and v == v else (vertex, None, None), None)
    vertices = np.array([key[0] for key in pins], np.int64)
    targets = np.array(
        [[math.nan if x is None else x for x in key[1:]] for key in pins], np.float64
    ).reshape(-1, 2)
    by_vertex: dict = {}
    by_place: dict = {}
    for i, (vertex, u, v) in enumerate(pins):
        by_vertex.setdefault(vertex, []).append(i)
        by_place.setdefault((int(island[vertex]), u, v), []).append(i)
    bad = ~np.isfinite(targets).all(axis=1)
    for group in (*by_vertex.values(), *by_place.values()):
        if len(group) > 1:
            bad[group] = True
    return original[vertices], targets, bad
