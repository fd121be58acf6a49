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
        for i, section in enumerate(tools.SECTIONS):
            if i:
                self.layout.separator()
            for tool in section.tools:
                self.layout.operator(tool.operator, icon=tool.icon)


def _draw(self, _context):
    self.layout.separator()
    self.layout.menu(VIEW3D_MT_flipfree.bl_idname, icon="UV")


CLASSES = (VIEW3D_MT_flipfree,)


def register():
    for name in PARENTS:
        getattr(bpy.types, name).append(_draw)


def unregister():
    for name in PARENTS:
        getattr(bpy.types, name).remove(_draw)
