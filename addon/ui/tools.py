# SPDX-License-Identifier: GPL-3.0-or-later
"""The one table of operators: what is registered, and in which order and under which tasks menus and sidebar show it."""

from dataclasses import dataclass
from types import ModuleType

from ..checker import checker
from ..fields import field_aligned, fit_tiles
from ..live import live_pins
from ..operators import (
    check,
    conformal,
    cut,
    embed,
    mark,
    match,
    quads,
    seamless,
    select,
    transfer,
    unwrap,
)
from ..operators.arrange import density, orient, rectify
from ..operators.mending import improve, repair
from ..operators.packing import pack
from ..operators.seams import auto_seams, cut_stretched
from ..views import controls


@dataclass(frozen=True)
class Tool:
    """module: has the operator's class. icon: one that all Blenders from 4.2 on have. command: of `blender -c flipfree`,
    where there is one; several words are the same."""

    module: ModuleType
    operator: str
    icon: str
    command: str = ""

    @property
    def cls(self) -> type:
        own = vars(self.module).values()
        return next(one for one in own if getattr(one, "bl_idname", "") == self.operator)


class Section:
    def __init__(self, name: str, *tools: Tool, draws: ModuleType | None = None):
        """draws: has draw_menu(layout) and draw_panel(layout, context), instead of a row of buttons."""
        self.name, self.tools, self.draws = name, tools, draws
        self.identifier = name.lower().replace(" ", "_")


SECTIONS = (
    Section(
        "Unwrap",
        Tool(unwrap, "uv.flipfree_unwrap", "UV", "unwrap"),
        Tool(pack, "uv.flipfree_pack", "PACKAGE", "pack"),
        Tool(check, "uv.flipfree_check", "CHECKMARK", "check"),
    ),
    Section(
        "Seams",
        Tool(auto_seams, "uv.flipfree_auto_seams", "MOD_EDGESPLIT", "seams"),
        Tool(cut_stretched, "uv.flipfree_cut_stretched", "MOD_UVPROJECT"),
        Tool(cut, "uv.flipfree_cut", "MOD_BOOLEAN", "cut"),
    ),
    Section(
        "Pins",
        Tool(live_pins, "uv.flipfree_live_pins", "UNPINNED"),
        Tool(match, "uv.flipfree_match", "PINNED", "match"),
        Tool(embed, "uv.flipfree_embed", "MESH_CIRCLE", "embed"),
        Tool(transfer, "uv.flipfree_transfer", "MOD_DATA_TRANSFER", "transfer"),
    ),
    Section(
        "Repair",
        Tool(repair, "uv.flipfree_repair", "MODIFIER", "repair"),
        Tool(improve, "uv.flipfree_improve", "MOD_SMOOTH", "improve"),
    ),
    Section(
        "Arrange",
        Tool(orient, "uv.flipfree_orient", "DRIVER_ROTATIONAL_DIFFERENCE"),
        Tool(rectify, "uv.flipfree_rectify", "MESH_GRID", "rectify"),
        Tool(density, "uv.flipfree_get_density", "EYEDROPPER"),
        Tool(density, "uv.flipfree_set_density", "TEXTURE"),
    ),
    Section(
        "Cones",
        Tool(conformal, "uv.flipfree_suggest_cones", "LIGHT", "cones"),
        Tool(conformal, "mesh.flipfree_mark_cone", "MESH_CONE"),
        Tool(conformal, "uv.flipfree_clear_cones", "X"),
        Tool(conformal, "uv.flipfree_conformal", "MOD_WARP", "conformal"),
    ),
    Section(
        "Seamless",
        Tool(seamless, "uv.flipfree_seamless", "MESH_TORUS", "seamless"),
        Tool(mark, "mesh.flipfree_mark", "CURVE_PATH"),
        Tool(field_aligned, "uv.flipfree_field_aligned", "MOD_LATTICE", "field field-aligned"),
        Tool(fit_tiles, "uv.flipfree_fit_tiles", "MOD_BUILD", "tiles"),
        Tool(quads, "uv.flipfree_quads", "MOD_REMESH", "quads"),
    ),
    Section(
        "Select",
        Tool(select, "uv.flipfree_select_failed", "CANCEL"),
        Tool(select, "uv.flipfree_select_poor", "ERROR"),
        Tool(select, "uv.flipfree_select_mends", "MODIFIER"),
        Tool(select, "uv.flipfree_select_faces", "FACESEL"),
    ),
    Section(
        "Show",
        Tool(controls, "uv.flipfree_show", "HIDE_OFF"),
        Tool(controls, "view3d.flipfree_show_field", "EMPTY_AXIS"),
        Tool(controls, "uv.flipfree_hide_all", "HIDE_ON"),
        draws=controls,
    ),
    Section(
        "Checker",
        Tool(checker, "uv.flipfree_checker", "TEXTURE"),
        Tool(checker, "uv.flipfree_remove_checker", "X"),
    ),
)


def all_tools() -> list[Tool]:
    return [tool for section in SECTIONS for tool in section.tools]
