# SPDX-License-Identifier: GPL-3.0-or-later
"""Flipfree UV: UV maps that never fold over, each written only with a certificate.

operators/*   what the menus offer: options, tasks, report lines
modal         drives a solver job from a menu, from scripts, in the background
mesh_io       Blender meshes <-> arrays            compat   Blender's versions
errors        what the user is told                cli      blender -b -c flipfree ...
solver        the package flipfree (a wheel)       menus    where all this appears
fields/*      field-aligned maps; field and cones drawn over the model
preferences   what holds for all operators
"""

import bpy

from . import cli, menus, modal, preferences, solver
from .fields import drawing, field_aligned
from .operators import check, conformal, improve, match, seamless, select, unwrap
from .operators.packing import pack

_CLASSES = (
    *preferences.CLASSES,
    *unwrap.CLASSES,
    *match.CLASSES,
    *improve.CLASSES,
    *pack.CLASSES,
    *conformal.CLASSES,
    *seamless.CLASSES,
    *field_aligned.CLASSES,
    *check.CLASSES,
    *select.CLASSES,
    *drawing.CLASSES,
)


def register():
    solver.check_version()
    for cls in _CLASSES:
        bpy.utils.register_class(cls)
    menus.register()
    cli.register()


def unregister():
    modal.close_all()
    drawing.unregister()
    cli.unregister()
    menus.unregister()
    for cls in reversed(_CLASSES):
        bpy.utils.unregister_class(cls)
