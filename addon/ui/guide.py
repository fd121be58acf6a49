# SPDX-License-Identifier: GPL-3.0-or-later
"""How the active UV map stands and what to do about it, for someone who never read a page."""

from dataclasses import dataclass

import bmesh

from flipfree import texts
from flipfree.distortion import LEVELS

from .. import certificates, compat, watch


@dataclass(frozen=True)
class Step:
    """lines: what was found, and what helps. buttons: (operator, text, options) besides Auto Unwrap, Pack and Check, which are
    always there. colour: "GREEN", "YELLOW", "RED", or "" where nothing was found out."""

    lines: tuple[str, ...]
    buttons: tuple[tuple[str, str, dict], ...] = ()
    colour: str = ""

    @property
    def icon(self) -> str:
        return compat.colour_icon(self.colour) if self.colour else "INFO"


_MOST_SEARCHED = 50_000  # edges
_SEAMS = ("uv.flipfree_auto_seams", "Auto Seams", {})
_REPAIR = ("uv.flipfree_repair", "Repair Flips", {})
_STRETCHED = (
    ("uv.flipfree_select_poor", "Select", {}),
    ("uv.flipfree_cut_stretched", "Cut Where Stretched", {}),
)


def step(context) -> Step:
    """Cheap enough to be asked at every redraw."""
    ob = context.view_layer.objects.active
    if ob is None or ob.type != "MESH":
        return Step(("Make a mesh object the active one.",))
    if context.mode not in {"OBJECT", "EDIT_MESH"}:
        return Step(("Works in Object Mode", "and in Edit Mode of meshes."))
    if context.mode == "OBJECT" and not ob.select_get():
        return Step((f"{ob.name} is not selected.",))
    if ob.data.uv_layers.active is None:
        if has_seams(ob):
            return Step(("Seams are marked: Auto Unwrap", "keeps them."))
        by_hand = (("mesh.mark_seam", "Mark Seam", {}),) if context.mode == "EDIT_MESH" else ()
        return Step(("No UV map yet: Auto Unwrap", "finds seams by itself."), (*by_hand, _SEAMS))
    kept = certificates.of(ob)
    if kept is None:
        return Step(("This UV map was not checked yet.",))
    if certificates.holds(ob, kept) is False:
        return Step(("Mesh or UVs have changed since:", "check again."))
    return _by_figures(kept.figures, kept.stacked_ok)


def _by_figures(figures: dict, stacked_ok: bool) -> Step:
    if figures["flips32"] > 0 or figures["overlaps"] > 0:
        counts = (("flips32", "flipped face"), ("overlaps", "overlap"))
        found = [texts.counted(figures[key], noun) for key, noun in counts if figures[key] > 0]
        return Step(
            (", ".join(found),),
            (_select("flipped" if figures["flips32"] > 0 else "overlapping"), _REPAIR),
            "RED",
        )
    if figures["island_overlaps"] > 0 and not stacked_ok:
        return Step(("Islands lie on each other:", "Pack separates them."), (), "RED")
    if not figures["ok"]:
        return Step(("The map failed its check:", "unwrap it anew."), (), "RED")
    needles = texts.needles_named(figures["needles"]).replace(": ", ":\n", 1).splitlines()
    if figures["poor"]:
        islands = len(figures["poor_islands"])
        where = texts.counted(islands, "island") if islands else "around single faces"
        share, _, beyond = texts.above_bound(figures["stretched"] or 0.0).partition(
            " is stretched "
        )
        level = figures["level"]
        return Step(
            (f"{level.capitalize()}: {share}", f"{beyond}, {where}", *needles),
            _STRETCHED if islands else (_select("worst", share=1.0),),
            "RED" if level == LEVELS[-1] else "YELLOW",
        )
    mirrored = figures["mirrored_islands"]
    lines = ("Nothing is wrong with this map:", _in_short(figures), *needles)
    if mirrored:
        return Step((*lines, texts.mirrored(mirrored)), (_select("mirrored"), _REPAIR), "GREEN")
    return Step(lines, (), "GREEN")


def _select(what: str, **options) -> tuple[str, str, dict]:
    return "uv.flipfree_select_faces", "Select", {"what": what, **options}


def _in_short(figures: dict) -> str:
    mean = "" if figures["energy"] is None else f", distortion {figures['energy']:.3f}"
    return texts.counted(figures["islands"], "island") + mean


def has_seams(ob) -> bool:
    """In Edit Mode, some edge is a seam (large meshes are not searched); else some was marked once."""
    if ob.mode == "EDIT":
        if watch.busy():  # as in certificates.holds
            return False
        bm = bmesh.from_edit_mesh(ob.data)
        return len(bm.edges) <= _MOST_SEARCHED and any(edge.seam for edge in bm.edges)
    # The attribute's name differs between Blenders.
    return "uv_seam" in ob.data.attributes or ".uv_seam" in ob.data.attributes
