# SPDX-License-Identifier: GPL-3.0-or-later
"""Pack Islands: the islands of existing maps, nested into one tile, a certified gap between any two (docs/pack.md)."""

import bpy

from ... import modal, solver
from ...runs import steps
from .. import common, options
from ..unwrap import MapTask, layout_notes

ROTATIONS = (
    (
        "straight",
        "Any but Straight",
        "Rectangles and other islands with straight outlines stay along the axes, others turn by any angle",
    ),
    ("free", "Any", "By any angle"),
    ("quarters", "90 Degrees", "By quarter turns only"),
    ("none", "None", "Not at all"),
)


class PackTask(MapTask):
    packs_alone = False
    bijective = False  # islands that overlap themselves are packed as they are

    def __init__(
        self,
        snapshot,
        *,
        margin_pixels=2.0,
        texture_size=1024,
        rotation="straight",
        stack_similar=False,
        same_density=True,
        use_pins=True,
        tile=1001,
        tiles=1,
        effort=1.0,
        aspect=1.0,
    ):
        super().__init__(snapshot)
        self.use_pins = use_pins
        self.margin = margin_pixels / texture_size
        self.aspect = aspect if tiles == 1 else 1.0
        self.pack_options = {
            "aspect": self.aspect,
            "margin": self.margin,
            "rotation": rotation,
            "stack_similar": stack_similar,
            "scale_true": same_density,
            "tile": tile,
            "tiles": tiles,
            "effort": effort,
        }

    def stages(self):
        snapshot = self.snapshot
        common.refuse_nonfinite_uvs(snapshot)
        yield modal.Pause()
        unmoved = [3 * t + k for t, k in self.pins()]
        yield modal.Pause()
        uv = snapshot.corner_uv
        yield modal.Pause()
        uv = yield from modal.paused(steps.doubles(uv))
        result = yield solver.pack(
            snapshot.vertices,
            snapshot.triangles,
            uv,
            unmoved=unmoved,
            **{**self.pack_options, "effort": 0.0},
        )
        yield from self.take(result)


def summary(tasks: list[PackTask]) -> str:
    """The report line, without the time."""
    text = common.figures([t.certificate for t in tasks], sum(t.islands for t in tasks))
    stats = tasks[0].result.stats
    if stats.get("stacked", 0):
        text += f", {common.plural(stats['stacked'], 'island')} stacked"
    if stats.get("tiles", 1) > 1:
        text += f", in {common.plural(stats['tiles'], 'tile')}"
    return text + layout_notes(tasks)


class UV_OT_flipfree_pack(
    options.KeepPins, options.CorrectAspect, options.MapOperator, bpy.types.Operator
):
    bl_idname = "uv.flipfree_pack"
    bl_label = "Pack Islands (Nested)"
    bl_description = (
        "Nest the islands of all objects into one tile, true outlines, holes used, with an exact least gap in pixels; "
        "islands with pins and faces that are not selected stay and are kept clear of"
    )
    bl_options = {"REGISTER", "UNDO"}
    verb = "Pack Islands"
    needs_uv = True
    joint_layout = True
    option_names = (
        "margin_pixels",
        "texture_size",
        "rotation",
        "same_density",
        "stack_similar",
        "use_pins",
        "correct_aspect",
        "tile",
        "tiles",
        "effort",
    )

    margin_pixels: bpy.props.FloatProperty(
        name="Margin",
        description="Least gap between islands, in pixels of the texture; half of it to the tile's border",
        default=2.0,
        min=0.0,
        soft_max=64.0,
        precision=1,
    )
    texture_size: bpy.props.IntProperty(
        name="Texture Size",
        description="Pixels of the texture's longer side, by which the margin is measured",
        default=1024,
        min=16,
        max=65536,
    )
    rotation: bpy.props.EnumProperty(
        name="Rotation",
        description="How islands may be turned",
        items=ROTATIONS,
        default="straight",
    )
    same_density: bpy.props.BoolProperty(
        name="Same Density",
        description="All islands get the same area per area of the surface. Otherwise they keep their relative sizes",
        default=True,
    )
    stack_similar: bpy.props.BoolProperty(
        name="Stack Similar",
        description="Islands of equal outline lie on top of each other and share their pixels",
        default=False,
    )
    tile: bpy.props.IntProperty(
        name="Tile",
        description="UDIM tile to pack into. The next one that has room, if others leave none there",
        default=1001,
        min=1001,
        max=1100,
    )
    tiles: bpy.props.IntProperty(
        name="Tiles",
        description="How many UDIM tiles, from that one on, islands are spread over: all at one scale",
        default=1,
        min=1,
        max=100,
    )
    effort: bpy.props.FloatProperty(
        name="Effort",
        description="How long to search for a denser layout: 1 is about a second for 300 islands, 0 puts boxes side by side",
        default=1.0,
        min=0.0,
        soft_max=20.0,
        max=1000.0,
        precision=1,
    )

    def has_effect(self, name):
        return name != "correct_aspect" or self.tiles == 1

    def make_task(self, snapshot, **options):
        return PackTask(snapshot, **options)

    def summary(self, tasks):
        return summary(tasks)


CLASSES = (UV_OT_flipfree_pack,)
