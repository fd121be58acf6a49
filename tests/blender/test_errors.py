# SPDX-License-Identifier: GPL-3.0-or-later
"""Each kind of bad input: its own message, the mesh and the selection untouched, the place shown on demand (docs/errors.md).

What to do about each, done as it is said, is in test_cures.py.
"""

import re
from pathlib import Path

import bpy
import numpy as np
import pytest
import shapes

REPOSITORY = Path(__file__).parents[2]


def refused(ob, *expected, operator=None, **options):
    """The operator refuses with a message that has all of `expected` and leaves everything alone."""
    message = shapes.refused(ob, "", operator or bpy.ops.uv.flipfree_unwrap, **options)
    assert all(text in message for text in (*expected, ob.name)), message
    assert ("Select Where It Failed" in message) == bpy.ops.uv.flipfree_select_failed.poll()
    return message


def test_mesh_without_faces():
    refused(shapes.add("Points", [(0, 0, 0), (1, 0, 0)], [], edges=[(0, 1)]), "no faces")


def test_packing_a_map_with_flips():
    ob = shapes.grid(3, uv=True)
    shapes.set_uv(ob, [(-x, y) for x, y in shapes.uv_of(ob)])
    if not shapes.exact_flips(ob):  # it was mirrored before
        shapes.set_uv(ob, [(-x, y) for x, y in shapes.uv_of(ob)])
    shapes.refused(ob, "is flipped.*Use Repair Flips", bpy.ops.uv.flipfree_pack)
    assert shapes.shown("face")


def test_no_selected_faces():
    ob = shapes.grid(3, uv=True)
    bpy.ops.object.mode_set(mode="EDIT")
    bpy.ops.mesh.select_all(action="DESELECT")
    with pytest.raises(RuntimeError, match="no faces are selected"):
        bpy.ops.uv.flipfree_unwrap()
    assert ob.mode == "EDIT"


def test_no_object_selected():
    ob = shapes.grid(3)
    ob.select_set(False)
    with pytest.raises(RuntimeError, match="poll"):
        bpy.ops.uv.flipfree_unwrap()


def defects():
    square = [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0)]
    return {
        "edge with three faces": (
            [(0, 0, 0), (1, 0, 0), (0, 1, 0), (0, -1, 0.5), (0, 0, 1)],
            [(0, 1, 2), (1, 0, 3), (0, 1, 4)],
        ),
        "faces that look to opposite sides": (
            [(0, 0, 0), (1, 0, 0), (0, 1, 0), (1, -1, 0)],
            [(0, 1, 2), (0, 1, 3)],
        ),
        "zero area": (
            [(0, 0, 0), (1, 0, 0), (2, 0, 0), (1, 1, 0)],
            [(0, 1, 3), (1, 2, 3), (2, 1, 0)],
        ),
        "zero length": ([(0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 1, 0)], [(0, 1, 2), (1, 3, 2)]),
        "duplicate": (square, [(0, 1, 2), (0, 2, 3), (0, 1, 2)]),
    }


@pytest.mark.parametrize("name", defects())
@pytest.mark.parametrize("operator", ["unwrap", "conformal", "seamless", "field_aligned"])
def test_no_operator_refuses_a_mesh_that_is_no_clean_surface(name, operator, capfd):
    ob = shapes.add("Broken", *defects()[name], uv=True)
    # These have boundaries of three and four edges, too short to be straight.
    free = {"boundary": "free"} if operator in {"seamless", "field_aligned"} else {}
    assert getattr(bpy.ops.uv, f"flipfree_{operator}")(**free) == {"FINISHED"}
    report = capfd.readouterr().out
    assert "; separated: " in report or " turned over" in report
    # Of zero area are faces whose corners lie on one line, and so inside edges.
    assert name == "zero area" or shapes.edges_with_loose_ends(ob) == []
    assert bpy.ops.uv.flipfree_select_mends.poll()


def with_a_pin_that_is_no_number():
    """At face 2 of a grid."""
    ob = shapes.grid(3, uv=True)
    uv = shapes.uv_of(ob)
    uv[9] = np.nan
    shapes.set_uv(ob, uv)
    shapes.set_pins(ob, [9])
    return ob


def test_pin_that_is_no_number():
    ob = with_a_pin_that_is_no_number()
    refused(ob, "face 2", "pinned UV", "Alt P")
    assert shapes.shown("face") == [2]


@pytest.mark.parametrize("mode", ["VERT", "EDGE", "FACE"])
def test_the_selection_before_a_failed_run_in_edit_mode_is_kept(mode):
    ob = with_a_pin_that_is_no_number()
    bpy.ops.object.mode_set(mode="EDIT")
    bpy.ops.mesh.select_mode(type=mode)
    bpy.ops.mesh.select_all(action="SELECT")
    refused(ob, "face 2", "pinned UV")
    assert shapes.shown("face") == [2]


def test_select_where_it_failed_is_off_after_a_run_that_went_well():
    ob = shapes.grid(3, uv=True)
    ob.data.vertices[5].co.x = float("nan")
    refused(ob, "vertex 5")
    assert bpy.ops.uv.flipfree_select_failed.poll()
    ob.data.vertices[5].co.x = -0.3
    assert bpy.ops.uv.flipfree_unwrap() == {"FINISHED"}
    assert not bpy.ops.uv.flipfree_select_failed.poll()


def test_places_of_a_mesh_that_changed_are_not_shown():
    ob = with_a_pin_that_is_no_number()
    refused(ob, "face 2", "pinned UV")
    shapes.enter("EDIT")
    bpy.ops.mesh.subdivide()
    with pytest.raises(RuntimeError, match="no longer the one"):
        bpy.ops.uv.flipfree_select_failed()


def flipped_grid(name, faces):
    """Mapped by x, y, but for these faces, which lie apart and upside down."""
    ob = shapes.grid(3, name, uv=True)
    uv = shapes.plane(ob)
    for face in faces:
        for loop in ob.data.polygons[face].loop_indices:
            uv[loop] = uv[loop] * (-1, 1) + 5
    shapes.set_uv(ob, uv)
    return ob


def test_places_in_several_objects_are_shown_together():
    first = flipped_grid("First", range(9))
    second = shapes.grid(3, "Second", uv=True)
    second.data.vertices[5].co.x = float("nan")
    shapes.activate(first, only=False)
    with pytest.raises(RuntimeError, match="no number(.|\n)*is flipped"):
        bpy.ops.uv.flipfree_pack()
    assert bpy.ops.uv.flipfree_select_failed() == {"FINISHED"}
    assert {ob.name for ob in bpy.context.objects_in_mode} == {"First", "Second"}
    assert tuple(bpy.context.tool_settings.mesh_select_mode) == (True, False, True)
    bpy.ops.object.mode_set(mode="OBJECT")
    assert shapes.selected(second, "vertex") == [5]


def test_places_are_named_in_the_whole_mesh_when_only_a_part_is_selected():
    ob = flipped_grid("Part", [8])
    bpy.ops.object.mode_set(mode="EDIT")
    shapes.select_faces(ob, [8])
    with pytest.raises(RuntimeError, match="face 8"):
        bpy.ops.uv.flipfree_pack()


def test_a_map_that_fails_its_certificate_is_not_written(part, monkeypatch):
    """The solver never returns one; if it did, the mesh would stay as it is."""
    from dataclasses import replace

    ob = shapes.grid(3, uv=True)
    original = part("operators.unwrap").UnwrapTask.collect

    def broken(self, result):
        if result is None:  # of a pause
            return original(self, result)
        certificate = replace(result.certificate, ok=False, failures=["3 triangles are flipped."])
        return original(self, replace(result, certificate=certificate))

    monkeypatch.setattr(part("operators.unwrap").UnwrapTask, "collect", broken)
    refused(ob, "failed its check", "3 triangles are flipped")


def test_every_code_of_the_solver_has_a_text_for_users(part):
    source = (REPOSITORY / "native/flipfree/base/error.h").read_text()
    codes = set(re.findall(r'CODE\(k\w+, "([^"]+)"\)', source))
    assert codes
    assert codes <= set(part("errors").TEXTS)
    of_python = {
        "out of memory",
        "solver process not started",
        "solver process ended",
    }
    assert codes | of_python == set(part("errors").TEXTS)


def test_the_documented_messages_are_the_real_ones(part):
    page = (REPOSITORY / "docs/errors.md").read_text()
    for text in part("errors").TEXTS.values():
        what, _, cure = text.partition(". ")
        assert what in page and cure in page


def test_popups_get_lines_that_fit_the_screen(part):
    errors = part("errors")
    text = "Suzanne: " + "so many words " * 40 + "\nUnwrap " + "x" * 300 + " and more"
    lines = errors.in_lines(text).split("\n")
    assert all(len(line) <= 100 or " " not in line for line in lines)
    assert " ".join(lines).split() == text.split()
    assert any(line.startswith("Unwrap") for line in lines)  # where it was broken already
    assert errors.in_lines("short") == "short"


def slit_grid():
    """Eight by eight quads with a slit of seams from the middle of a side inwards, both sides of which are pinned to one
    point at the vertex that is returned."""
    ob = shapes.grid(8, "Slit", bump=0.0, uv=True)
    at = np.array([v.co[:2] for v in ob.data.vertices])
    for edge in ob.data.edges:
        ends = at[list(edge.vertices)]
        edge.use_seam = bool((np.abs(ends[:, 0]) < 1e-6).all() and (ends[:, 1] < 0.1).all())
    vertex = int(np.flatnonzero((np.abs(at[:, 0]) < 1e-6) & (np.abs(at[:, 1] + 0.5) < 1e-6))[0])
    corner = shapes.corners(ob)
    uv = (at[corner] + 1) / 2
    shapes.set_uv(ob, uv)
    shapes.set_pins(ob, corner == vertex)
    return ob, vertex, corner


@pytest.mark.parametrize("operator", ["match", "unwrap"])
@pytest.mark.parametrize("cure", ["unpin", "clear"])
def test_one_vertex_on_two_sides_of_a_slit_is_named_once(operator, cure):
    ob, vertex, corner = slit_grid()
    run = getattr(bpy.ops.uv, f"flipfree_{operator}")
    message = refused(
        ob, f"vertex {vertex} lies on both sides of a seam", "Unpin one", operator=run
    )
    assert [int(n) for n in re.findall(r"\d+", message)] == [vertex]
    assert shapes.shown("vertex") == [vertex]
    if cure == "unpin":
        x = np.array([p.center.x for p in ob.data.polygons]).repeat(4)
        shapes.set_pins(ob, (corner == vertex) & (x < 0))
    else:
        for edge in ob.data.edges:
            edge.use_seam = False
    assert run() == {"FINISHED"}


def test_the_solvers_words_name_vertices_of_the_mesh():
    ob = shapes.two_sheets()
    corner = shapes.corners(ob)
    uv = shapes.uv_of(ob)
    uv[np.isin(corner, [30, 40])] = uv[np.flatnonzero(corner == 30)[0]]
    shapes.set_uv(ob, uv)
    shapes.set_pins(ob, np.isin(corner, [25, 30, 40]))
    refused(ob, "vertex 30 (and 1 more)", "Vertices 30 and 40", operator=bpy.ops.uv.flipfree_match)
