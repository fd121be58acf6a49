# SPDX-License-Identifier: GPL-3.0-or-later
"""Pack Islands: the islands of existing maps, nested into one tile, a certified gap between any two (docs/pack.md)."""

from dataclasses import dataclass, field

import bpy
import numpy as np

from ... import modal, solver
from ...meshes import labels
from .. import common, options
from ..arrange import moved
from ..unwrap import MapTask, summary_of_maps

ROTATIONS = {
    "straight": "Automatic: Rectangles and other islands with straight outlines stay along the axes, others turn by any angle",
    "free": "Any: By any angle",
    "quarters": "Cardinal: By 90 degrees only",
    "none": "None: Not at all",
}
GROUPS = {
    "none": "All Together: One layout of all islands",
    "material": "Material: Islands of each material have a layout of their own",
    "collection": "Collection: Islands of each collection have a layout of their own",
    "object": "Object: Islands of each object have a layout of their own",
}


# Of the largest coordinate's square: an area of a triangle above it is positive however it was rounded.
_SURELY = 1e-14


@dataclass
class Unplaced:
    """A map that waits for its layout."""

    uv: np.ndarray
    certificate: object = None
    stats: dict = field(default_factory=dict)
    _uv32: np.ndarray | None = None

    def uv32(self) -> np.ndarray:
        return self._uv32


class PackTask(MapTask):
    packs_alone = False
    bijective = False  # islands that overlap themselves are packed as they are

    use_pins = True

    def __init__(
        self,
        snapshot,
        *,
        group_by="none",
        share_tile=False,
        same_density=True,
        tiles=1,
        aspect=1.0,
        use_pins=True,
        margin=0.0,
        **pack_options,
    ):
        """pack_options: others of ff.pack."""
        super().__init__(snapshot, use_pins=use_pins, margin=margin)
        grouped = group_by != "none"
        tiles = 1 if grouped else tiles
        self.aspect = aspect if tiles == 1 and (share_tile or not grouped) else 1.0
        self.stacked_ok = pack_options.get("stack_similar", False) or (grouped and share_tile)
        self._groups = group_names(snapshot, group_by) if grouped else None
        self.pack_options = pack_options | {
            "aspect": self.aspect,
            "margin": margin,
            "scale_true": same_density,
            "tiles": tiles,
            "share_tile": grouped and share_tile,
        }

    def groups(self):
        """(#St,) the name of the group that each triangle's island is packed with, if there are groups."""
        return self._groups

    def island_count(self) -> int:
        return labels.count_islands(self.snapshot.triangles, self.result.uv32())

    def stages(self):
        snapshot = self.snapshot
        common.refuse_nonfinite_uvs(snapshot)
        uv = yield from modal.doubles(snapshot)
        yield modal.Pause()
        if moved.areas(uv).min() <= _SURELY * np.abs(uv).max() ** 2:
            yield modal.Pause()
            # The solver knows, and says which islands cannot be packed; the others are.
            given = self.pack_options.items()
            stacking = {name: value for name, value in given if name.startswith("stack_")}
            yield solver.pack(snapshot.vertices, snapshot.triangles, uv, effort=0.0, **stacking)
        self.result = Unplaced(uv)


def group_names(snapshot, group_by: str) -> np.ndarray:
    ob = bpy.data.objects[snapshot.object_name]
    if group_by == "material":
        names = [slot.material.name if slot.material else "" for slot in ob.material_slots] or [""]
        return np.array(names)[np.minimum(snapshot.materials, len(names) - 1)]
    named = ob.users_collection if group_by == "collection" else (ob,)
    return np.repeat(named[0].name if named else "", len(snapshot.triangles))


def summary(tasks: list[PackTask]) -> str:
    """The report line, without the time."""
    text, stats = "", tasks[0].result.stats
    if stats.get("stacked", 0):
        text += f", {common.plural(stats['stacked'], 'island')} stacked"
    if stats.get("tiles", 1) > 1:
        what = "layout" if tasks[0].pack_options.get("share_tile") else "tile"
        text += f", in {common.plural(stats['tiles'], what)}"
    return summary_of_maps(tasks, text)


class UV_OT_flipfree_pack(
    options.Margin,
    options.KeepPins,
    options.CorrectAspect,
    options.MapOperator,
    bpy.types.Operator,
):
    bl_idname = "uv.flipfree_pack"
    bl_label = "Pack Islands (Nested)"
    bl_description = (
        "Nest the islands of all objects into one tile, true outlines, holes used, with an exact least gap in pixels; "
        "islands with pins and faces that are not selected stay and are kept clear of"
    )
    needs_uv = True
    joint_layout = True
    option_names = (
        "margin_pixels texture_size rotation same_density stack_similar stack_mirrored group_by "
        "share_tile use_pins correct_aspect tile tiles effort"
    ).split()
    advanced = ("correct_aspect", "tile", "tiles", "effort")

    rotation: options.choice("Rotation: How islands may be turned", ROTATIONS)
    same_density: options.flag(
        "Same Density: All islands get the same area per area of the surface. Otherwise they keep their relative sizes",
        on=True,
    )
    stack_similar: options.flag(
        "Stack Similar: Islands of equal outline lie on top of each other and share their pixels"
    )
    stack_mirrored: options.flag(
        "Mirrored Too: Mirror images of islands lie on these as well, mirrored: their UVs are flipped, which the report and "
        "Check say"
    )
    group_by: options.choice(
        "Group By: What has a layout of its own; groups go by the alphabet", GROUPS
    )
    share_tile: options.flag(
        "Same Tile: All groups go into the first tile, on top of each other, as each has a texture of its own. Otherwise each "
        "has the next UDIM tile"
    )
    tile: options.whole(
        "First Tile: UDIM tile to pack into. The next one that has room, if others leave none there",
        (1001, 1001, 1100),
    )
    tiles: options.whole(
        "Tile Count: How many UDIM tiles, from that one on, islands are spread over: all at one scale",
        (1, 1, 100),
    )
    effort: options.real(
        "Effort: How long to search for a denser layout: 1 is about a second for 300 islands, 0 puts boxes side by side",
        (1.0, 0.0, 1000.0),
        soft_max=20.0,
        precision=1,
    )

    def needs(self):
        grouped = self.group_by != "none"
        one_tile = self.share_tile if grouped else self.tiles == 1
        return {
            **{"correct_aspect": one_tile, "tiles": not grouped, "share_tile": grouped},
            "stack_mirrored": self.stack_similar,
        }

    make_task = staticmethod(PackTask)
    summary = staticmethod(summary)
