# SPDX-License-Identifier: GPL-3.0-or-later
"""The submenu "Flipfree", in the UV menus of the 3D viewport and of the UV editor and in the Object menu; and the pie menu."""

import bpy

from . import tools

# Both UV menus draw IMAGE_MT_uvs_unwrap from 4.3 on, so the submenu goes into the menus themselves.
PARENTS = ("VIEW3D_MT_uv_map", "IMAGE_MT_uvs", "VIEW3D_MT_object")
# Where a shortcut calls the pie menu; none is set at first.
KEYMAPS = ("Mesh", "Object Mode", "UV Editor")
CALL_PIE = "wm.call_menu_pie"


class VIEW3D_MT_flipfree(bpy.types.Menu):
    bl_idname = "VIEW3D_MT_flipfree"
    bl_label = "Flipfree"

    def draw(self, _context):
        self.layout.operator_context = "INVOKE_DEFAULT"
        _draw_section(self.layout, tools.SECTIONS[0])
        self.layout.separator()
        for cls in _SUBMENUS:
            self.layout.menu(cls.bl_idname)


class VIEW3D_MT_flipfree_pie(bpy.types.Menu):
    bl_idname = "VIEW3D_MT_flipfree_pie"
    bl_label = "Flipfree"

    # West, east, south, north, then the corners from the upper left one on.
    NAMES = (
        *("uv.flipfree_pack", "uv.flipfree_unwrap", "uv.flipfree_check", "uv.flipfree_live_pins"),
        *("uv.flipfree_match", "uv.flipfree_auto_seams", "uv.flipfree_repair"),
        "uv.flipfree_select_poor",
    )

    def draw(self, _context):
        icons = {tool.operator: tool.icon for tool in tools.all_tools()}
        pie = self.layout.menu_pie()
        pie.operator_context = "INVOKE_DEFAULT"
        for name in self.NAMES:
            pie.operator(name, icon=icons[name])


def _draw_section(layout, section: tools.Section) -> None:
    if section.draws is not None:
        section.draws.draw_menu(layout)
        return
    for tool in section.tools:
        layout.operator(tool.operator, icon=tool.icon)


def _submenu(section: tools.Section) -> type:
    def draw(self, _context):
        self.layout.operator_context = "INVOKE_DEFAULT"
        _draw_section(self.layout, section)

    name = f"VIEW3D_MT_flipfree_{section.identifier}"
    return type(
        name, (bpy.types.Menu,), {"bl_idname": name, "bl_label": section.name, "draw": draw}
    )


_SUBMENUS = tuple(map(_submenu, tools.SECTIONS[1:]))


def _draw(self, _context):
    self.layout.separator()
    self.layout.menu(VIEW3D_MT_flipfree.bl_idname, icon="UV")


CLASSES = (*_SUBMENUS, VIEW3D_MT_flipfree, VIEW3D_MT_flipfree_pie)
_items: list = []  # (keymap, item)


def register():
    for name in PARENTS:
        getattr(bpy.types, name).append(_draw)
    addons = bpy.context.window_manager.keyconfigs.addon
    for name in KEYMAPS if addons is not None else ():  # none without a window
        keymap = addons.keymaps.new(name=name)
        item = keymap.keymap_items.new(CALL_PIE, "NONE", "PRESS")
        item.properties.name = VIEW3D_MT_flipfree_pie.bl_idname
        _items.append((keymap, item))


def unregister():
    for keymap, item in _items:
        keymap.keymap_items.remove(item)
    _items.clear()
    for name in PARENTS:
        getattr(bpy.types, name).remove(_draw)


def draw_shortcuts(context, layout) -> None:
    """For the preferences: rows in which a key can be set for each editor's pie menu."""
    import rna_keymap_ui  # of Blender's own scripts

    user = context.window_manager.keyconfigs.user
    for name in KEYMAPS:
        keymap = user.keymaps.get(name)
        for item in keymap.keymap_items if keymap is not None else ():
            if item.idname == CALL_PIE and item.properties.name == VIEW3D_MT_flipfree_pie.bl_idname:
                layout.context_pointer_set("keymap", keymap)
                layout.label(text=f"Pie Menu, {name}")
                rna_keymap_ui.draw_kmi([], user, keymap, item, layout, 0)
