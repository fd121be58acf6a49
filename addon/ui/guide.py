# SPDX-License-Identifier: GPL-3.0-or-later
"""What to do next with the active mesh, for someone who never read a page: seams, unwrap, check, pack, look."""

from dataclasses import dataclass

import bmesh

from .. import certificates, watch
from . import tools


@dataclass(frozen=True)
class Step:
    """number: which of the four steps, 0 before the first. operators: names for buttons, the recommended one first."""

    number: int
    lines: tuple[str, ...]
    operators: tuple[str, ...] = ()
    icon: str = "INFO"


NAMES = ("Seams", "Unwrap", "Check", "Pack")
_MOST_SEARCHED = 50_000  # edges
_UNWRAP, _CHECK, _PACK = "uv.flipfree_unwrap", "uv.flipfree_check", "uv.flipfree_pack"


def step(context) -> Step:
    """Cheap enough to be asked at every redraw."""
    ob = context.view_layer.objects.active
    if ob is None or ob.type != "MESH":
        return Step(0, ("Make a mesh object the active one.",))
    if context.mode not in {"OBJECT", "EDIT_MESH"}:
        return Step(0, ("Works in Object Mode", "and in Edit Mode of meshes."))
    if context.mode == "OBJECT" and not ob.select_get():
        return Step(0, (f"{ob.name} is not selected.",))
    if ob.data.uv_layers.active is None:
        return _first(ob, context)
    kept = certificates.of(ob)
    if kept is None:
        return Step(
            3,
            ("This UV map was not looked at yet.", "Check it, or unwrap anew."),
            (_CHECK, _UNWRAP),
        )
    if certificates.holds(ob, kept) is False:
        return Step(3, ("Mesh or UVs have changed since", "the last certificate."), (_CHECK,))
    return _by_certificate(kept)


def _first(ob, context) -> Step:
    """Without a UV map: seams or none."""
    if has_seams(ob):
        return Step(2, ("Seams are marked:", "unwrap along them."), (_UNWRAP,))
    lines = (
        "Select edges where the texture",
        "may be cut and mark them, or",
        "let Unwrap choose its cuts.",
    )
    by_hand = ("mesh.mark_seam",) if context.mode == "EDIT_MESH" else ()
    return Step(1, lines, (*by_hand, *_offered("uv.flipfree_auto_seams"), _UNWRAP))


def _by_certificate(kept) -> Step:
    figures = kept.figures
    if figures["flips32"] > 0 or figures["overlaps"] > 0:
        return Step(
            2,
            ("Faces are flipped or overlap.", "Unwrap makes a map without."),
            (*_offered("uv.flipfree_repair"), _UNWRAP),
            "ERROR",
        )
    if figures["island_overlaps"] > 0:
        return Step(4, ("Islands lie on each other.", "Pack separates them."), (_PACK,), "ERROR")
    if not figures["ok"]:
        return Step(
            2, ("The map failed its check.", "Unwrap makes a new one."), (_UNWRAP,), "ERROR"
        )
    if figures["poor"]:
        return Step(
            1,
            (
                f"{100.0 * (figures['stretched'] or 0.0):.0f} % of the surface is",
                "stretched beyond 1.25:",
                "cut there, or unwrap anew.",
            ),
            ("uv.flipfree_select_poor", _UNWRAP),
            "ERROR",
        )
    return Step(
        4, ("Nothing is wrong with this map.", "Pack nests it more densely."), (_PACK,), "CHECKMARK"
    )


def _offered(*names: str) -> tuple[str, ...]:
    """Those of these operators that the table has."""
    there = {tool.operator for tool in tools.all_tools()}
    return tuple(name for name in names if name in there)


def has_seams(ob) -> bool:
    """In Edit Mode, some edge is a seam (large meshes are not searched); else some was marked once."""
    if ob.mode == "EDIT":
        if watch.busy():  # as in certificates.holds
            return False
        bm = bmesh.from_edit_mesh(ob.data)
        return len(bm.edges) <= _MOST_SEARCHED and any(edge.seam for edge in bm.edges)
    # The attribute's name differs between Blenders.
    return "uv_seam" in ob.data.attributes or ".uv_seam" in ob.data.attributes
