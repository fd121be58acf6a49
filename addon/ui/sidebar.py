# SPDX-License-Identifier: GPL-3.0-or-later
"""The tab "Flipfree" in the sidebars of 3D viewport and UV editor: three buttons, what came of them, and all else by task.

Every panel is written once, as a plain class; `_in_both` makes the two that Blender wants.
"""

import textwrap

import bpy

from flipfree.distortion import STRETCH_BOUND

from .. import certificates, errors, texture
from ..live import live_pins
from ..operators import common
from . import guide, tools

_SPACES = {"VIEW_3D": "VIEW3D", "IMAGE_EDITOR": "IMAGE"}  # and how identifiers of panels begin
_MAIN = "flipfree"


class _Main:
    bl_label = "Flipfree UV"

    def draw(self, context):
        first = self.layout.column(align=True)
        first.scale_y = 1.4
        row = first
        for tool, text in zip(
            tools.SECTIONS[0].tools, ("Auto Unwrap", "Pack", "Check"), strict=True
        ):
            row.operator(tool.operator, text=text, icon=tool.icon)
            row = first.row(align=True) if row is first else row
        texture.draw(self.layout.column(align=True), context)
        found = guide.step(context)
        box = self.layout.box().column(align=True)
        box.alert = found.colour == "RED"
        for i, line in enumerate(found.lines):
            box.label(text=line, icon=found.icon if i == 0 else "BLANK1")
        row = self.layout.row(align=True)
        for name, text, options in found.buttons:
            button = row.operator(name, text=text)
            for option, value in options.items():
                setattr(button, option, value)
        session = live_pins.current()
        if session is not None:
            box = self.layout.box().column(align=True)
            _wrapped(box, session.text(), "ERROR" if session.problem else "PINNED")
            box.operator("uv.flipfree_live_pins", text="End Live Pins", depress=True)


def _wrapped(layout, text: str, icon: str) -> None:
    for i, line in enumerate(textwrap.wrap(text, 34)):
        layout.label(text=line, icon=icon if i == 0 else "BLANK1")


class _Details:
    bl_label = "Details"
    bl_options = {"DEFAULT_CLOSED"}

    def draw(self, context):
        ob = context.view_layer.objects.active
        kept = certificates.of(ob) if ob is not None and ob.type == "MESH" else None
        layout = self.layout.column(align=True)
        if kept is None:
            layout.label(text="This UV map was not checked yet")
        else:
            _figures(layout, ob, kept)
        if errors.said():
            _wrapped(self.layout.box().column(align=True), errors.said(), "INFO")


def _figures(layout, ob, kept) -> None:
    holds = certificates.holds(ob, kept)
    if holds is False:
        layout.label(text="The map has changed since", icon="ERROR")
    elif holds is None:
        layout.label(text="May have changed in Edit Mode", icon="QUESTION")
    layout.label(text=f"{ob.data.uv_layers.active.name}: {kept.verb}")
    body = layout.column(align=True)
    body.active = holds is not False
    for name, value, icon in rows(kept):
        row = body.split(factor=0.55)
        row.label(text=name, icon=icon)
        row.label(text=value)


def rows(kept) -> list[tuple[str, str, str]]:
    """(name, value, icon) of each line."""
    figures = kept.figures
    found = []
    for name, key in (
        ("Flipped Faces", "flips32"),
        ("Mirrored Islands", "mirrored_islands"),
        ("Turned Faces", "turned"),
        ("Overlaps", "overlaps"),
        ("Stacked Islands", "island_overlaps"),
    ):
        count = figures[key]
        if key in ("mirrored_islands", "turned") and count == 0:
            continue
        icon = "BLANK1" if count < 0 else ("CHECKMARK" if count == 0 else "ERROR")
        found.append((name, "not counted" if count < 0 else str(count), icon))
    for name, key in (
        ("Distortion", "energy"),
        ("99 % below", "energy_p99"),
        ("Worst", "max_energy"),
    ):
        value = figures[key]
        found.append((name, "unbounded" if value is None else f"{value:.3f}", "BLANK1"))
    share, icon = figures["stretched"], "ERROR" if figures["poor"] else "BLANK1"
    text = "not measured" if share is None else f"{100.0 * share:.1f} %"
    found.append((f"Beyond {STRETCH_BOUND}", text, icon))
    found.append(("Islands", str(figures["islands"]), "BLANK1"))
    if figures["seam_edges"] > 0:
        found.append(
            ("Exact Seams", f"{figures['seams_exact32']} of {figures['seam_edges']}", "BLANK1")
        )
    if kept.faces < kept.of:
        found.append(("Looked at", f"{kept.faces} of {common.plural(kept.of, 'face')}", "BLANK1"))
    return found


def _section(section: tools.Section) -> type:
    def draw(self, context):
        layout = self.layout.column(align=section.draws is None)
        if section.draws is not None:
            section.draws.draw_panel(layout, context)
            return
        for tool in section.tools:
            layout.operator(tool.operator, icon=tool.icon)

    values = {"bl_label": section.name, "bl_options": {"DEFAULT_CLOSED"}, "draw": draw}
    return type(f"_Section{section.name}", (), values)


def _in_both(panel: type, name: str, order: int) -> list[type]:
    """The panel for each of the two editors; all but the first are inside the first."""
    found = []
    for space, prefix in _SPACES.items():
        values = {
            "bl_idname": f"{prefix}_PT_{name}",
            "bl_space_type": space,
            "bl_region_type": "UI",
            "bl_category": "Flipfree",
            "bl_order": order,
        }
        if name != _MAIN:
            values["bl_parent_id"] = f"{prefix}_PT_{_MAIN}"
        found.append(type(values["bl_idname"], (panel, bpy.types.Panel), values))
    return found


CLASSES = [*_in_both(_Main, _MAIN, 0), *_in_both(_Details, f"{_MAIN}_details", 1)]
for _order, _each in enumerate(tools.SECTIONS[1:], start=2):
    CLASSES += _in_both(_section(_each), f"{_MAIN}_{_each.identifier}", _order)
