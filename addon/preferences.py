# SPDX-License-Identifier: GPL-3.0-or-later
"""Preferences > Add-ons > Flipfree UV: what holds for all operators."""

import bpy

from .properties import choice, real, whole

# When the solver gets a process of its own.
SEPARATE = {
    "never": "Never: Always solve inside Blender: a solver that is killed takes Blender along",
    "above": "Large Meshes: Only where that many triangles are solved; a process takes a moment to start",
    "always": "Always: However small the mesh is",
}


class FlipfreePreferences(bpy.types.AddonPreferences):
    bl_idname = __package__

    threads: whole(
        "Threads: How many threads the solver uses; 0: one for each core. Results are the same for every number",
        (0, 0, 1024),
        soft_max=64,
    )
    max_seconds: real(
        "Time Limit: Most seconds of the clock for each call of the solver; 0 is no limit. Maps that can be used by then are "
        "kept, and where there is none, nothing is changed",
        (0.0, 0.0),
        soft_max=3600.0,
        precision=1,
    )
    precision: whole(
        "Precision: Bits of the numbers in which conformal maps are computed where their own option is 0: 53 to 4096; 0: as "
        "many as it takes",
        (0, 0, 4096),
    )
    separate: choice(
        "Separate Process: Solve in a process of its own: if it crashes, or the system ends it because memory runs out, Blender "
        "and the mesh stay as they are. Results are the same",
        SEPARATE,
        default="above",
    )
    separate_from: whole(
        "From Triangles: Meshes of so many triangles together are solved in a process of their own",
        (100_000, 1),
        soft_max=10_000_000,
    )

    def draw(self, context):
        from .ui import menus  # which asks this module

        self.layout.use_property_split = True
        for name in ("threads", "max_seconds", "precision", "separate"):
            self.layout.prop(self, name)
        if self.separate == "above":
            self.layout.prop(self, "separate_from")
        menus.draw_shortcuts(context, self.layout)


def _get(name: str, default):
    """Without an entry among the add-ons (tests of modules by themselves) what a fresh one would have."""
    addon = bpy.context.preferences.addons.get(__package__)
    return default if addon is None else getattr(addon.preferences, name, default)


def threads() -> int | None:
    """For the solver: None is all cores."""
    return _get("threads", 0) or None


def max_seconds() -> float | None:
    """For the solver: None is no limit."""
    return _get("max_seconds", 0.0) or None


def precision() -> int:
    """Mantissa bits, 0 for as many as it takes."""
    return _get("precision", 0)


def separate_from() -> int | None:
    """The least number of triangles that are solved in a process of their own; None: they never are."""
    chosen = _get("separate", "above")
    return {"never": None, "always": 0}.get(chosen, _get("separate_from", 100_000))


CLASSES = (FlipfreePreferences,)
