# SPDX-License-Identifier: GPL-3.0-or-later
"""Check: the certificate of any UV map, ours or not; selects what is wrong (docs/unwrap.md)."""

import bpy
import numpy as np

from .. import mesh_io, modal, solver
from . import common, options


class CheckTask(modal.Task):
    def __init__(self, snapshot):
        super().__init__(snapshot)
        self.certificate = None
        self.islands = 0

    def start(self):
        common.refuse_nonfinite_uvs(self.snapshot)
        self.islands = mesh_io.count_islands(self.snapshot.triangles, self.snapshot.corner_uv)
        return solver.certify(self.snapshot, self.snapshot.corner_uv, bijective=True)

    def collect(self, result):
        self.certificate = result

    def torn_edges(self) -> int:
        return mesh_io.nearly_joined(self.snapshot.triangles, self.snapshot.corner_uv)

    def failed_faces(self) -> np.ndarray:
        return np.unique(self.snapshot.triangle_face[self.certificate.failed_faces])

    def write(self, ob):
        """Leaves UVs alone; shows the faces that the certificate names."""
        if not self.certificate.ok:
            mesh_io.select_only(ob, "face", self.failed_faces())


def summary(tasks: list[CheckTask]) -> str:
    """The report line, without the time."""
    text = common.figures([t.certificate for t in tasks], sum(t.islands for t in tasks))
    wrong = sum(len(t.failed_faces()) for t in tasks)
    verdict = f"{common.plural(wrong, 'face')} wrong, now selected" if wrong else "Nothing wrong"
    torn = sum(t.torn_edges() for t in tasks if t.certificate.overlaps > 0)
    if torn:
        text += (
            f"; on {common.plural(torn, 'edge')} the UVs of the two sides differ in the last bits only, which counts as a cut: "
            "join them with UV > Merge > By Distance"
        )
    return f"{verdict}: {text}"


class UV_OT_flipfree_check(options.MapOperator, bpy.types.Operator):
    bl_idname = "uv.flipfree_check"
    bl_label = "Check Flips and Overlaps"
    bl_description = (
        "Check the UV map with exact arithmetic: count flipped and overlapping faces, measure distortion, and select the faces "
        "that are wrong"
    )
    bl_options = {"REGISTER", "UNDO"}
    verb = "Check"
    needs_uv = True

    def make_task(self, snapshot):
        return CheckTask(snapshot)

    def summary(self, tasks):
        return summary(tasks)


CLASSES = (UV_OT_flipfree_check,)
