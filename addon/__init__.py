# SPDX-License-Identifier: GPL-3.0-or-later
"""Flipfree UV: UV maps that never fold over, each written only with a certificate.

operators/*   what the menus offer: options, tasks, report lines
modal         drives a solver job from a menu, from scripts, in the background
mesh_io       Blender meshes <-> arrays            compat   Blender's versions
errors        what the user is told                command_line   blender -b -c flipfree ...
solver        the package flipfree (a wheel)       ui/*     the table of operators, menus, sidebar
fields/*      field-aligned maps                views/*  what is drawn over models and UVs
aspect        the shape of the active image         texture  its size, and padding, per scene
properties    options and what they are, in one text
live/*        maps that follow pins while these are moved
preferences   what holds for all operators      certificates, watch   what was found of which map, and whether it holds
"""

import bpy

from . import certificates, command_line, modal, preferences, solver, texture, watch
from .live import live_pins
from .ui import menus, sidebar, tools
from .views import controls

_CLASSES = (
    *preferences.CLASSES,
    *(tool.cls for tool in tools.all_tools()),
    *menus.CLASSES,
    *sidebar.CLASSES,
)


def register():
    solver.check_version()
    for cls in _CLASSES:
        bpy.utils.register_class(cls)
    texture.register()
    watch.register()
    controls.register()
    menus.register()
    command_line.register()


def unregister():
    modal.close_all()
    live_pins.close()
    controls.unregister()
    command_line.unregister()
    menus.unregister()
    watch.unregister()
    texture.unregister()
    certificates.forget()
    for cls in reversed(_CLASSES):
        bpy.utils.unregister_class(cls)
