# SPDX-License-Identifier: GPL-3.0-or-later
"""The sidebar: what it advises next, the certificate it shows, whether that still holds; preferences."""

import bpy
import numpy as np
import pytest
import shapes


@pytest.fixture
def step(part):
    return lambda: part("ui.guide").step(bpy.context)


@pytest.fixture
def kept(part):
    """Of the active object."""
    certificates = part("certificates")
    certificates.forget()
    return lambda: certificates.of(bpy.context.object)


@pytest.fixture
def holds(part):
    certificates = part("certificates")
    return lambda: certificates.holds(bpy.context.object, certificates.of(bpy.context.object))


class Recorder:
    """Stands for a layout: keeps what is drawn."""

    def __init__(self, drawn=None):
        self.drawn = [] if drawn is None else drawn

    def __getattr__(self, name):
        def add(*args, **options):
            if name in ("label", "operator", "menu", "prop"):
                self.drawn.append((name, options.get("text", args[0] if args else "")))
            return Recorder(self.drawn)

        return add


def buttons(step):
    return [name for name, _, _ in step().buttons]


def draw(part, name):
    """What a panel of the sidebar shows."""
    from types import SimpleNamespace

    panel = SimpleNamespace(layout=Recorder())
    cls = next(c for c in part("ui.sidebar").CLASSES if c.__name__ == name)
    cls.draw(panel, bpy.context)
    return panel.layout.drawn


def test_the_guide_leads_from_seams_to_packing(step, kept):
    assert not step().colour and "mesh" in step().lines[0]
    ob = shapes.cube()
    ob.data.uv_layers.remove(ob.data.uv_layers[0])
    assert "Auto Unwrap" in step().lines[0] and buttons(step) == ["uv.flipfree_auto_seams"]
    bpy.ops.object.mode_set(mode="EDIT")
    assert buttons(step)[0] == "mesh.mark_seam"
    bpy.ops.mesh.select_all(action="SELECT")
    bpy.ops.mesh.mark_seam()
    assert "Seams are marked" in step().lines[0] and not step().buttons
    bpy.ops.object.mode_set(mode="OBJECT")
    assert "Seams are marked" in step().lines[0]
    assert bpy.ops.uv.flipfree_unwrap() == {"FINISHED"}
    assert step().colour == "GREEN" and step().icon != "INFO"
    shapes.set_uv(ob, -shapes.uv_of(ob) * [1, -1])
    ob.data.update()
    bpy.context.view_layer.update()
    assert not step().colour and "changed" in step().lines[0]
    assert bpy.ops.uv.flipfree_check() == {"FINISHED"}
    assert step().colour == "GREEN" and step().lines[2] == "6 islands are mirrored"
    assert step().buttons[0][2] == {"what": "mirrored"} and "uv.flipfree_repair" in buttons(step)
    uv = shapes.uv_of(ob)
    uv[0] = 2 * uv[1] - uv[0]
    shapes.set_uv(ob, uv)
    assert bpy.ops.uv.flipfree_check() == {"FINISHED"}
    assert step().colour == "RED" and step().lines == ("1 flipped face",)
    assert step().buttons[0][2] == {"what": "flipped"}
    assert "uv.flipfree_repair" in buttons(step)


def test_a_map_that_nobody_looked_at_is_to_be_checked(step, kept):
    shapes.cube()
    assert "not checked" in step().lines[0]


def test_stacked_islands_are_to_be_packed(step, kept):
    ob = shapes.two_sheets()
    uv = shapes.uv_of(ob)
    shapes.set_uv(
        ob, uv - uv.min(axis=0) * 0 - np.where(np.arange(len(uv))[:, None] < 64, 0, [0.6, 0])
    )
    shapes.set_pins(ob, np.zeros(len(uv), bool))
    assert bpy.ops.uv.flipfree_check() == {"FINISHED"}
    assert step().colour == "RED" and "Pack" in step().lines[1]


def test_stretched_maps_are_yellow_badly_stretched_ones_red_and_can_be_cut(step, kept):
    shapes.two_sheets(squeezed=True, pinned=False)
    assert bpy.ops.uv.flipfree_check() == {"FINISHED"}
    assert buttons(step) == ["uv.flipfree_select_poor", "uv.flipfree_cut_stretched"]
    assert (step().colour, step().lines[0]) == ("RED", "Badly stretched: 3 % of the surface")
    assert step().lines[1] == "beyond 1.25, 1 island"
    assert bpy.ops.uv.flipfree_cut_stretched() == {"FINISHED"}
    assert step().colour == "GREEN"


def test_an_object_that_is_not_selected_is_named(step):
    shapes.cube("Box").select_set(False)
    assert step().lines == ("Box is not selected.",)


@pytest.mark.parametrize("mode", ["OBJECT", "EDIT"])
def test_a_certificate_holds_until_the_map_changes_and_again_after_going_back(
    mode, kept, holds, part
):
    ob = shapes.grid(6, uv=True)
    assert kept() is None
    shapes.enter(mode)
    assert bpy.ops.uv.flipfree_unwrap() == {"FINISHED"}
    assert kept().verb == "Auto Unwrap" and kept().figures["flips32"] == 0
    assert holds() is True
    for other in ("OBJECT", "EDIT"):
        bpy.ops.object.mode_set(mode=other)
        assert holds() is True, "the mode makes no difference"
    bpy.ops.object.mode_set(mode="OBJECT")
    good = shapes.uv_of(ob)
    shapes.set_uv(ob, good * 2)
    ob.data.update()
    bpy.context.view_layer.update()
    assert holds() is False
    shapes.set_uv(ob, good)
    ob.data.update()
    bpy.context.view_layer.update()
    assert holds() is True


def test_uvs_moved_in_edit_mode_are_noticed(kept, holds):
    import bmesh

    ob = shapes.grid(4, uv=True)
    assert bpy.ops.uv.flipfree_unwrap() == {"FINISHED"}
    bpy.ops.object.mode_set(mode="EDIT")
    assert holds() is True
    bm = bmesh.from_edit_mesh(ob.data)
    bm.faces.ensure_lookup_table()
    bm.faces[0].loops[0][bm.loops.layers.uv.verify()].uv.x += 0.01
    bmesh.update_edit_mesh(ob.data)
    bpy.context.view_layer.update()
    assert holds() is False


def test_certificates_are_of_a_mesh_and_a_uv_map(kept):
    ob = shapes.grid(4, uv=True)
    assert bpy.ops.uv.flipfree_unwrap() == {"FINISHED"}
    first = kept()
    ob.data.uv_layers.active = ob.data.uv_layers.new(name="Other")
    assert kept() is None
    ob.data.uv_layers.active = ob.data.uv_layers["UVMap"]
    assert kept() is first
    shapes.grid(4, "Second", uv=True)
    assert kept() is None


@pytest.mark.halved
def test_large_edited_meshes_are_not_compared_at_every_change(kept, holds):
    shapes.grid(150, uv=True)
    assert bpy.ops.uv.flipfree_check() == {"FINISHED"}
    assert holds() is True
    bpy.ops.object.mode_set(mode="EDIT")
    assert holds() is None


def test_a_run_on_some_faces_says_so(kept, part):
    ob = shapes.grid(4, uv=True)
    bpy.ops.object.mode_set(mode="EDIT")
    shapes.select_faces(ob, range(5))
    assert bpy.ops.uv.flipfree_unwrap() == {"FINISHED"}
    assert (kept().faces, kept().of) == (5, 16)
    assert ("label", "5 of 16 faces") in draw(part, "VIEW3D_PT_flipfree_details")


def test_the_certificate_is_drawn_with_its_figures(kept, part):
    name = "VIEW3D_PT_flipfree_details"
    shapes.grid(4, uv=True)
    part("errors")._said[:] = [""]
    assert draw(part, name) == [("label", "This UV map was not checked yet")]
    assert bpy.ops.uv.flipfree_unwrap() == {"FINISHED"}
    texts = [text for _, text in draw(part, name)]
    assert " ".join(texts).endswith(part("errors").said()), "the last report stands below"
    part("errors")._said[:] = [""]
    texts = [text for _, text in draw(part, name)]
    assert texts[0] == "UVMap: Auto Unwrap"
    figures = dict(zip(texts[1::2], texts[2::2], strict=True))
    assert figures["Flipped Faces"] == figures["Overlaps"] == "0" and figures["Islands"] == "1"
    assert float(figures["Distortion"]) >= 1.0


def test_both_editors_have_every_panel_and_every_operator(part):
    classes = part("ui.sidebar").CLASSES
    shown = {space: set() for space in ("VIEW_3D", "IMAGE_EDITOR")}
    for cls in classes:
        assert cls.bl_category == "Flipfree" and hasattr(bpy.types, cls.bl_idname)
        shown[cls.bl_space_type].add(cls.bl_label)
    assert shown["VIEW_3D"] == shown["IMAGE_EDITOR"]
    shapes.cube()
    drawn = {
        text
        for cls in classes
        if cls.bl_space_type == "VIEW_3D"
        for kind, text in draw(part, cls.__name__)
        if kind == "operator"
    }
    first, *sections = part("ui.tools").SECTIONS
    expected = {tool.operator for s in sections if s.draws is None for tool in s.tools}
    assert expected | {"uv.flipfree_hide_all"} <= drawn
    main = [text for kind, text in draw(part, "VIEW3D_PT_flipfree") if kind == "operator"]
    assert main == ["Auto Unwrap", "Pack", "Check"]
    closed = [cls for cls in classes if "DEFAULT_CLOSED" in getattr(cls, "bl_options", ())]
    assert len(closed) == len(classes) - 2, "all but the tab itself, in both editors"


@pytest.fixture
def preferences(addon):
    found = bpy.context.preferences.addons[addon.__name__].preferences
    before = {name: getattr(found, name) for name in ("threads", "max_seconds", "precision")}
    yield found
    for name, value in before.items():
        setattr(found, name, value)


def test_preferences_reach_the_solver(preferences, part, monkeypatch):
    asked = {}
    for name in ("unwrap", "conformal"):
        real = getattr(part("solver").jobs, name)
        monkeypatch.setattr(
            part("solver").jobs,
            name,
            lambda *a, real=real, name=name, **k: asked.setdefault(name, k) and real(*a, **k),
        )
    preferences.threads, preferences.max_seconds, preferences.precision = 1, 60.0, 113
    shapes.grid(4, uv=True)
    assert bpy.ops.uv.flipfree_unwrap() == {"FINISHED"}
    assert asked["unwrap"]["threads"] == 1 and asked["unwrap"]["max_seconds"] == 60.0
    assert bpy.ops.uv.flipfree_conformal() == {"FINISHED"}
    assert asked["conformal"]["precision"] == 113


def test_of_two_limits_of_time_the_lower_one_counts(part):
    shorter = part("solver")._shorter
    assert shorter(300.0, None) == 300.0 and shorter(300.0, 10.0) == 10.0
    assert shorter(0.0, 10.0) == 10.0 and shorter(0.0, None) == 0.0
