# SPDX-License-Identifier: GPL-3.0-or-later
"""Islands that are moved, turned and scaled as they are; written only if rounding to 32 bits folded nothing."""

import time

import numpy as np

from ... import modal, solver
from ...meshes import labels, mesh_io
from .. import common


class MovedTask(modal.StagedTask):
    """Subclasses say where each island goes (`place`). Islands with pins stay if these are to be kept."""

    use_pins = True
    aspect = 1.0
    moved = stayed = _count = 0  # islands; those with pins stay

    def place(self, triangles: np.ndarray, uv: np.ndarray) -> np.ndarray | None:
        """New UVs (k, 3, 2) of an island: its triangles (k,), and their UVs in float64. None: it stays."""
        raise NotImplementedError

    def island_count(self) -> int:
        return self._count

    def stages(self):
        snapshot = self.snapshot
        common.refuse_nonfinite_uvs(snapshot)
        old = snapshot.corner_uv.astype(np.float64)
        new = yield from self._placed(old)
        before = yield solver.certify(snapshot, old, bijective=True)
        stored = new.astype(np.float32)
        after = yield solver.certify(snapshot, stored.astype(np.float64), bijective=True)
        if after.flips32 > before.flips32 or after.overlaps > max(before.overlaps, 0):
            faces = np.unique(snapshot.triangle_face[after.failed_faces])
            raise mesh_io.MeshProblem(
                f"{snapshot.object_name}: Blender's 32-bit UVs are too coarse for face {faces[0]}{mesh_io.more(faces)} there, it "
                "would fold. Make the island larger, or improve its map",
                "face",
                faces,
            )
        self.certificate = after
        self._loops, self._values = mesh_io.loop_values(snapshot, stored)

    def _placed(self, old: np.ndarray):
        """Stages that find the new UVs: there may be hundreds of thousands of islands."""
        snapshot = self.snapshot
        label = labels.island_labels(snapshot.triangles, snapshot.corner_uv)
        pinned = snapshot.pinned[snapshot.triangle_loops].any(axis=1)
        new = old.copy()
        begin = time.perf_counter()
        for triangles in labels.groups(label):
            if time.perf_counter() - begin > modal.MOMENT:
                yield modal.Pause()
                begin = time.perf_counter()
            self._count += 1
            if self.use_pins and pinned[triangles].any():
                self.stayed += 1
                continue
            found = self.place(triangles, old[triangles])
            if found is not None:
                new[triangles] = found
                self.moved += 1
        return new

    def writing(self, ob):
        return mesh_io.writing_uv(ob, self.snapshot, self._loops, self._values)


def notes(tasks: list[MovedTask]) -> str:
    stayed = sum(task.stayed for task in tasks)
    figures = common.figures(tasks)
    return figures + (f", {common.plural(stayed, 'island')} with pins left" if stayed else "")


def centre(uv: np.ndarray) -> np.ndarray:
    """Of the box."""
    flat = uv.reshape(-1, 2)
    return (flat.min(axis=0) + flat.max(axis=0)) / 2


def areas(uv: np.ndarray) -> np.ndarray:
    """(k,) signed, of triangles (k, 3, 2)."""
    a, b = uv[:, 1] - uv[:, 0], uv[:, 2] - uv[:, 0]
    return 0.5 * (a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0])
