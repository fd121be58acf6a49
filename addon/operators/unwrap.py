# SPDX-License-Identifier: GPL-3.0-or-later
"""Unwrap Flip-Free: one flip-free island per seam island (thesis 3.2, docs/unwrap.md)."""

import bpy
import numpy as np

from .. import mesh_io, modal, solver
from . import common, options


class MapTask(modal.Task):
    """A task whose result is a map on the mesh's own triangles."""

    def __init__(self, snapshot: mesh_io.Snapshot):
        super().__init__(snapshot)
        self.result = None
        self._loops = self._values = None

    def collect(self, result):
        self.take(result)

    def take(self, result):
        common.refuse_uncertified(self.snapshot, result.certificate)
        self.result = result
        self._loops, self._values = mesh_io.loop_values(self.snapshot, result.uv32())

    @property
    def certificate(self):
        return self.result.certificate

    @property
    def islands(self) -> int:
        return int(self.result.stats["charts"])

    def write(self, ob):
        mesh_io.write_uv(ob, self.snapshot, self._loops, self._values, self.new_seams())

    def new_seams(self) -> np.ndarray | None:
        """Edges to be marked as seams."""
        return None


class UnwrapTask(MapTask):
    def __init__(
        self,
        snapshot,
        *,
        bijective=True,
        cut_extremities=True,
        use_pins=True,
        mark_seams=False,
        pack=False,
        margin=0.005,
    ):
        super().__init__(snapshot)
        self.use_pins = use_pins
        self.bijective = bijective
        self.cut_extremities = cut_extremities
        self.pack = pack
        self.margin = margin
        self.mark_seams = mark_seams

    def start(self):
        return solver.unwrap(
            self.snapshot,
            pins=common.pins_of(self.snapshot) if self.use_pins else {},
            bijective=self.bijective,
            cut_extremities=self.cut_extremities,
            margin=self.margin,
            keep_places=not self.pack,
        )

    def automatic_cuts(self) -> np.ndarray:
        """Edges that the solver cut although they are no seams."""
        cut = mesh_io.edge_ids(self.snapshot, self.result.cut_edges)
        return cut[~self.snapshot.seams[cut]]

    def new_seams(self):
        return self.automatic_cuts() if self.mark_seams else None


def summary(tasks: list[UnwrapTask]) -> str:
    """The report line, without the time."""
    text = common.figures([t.certificate for t in tasks], sum(t.islands for t in tasks))
    cuts = sum(len(t.automatic_cuts()) for t in tasks)
    return f"{text}, {common.plural(cuts, 'edge')} cut automatically" if cuts else text


class UV_OT_flipfree_unwrap(
    options.NoOverlaps,
    options.KeepPins,
    options.Packing,
    options.MapOperator,
    bpy.types.Operator,
):
    bl_idname = "uv.flipfree_unwrap"
    bl_label = "Unwrap Flip-Free"
    bl_description = (
        "Unwrap along the seams so that no face is flipped, with low distortion; "
        "pinned UVs stay exactly where they are"
    )
    bl_options = {"REGISTER", "UNDO"}
    verb = "Unwrap Flip-Free"
    option_names = ("bijective", "cut_extremities", "use_pins", "mark_seams", "pack", "margin")

    cut_extremities: bpy.props.BoolProperty(
        name="Cut to Extremities",
        description=(
            "Closed parts without seams are cut open automatically: also along legs, fingers and whatever else "
            "would shrink many times. Off: one short cut. Without effect where UVs are pinned"
        ),
        default=True,
    )
    mark_seams: bpy.props.BoolProperty(
        name="Mark Cuts as Seams",
        description="Closed parts without seams are cut open automatically; mark these cuts as seams",
        default=False,
    )

    def make_task(self, snapshot, **options):
        return UnwrapTask(snapshot, **options)

    def summary(self, tasks):
        return summary(tasks)


CLASSES = (UV_OT_flipfree_unwrap,)
