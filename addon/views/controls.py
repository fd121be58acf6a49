# SPDX-License-Identifier: GPL-3.0-or-later
"""Switching views on and off: operators for menus and scripts, properties for the sidebar.

The properties of the window manager read and write `state`, so that nothing of them is stored in files.
"""

import bpy

from .. import errors
from ..operators import common
from . import draw, field, refresh, state

_NO_WINDOW = "Without a window there is nothing to draw in"
_FACES = ("none", *(row[0] for row in state.FACES))


def switch(what: str, on: bool) -> None:
    """One of state.ALL, in all editors."""
    state.switch(what, on)
    _follow()


def switch_off() -> None:
    state.switch_all_off()
    _follow()


def _follow() -> None:
    if state.anything() and not bpy.app.background:
        draw.start()
        refresh.start()
    else:
        draw.stop()
        refresh.stop()
    refresh.redraw()


class UV_OT_flipfree_show(bpy.types.Operator):
    bl_idname = "uv.flipfree_show"
    bl_label = "Show or Hide"
    bl_description = "Draw something over models and UVs of selected objects, or stop drawing it"
    bl_options = {"REGISTER"}

    what: bpy.props.EnumProperty(
        name="What",
        description="What is shown, or hidden if it is shown",
        items=[row[:3] for row in state.FACES + state.MARKS],
    )

    @classmethod
    def description(cls, _context, properties):
        return next(row[2] for row in state.FACES + state.MARKS if row[0] == properties.what)

    def execute(self, _context):
        if bpy.app.background:
            errors.complain(self, _NO_WINDOW)
            return {"CANCELLED"}
        switch(self.what, not state.is_on(self.what))
        return {"FINISHED"}


class UV_OT_flipfree_hide_all(bpy.types.Operator):
    bl_idname = "uv.flipfree_hide_all"
    bl_label = "Hide All"
    bl_description = "Stop drawing whatever this extension draws over models and UVs"
    bl_options = {"REGISTER"}

    @classmethod
    def poll(cls, _context):
        return common.allowed(cls, state.anything(), "Nothing is shown")

    def execute(self, _context):
        switch_off()
        return {"FINISHED"}


class VIEW3D_OT_flipfree_show_field(bpy.types.Operator):
    bl_idname = "view3d.flipfree_show_field"
    bl_label = "Field and Cones"
    bl_description = (
        "Draw the field and the cones of the selected objects over them, or stop drawing them"
    )
    bl_options = {"REGISTER"}

    def execute(self, context):
        if bpy.app.background:
            errors.complain(self, _NO_WINDOW)
            return {"CANCELLED"}
        on = not (state.is_on("field") and state.is_on("cones"))
        switch("field", on)
        switch("cones", on)
        if on and not any(_has_something(ob) for ob in context.selected_objects):
            self.report(
                {"WARNING"},
                "Nothing to draw yet: Field-Aligned Seamless Map stores a field and marks its cones, Mark Cone marks cones",
            )
        return {"FINISHED"}


def _has_something(ob) -> bool:
    if ob.type != "MESH":
        return False
    return field.there_is(ob.data) or any(g.name.startswith("Cone ") for g in ob.vertex_groups)


def draw_menu(layout) -> None:
    for name, text, _, icon in state.FACES + state.MARKS:
        shown = state.is_on(name)
        entry = layout.operator(
            "uv.flipfree_show", text=text, icon="CHECKBOX_HLT" if shown else icon
        )
        entry.what = name
    layout.operator("view3d.flipfree_show_field", icon="EMPTY_AXIS")
    layout.separator()
    layout.operator("uv.flipfree_hide_all", icon="HIDE_ON")


def draw_panel(layout, context) -> None:
    manager = context.window_manager
    layout.prop(manager, "flipfree_faces", text="Faces")
    if manager.flipfree_faces == "density":
        layout.prop(context.scene, "flipfree_texture_size")
    grid = layout.grid_flow(columns=2, align=True)
    for name, text, _, icon in state.MARKS:
        grid.prop(manager, f"flipfree_{name}", text=text, icon=icon, toggle=True)
    layout.operator("uv.flipfree_hide_all", icon="HIDE_ON")


def _set_faces(_manager, index: int) -> None:
    switch(_FACES[index] if index else state.current.faces, bool(index))


def _asks(name: str):
    return lambda _manager: state.is_on(name)


def _switches(name: str):
    return lambda _manager, on: switch(name, on)


def _properties() -> dict:
    found = {
        "flipfree_faces": bpy.props.EnumProperty(
            name="Faces",
            description="What faces are coloured by, in 3D viewports and UV editors",
            items=[
                ("none", "Not Coloured", "Faces as they are", "X", 0),
                *((*row, i) for i, row in enumerate(state.FACES, start=1)),
            ],
            get=lambda _manager: _FACES.index(state.current.faces or "none"),
            set=_set_faces,
        ),
    }
    for name, text, description, _ in state.MARKS:
        found[f"flipfree_{name}"] = bpy.props.BoolProperty(
            name=text,
            description=description,
            get=_asks(name),
            set=_switches(name),
        )
    return found


def register() -> None:
    for name, value in _properties().items():
        setattr(bpy.types.WindowManager, name, value)


def unregister() -> None:
    switch_off()
    for name in _properties():
        delattr(bpy.types.WindowManager, name)
