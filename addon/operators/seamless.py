# SPDX-License-Identifier: GPL-3.0-or-later
"""Seamless Map (thesis 5, docs/seamless-map.md)."""

import math
from dataclasses import replace

import bpy
import numpy as np

from flipfree.separated import in_unit_square

from .. import solver
from ..meshes import cones, islands, labels, mesh_io, refine, separated, turns
from . import common, cone_sums, match, options, parts

# Quarter turns by which a 32-bit cone angle may be off a whole number.
ROUNDING = 1e-5

CONES = {
    "auto": "Marked or Suggested: Those of the cone groups and `cone_angle`; parts that have none get suggested ones",
    "marked": "Marked: Those of the cone groups and `cone_angle`, and no others",
    "suggested": "Suggested: Placed where the map would scale most, whatever is marked",
}

# Codes of errors where a map was looked for and none was found that can be stored.
NO_MAP = (
    "rounding to 32 bits flips triangles",
    "iteration limit reached",
    "line search stalled",
    "certificate failed",
    "factorization failed",
)

SUGGEST_QUARTERS = "Suggest Cones with 'Quarter Turns'"
BALANCE = f"run {SUGGEST_QUARTERS}, which places them; Mark Cone adds and removes single ones"

BOUNDARIES = {
    "aligned_or_free": "Along the Axes: Boundaries run exactly along u and v, with corners at the boundary vertices that are "
    "marked as cones, or where they bend most. Parts without marks that find no such map have a free boundary, and the "
    "report says so",
    "aligned": "Along the Axes Only: The same, but nothing is changed if a part finds no such map",
    "free": "Free: As near to the surface as the inside allows: least distortion",
}


class SeamlessTask(parts.PartsTask):
    """All connected parts of the faces in one map, each a chart with cones of its own."""

    failed_cure = "take suggested cones with a lower Scale Bound, or clean up thin faces"
    poor_cure = "More cones there even the scale out: lower the Scale Bound, or use Mark Cone"

    cones_from, boundary, bound, engine = "auto", "aligned_or_free", 2.0, "auto"
    optimise = mark_cuts = mark_cones = fit = True

    def __init__(self, snapshot, cone_angles, boundary_vertices, *, meet_pins=False, **options):
        super().__init__(snapshot, **options)
        ob = bpy.data.objects[snapshot.object_name] if meet_pins else None
        self.pin_group = match.group_vertices(ob) if meet_pins else None
        self.pins = {}  # {submesh vertex: (u, v)}
        self.cone_angles = cone_angles  # {submesh vertex: angle}
        self.boundary_vertices = boundary_vertices  # (#Sv,) bool
        self.quarters = {}  # {submesh vertex: quarter turns of its angle}
        self.suggested = {}  # those of them that were not marked
        self.turns = np.zeros(0, np.int32)  # per cut edge of the result
        self.freed_boundaries = 0  # parts that found no map with an aligned boundary
        self.enlarged_islands = 0  # parts that 32 bits would not hold in scale

    @property
    def cures(self):
        return {
            **dict.fromkeys(NO_MAP, self.cure(self.failed_cure)),
            "angles violate Gauss-Bonnet": self.cure(BALANCE),
            "bad pins": "Pin vertices inside: cuts and boundaries stay where they are",
        }

    def cure(self, others: str) -> str:
        """What helps where boundaries that have to be straight may be at fault, and the others."""
        if self.boundary != "free" and self.boundary_vertices.any():
            return f"Choose 'Boundary: Free', or {others}"
        return others[0].upper() + others[1:]

    def start(self):
        if self.pin_group is not None:
            found = islands.islands_of(self.snapshot, np.zeros((0, 2), np.int32))
            islands.collect_pins(self.snapshot, found, self.pin_group)
            self.pins = {int(i.submesh[v]): uv for i in found for v, uv in i.pins.items()}
            match.refuse_without_pins(self.snapshot, self.pins)
        return super().start()

    def stages(self):
        if self.cones_from != "suggested":
            self.quarters = self._marked_quarters()
        components = self.components()
        for triangles in components:
            part, used = self.snapshot.part(triangles)
            if self.cones_from != "marked" and not any(v in self.quarters for v in used.tolist()):
                self.solving = used, triangles
                self.span = (0.0, 0.3)
                found = yield solver.suggest_cones(part, bound=self.bound, quarter_turns=True)
                self._suggest(used, found)
        self.solving = None
        self._refuse_unbalanced(components)
        self.span = (0.3, 0.9)
        found = yield solver.seamless(
            self.snapshot,
            self.quarters,
            **self.values("engine boundary optimise"),
        )
        yield from self.take(found)

    def components(self) -> list[np.ndarray]:
        """Triangles of each connected part."""
        return labels.groups(labels.face_components(self.snapshot.triangles))

    def take(self, found):
        """Last stage: the solver's map, placed as it will be stored, judged there with the cones of `quarters`."""
        uv = in_unit_square(found.uv64) if self.fit else found.uv64
        if self.pins:
            placed = replace(found, uv=uv, uv64=uv, _uv32=uv.astype(np.float32))
            moved = yield solver.with_pins(placed, self.pins)
            # What the seamless solver said of itself holds on.
            found, uv = replace(moved, stats=found.stats), moved.uv64
        self.result = islands.placed(found, uv)
        self.turns = found.transitions.quarter_turns
        self.freed_boundaries = found.stats.get("freed_boundaries", 0)
        self.enlarged_islands = found.stats.get("enlarged_islands", 0)
        # What is written was moved: judged again, as it will be stored.
        self.span = (0.9, 1.0)
        judged = yield solver.certify_seamless(self.result, self.quarters, self.pins)
        common.refuse_uncertified(self.snapshot, judged)
        faces = self.snapshot.triangle_face[found.parent_face]
        self.judge(judged, faces)
        self.island_overlaps = max(judged.island_overlaps, 0)

    def _marked_quarters(self):
        quarters, bad = {}, []
        for vertex, angle in self.cone_angles.items():
            quarter = angle / (math.pi / 2)
            on_boundary = self.boundary_vertices[vertex]
            if on_boundary and self.boundary == "free":
                continue
            if abs(quarter - round(quarter)) > ROUNDING or round(quarter) < 1:
                bad.append(vertex)
            elif on_boundary or round(quarter) != 4:
                quarters[vertex] = round(quarter)
        if bad:
            raise mesh_io.at_vertices(
                self.snapshot,
                bad,
                f"has a cone angle of {math.degrees(self.cone_angles[bad[0]]):.6g} degrees, and seamless maps have multiples of "
                f"90, 90 at least. Run {SUGGEST_QUARTERS}, or take the marks away with Clear Cones or choose 'Cones: Suggested', "
                "and let the cones be suggested",
            )
        return quarters

    def _suggest(self, used, found):
        quarters = {int(used[v]): k for v, k in found.quarter_turns.items() if k != 4}
        if sorted(quarters.values()) == [3, 5] and sum(quarters.values()) == 8:
            quarters = {}  # no torus has these two; without cones there is a map
        self.quarters.update(quarters)
        self.suggested.update(quarters)

    def _refuse_unbalanced(self, components):
        lefts = []
        for triangles in components:
            part, used = self.snapshot.part(triangles)
            if self.boundary_vertices[used].any():
                continue  # a boundary bends as it must; the solver says where corners cannot be
            angles = np.array([self.quarters.get(v, 4) for v in used.tolist()]) * (math.pi / 2)
            flat = np.zeros(len(used), bool)
            lefts.append((triangles, cone_sums.curvature_left(part, angles, flat)))
        cone_sums.refuse_unbalanced(self.snapshot, lefts, SUGGEST_QUARTERS)

    def mark(self, ob):
        """Writes beside the map what the mesh's own vertices and faces shall bear."""
        if self.mark_cones and self.suggested:
            curvature = {int(self.snapshot.vertex_ids[v]): 4 - k for v, k in self.suggested.items()}
            cones.add(ob, curvature)

    def writing(self, ob):
        snapshot, result = separated.on_whole(self.snapshot, self.result)
        new_faces = refine.needs_new_faces(snapshot, result)
        if new_faces:
            refine.check(snapshot, result)
        if mesh_io.counts(ob) == self.snapshot.counts:
            self.mark(ob)  # before the mesh is refined: ids hold still
        wanted = self.turns if self.mark_cuts else None
        if new_faces:
            self.new_vertices = refine.write(
                ob, snapshot, result, mark_cuts=self.mark_cuts, cut_turns=wanted
            )
            return
        yield from super().writing(ob)
        if wanted is not None:
            turns.write(ob, snapshot, result.cut_edges, wanted)


def make_task(snapshot, **options) -> SeamlessTask:
    snapshot = separated.separated(snapshot)
    return SeamlessTask(snapshot, *cone_sums.marked(snapshot), **options)


def summary(tasks: list[SeamlessTask]) -> str:
    """The report line, without the time."""
    chosen = sum(len(t.suggested) for t in tasks)
    return figures(tasks, f" ({chosen} suggested)" if chosen else "")


def figures(tasks: list[SeamlessTask], more: str) -> str:
    """more: said after the number of cones."""
    certificates = [c for t in tasks for c in t.certificates]
    edges = sum(c.seam_edges for c in certificates)
    triangles = sum(c.triangles for c in certificates)
    mean = sum(c.energy * c.triangles for c in certificates) / max(triangles, 1)
    return ", ".join(
        [
            common.plural(sum(t.island_count() for t in tasks), "island"),
            common.plural(sum(len(t.quarters) for t in tasks), "cone") + more,
            f"{sum(c.seams_exact32 for c in certificates)} of {common.plural(edges, 'seam edge')} exact",
            common.plural(sum(max(c.flips32, 0) for c in certificates), "flip"),
            f"distortion mean {mean:.3f} max {max(c.max_energy for c in certificates):.3g} on "
            + common.plural(triangles, "triangle"),
            parts.added(tasks),
        ]
    ) + common.separated_text(certificates)


class UV_OT_flipfree_seamless(options.MapOperator, bpy.types.Operator):
    bl_idname = "uv.flipfree_seamless"
    bl_label = "Seamless Map"
    bl_description = (
        "Map a surface so that across every seam the map only turns by quarters and moves: textures with fourfold "
        "symmetry keep their direction and size. The cut is marked as seams"
    )
    advanced = ("engine",)

    cones_from: options.choice(
        "Cones: Where the map's angles around a vertex are no full turn", CONES
    )
    bound: options.scale_bound(2.0)
    boundary: options.choice("Boundary: Where the surface is open", BOUNDARIES)
    optimise: options.flag("Optimise: Lower the distortion; the seams keep matching", on=True)
    fit: options.fit_unit_square()
    mark_cuts: options.mark_cuts(", with their quarter turns in the attribute `seam_turns`")
    mark_cones: options.flag(
        "Mark Suggested Cones: Put suggested cones into the groups `Cone +1`, `Cone -1`, ...: the next run takes the same ones",
        on=True,
    )
    meet_pins: options.meet_pins()
    engine: options.engine()

    def needs(self):
        return {"bound": self.cones_from != "marked"}

    make_task = staticmethod(make_task)
    summary = staticmethod(summary)
