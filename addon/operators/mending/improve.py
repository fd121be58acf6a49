# SPDX-License-Identifier: GPL-3.0-or-later
"""Improve: less distortion for a map, without a flip on the way (docs/repair.md)."""

import bpy

from ... import modal, solver
from ...meshes import labels
from .. import common, options
from ..unwrap import MapTask, layout_notes


class ImproveTask(MapTask):
    flattens = True
    packs_alone = False

    bijective = use_pins = True
    iterations = 200

    def __init__(self, snapshot, *, pack=False, **options):
        super().__init__(snapshot, packs=pack, **options)

    def island_labels(self):
        return labels.island_labels(self.snapshot.triangles, self.snapshot.corner_uv)

    def stages(self):
        snapshot = self.snapshot
        pins = self.pins()
        uv = yield from modal.doubles(snapshot)
        result = yield solver.improve(
            (snapshot.vertices, snapshot.triangles, uv),
            pins=pins,
            **self.values("bijective iterations aspect"),
        )
        yield from self.take(result)

    def island_count(self) -> int:
        return labels.count_islands(self.snapshot.triangles, self.result.uv32())


def summary(tasks: list[ImproveTask]) -> str:
    """The report line, without the time."""
    text = common.figures(tasks)
    repaired = sum(int(t.result.stats.get("flips_before", 0)) for t in tasks)
    if repaired:
        text += f", {common.plural(repaired, 'flip')} repaired"
    return text + layout_notes(tasks)


class UV_OT_flipfree_improve(
    options.NoOverlaps,
    options.KeepPins,
    options.Packing,
    options.CorrectAspect,
    options.UseModifiers,
    options.MapOperator,
    bpy.types.Operator,
):
    bl_idname = "uv.flipfree_improve"
    bl_label = "Improve Flip-Free Map"
    bl_description = (
        "Lower the distortion of a UV map without making flips; islands and pins stay. Flips that it has are "
        "repaired first"
    )
    needs_uv = True
    joint_layout = True

    iterations: options.whole(
        "Iterations: At most so many steps for each island; it ends earlier when nothing is left to gain",
        (200, 1, 10000),
    )

    make_task = staticmethod(ImproveTask)
    summary = staticmethod(summary)

    def hint(self, tasks):
        """Islands stay at their places but change their outlines, and may come to lie on each other."""
        meet = not tasks[0].packs and any(t.certificate.island_overlaps > 0 for t in tasks)
        return "'Pack Islands' keeps islands apart" if meet else ""
