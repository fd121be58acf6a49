# SPDX-License-Identifier: GPL-3.0-or-later
"""Embed in Polygon: every island onto a convex polygon, whatever it is like inside (thesis 3.2, docs/match-pins.md)."""

import bpy
import numpy as np

from .. import solver
from ..meshes import islands, selection, separated
from . import common, match, options, parts

BOUNDARIES = {
    "circle": "Circle: By length along the boundary",
    "square": "Square: By length along the boundary, with a corner near each quarter of it",
    "triangle": "Triangle: Equilateral, with a corner near each third of the boundary",
    "pinned": "Pinned: Pinned UVs of the boundary stay exactly where they are; between two of them it runs straight. They "
    "have to make a convex polygon",
    "selected": "Selected: The same with the selected vertices of the boundary: its whole loop, or the corners of a polygon, "
    "at their UVs",
}

METHODS = {
    "ladder": "Automatic: Tutte's, or progressive where rounding makes that flip",
    "progressive": "Progressive: Vertices are inserted one by one, each where it is flip-free",
    "tutte": "Tutte: Refused where rounding makes it flip",
}

# Those that are made of the user's own places.
_OWN = ("pinned", "selected")


class EmbedTask(parts.PackedTask):
    """Every island by itself."""

    poor_cure = "Turn on Optimise, or take a boundary that is more like the island's own"

    boundary, method, optimise = "circle", "ladder", False
    pack_options = {"scale_true": True}

    def __init__(self, snapshot, marked, *, pack=True, **options):
        """marked: vertices of the mesh at whose UVs the boundary has corners, besides pinned ones."""
        super().__init__(snapshot, **options)
        self.marked = marked
        self.packs = pack and self.boundary not in _OWN

    def stages(self):
        found = islands.islands_of(self.snapshot)
        for island in found:
            self._refuse_no_disk(island)
        if self.boundary in _OWN:
            pinned = self.boundary == "pinned"
            islands.collect_pins(self.snapshot, found, self.marked, pinned=pinned)
        pieces = []
        for i, island in enumerate(found):
            self.solving = island.submesh, island.triangles
            self.span = (i / len(found), (i + 1) / len(found))
            result = yield solver.embed(
                island,
                boundary="corners" if self.boundary in _OWN else self.boundary,
                corners=self._corners(island) if self.boundary in _OWN else None,
                method=self.method,
                optimise=self.optimise,
            )
            pieces.append(islands.Piece(island.triangles, island.submesh, self.checked(result)))
        yield from self.put_together(pieces)

    def _refuse_no_disk(self, island):
        loops = len(island.boundary_loops())
        handles = island.genus(loops)
        if loops == 1 and handles == 0:
            return
        what = "is closed" if loops == 0 else f"has {loops} boundaries"
        if handles:
            what = f"has {common.plural(handles, 'handle')}"
        match.refuse_island(
            self.snapshot,
            island,
            f"{what}, and only disks fit into a polygon. Mark seams that leave it one boundary",
        )

    def _corners(self, island) -> dict:
        (rim,) = island.boundary_loops()
        corners = {v: island.pins[v] for v in rim if v in island.pins}
        if len(corners) < 3:
            match.refuse_island(
                self.snapshot,
                island,
                f"has {common.plural(len(corners), 'corner')} on its boundary, and a polygon has three at least. "
                + (
                    "Pin more of its UVs there with P"
                    if self.boundary == "pinned"
                    else "Select more vertices there"
                ),
            )
        return corners


def make_task(snapshot, *, boundary="circle", **options) -> EmbedTask:
    ob = bpy.data.objects[snapshot.object_name]
    marked = {"pinned": match.group_vertices, "selected": selection.vertices}
    found = marked[boundary](ob) if boundary in _OWN else np.zeros(0, np.int64)
    return EmbedTask(separated.separated(snapshot), found, boundary=boundary, **options)


class UV_OT_flipfree_embed(
    options.Margin, options.UseModifiers, options.MapOperator, bpy.types.Operator
):
    bl_idname = "uv.flipfree_embed"
    bl_label = "Embed in Polygon"
    bl_description = (
        "Map every island onto a circle, a square, a triangle or a convex polygon of your own, without a flip, however crooked "
        "the island is. Edges that such a boundary flattens are split"
    )
    joint_layout = True
    advanced = ("method",)

    boundary: options.choice(
        "Boundary: The convex polygon that islands are mapped onto", BOUNDARIES
    )
    method: options.choice("Method: How the inside gets its place", METHODS)
    optimise: options.flag("Optimise: Lower the distortion, with the boundary held")
    pack: options.flag(
        "Pack Islands: Pack the islands into the unit square, in the size of their surface. Off: all lie around the origin",
        on=True,
    )

    def needs(self):
        packs = self.pack and self.boundary not in _OWN
        return {"pack": self.boundary not in _OWN, "margin_pixels": packs, "texture_size": packs}

    make_task = staticmethod(make_task)
    summary = staticmethod(parts.packed_summary)
