# SPDX-License-Identifier: GPL-3.0-or-later
"""The submenu "Flipfree": in the UV menus of the 3D viewport and of the UV editor, and in the Object menu."""

import bpy

from . import tools

# Both UV menus draw IMAGE_MT_uvs_unwrap from 4.3 on, so the submenu goes into the menus themselves.
PARENTS = ("VIEW3D_MT_uv_map", "IMAGE_MT_uvs", "VIEW3D_MT_object")


class VIEW3D_MT_flipfree(bpy.types.Menu):
    bl_idname = "VIEW3D_MT_flipfree"
    bl_label = "Flipfree"

    def draw(self, _context):
        self.layout.operator_context = "INVOKE_DEFAULT"
        in_menu = [section for section in tools.SECTIONS if not section.submenu]
        for section in in_menu:
            _draw_section(self.layout, section)
            self.layout.separator()
        for cls in _SUBMENUS:
            self.layout.menu(cls.bl_idname)


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


_SUBMENUS = tuple(_submenu(section) for section in tools.SECTIONS if section.submenu)


def _draw(self, _context):
    self.layout.separator()
    self.layout.menu(VIEW3D_MT_flipfree.bl_idname, icon="UV")


CLASSES = (*_SUBMENUS, VIEW3D_MT_flipfree)


def register():
    for name in PARENTS:
        getattr(bpy.types, name).append(_draw)


def unregister():
    for name in PARENTS:
        getattr(bpy.types, name).remove(_draw)
