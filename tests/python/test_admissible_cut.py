"""ff.admissible_cut by the definition (thesis 5.2.1): disks, right angles, cones inside."""

from __future__ import annotations

import numpy as np
import pytest

import flipfree as ff

from mesh_files import data_folder, read_mesh
from surfaces import bumpy_grid, octahedron_sphere, torus


def assert_admissible(cut: ff.AdmissibleCut, cones: dict[int, int]) -> int:
    """Returns the number of components."""
    split, origin = ff.split_fans(cut.faces, cuts=cut.cut_edges)
    label, _ = ff.islands(split)
    ends = [branch[k] for branch in cut.branches for k in (0, -1)]
    nodes, degree = np.unique(ends, return_counts=True)
    inner = np.concatenate([branch[1:-1] for branch in cut.branches])
    assert len(np.unique(inner)) == len(inner) and not np.isin(inner, nodes).any()
    assert not np.isin(list(cones), np.append(inner, nodes)).any(), "a branch runs through a cone"
    assert set(degree.tolist()) <= {3, 4}
    for node, count in zip(nodes.tolist(), degree.tolist(), strict=True):
        right = int((cut.corners[:, 0] == node).sum())
        flat = int((cut.flat[:, 0] == node).sum())
        assert (right, flat) == ((4, 0) if count == 4 else (2, 1))
    for corner, face in np.concatenate([cut.corners, cut.flat]):
        assert corner in cut.faces[face]
    components = np.unique(label)
    for first in components:
        own = split[label == first]
        sides = np.sort(np.concatenate([own[:, (k, (k + 1) % 3)] for k in range(3)]), axis=1)
        edges, uses = np.unique(sides, axis=0, return_counts=True)
        assert len(np.unique(own)) - len(edges) + len(own) == 1, "no disk"
        inside = set(origin[np.unique(own)].tolist())
        corners = sum(label[face] == first for face in cut.corners[:, 1])
        assert corners == 4 + sum(k - 4 for v, k in cones.items() if v in inside)
    return len(components)


@pytest.mark.parametrize("cones", [{}, {0: 3, 60: 5}, {0: 3, 60: 3, 130: 5, 200: 5}, {7: 1, 90: 7}])
def test_tori_are_cut_into_disks_with_right_angles(cones: dict[int, int]) -> None:
    vertices, faces = torus()
    if cones == {0: 3, 60: 5}:
        with pytest.raises(ff.Infeasible):
            ff.admissible_cut(vertices, faces, cones)
        return
    cut = ff.admissible_cut(vertices, faces, cones)
    assert_admissible(cut, cones)
    assert np.array_equal(cut.vertices[: len(vertices)], vertices)
    place = (vertices[faces[cut.vertex_parent]] * cut.vertex_barycentric[:, :, None]).sum(axis=1)
    assert np.abs(place - cut.vertices).max() < 1e-12
    assert np.isin(cut.parent_face, np.arange(len(faces))).all()


@pytest.mark.parametrize("odd", [True, False])
def test_two_handles_along_a_field_or_as_they_come(odd: bool) -> None:
    folder = data_folder()
    if folder is None or not (folder / "fields" / "eight766.obj").exists():
        pytest.skip("the shared data folder is not here (FLIPFREE_DATA)")
    mesh = read_mesh(folder / "fields" / "eight766.obj")
    cones = {int(v): 5 for v in np.random.default_rng(3).permutation(len(mesh.vertices))[:8]}
    if not odd:
        assert_admissible(ff.admissible_cut(mesh.vertices, mesh.faces, cones), cones)
        return
    field = ff.cross_field(mesh.vertices, mesh.faces, signature=ff.Signature(cones, []))
    for reroute in (True, False):
        cut = ff.admissible_cut(mesh.vertices, mesh.faces, field=field, reroute=reroute)
        assert_admissible(cut, cones)
        assert (cut.stats["guided"] + cut.stats["fallback"] > 0) <= reroute


def test_spheres_have_no_cut_and_open_surfaces_are_refused() -> None:
    vertices, faces = octahedron_sphere(2)
    cut = ff.admissible_cut(vertices, faces, {v: 3 for v in range(8)})
    assert cut.branches == [] and cut.cut_edges.shape == (0, 2) and len(cut.corners) == 0
    with pytest.raises(ff.Infeasible, match="Gauss-Bonnet|quarter turns"):
        ff.admissible_cut(vertices, faces, {0: 3})
    with pytest.raises(ff.InvalidInput, match="open at face"):
        ff.admissible_cut(*bumpy_grid(), {})
    with pytest.raises(ff.InvalidInput, match="Both cones and field"):
        field = ff.cross_field(vertices, faces)
        ff.admissible_cut(vertices, faces, {0: 3}, field=field)


def equations(cut: ff.AdmissibleCut) -> tuple[list[list[tuple[int, int]]], np.ndarray]:
    """Of a cut whose nodes all have four branches: around every component its segments in order, as (branch, side), and the
    matrix of thesis 5.2.4, a row for each branch and a column for each segment."""
    split, origin = ff.split_fans(cut.faces, cuts=cut.cut_edges)
    side_of = {}
    for b, branch in enumerate(cut.branches):
        for u, v in zip(branch[:-1].tolist(), branch[1:].tolist(), strict=True):
            side_of |= {(u, v): (b, 0), (v, u): (b, 1)}
    ends = np.stack([split, np.roll(split, -1, axis=1)], -1).reshape(-1, 2)
    named = list(map(tuple, origin[ends].tolist()))
    follow = {
        int(u): (int(v), side_of[n]) for (u, v), n in zip(ends, named, strict=True) if n in side_of
    }
    around = []
    while follow:
        first = at = next(iter(follow))
        walk = []
        while at in follow:
            at, side = follow.pop(at)
            walk.append(side)
        assert at == first
        start = next(i for i in range(len(walk)) if walk[i] != walk[i - 1])
        walk = walk[start:] + walk[:start]
        around.append([s for i, s in enumerate(walk) if i == 0 or s != walk[i - 1]])
    column = {s: i for i, s in enumerate(s for cycle in around for s in cycle)}
    matrix = np.zeros((len(cut.branches), len(column)))
    for cycle in around:
        for i, (b, side) in enumerate(cycle):
            for other in (cycle[i - 1], cycle[(i + 1) % len(cycle)]):
                matrix[b, column[other]] += 1 - 2 * side
    return around, matrix


def test_a_torus_with_two_cones_has_the_equations_of_the_dissertation() -> None:
    # Thesis 5.7, segments 1 to 6 around one component, 7 and 8 around the other, branches (1, 7), (2, 5), (3, 6), (4, 8). Those
    # of 5.8.2 are missing in print, and those of 5.8.3 contradict each other there.
    printed = np.array(
        [
            [0, 1, 0, 0, 0, 1, 0, -2],
            [1, 0, 1, -1, 0, -1, 0, 0],
            [-1, 1, 0, 1, -1, 0, 0, 0],
            [0, 0, 1, 0, 1, 0, -2, 0],
        ]
    )
    assert np.linalg.matrix_rank(printed) == 4 and not printed.sum(axis=1).any()
    cut = ff.admissible_cut(*torus(), {0: 2, 130: 6})
    around, matrix = equations(cut)
    assert sorted(map(len, around)) == [2, 6]
    assert np.linalg.matrix_rank(matrix) == 4 and not matrix.sum(axis=1).any()
    six, two = sorted(around, key=len, reverse=True)
    columns = {s: i for i, s in enumerate(s for cycle in around for s in cycle)}
    same = []
    for turn in range(6):
        for swap in (two, two[::-1]):
            for way in (six, six[::-1]):
                order = [columns[s] for s in [*way[turn:], *way[:turn], *swap]]
                rows = {tuple(row) for row in [*matrix[:, order], *-matrix[:, order]]}
                same.append(all(tuple(row) in rows for row in printed.astype(float)))
    assert any(same)
