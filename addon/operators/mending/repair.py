# SPDX-License-Identifier: GPL-3.0-or-later
"""Repair: flipped, collapsed and overlapping faces of a UV map, mended with little change (docs/repair.md)."""

import bpy
import numpy as np

from ... import solver
from .. import common, options
from ..unwrap import MapTask, left_tiles_text

OVERLAPS = {
    "cut": "Cut: It falls into pieces; the largest stays, the others are put where there is room",
    "open": "Open: It is unwrapped again without further cuts, at its old place and size",
    "keep": "Keep: It stays as it is",
}
STRETCHED = {
    "keep": "Keep: They stay exactly as they are; the report counts them",
    "improve": "Improve: Their distortion is lowered where they are, at the scale of the other islands if most have one; "
    "where that is not enough, they are unwrapped again along their seams",
}


class RepairTask(MapTask):
    packs = False

    overlaps, stretched = "cut", "keep"
    use_pins = True
    disjoint = False

    def stages(self):
        result = yield solver.repair(
            self.snapshot,
            pins=self.pins() or None,
            **self.values("overlaps stretched disjoint margin aspect"),
        )
        yield from self.take(result)

    def new_seams(self):
        return super().new_seams() if self.result.stats["added_cuts"] else None

    def stays(self) -> bool:
        """Nothing had to be mended."""
        old = self.snapshot.corner_uv
        return bool((self.result.uv32() == old).all()) and bool(np.isfinite(old).all())

    def writing(self, ob):
        if not self.stays():
            yield from super().writing(ob)


def total(tasks: list[RepairTask], name: str) -> int:
    return sum(max(int(t.result.stats[name]), 0) for t in tasks)


def summary(tasks: list[RepairTask]) -> str:
    """The report line, without the time."""
    before = [common.plural(total(tasks, "flips_before"), "flip")]
    overlaps = total(tasks, "overlaps_before")
    if overlaps:
        before.append(common.plural(overlaps, "overlap"))
    wound = total(tasks, "winding_failures_before")
    if wound:
        before.append(f"{common.plural(wound, 'vertex', 'vertices')} wound more than once")
    lost = total(tasks, "corners_without_place")
    if lost:
        before.append(f"{common.plural(lost, 'corner')} without a place")
    joined = total(tasks, "corners_rejoined")
    became = [f"{common.plural(joined, 'corner')} joined to others again"] if joined else []
    became += [
        f"{common.plural(total(tasks, name), 'island')} {what}"
        for name, what in (
            ("charts_mirrored", "mirrored"),
            ("charts_unfolded", "unfolded"),
            ("charts_anew", "unwrapped again"),
            ("charts_cut", "cut"),
            ("charts_improved", "less stretched"),
            ("charts_stretched_anew", "unwrapped again, as too stretched"),
            ("charts_moved", "moved"),
        )
        if total(tasks, name)
    ]
    corners = sum(3 * len(t.snapshot.triangles) for t in tasks)
    kept = 100.0 * total(tasks, "corners_kept") / max(corners, 1)
    text = common.figures(tasks)
    stretched = total(tasks, "stretched_charts")
    if stretched:
        why = " by their pins" if tasks[0].stretched == "improve" else ""
        text += f", {common.plural(stretched, 'island')} stretched{why}"
    left = sum(int(t.result.stats.get("left_tiles", 0)) for t in tasks)
    text += left_tiles_text(left) if left else ""
    text += common.texture_text(tasks[0].aspect)
    if not became and all(t.stays() for t in tasks):
        return f"nothing to repair: {text}"
    # Rounded down: 100 % are all of them.
    became.append(f"{int(kept)} % of the UVs as before")
    return f"{text}; before: {', '.join(before)}; {', '.join(became)}"


class UV_OT_flipfree_repair(
    options.KeepPins,
    options.Margin,
    options.CorrectAspect,
    options.UseModifiers,
    options.MapOperator,
    bpy.types.Operator,
):
    bl_idname = "uv.flipfree_repair"
    bl_label = "Repair Flips"
    bl_description = (
        "Mend flipped, collapsed and overlapping faces of a UV map with as little change as possible; "
        "what is right stays exactly as it is"
    )
    needs_uv = True

    overlaps: options.choice(
        "Overlapping Islands: What becomes of an island that lies on itself though none of its faces is flipped",
        OVERLAPS,
    )
    stretched: options.choice(
        "Stretched Islands: What becomes of islands without a flip whose mean distortion is more than a tenth above that of an "
        "unwrap of them",
        STRETCHED,
    )
    disjoint: options.flag(
        "Move Islands Apart: Islands that lie on larger ones are put where there is room. Off: islands that share their place "
        "on purpose stay. Islands with pins always stay"
    )
    mark_seams: options.flag(
        "Mark Cuts as Seams: Mark the edges along which the map is cut as seams, where islands had to be cut"
    )

    make_task = staticmethod(RepairTask)
    summary = staticmethod(summary)

    def hint(self, tasks):
        kept = tasks[0].stretched != "improve" and total(tasks, "stretched_charts")
        return "'Stretched Islands: Improve' lowers their distortion" if kept else ""
