# SPDX-License-Identifier: GPL-3.0-or-later
"""Where the operators appear: the unwrap menu of the UV editor, which the 3D viewport's UV menu contains as well."""

from . import compat
from .fields import drawing

ENTRIES = (
    "uv.flipfree_unwrap",
    "uv.flipfree_match",
    "uv.flipfree_improve",
    "uv.flipfree_pack",
    "uv.flipfree_conformal",
    "uv.flipfree_seamless",
    "uv.flipfree_field_aligned",
    "uv.flipfree_suggest_cones",
    "mesh.flipfree_mark_cone",
    "uv.flipfree_check",
    "uv.flipfree_select_poor",
    "uv.flipfree_select_failed",
    "uv.flipfree_select_mends",
)


def _draw(self, _context):
    layout = self.layout
    layout.separator()
    layout.operator_context = "INVOKE_DEFAULT"
    for name in ENTRIES:
        layout.operator(name)
    layout.operator("view3d.flipfree_show_field", text=drawing.label())


def register():
    compat.unwrap_menu().append(_draw)


def unregister():
    compat.unwrap_menu().remove(_draw)
