# SPDX-License-Identifier: GPL-3.0-or-later
"""Auto Unwrap: one flip-free island per seam island (thesis 3.2, docs/unwrap.md)."""

import copy
import dataclasses

import bpy
import numpy as np

from flipfree.calls.unwrapping import SEAMS
from flipfree.distortion import STRETCH_BOUND

from .. import modal, solver
from ..meshes import islands, labels, mesh_io, selection
from ..runs import steps
from . import common, options


class MapTask(modal.StagedTask):
    """A task whose result is a map on the mesh's own triangles. Subclasses have `bijective`, `use_pins` and `margin`.

    Islands that the solver names as the place of an error keep their UVs; the task is done again without them.
    """

    packs = True  # takes part in a layout of all objects
    packs_alone = True  # what the solver returned is such a layout if no other object takes part
    keep_placement = False
    aspect = 1.0  # width over height of the texture
    margin = 0.0  # between islands, in widths of the texture
    mark_seams = False

    def __init__(self, snapshot: mesh_io.Snapshot, **options):
        super().__init__(snapshot, **options)
        self.result = None
        self._loops = self._values = None
        self._failed = np.zeros(0, np.int64)  # triangles of the islands that an error names

    def pins(self) -> dict:
        return common.pins_of(self.snapshot) if self.use_pins else {}

    def island_labels(self) -> np.ndarray:
        """(#St,) the same number for triangles of one of the islands that the solver maps on their own."""
        return islands.seam_islands(self.snapshot)

    def explain(self, error):
        named = mesh_io.triangles_at(self.snapshot, error.kind, error.elements)
        if len(named):
            label = self.island_labels()
            self._failed = np.flatnonzero(np.isin(label, label[named]))

    def instead(self):
        if not 0 < len(self._failed) < len(self.snapshot.triangles):
            return None
        rest = copy.copy(self)
        rest.snapshot = self.snapshot.without(self._failed)
        rest._failed = self._failed[:0]
        rest.packs_alone = False  # what was left out keeps its place
        rest.leaves_out = "Its island keeps its UVs, the others were mapped"
        return rest

    def leave_out(self, chosen: np.ndarray):
        """Goes on without the triangles of this mask, which stay where they are."""
        if chosen.any():
            self.snapshot = self.snapshot.without(np.flatnonzero(chosen))
            self.packs_alone = False
            self.leaves_out = "The other islands stay"

    def take(self, result):
        """Stages that keep a result, and what will be stored of it."""
        common.refuse_uncertified(self.snapshot, result.certificate)
        storing = mesh_io.storing(self.snapshot, result.uv32())
        self._loops, self._values = yield from modal.paused(storing)
        self.result = result

    def uv_on_texture(self) -> np.ndarray:
        """(#St, 3, 2) the map as a layout of all objects takes it."""
        return self.result.uv

    def surface(self):
        """(vertices, triangles) of the map."""
        return self.snapshot.vertices, self.snapshot.triangles

    def in_snapshot(self, kind, ids):
        """Ids of the surface as those of the snapshot."""
        return kind, ids.tolist()

    def stored_map(self):
        return *self.surface(), self.result.uv32()

    def lay_out(self, uv, stored, stats, mirrored):
        """Stages that certify and take another layout of the same map: uv (m, 3, 2) float64, what is stored of it, and which
        triangles it mirrors."""
        values = yield from modal.paused(steps.doubles(stored))
        certificate = yield solver.certify(
            self.snapshot,
            values,
            pins=self.pins(),
            bijective=self.bijective and self.certificate.overlaps == 0,
            mirrored=mirrored,
            aspect=self.aspect,
        )
        yield modal.Pause()
        yield from self.take(
            dataclasses.replace(
                self.result,
                uv=uv,
                _uv32=stored,
                certificate=certificate,
                stats={**self.result.stats, **stats},
            )
        )

    @property
    def certificate(self):
        return self.result and self.result.certificate

    def island_count(self) -> int:
        return int(self.result.stats["charts"])

    def writing(self, ob):
        seams = self.new_seams()
        yield
        yield from mesh_io.writing_uv(ob, self.snapshot, self._loops, self._values, seams)

    def automatic_cuts(self) -> np.ndarray:
        """Edges that the solver cut although they are no seams."""
        cut = mesh_io.edge_ids(self.snapshot, self.result.cut_edges)
        return cut[~self.snapshot.seams[cut]]

    def new_seams(self) -> np.ndarray | None:
        """Edges to be marked as seams."""
        return self.automatic_cuts() if self.mark_seams else None


class UnwrapTask(MapTask):
    flattens = True
    _laid_out = None  # where islands with pins have their shape on the texture

    seams, stretch = SEAMS, STRETCH_BOUND
    bijective = may_add_cuts = cut_extremities = use_pins = True
    select_cuts = False

    def __init__(self, snapshot, **options):
        super().__init__(snapshot, **options)
        self.packs_alone = self.aspect == 1.0

    def stages(self):
        self._laid_out = None
        pins = self.pins()
        yield modal.Pause()
        yield from modal.paused(self.snapshot.finding_diagonals())
        result = yield solver.unwrap(
            self.snapshot,
            pins=pins,
            **self.values("seams stretch bijective may_add_cuts cut_extremities margin"),
            keep_places=self.keep_placement and self.packs_alone,
            effort=solver.QUICK_PACKING if self.packs_alone else 0.0,
        )
        yield from self.take(result)
        if self.aspect != 1.0 and pins:
            yield from self._pinned_on_texture(pins)

    def _pinned_on_texture(self, pins):
        """Islands with pins were made in the unit square, where these are; what lies between them gets its shape on the texture.
        The others wait for the layout."""
        uv = self.result.uv
        label = labels.island_labels(self.snapshot.triangles, self.result.uv32())
        pinned = np.flatnonzero(np.isin(label, label[[triangle for triangle, _ in pins]]))
        part, _ = self.snapshot.part(pinned)
        number = np.full(len(label), -1)
        number[pinned] = np.arange(len(pinned))
        found = yield solver.improve(
            (part.vertices, part.triangles, uv[pinned]),
            pins={(int(number[t]), k): place for (t, k), place in pins.items()},
            **self.values("bijective aspect"),
        )
        self._laid_out = uv / [self.aspect, 1.0]
        self._laid_out[pinned] = found.uv

    def uv_on_texture(self):
        """Its islands as if they had been laid out on the texture."""
        if self._laid_out is not None:
            return self._laid_out
        return self.result.uv if self.aspect == 1.0 else self.result.uv / [self.aspect, 1.0]

    @property
    def poor_cure(self):
        if self.pins():
            return "Move or unpin some of the pins, or mark more seams there"
        if self.seams == "given":
            return "'Seams: Automatic' cuts there, or mark seams yourself"
        if self.stretch > STRETCH_BOUND:
            return "A lower 'Stretch' cuts there, or mark seams yourself"
        return common.MORE_SEAMS

    def writing(self, ob):
        yield from super().writing(ob)
        if self.select_cuts:
            selection.select_only(ob, "edge", self.automatic_cuts())


def summary_of_maps(tasks: list[MapTask], more: str = "") -> str:
    """The report line, without the time. more: said after the figures of the map."""
    return common.figures(tasks) + more + layout_notes(tasks)


def summary(tasks: list[UnwrapTask]) -> str:
    cuts = sum(len(t.automatic_cuts()) for t in tasks)
    return summary_of_maps(
        tasks, f", {common.plural(cuts, 'edge')} cut automatically" if cuts else ""
    )


def left_tiles_text(count: int) -> str:
    return f", {common.plural(count, 'island')} beyond the tile that {'it was' if count == 1 else 'they were'} in"


def layout_notes(tasks: list[MapTask]) -> str:
    """What a user might wonder about where the islands went."""
    stats = tasks[0].result.stats
    text = f", {100.0 * stats['fill']:.0f} % filled" if stats.get("fill", 0.0) > 0.0 else ""
    text += common.texture_text(tasks[0].aspect)
    if not stats.get("margin_met", 1) and not stats.get("kept_places", 0):
        text += ", some gaps below the margin"
    if tasks[0].keep_placement and not stats["kept_places"]:
        text += ", packed, as old places were missing, overlapping or outside the unit square"
    if stats.get("enlarged_islands", 0):
        text += f", {stats['enlarged_islands']} too small for 32 bits enlarged"
    if stats.get("left_tiles", 0):
        text += left_tiles_text(stats["left_tiles"])
    if stats.get("tile", 0):
        text += f", in tile {1001 + stats['tile']} beside other islands, which leave no room"
    return text


class UV_OT_flipfree_unwrap(
    options.Stretch,
    options.NoOverlaps,
    options.KeepPins,
    options.Placement,
    options.CorrectAspect,
    options.UseModifiers,
    options.MapOperator,
    bpy.types.Operator,
):
    bl_idname = "uv.flipfree_unwrap"
    bl_label = "Auto Unwrap"
    bl_description = (
        "Unwrap so that no face is flipped, with low distortion, along marked seams and more where these leave too much stretch; "
        "pinned UVs stay exactly where they are"
    )
    option_names = (
        "seams stretch bijective may_add_cuts cut_extremities use_pins mark_seams select_cuts "
        "keep_placement margin_pixels texture_size correct_aspect use_modifiers"
    ).split()
    advanced = (
        *("may_add_cuts", "cut_extremities", "select_cuts", "keep_placement", "texture_size"),
        *("correct_aspect", "use_modifiers"),
    )
    joint_layout = True

    seams: options.choice(
        "Seams: Where islands end. On meshes with pinned UVs no seams are looked for, unless Keep Pins is off",
        {
            "auto": "Automatic: Along the edges that are marked as seams, and where an island is closed, has handles or would be "
            "stretched more than allowed, also along short seams that are found",
            "given": "Marked: Along the edges that are marked as seams, and no others that are not needed",
        },
        default=SEAMS,
    )
    may_add_cuts: options.flag(
        "May Add Cuts: An island that would lie on top of itself, and could only be kept from it by crushing it, is cut "
        "further. Off: it is crushed. Without effect on islands with pins, or where overlaps are allowed",
        on=True,
    )
    cut_extremities: options.flag(
        "Cut to Extremities: Closed parts without seams are cut open automatically: also along legs, fingers and whatever else "
        "would shrink many times. Off: one short cut. Without effect where UVs are pinned",
        on=True,
    )
    mark_seams: options.flag(
        "Mark Cuts as Seams: Mark the edges that were cut automatically as seams"
    )
    select_cuts: options.flag("Select Added Cuts: Select the edges that were cut automatically")

    def needs(self):
        return {"stretch": self.seams != "given", "cut_extremities": self.seams == "given"}

    make_task = staticmethod(UnwrapTask)
    summary = staticmethod(summary)
