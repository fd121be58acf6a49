# SPDX-License-Identifier: GPL-3.0-or-later
"""What the views compute and draw, without a window: figures, wrong faces, seams, pins; switching."""

from fractions import Fraction

import bpy
import numpy as np
import pytest
import shapes


def drawn(part, ob, what):
    """The drawing of one object with this switched on."""
    state, refresh = part("views.state"), part("views.refresh")
    state.switch(what, True)
    try:
        return refresh._read(ob, ()).drawing
    finally:
        state.switch_all_off()


def certificate_of(part, ob):
    part("certificates").forget()
    assert bpy.ops.uv.flipfree_check() == {"FINISHED"}
    return part("certificates").of(ob).figures


def test_the_legend_of_distortion_has_the_figures_of_the_certificate(part):
    ob = shapes.stretched_monkey()  # of quads, the two triangles of which differ
    figures = certificate_of(part, ob)
    drawing = drawn(part, ob, "distortion")
    ours = part("views.measures").figures(drawing.values, drawing.weights)
    assert ours.mean == pytest.approx(figures["energy"], rel=1e-5)
    assert ours.worst == pytest.approx(figures["max_energy"], rel=1e-4)
    assert ours.percentiles[2] == pytest.approx(figures["energy_p99"], rel=1e-4)
    quads = np.bincount(shapes.face_of_triangles(ob)) == 2
    first = np.searchsorted(shapes.face_of_triangles(ob), np.flatnonzero(quads))
    assert len(first) > 100  # each face has one colour
    assert (drawing.face_values[first] == drawing.face_values[first + 1]).all()


def test_flipped_faces_have_no_bound_and_faces_without_area_no_value(part):
    measures = part("views.measures")
    points = np.array(
        [
            [[0, 0, 0], [1, 0, 0], [0, 1, 0]],
            [[0, 0, 0], [1, 0, 0], [0, 1, 0]],
            [[0, 0, 0], [1, 0, 0], [2, 0, 0]],
        ],
        float,
    )
    uv = np.array(
        [[[0, 0], [1, 0], [0, 1]], [[0, 0], [0, 1], [1, 0]], [[0, 0], [1, 0], [0, 1]]], float
    )
    found = measures.stretch(points, uv)
    for measure in (measures.dirichlet, measures.angle, measures.area):
        values = measure(found)
        assert values[0] == pytest.approx(1.0) and np.isposinf(values[1]) and np.isnan(values[2])
    colours = part("views.faces").colours(
        part("views.faces").SCALES["distortion"], np.array([0.0, np.inf, np.nan])
    )
    assert len({tuple(c) for c in colours.tolist()}) == 3
    figures = measures.figures(measures.dirichlet(found), found.area)
    assert figures.mean == pytest.approx(1.0) and np.isinf(figures.worst)


def test_orientation_is_exact_where_doubles_are_not(part):
    measures = part("views.measures")
    random = np.random.default_rng(2)
    base = random.random((4000, 3, 2)).astype(np.float32)
    # Third corners within some units in the last place of the line through the other two.
    on_line = (base[:, 0] + (base[:, 1] - base[:, 0]) * random.random((4000, 1))).astype(np.float32)
    steps = random.integers(-1, 2, (4000, 2)).astype(np.float32)
    base[:, 2] = np.nextafter(on_line, on_line + steps, dtype=np.float32)
    base[:50, 2] = base[:50, 0]
    sign = measures.orientation(base)
    for triangle, found in zip(base, sign, strict=True):
        (ax, ay), (bx, by), (cx, cy) = [[Fraction(float(x)) for x in p] for p in triangle]
        exact = (bx - ax) * (cy - ay) - (by - ay) * (cx - ax)
        assert found == (exact > 0) - (exact < 0)
    assert set(sign.tolist()) == {-1, 0, 1}


@pytest.mark.parametrize("mode", ["OBJECT", "EDIT"])
@pytest.mark.parametrize("what", ["distortion", "angle", "area", "density"])
def test_every_visible_triangle_is_coloured_on_the_model_and_in_the_map(what, mode, part):
    ob = shapes.grid(6, uv=True)
    assert bpy.ops.uv.flipfree_unwrap() == {"FINISHED"}
    hidden = np.zeros(36, bool)
    hidden[:4] = True
    ob.data.polygons.foreach_set("hide", hidden)
    bpy.ops.object.mode_set(mode=mode)
    drawing = drawn(part, ob, what)
    legend = part("views.legend").of([drawing], what)
    surface, plane = drawing.shapes
    assert (surface.place, plane.place) == ("SURFACE", "MAP")
    assert len(surface.pos) == len(plane.pos) == len(surface.colour) == 3 * 2 * 32
    assert np.isfinite(surface.pos).all() and plane.pos.min() >= 0.0 and plane.pos.max() <= 1.0
    assert legend.bar.shares.sum() == pytest.approx(1.0)
    assert any(text.startswith("mean ") for _, text in legend.lines)


def test_density_counts_the_size_in_the_scene(part):
    ob = shapes.grid(4, bump=0.0, uv=True)
    shapes.set_uv(ob, shapes.plane(ob) / 2)
    assert drawn(part, ob, "density").values == pytest.approx(512.0)
    for scale in ((2.0, 2.0, 2.0), (4.0, 1.0, 1.0), (4.0, -1.0, 0.0)):  # four times the area
        ob.scale = scale
        bpy.context.view_layer.update()
        assert drawn(part, ob, "density").values == pytest.approx(256.0)


def test_a_mesh_without_a_map_says_so(part):
    ob = shapes.grid(3)
    drawing = drawn(part, ob, "distortion")
    assert drawing.values is None and not drawing.shapes
    assert part("views.legend").of([drawing], "distortion").lines[0][1] == "no UV map to measure"


def test_wrong_faces_are_named_by_kind(part):
    ob = shapes.two_sheets()
    corner = shapes.corners(ob)
    uv = shapes.uv_of(ob)
    uv[corner == 12] += [0.25, 0.1]
    uv[corner >= 25] -= [0.5, 0.0]
    uv[60:64] = uv[60]  # a face of the large one
    shapes.set_uv(ob, uv)
    snapshot = part("meshes.mesh_io").read(ob, only_selected=False)
    job = part("views.faults").start(snapshot)
    assert job.wait(60.0)
    found = part("views.faults").collect(snapshot, job.result())
    sign = part("views.measures").orientation(snapshot.corner_uv)
    assert found.flipped.tolist() == np.unique(snapshot.triangle_face[sign < 0]).tolist()
    assert found.flipped.size and 15 in found.degenerate
    assert set(range(16, 32)) <= set(found.overlapping.tolist()), "stacked islands as a whole"
    assert found.stacked_pairs >= 1
    together = np.concatenate([found.flipped, found.degenerate, found.overlapping])
    assert len(np.unique(together)) == len(together)


def test_seams_have_the_colour_of_their_turns(part):
    ob = shapes.primitive("torus", major_segments=16, minor_segments=8)
    assert bpy.ops.uv.flipfree_seamless() == {"FINISHED"}
    drawing = drawn(part, ob, "seams")
    seams = [edge.index for edge in ob.data.edges if edge.use_seam]
    surface, plane = drawing.shapes
    assert len(surface.pos) == 2 * len(seams) and len(plane.pos) == 4 * len(seams)
    stored = np.zeros(len(ob.data.edges), np.int32)
    ob.data.attributes["seam_turns"].data.foreach_get("value", stored)
    colours = part("views.marks").SEAM_COLOURS
    expected = np.repeat([colours[t] for t in stored[seams].tolist()], 2, axis=0)
    assert surface.colour == pytest.approx(expected)


def test_cones_come_with_their_turns_and_what_is_missing(part):
    ob = shapes.cube()
    for v in range(7):
        (ob.vertex_groups.get("Cone +1") or ob.vertex_groups.new(name="Cone +1")).add(
            [v], 1.0, "ADD"
        )
    drawing = drawn(part, ob, "cones")
    texts = [text for _, text in drawing.notes]
    assert texts == ["Cube: 7 cones", "The cones still lack +1 quarter turns"]
    on_model = [mark for mark in drawing.marks if mark.place == "SURFACE"]
    assert [mark.text for mark in on_model] == ["+1"] * 7 and all(m.normal for m in on_model)
    in_map = {mark.at[:2] for mark in drawing.marks if mark.place == "MAP"}
    corner = shapes.corners(ob)
    assert in_map == {tuple(uv) for uv in shapes.uv_of(ob)[corner < 7].tolist()}


def contradicting(part, ob):
    snapshot = part("meshes.mesh_io").read(ob, only_selected=False)
    vertices, _, bad = part("views.marks").contradictions(snapshot)
    return sorted(np.unique(snapshot.vertex_ids[vertices[bad]]).tolist()), len(vertices)


def test_pins_contradict_each_other_where_no_map_can_meet_both(part):
    ob = shapes.grid(4, bump=0.0, uv=True)
    corner = shapes.corners(ob)
    uv = shapes.plane(ob)
    shapes.set_uv(ob, uv)
    shapes.set_pins(ob, np.isin(corner, [6, 12, 18]))
    assert contradicting(part, ob) == ([], 3)
    uv[corner == 18] = uv[corner == 6][0]
    shapes.set_uv(ob, uv)
    assert contradicting(part, ob) == ([6, 18], 3)
    uv[np.flatnonzero(corner == 12)[0]] += 0.1
    shapes.set_uv(ob, uv)
    assert contradicting(part, ob) == ([6, 12, 18], 4)


def test_a_vertex_on_a_seam_may_have_two_pins(part):
    ob = shapes.grid(4, bump=0.0, uv=True)
    corner = shapes.corners(ob)
    uv = shapes.plane(ob)
    uv[shapes.seam_in_the_middle(ob)] += [3.0, 0.0]
    shapes.set_uv(ob, uv)
    shapes.set_pins(ob, corner == 12)
    assert contradicting(part, ob) == ([], 2)


def test_one_colouring_at_a_time_and_one_call_for_off(part):
    state = part("views.state")
    try:
        state.switch("distortion", True)
        state.switch("pins", True)
        state.switch("area", True)
        assert not state.is_on("distortion") and state.is_on("area") and state.is_on("pins")
        state.switch("distortion", False)
        assert state.is_on("area")
    finally:
        state.switch_all_off()
    assert not state.anything()


def test_without_a_window_it_says_so_and_stores_nothing(tmp_path, part):
    for what in part("views.state").ALL:
        with pytest.raises(RuntimeError, match="Without a window"):
            bpy.ops.uv.flipfree_show(what=what)
    manager = bpy.context.window_manager
    manager.flipfree_faces = "distortion"
    assert manager.flipfree_faces == "distortion"
    assert not [key for key in manager.keys() if "flipfree" in key]
    part("views.controls").switch_off()
    assert manager.flipfree_faces == "none"


def test_edited_meshes_are_read_without_telling_blender_that_they_changed(part):
    ob = shapes.grid(4, uv=True)
    bpy.ops.object.mode_set(mode="EDIT")
    bpy.context.view_layer.update()
    watch = part("watch")
    before, meshes = watch.stamp(ob), len(bpy.data.meshes)
    for what in part("views.state").ALL:
        if what != "faults":
            drawn(part, ob, what)
    bpy.context.view_layer.update()
    assert watch.stamp(ob) == before and len(bpy.data.meshes) == meshes
