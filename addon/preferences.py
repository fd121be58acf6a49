# SPDX-License-Identifier: GPL-3.0-or-later
"""Preferences > Add-ons > Flipfree UV: what holds for all operators."""

import bpy


class FlipfreePreferences(bpy.types.AddonPreferences):
    bl_idname = __package__

    threads: bpy.props.IntProperty(
        name="Threads",
        description="How many threads the solver uses; 0: one for each core. Results are the same for every number",
        default=0,
        min=0,
        max=1024,
        soft_max=64,
    )

    def draw(self, _context):
        self.layout.prop(self, "threads")


def threads() -> int | None:
    """For the solver: None is all cores."""
    addon = bpy.context.preferences.addons.get(__package__)
    chosen = getattr(addon.preferences, "threads", 0) if addon is not None else 0
    return chosen or None


CLASSES = (FlipfreePreferences,)
