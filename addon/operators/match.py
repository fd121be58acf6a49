# SPDX-License-Identifier: GPL-3.0-or-later
"""Match Pins: pinned UVs met bit for bit without a fold, subdividing where that is needed (thesis 3.3, docs/match-pins.md)."""

from dataclasses import dataclass, field, replace

import bpy
import numpy as np

from flipfree.calls.matching import edges_between_pins, held_by_pins

from .. import solver, texture
from ..meshes import islands, labels, marks, mesh_io, refine, selection, separated
from . import common, layout, options, parts

GROUP = refine.PIN_GROUP
MOVABLE = refine.MOVABLE_GROUP

REST = {
    "keep": "Stay: Islands without pins keep their UVs",
    "unwrap": "Unwrap: Islands without pins are unwrapped. They keep their places if these are free, or else are packed "
    "beside the others",
}


@dataclass
class Marked:
    """What the mesh says besides pins: mesh vertices whose targets on the outline are only where they begin; keys of edges
    (labels.edge_keys) that are part of lines, and of paths."""

    movable: np.ndarray = field(default_factory=lambda: np.zeros(0, np.int64))
    lines: np.ndarray = field(default_factory=lambda: np.zeros(0, np.int64))
    paths: np.ndarray = field(default_factory=lambda: np.zeros(0, np.int64))


class MatchTask(parts.PartsTask):
    poor_cure = "Move pins nearer to where their surroundings are, or mark seams there"

    bijective = straight_lines = may_add = True
    cut_open, rest = False, "keep"
    max_seconds = options.MAX_SECONDS
    aspect = 1.0

    def __init__(self, snapshot, group_vertices, *, marked=None, **given):
        super().__init__(snapshot, **given)
        self.marked = marked or Marked()
        self.group_vertices = group_vertices  # mesh vertices of the group `Pins`
        self.charts = 0
        self.hurried = 0  # islands whose map could be better with more time
        self._cuts = np.zeros((0, 2), np.int32)  # added, as submesh pairs
        self._outline_vertices = np.zeros(0, np.int64)  # of the island being solved

    def stages(self):
        pinned, free = yield from self._sort_islands()
        pieces = []
        for island in pinned:
            if len(island.pins) == 1 and not self._may_move(island):
                pieces.append((yield from self._moved(island)))
                continue
            request = self._request(island)
            outline = request["boundary_loop"] or list(island.pins)
            self.solving = island.submesh, island.triangles
            self._outline_vertices = island.submesh[outline]
            result = yield solver.match(island, max_seconds=self.max_seconds, **request)
            if self.aspect != 1.0:
                result = yield from self._on_texture(island, request, result)
            self.hurried += int(result.stats.get("time_limit_reached", 0))
            pieces.append(islands.Piece(island.triangles, island.submesh, self._counted(result)))
        if self.rest == "unwrap" and free:
            triangles = np.sort(np.concatenate([island.triangles for island in free]))
            result, used = yield from self._unwrap(triangles)
            result = yield layout.pack_beside(
                self.snapshot, triangles, result, pieces, aspect=self.aspect
            )
            pieces.append(islands.Piece(triangles, used, self._counted(result)))
        self.result = islands.combine(self.snapshot, pieces, self._cuts)
        if len(self.result.seam_triangles):
            yield from self._check_seams(pieces)
        if not self.may_add:
            self._refuse_new_faces()
        yield from self.look_at_islands()

    def _on_texture(self, island, request, result):
        """The same with its shape on the texture, as far as pins, and lines between two of them, leave it open."""
        pinned = np.zeros(len(island.vertices), bool)
        pinned[[*island.pins, *(v for line, _ in request["lines"] for v in line)]] = True
        found = yield solver.improve(
            (result.vertices, result.faces, result.uv),
            pins=held_by_pins(result, island.faces, pinned),
            bijective=request["bijective"],
            repair=False,
            **self.values("aspect max_seconds"),
        )
        measured = result.certificate.provenance_failures
        return result.at(
            found, certificate=replace(found.certificate, provenance_failures=measured)
        )

    def _refuse_new_faces(self):
        """Raises MeshProblem if the map needs more than the mesh's own faces, and says how much."""
        count = len(self.result.vertices) - len(self.snapshot.vertices)
        faces = np.array(sorted(refine.plan(self.snapshot, self.result).children), np.int64)
        if count == 0 and len(faces) == 0:
            return
        new = common.plural(count, "new vertex", "new vertices")
        raise mesh_io.MeshProblem(
            f"{self.snapshot.object_name}: the pins cannot be met without {new if count else 'splitting'} in "
            f"{common.plural(len(faces), 'face')}, the first is face {faces[0]}. Turn on May Add Vertices in the redo "
            "panel, or move pins nearer to where their surroundings are",
            "face",
            faces,
        )

    def island_count(self) -> int:
        return self.charts

    def _sort_islands(self):
        """(islands with pins, islands without); closed ones are refused, or cut open first."""
        found = islands.islands_of(self.snapshot)
        self._collect_pins(found)
        refuse_without_pins(self.snapshot, any(island.pins for island in found))
        closed = [island for island in found if island.pins and self._needs_cut(island)]
        if closed:
            triangles = np.sort(np.concatenate([island.triangles for island in closed]))
            result, used = yield from self._unwrap(triangles)
            self._cuts = np.setdiff1d(
                used[result.cut_edges] @ [1 << 32, 1],
                np.sort(self.snapshot.cuts, axis=1).astype(np.int64) @ [1 << 32, 1],
            )
            self._cuts = np.column_stack([self._cuts >> 32, self._cuts & 0xFFFFFFFF])
            found = islands.islands_of(
                self.snapshot, np.concatenate([self.snapshot.cuts, self._cuts])
            )
            self._collect_pins(found)
        return [i for i in found if i.pins], [i for i in found if not i.pins]

    def _needs_cut(self, island) -> bool:
        """Whether no flat piece is like this island. Raises MeshProblem, naming it, unless it may be cut."""
        loops = len(island.boundary_loops())
        if loops and island.genus(loops) == 0:
            return False
        if self.cut_open:
            return True
        handles = common.plural(island.genus(loops), "handle")
        refuse_island(
            self.snapshot,
            island,
            f"{'has ' + handles if loops else 'is closed'} and cannot be flattened in one piece. Mark seams that open "
            "it, or turn on Cut Open in the redo panel",
        )

    def _moved(self, island):
        """The piece of an island with one pin: unwrapped as it lies, in its size and direction, and moved to the pin. One pin
        alone leaves both open, and a map of another size would be a surprise."""
        self.solving = island.submesh, island.triangles
        result = yield solver.unwrap_island(island, bijective=self.bijective)
        ((vertex, target),) = island.pins.items()
        pinned = island.faces == vertex
        seen = np.array([self.aspect, 1.0])
        uv = result.uv - result.uv[pinned][0]
        uv = islands.turned_like(uv, self.snapshot.corner_uv[island.triangles] * seen, ~pinned)
        uv = uv / seen + np.array(target)
        corners = np.argwhere(pinned).tolist()
        # It meets its pin already: it is rounded and certified.
        result = yield solver.improve(
            (island.vertices, island.faces, uv),
            pins={(f, k): target for f, k in corners},
            repair=False,
            iterations=0,
            **self.values("bijective aspect"),
        )
        return islands.Piece(island.triangles, island.submesh, self._counted(result))

    def _unwrap(self, triangles):
        """(result of unwrapping these triangles, submesh vertex of each of its vertices)."""
        part, used = self.snapshot.part(triangles)
        self.solving = used, triangles
        result = yield solver.unwrap(
            part,
            pins={},
            seams="given",
            bijective=self.bijective,
            may_add_cuts=False,
            cut_extremities=False,
            margin=texture.margin(),
            keep_places=False,
            effort=0.0,  # packed beside the others
        )
        return result, used

    def _collect_pins(self, found):
        islands.collect_pins(self.snapshot, found, self.group_vertices)

    def _request(self, island) -> dict:
        """Pins in the solver's terms: the whole boundary if all of it is pinned, lines, points."""
        points = dict(island.pins)
        outline = self._outline(island)
        request = {"boundary_loop": None, "boundary_uv": None, "bijective": self.bijective}
        if outline is not None:
            begin = np.empty((len(island.vertices), 2))
            begin[island.faces] = self.snapshot.corner_uv[island.triangles]
            request["boundary_loop"] = outline
            request["boundary_uv"] = [points.pop(v, tuple(begin[v].tolist())) for v in outline]
            request["movable"] = [v for v in outline if v not in island.pins]
            request["bijective"] = False  # the targets say whether it overlaps itself
        lines = self._lines(island, points, outline or []) if self.straight_lines else []
        request["lines"] = [(c, (island.pins[c[0]], island.pins[c[-1]])) for c in lines]
        request["paths"] = self._paths(island, outline)
        request["points"] = points
        return request

    def _may_move(self, island) -> set[int]:
        ids = self.snapshot.vertex_ids[island.submesh]
        return set(np.flatnonzero(np.isin(ids, self.marked.movable)).tolist()) - set(island.pins)

    def _outline(self, island) -> list[int] | None:
        """The loop that the whole outline is prescribed by: all pinned, or movable from where they are; of several loops, one
        that runs as an outline does."""
        loops = island.boundary_loops()
        movable = self._may_move(island)
        for loop in loops:
            lost = [v for v in loop if v not in island.pins and v not in movable]
            if lost and movable.intersection(loop):
                why = f"is neither pinned nor in the group '{MOVABLE}', as others of its boundary are. Pin it with P"
                raise islands.problem_at(self.snapshot, island, lost, why)
        placed = movable | set(island.pins)
        whole = [loop for loop in loops if placed.issuperset(loop)]
        if len(loops) == 1:
            return whole[0] if whole else None
        for loop in whole:
            uv = np.array([island.pins.get(v, (np.nan, np.nan)) for v in loop])
            uv = uv[np.isfinite(uv).all(axis=1)]
            following = np.roll(uv, -1, axis=0)
            if float(np.sum(uv[:, 0] * following[:, 1] - uv[:, 1] * following[:, 0])) > 0.0:
                return loop
        return None

    def _paths(self, island, outline) -> dict[int, list[int]]:
        """{pinned vertex: marked vertices from it to the outline}"""
        rim = {v for loop in island.boundary_loops() for v in loop}
        ends = rim | set(island.pins)
        found = {}
        keys = self.marked.paths
        for chain in islands.chains_of(self.snapshot, island, keys, what="path's", ends=ends):
            path = chain if chain[-1] in rim else chain[::-1]
            if path[-1] not in rim or path[0] in rim or path[0] not in island.pins:
                why = "is the end of a marked path, which has to lead from a pin inside to the boundary"
                raise islands.problem_at(self.snapshot, island, [chain[0], chain[-1]], why)
            if outline is None:
                why = "is where a marked path begins, but the outline is not pinned: its sheets are unknown"
                raise islands.problem_at(self.snapshot, island, [path[0]], why)
            found[path[0]] = path
        return found

    def _lines(self, island, points, outline: list) -> list[list[int]]:
        """Marked lines from pin to pin, and mesh edges between pinned vertices that are to stay straight."""
        rim = {frozenset(side) for side in zip(outline, outline[1:] + outline[:1], strict=True)}
        chains = []
        for chain in islands.chains_of(
            self.snapshot, island, self.marked.lines, what="line's", ends=island.pins
        ):
            loose = [v for v in (chain[0], chain[-1]) if v not in island.pins]
            if loose:
                why = "is the end of a marked line and not pinned. Pin it with P"
                raise islands.problem_at(self.snapshot, island, loose, why)
            if len(chain) > 2 and not rim.issuperset(
                map(frozenset, zip(chain, chain[1:], strict=False))
            ):
                chains.append(chain)
        edges = island.edges()
        in_mesh = self.snapshot.vertex_ids[island.submesh[edges]]
        real = np.isin(labels.edge_keys(in_mesh), labels.edge_keys(self.snapshot.edges))
        return chains + edges_between_pins(island.faces, edges[real], list(island.pins), outline)

    def explain(self, error):
        """As in PartsTask; contradictions without a place are about the outline."""
        outlines = ("contradictory pins", "polygon is not weakly self-overlapping")
        if not len(error.elements) and error.code in outlines:
            error.kind, error.elements = "vertex", self._outline_vertices.tolist()
            return
        super().explain(error)

    def _counted(self, result):
        self.charts += int(result.stats.get("charts", 1))
        return self.checked(result)

    def _check_seams(self, pieces):
        """Pieces whose rims got vertices from across a seam are certified again, as they are stored now."""
        result = self.result
        for piece in pieces:
            if not np.isin(result.seam_triangles, piece.triangles).any():
                continue
            chosen = np.isin(result.parent_face, piece.triangles)
            certificate = yield solver.certify_arrays(
                result.vertices,
                result.faces[chosen],
                result.stored[chosen],
                bijective=self.bijective and piece.result.certificate.overlaps == 0,
            )
            if not certificate.ok:
                raise mesh_io.MeshProblem(
                    f"{self.snapshot.object_name}: a seam could not be subdivided on both sides: "
                    f"{'; '.join(certificate.failures)}. Subdivide it by hand, or move a pin"
                )


def summary(tasks: list[MatchTask]) -> str:
    """The report line, without the time."""
    text = common.figures(tasks, sum(task.island_overlaps for task in tasks))
    hurried = sum(task.hurried for task in tasks)
    if hurried:
        text += f", {common.plural(hurried, 'island')} stopped at the time limit"
    return f"{text}, {parts.added(tasks)}{common.texture_text(tasks[0].aspect)}"


def make_task(snapshot, **options) -> MatchTask:
    snapshot = separated.separated(snapshot)
    ob = bpy.data.objects[snapshot.object_name]
    marked = Marked(
        selection.in_group(ob, MOVABLE),
        marks.chain_keys(ob, snapshot, "line"),
        marks.chain_keys(ob, snapshot, "path"),
    )
    return MatchTask(snapshot, group_vertices(ob), marked=marked, **options)


class UV_OT_flipfree_match(
    options.NoOverlaps,
    options.TimeLimit,
    options.CorrectAspect,
    options.UseModifiers,
    options.MapOperator,
    bpy.types.Operator,
):
    bl_idname = "uv.flipfree_match"
    bl_label = "Match Pins"
    bl_description = (
        "Map every island with pins so that pinned UVs keep their place exactly and nothing folds; "
        "triangles are subdivided only where no other way is left"
    )
    needs_uv = True
    option_names = (
        "bijective may_add straight_lines cut_open rest correct_aspect max_seconds use_modifiers"
    ).split()

    may_add: options.flag(
        "May Add Vertices: Triangles are subdivided where the pins leave no other way. Off: the mesh stays as it is, and pins "
        "that cannot be met then are refused",
        on=True,
    )
    straight_lines: options.flag(
        "Straight Lines: Marked lines run straight from pin to pin, and edges between two pinned vertices stay straight, even "
        "where triangles beside them are subdivided",
        on=True,
    )
    cut_open: options.flag(
        "Cut Open: Pinned islands that are closed or have handles are cut open, and the cuts marked as seams"
    )
    rest: options.choice("Other Islands", REST)

    make_task = staticmethod(make_task)
    summary = staticmethod(summary)


def refuse_without_pins(snapshot, pins):
    """Raises MeshProblem if there are none."""
    if not pins:
        raise mesh_io.MeshProblem(
            f"{snapshot.object_name}: no UV is pinned. Pin some with P in the UV editor, or put vertices "
            f"into the group '{GROUP}'"
        )


def refuse_island(snapshot, island, what: str):
    """Raises MeshProblem, naming the island."""
    faces = np.unique(snapshot.triangle_face[island.triangles])
    raise mesh_io.MeshProblem(
        f"{snapshot.object_name}: the island of face {faces[0]} ({common.plural(len(faces), 'face')}) {what}",
        "face",
        faces,
    )


def group_vertices(ob) -> np.ndarray:
    """Mesh vertices of the group `Pins`."""
    return selection.in_group(ob, GROUP)
