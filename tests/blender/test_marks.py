# SPDX-License-Identifier: GPL-3.0-or-later
"""Mark Line, Path or Loop, and what Match Pins and Field-Aligned Seamless Map make of the marks."""

import json

import bmesh
import bpy
import numpy as np
import pytest
import shapes

import flipfree as ff

mark = bpy.ops.mesh.flipfree_mark
N = 8  # cells to a side of the sheet; vertex = (N + 1) column + row


def sheet(pins):
    """A bumpy sheet mapped by x and y, with these vertices pinned: {vertex: offset}."""
    ob = shapes.grid(N, bump=0.3, uv=True)
    uv, corner = shapes.flat(ob)
    for vertex, offset in pins.items():
        uv[corner == vertex] += np.float32(offset)
    shapes.set_uv(ob, uv)
    shapes.set_pins(ob, np.isin(corner, list(pins)))
    return ob, uv


def select_edges(ob, chain):
    pairs = {frozenset(pair) for pair in zip(chain, chain[1:], strict=False)}
    if ob.mode != "EDIT":
        shapes.enter("EDIT")
    chosen = [e.index for e in ob.data.edges if frozenset(e.vertices) in pairs]
    assert len(chosen) == len(pairs)
    shapes.select(ob, "edge", chosen)


def marked(ob, chain, kind):
    select_edges(ob, chain)
    assert mark(kind=kind) == {"FINISHED"}
    bpy.ops.mesh.select_all(action="SELECT")
    bpy.ops.object.mode_set(mode="OBJECT")


def at(ob, vertex):
    """The one UV of a vertex."""
    uv = shapes.uv_of(ob)[shapes.corners(ob) == vertex]
    assert (uv == uv[0]).all()
    return uv[0].astype(float)


def off_line(points, a, b):
    along = (b - a) / np.linalg.norm(b - a)
    return np.abs((points - a) @ [-along[1], along[0]]).max()


def test_a_marked_chain_runs_straight_from_pin_to_pin_and_bends_at_pins():
    chain = [4 * 9 + row for row in range(1, 8)]  # a column of the sheet
    ob, uv = sheet({37: (0.2, 0.0), 40: (-0.2, 0.0), 43: (0.1, 0.0)})
    marked(ob, chain, "line")
    assert bpy.ops.uv.flipfree_match() == {"FINISHED"}
    assert shapes.exact_flips(ob) == 0
    places = np.array([at(ob, v) for v in chain])
    targets = [uv[shapes.corners(ob)[: len(uv)] == v][0] for v in (37, 40, 43)]
    assert np.array_equal(places[[0, 3, 6]].astype(np.float32), np.array(targets, np.float32))
    for first, last in ((0, 3), (3, 6)):
        assert off_line(places[first : last + 1], places[first], places[last]) < 1e-6


def test_lines_may_bend_without_the_option_and_their_ends_have_to_be_pinned():
    chain = [4 * 9 + row for row in range(1, 8)]
    ob, _ = sheet({37: (0.2, 0.0), 43: (-0.2, 0.1)})
    marked(ob, chain, "line")
    assert bpy.ops.uv.flipfree_match(straight_lines=False) == {"FINISHED"}
    places = np.array([at(ob, v) for v in chain])
    assert off_line(places, places[0], places[-1]) > 1e-5
    ob, _ = sheet({37: (0.2, 0.0), 30: (0.0, 0.0)})
    marked(ob, chain, "line")
    with pytest.raises(RuntimeError, match="vertex 43 is the end of a marked line and not pinned"):
        bpy.ops.uv.flipfree_match()


def rim():
    return [v for v in range((N + 1) ** 2) if v % (N + 1) in (0, N) or v // (N + 1) in (0, N)]


def test_movable_parts_of_a_pinned_outline_may_move():
    loose = [v for v in rim() if 0 < v < N]  # a side without its corners
    results = []
    for movable in (False, True):
        pins = {v: (0.0, 0.0) for v in rim() if not movable or v not in loose}
        ob, uv = sheet(pins | {40: (0.2, 0.1)})
        if movable:
            ob.vertex_groups.new(name="Movable").add(loose, 1.0, "REPLACE")
        corner = shapes.corners(ob)
        assert bpy.ops.uv.flipfree_match() == {"FINISHED"}
        assert shapes.exact_flips(ob) == 0
        for v in pins:
            assert at(ob, v).astype(np.float32).tolist() == uv[corner == v][0].tolist()
        moved = [np.abs(at(ob, v) - uv[corner == v][0]).max() for v in loose]
        results.append(max(moved))
    assert results[0] == 0.0 and results[1] > 1e-4


def test_a_boundary_that_is_neither_pinned_nor_movable_is_named():
    pins = {v: (0.0, 0.0) for v in rim() if v > 4}
    ob, _ = sheet(pins)
    ob.vertex_groups.new(name="Movable").add([1, 2, 3], 1.0, "REPLACE")
    with pytest.raises(RuntimeError, match="vertex 0 .*neither pinned nor in the group 'Movable'"):
        bpy.ops.uv.flipfree_match()


def test_a_path_says_on_which_sheet_a_pin_lies():
    """A strip of quads bent to more than a full turn: its end lies on its beginning."""
    length, turn = 60, 1.15 * 2 * np.pi
    t = np.linspace(0.0, 1.0, length + 1)
    vertices = [(10 * s, w, 0.0) for s in t for w in (0.0, 0.5, 1.0)]
    faces = [
        (3 * i + k, 3 * i + 3 + k, 3 * i + 4 + k, 3 * i + 1 + k)
        for i in range(length)
        for k in (0, 1)
    ]
    ends = []
    for sheet_end in (1, length - 1):
        ob = shapes.add("Strip", vertices, faces, uv=True)
        corner = shapes.corners(ob)
        angle = turn * t[corner // 3]
        radius = 2.0 - 0.5 * (corner % 3)
        place = np.column_stack([radius * np.cos(angle), radius * np.sin(angle)])
        uv = np.array(place, np.float32)
        middle = 3 * sheet_end + 1
        border = np.array([v % 3 != 1 or v in (1, 3 * length + 1) for v in corner])
        shapes.set_uv(ob, uv)
        shapes.set_pins(ob, border | (corner == middle))
        marked(ob, [middle, middle - 1], "path")
        assert bpy.ops.uv.flipfree_match() == {"FINISHED"}
        assert shapes.exact_flips(ob) == 0
        assert at(ob, middle).astype(np.float32).tolist() == uv[corner == middle][0].tolist()
        ends.append(middle)
        bpy.data.objects.remove(ob)
        bpy.context.view_layer.update()


def test_paths_that_lead_nowhere_are_refused():
    ob, _ = sheet({v: (0.0, 0.0) for v in [*rim(), 40]})
    marked(ob, [41, 42], "path")
    with pytest.raises(RuntimeError, match="has to lead from a pin inside to the boundary"):
        bpy.ops.uv.flipfree_match()
    ob, _ = sheet({20: (0.0, 0.0), 40: (0.1, 0.0)})
    marked(ob, [40, 41, 42, 43, 44], "path")
    with pytest.raises(RuntimeError, match="the outline is not pinned"):
        bpy.ops.uv.flipfree_match()


def torus(turned=None):
    """A torus of 24 x 12 quads with a ring around its tube selected, and marked to turn so."""
    ob = shapes.primitive("torus", major_segments=24, minor_segments=12)
    ring = [p.index for p in ob.data.polygons if p.index // 12 == 3]
    if turned is not None:
        shapes.enter("EDIT")
        shapes.select_faces(ob, ring)
        assert mark(kind="loop", quarter_turns=turned) == {"FINISHED"}
        bpy.ops.object.mode_set(mode="OBJECT")
    return ob


def test_a_marked_ring_is_a_closed_strip_of_triangles(part):
    ob = torus(-2)
    snapshot = part("meshes.mesh_io").read(ob, only_selected=False)
    ((strip, turns),) = part("meshes.marks").loops(ob, snapshot)
    assert turns == -2 and len(strip) == 24 and len(set(strip.tolist())) == 24
    for a, b in zip(strip, np.roll(strip, -1), strict=True):
        assert len(set(snapshot.triangles[a]) & set(snapshot.triangles[b])) == 2


@pytest.mark.parametrize("turned", [0, 1])
def test_the_field_turns_along_a_marked_ring_as_asked(part, turned):
    ob = torus(turned)
    cones = {0: 1, 60: 1, 130: -1, 200: -1}  # without cones no loop of a torus can turn
    for vertex, curvature in cones.items():
        group = ob.vertex_groups.get(f"Cone {curvature:+d}")
        group = group or ob.vertex_groups.new(name=f"Cone {curvature:+d}")
        group.add([vertex], 1.0, "REPLACE")
    snapshot = part("meshes.mesh_io").read(ob, only_selected=False)
    (loop,) = part("meshes.marks").loops(ob, snapshot)
    field = ff.cross_field(
        snapshot.vertices,
        snapshot.triangles,
        signature=ff.Signature({v: 4 - c for v, c in cones.items()}, [loop]),
    )
    again = ff.signature(snapshot.vertices, snapshot.triangles, field)
    assert again.cones == {v: 4 - c for v, c in cones.items()}
    assert bpy.ops.uv.flipfree_field_aligned(field_from="cones") == {"FINISHED"}
    assert shapes.exact_flips(ob) == 0


def test_marks_are_cleared_and_what_is_no_ring_is_refused():
    ob = torus(1)
    shapes.enter("EDIT")
    with pytest.raises(RuntimeError, match="closed ring"):
        shapes.select_faces(ob, [0, 1, 2])
        mark(kind="loop")
    bpy.ops.mesh.select_all(action="SELECT")
    assert mark(kind="none") == {"FINISHED"}
    bm = bmesh.from_edit_mesh(ob.data)
    assert not [name for name in bm.faces.layers.int.keys() if name.startswith("Loop")]
    bpy.ops.mesh.select_all(action="DESELECT")
    with pytest.raises(RuntimeError, match="no edges are selected"):
        mark(kind="path")


@pytest.mark.parametrize("kind", ["rawfield", "ffield", "rotation", "json"])
def test_fields_and_signatures_come_from_files(part, tmp_path, kind):
    ob = torus()
    bm = bmesh.new()
    bm.from_mesh(ob.data)
    bmesh.ops.triangulate(bm, faces=bm.faces)
    bm.to_mesh(ob.data)
    bm.free()
    read = part("meshes.mesh_io").read(ob, only_selected=False)
    path = tmp_path / f"torus.{kind}"
    field = ff.cross_field(read.vertices, read.triangles, alignment=0.5)
    source = "signature" if kind == "json" else "file"
    if kind == "json":
        ff.signature(read.vertices, read.triangles, field).write(path)
    else:
        field.write(path, read.vertices, read.triangles)
    run = bpy.ops.uv.flipfree_field_aligned
    options = {"field_from": source, "field_file": str(path)}
    assert run(engine="padding", reroute=True, **options) == {"FINISHED"}
    assert shapes.exact_flips(ob) == 0
    with pytest.raises(RuntimeError, match="no file is named"):
        run(field_from=source)
    path.write_text(json.dumps({"cones": {"0": 3}}) if kind == "json" else "1 2 3")
    with pytest.raises(RuntimeError, match=r"Gauss-Bonnet|torus\."):
        run(**options)
