# SPDX-License-Identifier: GPL-3.0-or-later
"""One mesh in Edit Mode whose map follows its pins.

    last good map --pins have moved--> job: the same pulled to where they are now --met--> last good map, written
                                                                                 --not--> said; the map stays

Jobs are of one island each and start at its last good map, so that the map moves as steadily as the pins do.
"""

import time

import numpy as np

import flipfree

from .. import errors, solver, watch
from ..meshes import labels, mesh_io
from ..runs import processes
from . import edited

# For one update. What takes longer is not met in time, which is said.
SECONDS = 4.0
# A job whose pins have gone on meanwhile is given up after so long.
_STALE = 1.0


class Followed:
    def __init__(self, ob, process=None, *, aspect=1.0):
        """Raises MeshProblem if the mesh cannot be read. process: where its jobs are solved, None: in Blender's own. aspect:
        width over height of the texture on which islands keep their shape."""
        self.name, self.uid = ob.name, watch.uid(ob)
        self.process = process
        self.aspect = aspect
        self.updates = 0
        self.unmet: dict[int, str] = {}  # island -> why its pins cannot be met where they are
        self._job = None  # (job, island, part, key, when it began)
        self._take(mesh_io.read(ob, only_selected=False))
        self._held = edited.held(ob)
        self._stamp = watch.stamp(ob)

    def _take(self, snapshot):
        """From here on the map is what it is now."""
        self.snapshot = snapshot
        self.base = snapshot.uv.copy()  # the last good map, per loop
        self.pinned = snapshot.pinned.copy()  # at the last look
        roots = labels.island_labels(snapshot.triangles, snapshot.corner_uv)
        self.island = np.unique(roots, return_inverse=True)[1].reshape(-1)  # of each triangle
        self._of_loop = np.full(len(self.base), -1)
        self._of_loop[snapshot.triangle_loops] = self.island[:, None]
        self._tried: dict[int, bytes] = {}  # island -> pins of the last job
        self.unmet.clear()

    @property
    def idle(self) -> bool:
        return self._job is None

    @property
    def problem(self) -> str:
        return next(iter(self.unmet.values()), "")

    def tick(self, ob, at_rest: bool) -> bool:
        """Looks once at what has changed; True if something was written. at_rest: no other operator is moving anything."""
        if self._held is None or not self._held.is_valid:  # undo makes another one
            if not at_rest:
                return False
            self._held = edited.held(ob)
        written = self._collect(ob)
        stamp = watch.stamp(ob), at_rest
        if stamp == self._stamp and not written:
            return False
        self._stamp = stamp
        if at_rest and self.idle:
            written |= self._settle(ob)
        if mesh_io.counts(ob)[2:] == self.snapshot.counts[2:]:
            self._follow(*edited.read(ob, self.snapshot.layer_name))
        return written

    def _settle(self, ob) -> bool:
        """What else than pins has changed: a map without flips is the new one, whoever made it; in another, what is not pinned
        goes back to the last good one. True if something was written."""
        now = mesh_io.read(ob, only_selected=False)
        old = self.snapshot
        if (
            now.counts != old.counts
            or now.layer_name != old.layer_name
            or not np.array_equal(now.triangle_loops, old.triangle_loops)
            or not np.array_equal(now.vertices, old.vertices)
        ):
            self._take(now)
            return False
        free = ~now.pinned & (now.uv != self.base).any(axis=1)
        if not free.any():
            return False
        touched = np.isin(self.island, self._of_loop[free])
        if _positive(now.corner_uv[touched]):
            self._take(now)
            return False
        edited.write(ob, old.layer_name, self.base, free)
        return True

    def _follow(self, uv, pinned):
        """Starts a job for an island whose pins are elsewhere than in the last good map."""
        moved = pinned & (uv != self.base).any(axis=1) & (self._of_loop >= 0)
        freed = self.pinned & ~pinned & (self._of_loop >= 0)
        away = set(np.unique(self._of_loop[moved | freed]).tolist())
        for island in self.unmet.keys() - away:
            del self.unmet[island]
        for island in self._tried.keys() - away:
            del self._tried[island]
        if not self.idle:
            job, island, _, key, began = self._job
            stale = self._key(island, uv, pinned) != key
            if stale and time.perf_counter() - began > _STALE:
                job.cancel()
            return
        for island in sorted(away):
            key = self._key(island, uv, pinned)
            if self._tried.get(island) != key and pinned[self._of_loop == island].any():
                self._start(island, uv, pinned, key)
                break
        else:
            self.pinned = pinned

    def _key(self, island, uv, pinned) -> bytes:
        of = pinned & (self._of_loop == island)
        return np.flatnonzero(of).tobytes() + uv[of].tobytes()

    def _start(self, island, uv, pinned, key):
        self._tried[island] = key
        part, _ = self.snapshot.part(np.flatnonzero(self.island == island))
        loops = part.triangle_loops
        start = self.base[loops].astype(np.float64)
        rows, corners = np.nonzero(pinned[loops])
        targets = uv[loops[rows, corners]].astype(np.float64)
        if not np.isfinite(targets).all():
            self.unmet[island] = f"{self.name}: a pinned UV is no number. Unpin it with Alt P"
            return
        places, at = np.unique(self.base[loops[rows, corners]], axis=0, return_index=True)
        if len(places) == 1:  # the island goes with it, as it is
            start += targets[at[0]] - start[rows[at[0]], corners[at[0]]]
        keys = zip(rows.tolist(), corners.tolist(), strict=True)
        pins = dict(zip(keys, map(tuple, targets.tolist()), strict=True))
        with processes.within(self.process):
            try:
                job = solver.improve(
                    (part.vertices, part.triangles, start),
                    pins=pins,
                    iterations=0 if len(places) == 1 else 200,
                    max_seconds=SECONDS,
                    aspect=self.aspect,
                )
            except flipfree.FlipfreeError as error:
                self._failed(island, part, error)
                return
        self._job = job, island, part, key, time.perf_counter()

    def _collect(self, ob) -> bool:
        """Takes the result of a job that has ended and writes it; True if it did."""
        if self._job is None or not self._job[0].wait(0.0):
            return False
        (job, island, part, _, _), self._job = self._job, None
        self._stamp = None  # pins may have gone on meanwhile
        if mesh_io.counts(ob) != self.snapshot.counts:
            return False
        try:
            loops, values = mesh_io.loop_values(part, job.result().uv32())
        except flipfree.Cancelled:
            self._tried.pop(island, None)
            return False
        except flipfree.FlipfreeError as error:
            self._failed(island, part, error)
            return False
        self.unmet.pop(island, None)
        self.base[loops] = values
        uv, pinned = edited.read(ob, self.snapshot.layer_name)
        changed = ~pinned & (uv != self.base).any(axis=1) & (self._of_loop == island)
        edited.write(ob, self.snapshot.layer_name, self.base, changed)
        self.pinned[loops] = pinned[loops]
        self.updates += 1
        return True

    def _failed(self, island, part, error):
        if isinstance(error, flipfree.NotConverged) and error.code == "time limit reached":
            self.unmet[island] = f"{self.name}: no map was found within {SECONDS:g} seconds"
        elif isinstance(error, flipfree.NotConverged | flipfree.Infeasible):
            self.unmet[island] = f"{self.name}: these pins cannot be met with the mesh's own faces"
        else:
            self.unmet[island] = str(errors.from_solver(part, error))

    def restore(self, ob) -> bool:
        """Islands whose pins are not met get their last good map, with the pins of that; True if there were some."""
        away = list(self.unmet) + ([] if self._job is None else [self._job[1]])
        self.close()
        loops = np.flatnonzero(np.isin(self._of_loop, away))
        if len(loops) and mesh_io.counts(ob) == self.snapshot.counts:
            mesh_io.write_uv(ob, self.snapshot, loops, self.base[loops])
        return len(loops) > 0

    def close(self):
        """No solver thread outlives the session."""
        self._held = None
        if self._job is not None:
            self._job[0].cancel()
            self._job[0].wait(10.0)
            self._job = None


def _positive(uv: np.ndarray) -> bool:
    """Whether no triangle (k, 3, 2) seems flipped or flat; the solver judges exactly."""
    a, b = (uv[:, k].astype(np.float64) - uv[:, 0] for k in (1, 2))
    return bool((a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0] > 0.0).all())
