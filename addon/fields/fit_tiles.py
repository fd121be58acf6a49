# SPDX-License-Identifier: GPL-3.0-or-later
"""Fit Tiles: a seamless map on which textures that repeat run on through the seams (docs/field-aligned.md)."""

import math

import bpy
import numpy as np

from .. import scene, solver
from ..meshes import mesh_io
from ..operators import common, options
from . import field_aligned

SOURCES = {
    **field_aligned.FOLLOWED,
    "map": "UV Map: The active UV map, which is seamless as it is stored: that of an earlier run of this, or of a seamless map",
}


class FitTilesTask(field_aligned.FieldAlignedTask):
    """A map along a field, or the one that there is, with tiles of UV length 1."""

    tile_count, tile_size, from_map, prefer_translations = 100, 0.0, False, True
    fit = mark_cones = write_field = False

    def __init__(self, snapshot, given, **options):
        super().__init__(snapshot, given, **options)
        self.figures = {}

    def side(self) -> tuple[float, float]:
        """Of a tile, in the object; and in the scene how long what is 1 in the object."""
        own, snapshot = self.snapshot.vertices, self.snapshot
        ob = bpy.data.objects[snapshot.object_name]
        in_scene = scene.placed_vertices(own, snapshot.triangles, ob)
        area, outside = (
            float(np.linalg.norm(scene.normals(points[snapshot.triangles]), axis=1).sum() / 2)
            for points in (own, in_scene)
        )
        unit = math.sqrt(outside / area) if area > 0.0 else 1.0
        return (
            self.tile_size / unit if self.tile_size else math.sqrt(area / self.tile_count)
        ) or 1.0, unit

    def stages(self):
        if not self.from_map:
            yield from super().stages()
            return
        snapshot = self.snapshot
        told = yield solver.certify(snapshot, snapshot.corner_uv, seamless=True)
        if told.flips32 or told.seams_exact32 < told.seam_edges:
            raise mesh_io.MeshProblem(
                f"{snapshot.object_name}: the UV map is not seamless as it is stored: "
                f"{told.seams_exact32} of {common.plural(told.seam_edges, 'seam edge')} match, "
                f"{common.plural(told.flips32, 'flip')}. Let Along make a new map"
            )
        found = yield from self.finishing(
            (snapshot.vertices, snapshot.triangles, snapshot.corner_uv)
        )
        self.quarters = {int(v): int(k) for v, k in found.certificate.quarter_cones}
        yield from self.take(found)

    def finishing(self, found):
        self.span = (0.7, 0.9)
        side, unit = self.side()
        features = None
        if not self.from_map and self.exact_edges():
            features = self.given.follow["sharp_edges"]
        made = yield solver.fit_tiles(
            found, tile=side, features=features, **self.values("prefer_translations")
        )
        self.figures = made.stats
        self.size, self.asked = made.stats["tile"] * unit, side * unit
        return made


def make_task(snapshot, *, field_from="curvature", **options) -> FitTilesTask:
    from_map = field_from == "map"
    return field_aligned.make_task(
        snapshot,
        task=FitTilesTask,
        field_from="smooth" if from_map else field_from,
        from_map=from_map,
        **options,
    )


def summary(tasks: list[FitTilesTask]) -> str:
    """The report line, without the time."""
    tiles = round(sum(task.figures["tiles"] for task in tasks))
    sizes = sorted(task.size for task in tasks)
    size = f"{sizes[0]:.4g}" if sizes[0] == sizes[-1] else f"{sizes[0]:.4g} to {sizes[-1]:.4g}"
    seams = sum(task.figures["seams"] for task in tasks)
    turned = sum(task.figures["seams_quarter"] + task.figures["seams_half"] for task in tasks)
    through = ""
    if seams:
        matched = np.mean([task.figures["seams_matched"] for task in tasks])
        through = f", any texture runs through {100 * matched:.0f} % of the seams" + (
            f" ({seams - turned} of {common.plural(seams, 'edge')}), through the others one that looks the same turned"
            if turned
            else ""
        )
    return f"{common.plural(tiles, 'tile')} of {size}{through}; {field_aligned.summary(tasks)}"


class UV_OT_flipfree_fit_tiles(field_aligned.AlongField, options.MapOperator, bpy.types.Operator):
    bl_idname = "uv.flipfree_fit_tiles"
    bl_label = "Fit Tiles"
    bl_description = (
        "Map a surface so that textures that repeat run on through its seams: seams, cones and corners lie on whole tiles, "
        "each of UV length 1"
    )
    option_names = (
        "tile_count tile_size field_from curvature sharp_angle boundary prefer_translations mark_cuts"
    ).split()

    tile_count: options.whole(
        "Tiles: About how many tiles cover each object", (100, 1, 100_000_000)
    )
    tile_size: options.real(
        "Tile Size: How long the side of a tile is in the scene; 0: as the number of tiles makes it",
        (0.0, 0.0),
        subtype="DISTANCE",
    )
    field_from: options.choice(
        "Along: The map that is fitted: a new one along a field, or the active UV map", SOURCES
    )
    prefer_translations: options.flag(
        "Few Turned Seams: Seams are moved so that those across which the texture turns are short. Off: they stay where the "
        "map has them",
        on=True,
    )
    mark_cuts: options.mark_cuts(", with their quarter turns in the attribute `seam_turns`")

    def needs(self):
        return {
            "tile_count": not self.tile_size,
            "curvature": self.field_from == "curvature",
            "sharp_angle": self.field_from == "edges",
            "boundary": self.field_from != "map",
        }

    def advice(self, tasks):
        less = min(task.size / task.asked for task in tasks)
        return (
            f"Tiles are {100 * less:.0f} % of what was asked for: whole numbers leave no larger ones"
            if less < 0.8
            else ""
        )

    make_task = staticmethod(make_task)
    summary = staticmethod(summary)
