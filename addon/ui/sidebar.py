# SPDX-License-Identifier: GPL-3.0-or-later
"""The tab "Flipfree" in the sidebars of 3D viewport and UV editor: what to do next, the last certificate, all operators.

Every panel is written once, as a plain class; `_in_both` makes the two that Blender wants.
"""

import textwrap

import bpy

from .. import certificates
from ..live import live_pins
from ..operators import common
from . import guide, tools

_SPACES = {"VIEW_3D": "VIEW3D", "IMAGE_EDITOR": "IMAGE"}  # and how identifiers of panels begin
_MAIN = "flipfree"


class _Guide:
    bl_label = "Flipfree UV"

    def draw(self, context):
        found = guide.step(context)
        row = self.layout.row(align=True)
        row.enabled = False
        for number, name in enumerate(guide.NAMES, start=1):
            row.label(text=f"{number} {name}" if number != found.number else f"[{number} {name}]")
        box = self.layout.box().column(align=True)
        for i, line in enumerate(found.lines):
            box.label(text=line, icon=found.icon if i == 0 else "BLANK1")
        for name in found.operators:
            self.layout.operator(name)
        session = live_pins.current()
        if session is not None:
            box = self.layout.box().column(align=True)
            icon = "ERROR" if session.problem else "PINNED"
            for i, line in enumerate(textwrap.wrap(session.text(), 34)):
                box.label(text=line, icon=icon if i == 0 else "BLANK1")
            box.operator("uv.flipfree_live_pins", text="End Live Pins", depress=True)


class _Certificate:
    bl_label = "Last Certificate"

    def draw(self, context):
        ob = context.view_layer.objects.active
        kept = certificates.of(ob) if ob is not None and ob.type == "MESH" else None
        layout = self.layout.column(align=True)
        if kept is None:
            layout.label(text="None yet for this UV map")
            return
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
        ("Turned Faces", "turned"),
        ("Overlaps", "overlaps"),
        ("Stacked Islands", "island_overlaps"),
    ):
        count = figures[key]
        if key == "turned" and count == 0:
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
    found.append(
        ("Beyond 1.25", "not measured" if share is None else f"{100.0 * share:.1f} %", icon)
    )
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

    options = set() if section.opened else {"DEFAULT_CLOSED"}
    return type(
        f"_Section{section.name}",
        (),
        {"bl_label": section.name, "bl_options": options, "draw": draw},
    )


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


CLASSES = [*_in_both(_Guide, _MAIN, 0), *_in_both(_Certificate, f"{_MAIN}_certificate", 2)]
for _order, _each in enumerate(tools.SECTIONS):
    # The certificate stands below the first section, which makes it.
    CLASSES += _in_both(
        _section(_each), f"{_MAIN}_{_each.identifier}", _order if _order == 0 else _order + 2
    )
