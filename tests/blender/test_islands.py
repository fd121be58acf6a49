# SPDX-License-Identifier: GPL-3.0-or-later
"""Islands as meshes of their own, and maps refined on one side of a seam put together again."""

from types import SimpleNamespace

import bpy
import numpy as np
import pytest
import shapes


def seam_in_the_middle(n=4):
    """A flat sheet with a seam along x = 0 and UVs = its x, y, the right half moved away."""
    ob = shapes.grid(n, bump=0.0, uv=True)
    right = shapes.seam_in_the_middle(ob)
    shapes.set_uv(ob, shapes.plane(ob) + np.outer(right, np.float32([3.0, 0.0])))
    return ob


def halved(snapshot, island, seam_edges, share=0.5):
    """A result as the solver returns it: `share` of the way along each of these island edges there is a new vertex."""
    n = len(island.vertices)
    vertices, parents, weights = island.vertices.tolist(), [0] * n, [[0.0] * 3] * n
    corner_uv = snapshot.corner_uv[island.triangles].astype(float)
    faces, uv, parent_face = [], [], []
    for f, triangle in enumerate(island.faces.tolist()):
        parts = [[(v, corner_uv[f, k]) for k, v in enumerate(triangle)]]
        for k in range(3):
            (a, at_a), (b, at_b), c = (parts[0][(k + i) % 3] for i in range(3))
            key = tuple(sorted((a, b)))
            if key not in seam_edges:
                continue
            step = share if a == key[0] else 1 - share
            new = len(vertices), at_a * (1 - step) + at_b * step
            vertices.append(island.vertices[a] * (1 - step) + island.vertices[b] * step)
            parents.append(f)
            weights.append([1 - step if v == a else step if v == b else 0.0 for v in triangle])
            parts = [[(a, at_a), new, c], [new, (b, at_b), c]]
            break
        faces += [[v for v, _ in p] for p in parts]
        uv += [[q for _, q in p] for p in parts]
        parent_face += [f] * len(parts)
    uv = np.array(uv)
    return SimpleNamespace(
        vertices=np.array(vertices),
        faces=np.array(faces, np.int32),
        parent_face=np.array(parent_face),
        vertex_parent=np.array(parents),
        vertex_barycentric=np.array(weights),
        cut_edges=np.zeros((0, 2), np.int32),
        uv=uv,
        uv32=lambda: uv.astype(np.float32),
    )


def rim(snapshot, island):
    """Island edges on the seam."""
    seams = {tuple(sorted(pair)) for pair in snapshot.cuts.tolist()}
    return {
        tuple(pair)
        for pair in island.edges().tolist()
        if tuple(sorted(island.submesh[list(pair)].tolist())) in seams
    }


@pytest.mark.parametrize("mode", ["OBJECT", "EDIT"])
@pytest.mark.parametrize("sides", ["one", "both at one place", "both at two places"])
def test_a_vertex_on_a_seam_is_one_on_both_sides(part, mode, sides):
    islands, mesh_io, refine = part("meshes.islands"), part("meshes.mesh_io"), part("meshes.refine")
    ob = seam_in_the_middle()
    before = len(ob.data.vertices)
    if mode == "EDIT":
        shapes.enter("EDIT")
    snapshot = mesh_io.read(ob, only_selected=mode == "EDIT")
    left, right = islands.islands_of(snapshot)
    places = [0.5] if sides == "one" else [0.5, 0.5 if "one" in sides else 0.25]
    pieces = [
        islands.Piece(i.triangles, i.submesh, halved(snapshot, i, rim(snapshot, i), share))
        for i, share in zip((left, right), places, strict=False)
    ]
    combined = islands.combine(snapshot, pieces)
    new = {"one": 4, "both at one place": 4, "both at two places": 8}[sides]
    assert len(combined.vertices) == before + new
    assert refine.write(ob, snapshot, combined, mark_cuts=False) == new
    bpy.ops.object.mode_set(mode="OBJECT")
    mesh = ob.data
    assert len(mesh.vertices) == before + new
    uses = np.bincount([loop.edge_index for loop in mesh.loops], minlength=len(mesh.edges))
    assert uses.min() >= 1 and uses.max() == 2, "the mesh came apart"
    for edge in mesh.edges:
        on_seam = all(abs(mesh.vertices[v].co.x) < 1e-6 for v in edge.vertices)
        assert edge.use_seam == on_seam
        assert uses[edge.index] == 2 or not on_seam
    assert shapes.exact_flips(ob) == 0
    assert sum(p.area for p in mesh.polygons) == pytest.approx(4.0, rel=1e-6)
    # Both sides have the point where it lies: here the UVs are the positions, on the right moved.
    uv = shapes.uv_of(ob)
    for polygon in mesh.polygons:
        for k in polygon.loop_indices:
            place = np.array(mesh.vertices[mesh.loops[k].vertex_index].co[:2])
            shift = 3.0 if polygon.center.x > 0 else 0.0
            assert uv[k] == pytest.approx(place + [shift, 0.0], abs=1e-6)


def test_a_seam_inside_one_island_is_split_on_both_sides(part):
    islands, mesh_io = part("meshes.islands"), part("meshes.mesh_io")
    ob = seam_in_the_middle()
    mesh = ob.data
    for edge in mesh.edges:  # a slit: only its upper half
        edge.use_seam = edge.use_seam and all(mesh.vertices[v].co.y > -1e-6 for v in edge.vertices)
    snapshot = mesh_io.read(ob, only_selected=False)
    (island,) = islands.islands_of(snapshot)
    slit = rim(snapshot, island)
    assert len(slit) == 4  # two edges, two sides each
    one_side = {min(slit)}
    result = halved(snapshot, island, one_side)
    combined = islands.combine(snapshot, [islands.Piece(island.triangles, island.submesh, result)])
    new = len(snapshot.vertices)
    assert len(combined.vertices) == new + 1
    beside = combined.parent_face[(combined.faces == new).any(axis=1)]
    assert len(beside) == 4 and len(set(beside.tolist())) == 2


def test_faces_that_were_not_selected_stay_joined(part):
    islands, mesh_io, refine = part("meshes.islands"), part("meshes.mesh_io"), part("meshes.refine")
    ob = seam_in_the_middle()
    for edge in ob.data.edges:
        edge.use_seam = False
    bpy.ops.object.mode_set(mode="EDIT")
    shapes.select_faces(ob, range(8))  # x < 0
    snapshot = mesh_io.read(ob, only_selected=True)
    (island,) = islands.islands_of(snapshot)
    border = {
        tuple(pair)
        for pair in island.edges().tolist()
        if (np.abs(island.vertices[pair, 0]) < 1e-6).all()
    }
    piece = islands.Piece(island.triangles, island.submesh, halved(snapshot, island, border))
    refine.write(ob, snapshot, islands.combine(snapshot, [piece]), mark_cuts=False)
    bpy.ops.object.mode_set(mode="OBJECT")
    mesh = ob.data
    uses = np.bincount([loop.edge_index for loop in mesh.loops], minlength=len(mesh.edges))
    for edge in mesh.edges:
        if all(abs(mesh.vertices[v].co.x) < 1e-6 for v in edge.vertices):
            assert uses[edge.index] == 2
    assert sorted(p.loop_total for p in mesh.polygons if p.center.x > 0) == [4] * 4 + [5] * 4
    # The UVs of faces that got a corner are what they were, and in between on it.
    uv = shapes.uv_of(ob)
    for polygon in mesh.polygons:
        if polygon.center.x < 0:
            continue
        for k in polygon.loop_indices:
            place = np.array(mesh.vertices[mesh.loops[k].vertex_index].co[:2])
            assert uv[k] == pytest.approx(place + [3.0, 0.0], abs=1e-6)
