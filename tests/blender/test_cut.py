# SPDX-License-Identifier: GPL-3.0-or-later
"""Admissible Cut: seams at right angles, on the mesh's own edges and on split ones; the precision of conformal maps."""

import bpy
import numpy as np
import pytest
import shapes

from judges.disjoint_sets import DisjointSets


def torus(cones):
    ob = shapes.primitive("torus", major_segments=24, minor_segments=12, generate_uvs=True)
    for vertex, curvature in cones.items():
        name = f"Cone {curvature:+d}"
        group = ob.vertex_groups.get(name) or ob.vertex_groups.new(name=name)
        group.add([vertex], 1.0, "REPLACE")
    return ob


def seam_pairs(ob):
    return np.array([tuple(e.vertices) for e in ob.data.edges if e.use_seam]).reshape(-1, 2)


def disks(ob):
    """Euler characteristic of each part that seams leave."""
    faces = [list(p.vertices) for p in ob.data.polygons]
    seams = {frozenset(pair) for pair in seam_pairs(ob).tolist()}
    beside = {}
    for f, corners in enumerate(faces):
        for side in zip(corners, corners[1:] + corners[:1], strict=True):
            beside.setdefault(frozenset(side), []).append(f)
    part = DisjointSets(len(faces))
    for side, both in beside.items():
        if side not in seams and len(both) == 2:
            part.join(*both)
    return len({part.find(f) for f in range(len(faces))})


@pytest.mark.parametrize("mode", ["OBJECT", "EDIT"])
@pytest.mark.parametrize("follow", ["cones", "field"])
def test_seams_cut_a_torus_open_and_leave_its_map(mode, follow):
    ob = torus({0: 1, 60: 1, 130: -1, 200: -1})
    shapes.enter(mode)
    old = {tuple(v.co) for v in ob.data.vertices}
    assert bpy.ops.uv.flipfree_cut(follow=follow, select_corners=True) == {"FINISHED"}
    bpy.ops.object.mode_set(mode="OBJECT")
    assert old <= {tuple(v.co) for v in ob.data.vertices}
    nodes, degree = np.unique(seam_pairs(ob), return_counts=True)
    assert set(degree[degree != 2].tolist()) <= {3, 4} and disks(ob) >= 1
    assert {v.index for v in ob.data.vertices if v.select} == set(nodes[degree > 2].tolist())
    assert bpy.ops.uv.flipfree_unwrap(seams="given") == {"FINISHED"}
    assert shapes.exact_flips(ob) == 0


def test_split_edges_get_their_place_in_the_map_that_is_there():
    ob = torus({7: 3, 90: -3})
    bpy.ops.uv.flipfree_unwrap()
    at = shapes.corners(ob)
    before = {tuple(uv) for uv in shapes.uv_of(ob).tolist()}
    assert bpy.ops.uv.flipfree_cut() == {"FINISHED"}
    kept = np.isin(shapes.corners(ob), at)
    assert {tuple(uv) for uv in shapes.uv_of(ob)[kept].tolist()} >= before
    assert shapes.exact_flips(ob) == 0


def test_what_has_no_such_cut_is_refused():
    shapes.grid(4)
    with pytest.raises(RuntimeError, match="open at face"):
        bpy.ops.uv.flipfree_cut()
    torus({0: 1})
    with pytest.raises(RuntimeError, match="Still missing"):
        bpy.ops.uv.flipfree_cut()


@pytest.mark.parametrize("bits", [0, 53, 200])
def test_conformal_maps_have_the_precision_that_was_asked_for(part, bits, monkeypatch):
    asked = []
    solver = part("solver")
    start = solver.jobs.conformal
    monkeypatch.setattr(
        solver.jobs, "conformal", lambda *a, **o: asked.append(o["precision"]) or start(*a, **o)
    )
    ob = shapes.grid(6, bump=0.4)
    assert bpy.ops.uv.flipfree_conformal(precision=bits) == {"FINISHED"}
    assert asked == [bits or "auto"] and shapes.exact_flips(ob) == 0
    with pytest.raises(RuntimeError, match="53 to 4096"):
        bpy.ops.uv.flipfree_conformal(precision=20)
