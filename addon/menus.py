# SPDX-License-Identifier: GPL-3.0-or-later
"""Where the operators appear: the unwrap menu of the UV editor, which the 3D viewport's UV menu contains as well."""

from . import compat


def _draw(self, _context):
    layout = self.layout
    layout.separator()
    layout.operator_context = "INVOKE_DEFAULT"
    for name in ("uv.flipfree_unwrap", "uv.flipfree_check"):
        layout.operator(name)


def register():
    compat.unwrap_menu().append(_draw)


def unregister():
    compat.unwrap_menu().remove(_draw)
