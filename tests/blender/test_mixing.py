# SPDX-License-Identifier: GPL-3.0-or-later
"""Layers of a mesh that gets new vertices: one value on both sides of an edge where there was one, linear on the triangles that
are mapped."""

import bpy
import numpy as np
import pytest
import rich
import shapes
from test_refine import split

CORNER = ("Other", "CORNER FLOAT", "CORNER FLOAT_VECTOR", "CORNER FLOAT_COLOR", "CORNER BYTE_COLOR")
NAMES = ("CORNER INT", "CORNER BOOLEAN")


def uneven(seed=1):
    """A sheet of quads that are not flat, every corner layer at random: one value per vertex, but two along a line."""
    ob = shapes.grid(4, bump=0.9, uv=True)
    mesh = ob.data
    random = np.random.default_rng(seed)
    rich.add_attributes(ob)
    mesh.uv_layers.new(name="Other", do_init=False)
    for name in NAMES:
        mesh.attributes.new(name, name.split()[1], "CORNER")
    mesh.uv_layers.active = mesh.uv_layers["UVMap"]
    vertex = np.array([loop.vertex_index for loop in mesh.loops])
    face = np.repeat(np.arange(len(mesh.polygons)), 4)
    right = face >= 8
    for name in CORNER + NAMES:
        attribute = mesh.attributes[name]
        width = rich.KINDS[attribute.data_type][1]
        drawn = random.random((2, len(mesh.vertices), width))
        if name in NAMES:
            drawn = drawn > 0.5 if "BOOL" in name else np.floor(drawn * 1e6)
        rich.set_values(attribute, drawn[right.astype(int), vertex])
    return ob


def by_corner(ob, name):
    """{vertex: [(face, value)]}"""
    mesh = ob.data
    values = rich.values(mesh.attributes[name])
    found = {}
    for face in mesh.polygons:
        for loop in face.loop_indices:
            found.setdefault(mesh.loops[loop].vertex_index, []).append((face.index, values[loop]))
    return found


@pytest.fixture(params=["OBJECT", "EDIT"])
def refined(request, part):
    """(object, {new vertex: its old ends}, {layer: what its corners carried before})."""
    ob = uneven()
    before = {name: by_corner(ob, name) for name in CORNER + NAMES}
    points = np.array([v.co for v in ob.data.vertices])
    snapshot = part("meshes.mesh_io").read(ob, only_selected=False)
    diagonal = tuple(sorted(snapshot.diagonals[0].tolist()))
    halved = {diagonal, (12, 17), (6, 7), (12, 13)}
    shapes.enter(request.param)
    assert part("meshes.refine").write(ob, snapshot, split(snapshot, halved), mark_cuts=False) == 4
    bpy.ops.object.mode_set(mode="OBJECT")
    ends = {}
    for new in range(25, 29):
        at = np.array(ob.data.vertices[new].co)
        (ends[new],) = [e for e in halved if np.abs(points[list(e)].mean(axis=0) - at).max() < 1e-6]
    return ob, ends, before


def sides(values):
    return {value.tobytes() for _, value in values}


def test_both_sides_of_an_edge_have_the_bits_of_one_value_where_they_had_one(refined):
    ob, ends, before = refined
    joined = parted = 0
    for name in CORNER + NAMES:
        after = by_corner(ob, name)
        for new, (a, b) in ends.items():
            one = len(sides(before[name][a])) == 1 and len(sides(before[name][b])) == 1
            assert len(sides(after[new])) == 1 if one else len(sides(after[new])) <= 2, (name, new)
            joined, parted = joined + one, parted + (not one)
    assert joined and parted, "both kinds are there"


def test_values_are_linear_on_the_triangles_that_are_mapped(refined):
    ob, ends, before = refined
    for name in CORNER:
        after = by_corner(ob, name)
        step = 0.01 if "BYTE" in name else 1e-6
        for new, (a, b) in ends.items():
            allowed = [
                (np.asarray(x, float) + np.asarray(y, float)) / 2
                for f, x in before[name][a]
                for g, y in before[name][b]
                if f == g
            ]
            for _, value in after[new]:
                off = min(np.abs(np.asarray(value, float) - found).max() for found in allowed)
                assert off < step, (name, new)


def test_names_are_those_of_one_end_and_no_mean(refined):
    ob, ends, before = refined
    for name in NAMES:
        after = by_corner(ob, name)
        for new, pair in ends.items():
            known = set().union(*(sides(before[name][end]) for end in pair))
            assert sides(after[new]) <= known, (name, new)


def test_another_map_is_as_whole_as_before(refined, part):
    ob, _, _ = refined
    ob.data.uv_layers.active = ob.data.uv_layers["Other"]
    found = part("meshes.mesh_io").read(ob, only_selected=False)
    labels = part("meshes.labels")
    assert labels.nearly_joined(found.triangles, found.corner_uv) == 0
    assert labels.count_islands(found.triangles, found.corner_uv) == 2


def test_corners_of_old_vertices_keep_their_bits(refined):
    ob, _, before = refined
    for name in CORNER + NAMES:
        after = by_corner(ob, name)
        for vertex, values in before[name].items():
            assert sides(after[vertex]) == sides(values), (name, vertex)


def test_selection_and_hiding_stay(part):
    """Of what was there; new vertices and faces are as the face is that they lie in."""
    ob = shapes.grid(4, bump=0.3, uv=True)
    mesh = ob.data
    chosen = [0, 1, 2, 5]
    for sequence in (mesh.vertices, mesh.edges, mesh.polygons):
        sequence.foreach_set("select", np.zeros(len(sequence), bool))
    mesh.vertices[12].select = True  # alone
    mesh.polygons[15].hide = True
    mesh.edges[3].hide = True
    before = shapes.selected(ob, "vertex"), [p.hide for p in mesh.polygons].count(True)
    snapshot = part("meshes.mesh_io").read(ob, only_selected=False)
    assert chosen and part("meshes.refine").write(
        ob, snapshot, split(snapshot, {(12, 17)}), mark_cuts=False
    )
    assert shapes.selected(ob, "vertex") == before[0]
    assert [p.hide for p in mesh.polygons].count(True) == before[1]
    assert sum(e.hide for e in mesh.edges) == 1
