# SPDX-License-Identifier: GPL-3.0-or-later
"""Auto Unwrap through its operator, in every mode; judged by arithmetic that shares nothing with the solver."""

import bmesh
import bpy
import numpy as np
import pytest
import shapes
from layouts import islands


def unwrap(**options):
    """Along marked seams, and no others that are not needed."""
    assert bpy.ops.uv.flipfree_unwrap(**{"seams": "given"} | options) == {"FINISHED"}


@pytest.mark.parametrize("levels", [0, 1, 2])
def test_the_monkey_is_unwrapped_along_its_seams(levels):
    ob = shapes.monkey(levels)
    unwrap()
    assert shapes.exact_flips(ob) == 0
    assert len(islands(ob)) == 4  # two halves of the head, two eyes


@pytest.mark.parametrize("mode", ["OBJECT", "EDIT"])
def test_both_modes_give_the_same_bits(mode):
    ob = shapes.grid(12, uv=True)
    unwrap()
    expected = shapes.uv_of(ob)
    other = shapes.grid(12, uv=True)
    shapes.enter(mode)
    unwrap()
    assert bpy.context.mode == ("EDIT_MESH" if mode == "EDIT" else "OBJECT")
    bpy.ops.object.mode_set(mode="OBJECT")
    assert shapes.uv_of(other).tobytes() == expected.tobytes()


def test_only_selected_faces_move():
    ob = shapes.grid(10, uv=True)
    rng = np.random.default_rng(5)
    before = rng.random((len(ob.data.loops), 2), np.float32)
    shapes.set_uv(ob, before)
    bpy.ops.object.mode_set(mode="EDIT")
    chosen = [0, 1, 2, 10, 11, 12, 55, 66]  # the last two touch in one point only
    shapes.select_faces(ob, chosen)
    unwrap()
    bpy.ops.object.mode_set(mode="OBJECT")
    after = shapes.uv_of(ob)
    inside = np.isin(np.repeat(np.arange(100), 4), chosen)
    assert after[~inside].tobytes() == before[~inside].tobytes()
    assert (after[inside] != before[inside]).any(axis=1).mean() > 0.9


def test_several_objects_at_once_and_shared_meshes_once():
    first = shapes.grid(6, "First", uv=True)
    second = shapes.cube("Second")
    twin = bpy.data.objects.new("Twin", first.data)
    bpy.context.scene.collection.objects.link(twin)
    bystander = shapes.grid(4, "Bystander", uv=True)
    bystander.select_set(False)
    before = shapes.uv_of(bystander).tobytes()
    for ob in (first, second, twin):
        shapes.activate(ob, only=False)
    unwrap()
    assert shapes.exact_flips(first) == 0 and shapes.exact_flips(second) == 0
    assert shapes.uv_of(bystander).tobytes() == before


@pytest.mark.parametrize("pins", [[60], [0, 120], [0, 60, 120]])
def test_pins_stay_bit_for_bit(pins):
    ob = shapes.grid(10, uv=True)
    unwrap()
    uv = shapes.uv_of(ob)
    corner = shapes.corners(ob)
    pinned = np.isin(corner, pins)
    uv[corner == 60] += np.float32([0.01, -0.013])
    shapes.set_uv(ob, uv)
    shapes.set_pins(ob, pinned)
    unwrap()
    after = shapes.uv_of(ob)
    assert after[pinned].tobytes() == uv[pinned].tobytes()
    assert shapes.exact_flips(ob) == 0


def test_pins_can_be_ignored():
    ob = shapes.grid(6, uv=True)
    unwrap()
    uv = shapes.uv_of(ob)
    shapes.set_uv(ob, uv)
    shapes.set_pins(ob, np.arange(8))
    uv[:8] = np.linspace(0, 1, 16).reshape(8, 2)
    shapes.set_uv(ob, uv)
    unwrap(use_pins=False)
    assert (shapes.uv_of(ob)[:8] != uv[:8]).any()
    assert shapes.exact_flips(ob) == 0


def test_a_closed_mesh_without_seams_is_cut_along_edges_never_through_faces():
    ob = shapes.cube()
    unwrap()
    assert shapes.exact_flips(ob) == 0
    assert not any(edge.use_seam for edge in ob.data.edges)
    # One UV per corner of each quad: every quad is whole, as its two triangles are not flipped.
    assert len(islands(ob)) == 1


def test_automatic_cuts_become_seams_if_allowed():
    ob = shapes.cube()
    unwrap(mark_seams=True)
    assert sum(edge.use_seam for edge in ob.data.edges) >= 3
    uv = shapes.uv_of(ob)
    # With these seams nothing is left to cut.
    count = len(islands(ob))
    unwrap(mark_seams=True)
    assert len(islands(ob)) == count and uv.shape == shapes.uv_of(ob).shape


def test_hidden_faces_are_left_alone_in_edit_mode():
    ob = shapes.grid(6, uv=True)
    before = shapes.uv_of(ob)
    bpy.ops.object.mode_set(mode="EDIT")
    shapes.select_faces(ob, [3])
    bpy.ops.mesh.hide()
    bpy.ops.mesh.select_all(action="SELECT")
    unwrap()
    bpy.ops.object.mode_set(mode="OBJECT")
    assert shapes.uv_of(ob)[12:16].tobytes() == before[12:16].tobytes()
    assert (shapes.uv_of(ob)[:12] != before[:12]).any()


def test_the_uv_editors_own_selection_counts_where_it_is_in_use(part, monkeypatch):
    """No window here: the operator's helper is called with the area that it would see."""
    from types import SimpleNamespace

    ob = shapes.grid(3, uv=True)
    shapes.enter("EDIT")
    bm = bmesh.from_edit_mesh(ob.data)
    layer = bm.loops.layers.uv.verify()
    for face in bm.faces:
        chosen = face.index == 4
        if hasattr(face, "uv_select"):
            face.uv_select = chosen
        else:
            for loop in face.loops:
                loop[layer].select = chosen
    bmesh.update_edit_mesh(ob.data)

    def context(area, sync):
        return SimpleNamespace(
            mode="EDIT_MESH",
            objects_in_mode_unique_data=[ob],
            area=SimpleNamespace(type=area),
            tool_settings=SimpleNamespace(use_uv_select_sync=sync),
        )

    def faces(area, sync):
        (snapshot,), _ = part("operators.common").read_meshes(context(area, sync))
        return set(snapshot.triangle_face.tolist())

    assert faces("IMAGE_EDITOR", False) == {4}
    assert len(faces("IMAGE_EDITOR", True)) == 9
    assert len(faces("VIEW_3D", False)) == 9


def test_the_report_has_the_numbers(capfd):
    shapes.grid(8, uv=True)
    unwrap()
    out = capfd.readouterr().out
    assert "1 island, 0 flips, 0 overlaps, distortion mean 1.0" in out and " s" in out


def test_islands_may_overlap_themselves_if_allowed():
    ob = shapes.monkey(1)
    unwrap(bijective=False)
    assert shapes.exact_flips(ob) == 0


def rings(turns=1.6, sectors=96, rows=6):
    """A strip of quads around a slender cone: flat, it winds `turns` times around a point, and lies on itself."""
    around, out = np.meshgrid(
        np.linspace(0.0, 6 * np.pi * turns, sectors + 1), np.linspace(1.0, 2.5, rows + 1)
    )
    lift = np.sqrt(1.0 - 1.0 / 9.0)
    vertices = np.stack([out * np.cos(around) / 3, out * np.sin(around) / 3, out * lift], -1)
    at = np.arange((sectors + 1) * (rows + 1)).reshape(rows + 1, sectors + 1)
    faces = np.stack([at[:-1, :-1], at[:-1, 1:], at[1:, 1:], at[1:, :-1]], -1).reshape(-1, 4)
    return shapes.add("Rings", vertices.reshape(-1, 3), faces)


def test_an_island_that_would_lie_on_itself_is_cut_along_edges_that_can_be_selected():
    ob = rings()
    shapes.activate(ob)
    unwrap(select_cuts=True)
    assert shapes.exact_flips(ob) == 0
    assert len(islands(ob)) > 1
    chosen = {edge.index for edge in ob.data.edges if edge.select}
    assert chosen and not any(edge.use_seam for edge in ob.data.edges)
    unwrap(mark_seams=True)
    seams = {edge.index for edge in ob.data.edges if edge.use_seam}
    assert seams == chosen


def test_no_cuts_are_added_where_they_may_not():
    ob = rings()
    shapes.activate(ob)
    unwrap(may_add_cuts=False)
    assert len(islands(ob)) == 1
    assert shapes.exact_flips(ob) == 0


def reported(capfd, **options):
    assert bpy.ops.uv.flipfree_unwrap(**options) == {"FINISHED"}
    return capfd.readouterr().out


@pytest.mark.parametrize("make", ["cone", "monkey", "uv_sphere", "cube"])
def test_by_default_seams_are_found_that_keep_the_bound(make, capfd):
    getattr(bpy.ops.mesh, f"primitive_{make}_add")()
    ob = bpy.context.object
    line = reported(capfd)
    assert "Warning" not in line and "stretched" not in line
    assert float(line.split("distortion mean ")[1].split()[0]) <= 1.03
    assert not any(edge.use_seam for edge in ob.data.edges)
    line = reported(capfd, seams="given")
    assert "% of the surface is stretched beyond 1.25" in line and "Warning" in line
    assert "'Seams: Automatic' cuts there" in line


def test_seams_that_are_marked_are_kept_and_no_others_added_where_the_bound_holds(capfd):
    ob = shapes.grid(4, bump=0.0)
    middle = [
        e for e in ob.data.edges if all(abs(ob.data.vertices[v].co.x) < 1e-6 for v in e.vertices)
    ]
    assert len(middle) == 4
    for edge in middle:
        edge.use_seam = True
    line = reported(capfd)
    assert "2 islands" in line and "cut automatically" not in line and "stretched" not in line


def test_pins_and_automatic_seams_do_not_exclude_each_other(capfd):
    """Where pins are, nothing is cut that has not to be; the report names the pins, not a seam."""
    ob = shapes.grid(4, bump=0.0, uv=True)
    at = shapes.plane(ob)
    shapes.set_uv(ob, (at * [1.0, 0.2] + 1) / 4)
    shapes.set_pins(ob, np.ones(len(at), bool))
    line = reported(capfd)
    assert (
        "100 % of the surface is stretched beyond 1.25" in line and "unpin some of the pins" in line
    )
    assert shapes.uv_of(ob) == pytest.approx((at * [1.0, 0.2] + 1) / 4)
    line = reported(capfd, use_pins=False)
    assert "stretched" not in line
