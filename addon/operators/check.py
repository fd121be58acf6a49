# SPDX-License-Identifier: GPL-3.0-or-later
"""Check: the certificate of any UV map, ours or not; selects what is wrong (docs/repair.md)."""

import bpy
import numpy as np

from flipfree.distortion import LEVELS

from .. import modal, solver
from ..meshes import labels, selection
from . import common, options

_MOST_NAMED = 3  # islands in a report


class CheckTask(modal.StagedTask):
    stacked_ok = False
    aspect = 1.0
    _label = None  # island of each triangle

    def island_count(self) -> int:
        return len(np.unique(self._label))

    def stored_map(self):
        return self.snapshot.vertices, self.snapshot.triangles, self.snapshot.corner_uv

    def stages(self):
        common.refuse_nonfinite_uvs(self.snapshot)
        yield modal.Pause()
        self._label = labels.island_labels(self.snapshot.triangles, self.snapshot.corner_uv)
        uv = yield from modal.doubles(self.snapshot)
        self.certificate = yield solver.certify(
            self.snapshot,
            uv,
            bijective=True,
            disjoint=not self.stacked_ok,
            mirrored="islands",
            aspect=self.aspect,
        )

    def torn_edges(self) -> int:
        return labels.nearly_joined(self.snapshot.triangles, self.snapshot.corner_uv)

    def stacked(self) -> np.ndarray:
        """Islands that share area with others, as labels; none if they may."""
        if self.stacked_ok:
            return np.zeros(0, np.int64)
        return np.unique(self._label[self.certificate.island_overlap_faces])

    def failed_faces(self) -> np.ndarray:
        """What the certificate names, and all of islands that are on others."""
        wrong = np.isin(self._label, self.stacked())
        wrong[self.certificate.failed_faces] = True
        return np.unique(self.snapshot.triangle_face[wrong])

    def write(self, ob):
        """Leaves UVs alone; shows the faces that are wrong."""
        if not self.certificate.ok:
            selection.select_only(ob, "face", self.failed_faces())


def summary(tasks: list[CheckTask]) -> str:
    """The report line, without the time."""
    text = common.figures(tasks)
    wrong = sum(len(t.failed_faces()) for t in tasks)
    verdict = f"{common.plural(wrong, 'face')} wrong, now selected" if wrong else "Nothing wrong"
    level = max(t.certificate.level for t in tasks)
    if level and not wrong:
        verdict = f"No flips and no overlaps, but {LEVELS[level]}"
    nowhere = [text for t in tasks for text in t.certificate.failures]
    if not wrong and nowhere:  # of the whole map, no face in particular
        verdict = nowhere[0]
    stacked = [int(t.snapshot.triangle_face[island]) for t in tasks for island in t.stacked()]
    if stacked:
        named = ", ".join(map(str, stacked[:_MOST_NAMED]))
        more = f" and {len(stacked) - _MOST_NAMED} more" if len(stacked) > _MOST_NAMED else ""
        text += f"; stacked: islands of the faces {named}{more}"
    torn = sum(t.torn_edges() for t in tasks if t.certificate.overlaps > 0)
    if torn:
        text += (
            f"; on {common.plural(torn, 'edge')} the UVs of the two sides differ in the last bits only, which counts as a cut: "
            "join them with UV > Merge > By Distance"
        )
    return f"{verdict}: {text}{common.texture_text(tasks[0].aspect)}"


class UV_OT_flipfree_check(
    options.MeasureAspect, options.UseModifiers, options.MapOperator, bpy.types.Operator
):
    bl_idname = "uv.flipfree_check"
    bl_label = "Check Flips and Overlaps"
    bl_description = (
        "Check the UV map with exact arithmetic: count flipped and overlapping faces and islands, measure distortion, and select "
        "the faces that are wrong"
    )
    needs_uv = True
    writes = False

    stacked_ok: options.flag(
        "Allow Stacked Islands: Islands that lie on each other are counted, but not wrong: for parts that share a texture on "
        "purpose"
    )

    make_task = staticmethod(CheckTask)
    summary = staticmethod(summary)

    def advice(self, tasks: list[CheckTask]) -> str:
        """What to do about what is wrong or poor; "" if nothing is."""
        texts = []
        if any(len(t.stacked()) for t in tasks):
            texts.append("Pack the islands, or allow stacked ones in the redo panel")
        if any(t.certificate.flips32 > 0 or t.certificate.overlaps > 0 for t in tasks):
            texts.append(
                "Repair Flips mends them and leaves the rest of the map as it is, Auto Unwrap makes a new one"
            )
        elif not texts and any(len(t.failed_faces()) for t in tasks):
            texts.append("Unwrap it anew")
        elif not texts and not all(t.certificate.ok for t in tasks):
            texts.append("Give the mesh's faces an area: Mesh > Clean Up > Degenerate Dissolve")
        return ". ".join([*texts, *filter(None, [common.advice(tasks)])])

    def hint(self, tasks):
        mirrored = any(task.certificate.mirrored_islands for task in tasks)
        cure = "Select Faces by Map shows what is mirrored, Repair Flips turns it over"
        return ". ".join(filter(None, [super().hint(tasks), cure * mirrored]))
