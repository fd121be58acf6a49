# SPDX-License-Identifier: GPL-3.0-or-later
"""Seam islands of a snapshot as meshes of their own, and their refined maps put together again.

    Snapshot --islands_of--> [Island] --solver, one by one--> [Piece] --combine--> Combined, in the snapshot's numbers

The solver of one island may add vertices on its rim. If that is a seam, the faces across it, of another island or of the
same one, get the same points: `combine` splits them there, each side with UVs of its own, so that the mesh stays closed.
"""

from dataclasses import dataclass, field

import numpy as np

from flipfree.separated import boundary_loops, joined

from . import labels, mesh_io

_SIDES = ((0, 1), (1, 2), (2, 0))


class Island:
    """One seam island as a mesh of its own. Its vertices differ from the submesh's where it lies on both sides of a seam."""

    def __init__(self, snapshot, triangles: np.ndarray, split: np.ndarray, origin: np.ndarray):
        """split (#St, 3), origin (n,): the snapshot's triangles cut apart along its seams (mesh_io.split_fans)."""
        self.triangles = triangles  # ids of the snapshot's triangles
        used, compact = np.unique(split[triangles], return_inverse=True)
        self.faces = compact.reshape(-1, 3).astype(np.int32)
        self.submesh = origin[used]
        self.vertices = snapshot.vertices[self.submesh]
        self.pins: dict[int, tuple[float, float]] = {}

    def boundary_loops(self) -> list[list[int]]:
        """Vertices of each loop in order, the surface on the left; the longest loop in space first."""
        return sorted(boundary_loops(self.faces), key=lambda loop: -self._length(loop))

    def _length(self, loop: list[int]) -> float:
        points = self.vertices[loop]
        return float(np.linalg.norm(points - np.roll(points, -1, axis=0), axis=1).sum())

    def genus(self, loops: int) -> int:
        euler = len(self.vertices) - len(self.edges()) + len(self.faces)
        return (2 - loops - euler) // 2

    def edges(self) -> np.ndarray:
        """(e, 2) island vertices, lower first, each once."""
        return labels.edges_of(self.faces)[0]


def seam_islands(snapshot) -> np.ndarray:
    """(#St,) smallest triangle of each triangle's seam island."""
    return labels.face_components(mesh_io.split_fans(snapshot.triangles, snapshot.cuts)[0])


def islands_of(snapshot, cuts: np.ndarray | None = None) -> list[Island]:
    """Islands by their first triangle. cuts: (s, 2) submesh vertex pairs; default the snapshot's seams."""
    cuts = snapshot.cuts if cuts is None else cuts
    split, origin = mesh_io.split_fans(snapshot.triangles, cuts)
    found = labels.groups(labels.face_components(split))
    return [Island(snapshot, triangles, split, origin) for triangles in found]


def problem_at(snapshot, island: Island, vertices, why: str) -> mesh_io.MeshProblem:
    """To be raised: about these vertices of the island."""
    return mesh_io.at_vertices(snapshot, island.submesh[vertices], why)


def chains_of(snapshot, island: Island, marked: np.ndarray, *, what: str, ends=()) -> list:
    """Paths along edges of the mesh with these keys, in the island's own vertices: along a seam there is one on either side.
    They end where no marked edge goes on, and at the vertices `ends`. what: how the edges were marked. Raises MeshProblem
    where three meet, and for rings."""
    edges = island.edges()
    in_mesh = snapshot.vertex_ids[island.submesh[edges]]
    near: dict[int, list[int]] = {}
    for a, b in edges[np.isin(labels.edge_keys(in_mesh), marked)].tolist():
        near.setdefault(a, []).append(b)
        near.setdefault(b, []).append(a)
    crossing = [v for v, others in near.items() if len(others) > 2 and v not in ends]
    if crossing:
        why = f"joins more than two {what} edges. Take one chain at a time"
        raise problem_at(snapshot, island, crossing, why)
    found, done = [], set()
    stops = {v for v, others in near.items() if len(others) != 2 or v in ends}
    for start in sorted(stops):
        for second in near[start]:
            if (start, second) in done:
                continue
            chain = [start, second]
            while chain[-1] not in stops:
                chain.append(next(w for w in near[chain[-1]] if w != chain[-2]))
            done |= {(start, second), (chain[-1], chain[-2])}
            found.append(chain)
    rings = set(near) - {v for chain in found for v in chain}
    if rings:
        why = f"lies on a closed ring of {what} edges, which has no ends. Leave out one of them"
        raise problem_at(snapshot, island, sorted(rings), why)
    return found


def collect_pins(snapshot, found: list[Island], vertices, *, pinned=True) -> None:
    """Gives islands their pins: the pinned corners, unless not asked for, and all corners at these mesh vertices. Two places
    for one vertex are refused by name."""
    for island in found:
        loops = snapshot.triangle_loops[island.triangles]
        mesh_vertices = snapshot.vertex_ids[island.submesh]
        chosen = np.isin(mesh_vertices[island.faces], vertices)
        if pinned:
            chosen |= snapshot.pinned[loops]
        rows, corners = np.nonzero(chosen)
        for row, corner in zip(rows.tolist(), corners.tolist(), strict=True):
            vertex = int(island.faces[row, corner])
            target = tuple(map(float, snapshot.uv[loops[row, corner]]))
            if not np.isfinite(target).all():
                why = "has a pinned UV that is no number. Unpin it with Alt P"
                raise problem_at(snapshot, island, [vertex], why)
            if island.pins.setdefault(vertex, target) != target:
                why = "is pinned to two places in one island. Mark a seam between them, or unpin one with Alt P"
                raise problem_at(snapshot, island, [vertex], why)


@dataclass
class Piece:
    """A map of some of the snapshot's triangles, perhaps refined; numbers are its own."""

    triangles: np.ndarray  # (#pt,) ids of the snapshot's triangles
    submesh: np.ndarray  # (#pv,) submesh vertex of each of the piece's vertices before refinement
    result: object  # flipfree.Parametrization


@dataclass
class Combined:
    """A map of the whole snapshot in the shape of flipfree.Parametrization, as refine.write takes it."""

    vertices: np.ndarray
    faces: np.ndarray
    parent_face: np.ndarray
    vertex_parent: np.ndarray
    vertex_barycentric: np.ndarray
    cut_edges: np.ndarray
    uv: np.ndarray  # (m', 3, 2) float64
    stored: np.ndarray  # (m', 3, 2) float32
    # triangles of the snapshot that were split because of a vertex across a seam
    seam_triangles: np.ndarray = field(default_factory=lambda: np.zeros(0, np.int64))
    # cuts along diagonals of faces split these, although UVs are not torn there
    split_cuts: bool = False

    def uv32(self) -> np.ndarray:
        return self.stored


def placed(found, uv: np.ndarray, **more) -> Combined:
    """A solver's map of a whole snapshot, with other UVs (m', 3, 2)."""
    names = "vertices faces parent_face vertex_parent vertex_barycentric cut_edges".split()
    kept = {name: getattr(found, name) for name in names}
    return Combined(**kept, uv=uv, stored=uv.astype(np.float32), **more)


def combine(snapshot, pieces: list[Piece], cut_edges: np.ndarray | None = None) -> Combined:
    """One map over the snapshot; triangles of no piece keep their UVs. cut_edges: (s, 2) submesh pairs that were cut; default:
    those of the pieces."""
    rows = [(piece.triangles, piece.submesh, piece.result) for piece in pieces]
    found = joined(snapshot.vertices, rows, "uv")
    found["stored"] = np.concatenate([piece.result.uv32() for piece in pieces])
    rest = np.setdiff1d(np.arange(len(snapshot.triangles)), found["parent_face"])
    left = {"faces": snapshot.triangles[rest], "parent_face": rest}
    left["uv"] = left["stored"] = snapshot.corner_uv[rest]
    order = np.argsort(np.concatenate([found["parent_face"], rest]), kind="stable")
    for name, values in left.items():
        found[name] = np.concatenate([found[name], values.astype(found[name].dtype)])[order]
    if cut_edges is not None:
        found["cut_edges"] = cut_edges
    combined = Combined(**found)
    close_seams(snapshot, combined)
    return combined


def _rim_points(snapshot, combined) -> dict[tuple[int, int], list[tuple[float, int]]]:
    """New vertices on edges of the snapshot: {(i, j), i < j: [(share of the way from i to j, vertex), ...] in order}."""
    points: dict[tuple[int, int], list[tuple[float, int]]] = {}
    for v in range(len(snapshot.vertices), len(combined.vertices)):
        weights = combined.vertex_barycentric[v]
        support = np.flatnonzero(weights != 0.0)
        if len(support) != 2:
            continue
        corners = snapshot.triangles[combined.vertex_parent[v]][support]
        first, second = support if corners[0] < corners[1] else support[::-1]
        key = (int(min(corners)), int(max(corners)))
        share = float(weights[second] / (weights[first] + weights[second]))
        points.setdefault(key, []).append((share, v))
    return {key: sorted(found) for key, found in points.items()}


def close_seams(snapshot, combined) -> None:
    """Gives every triangle beside an edge with new vertices all of these."""
    points = _rim_points(snapshot, combined)
    if not points:
        return
    # Two islands may have split a seam at one place, as Blender stores it: one vertex then.
    same, parent = np.arange(len(combined.vertices)), combined.vertex_parent
    stored = combined.vertices.astype(np.float32)
    for key, found in points.items():
        kept = [found[0]]
        for share, vertex in found[1:]:
            last = kept[-1]
            if (stored[vertex] == stored[last[1]]).all() and parent[vertex] != parent[last[1]]:
                same[vertex] = last[1]
            else:
                kept.append((share, vertex))
        points[key] = kept
    combined.faces = same[combined.faces].astype(np.int32)

    beside: dict[tuple[int, int], list[int]] = {key: [] for key in points}
    wanted = labels.edge_keys(np.array(list(points)))
    for k, m in _SIDES:
        ends = snapshot.triangles[:, (k, m)]
        for t in np.flatnonzero(np.isin(labels.edge_keys(ends), wanted)).tolist():
            beside[int(ends[t].min()), int(ends[t].max())].append(t)
    near = np.isin(combined.parent_face, np.unique(np.concatenate(list(beside.values()))))
    children: dict[int, list] = {}
    for child in np.flatnonzero(near).tolist():
        own = combined.faces[child].tolist(), combined.uv[child], combined.stored[child]
        corners = list(zip(*own, strict=True))
        children.setdefault(int(combined.parent_face[child]), []).append(corners)
    touched = set()
    for (i, j), found in points.items():
        share = {i: 0.0, j: 1.0, **{v: s for s, v in found}}
        for t in beside[i, j]:
            for _, vertex in found:
                if _insert(children[t], share, vertex):
                    touched.add(t)
    _drop_unused(combined, same, children, near, touched)


def _insert(children: list, share: dict[int, float], vertex: int) -> bool:
    """Splits that child whose side contains the place of `vertex` on the edge, unless a child has the vertex already."""
    for corners in children:
        if any(corner[0] == vertex for corner in corners):
            return False
    place = share[vertex]
    for at, corners in enumerate(children):
        for k, m in _SIDES:
            (a, uv_a, _), (b, uv_b, _) = corners[k], corners[m]
            if a not in share or b not in share:
                continue
            low, high = sorted((share[a], share[b]))
            if not low < place < high:
                continue
            step = (place - share[a]) / (share[b] - share[a])
            middle = uv_a * (1.0 - step) + uv_b * step
            new = (vertex, middle, middle.astype(np.float32))
            apex = corners[3 - k - m]
            children[at : at + 1] = [[corners[k], new, apex], [new, corners[m], apex]]
            return True
    raise mesh_io.MeshProblem("a new vertex on a seam has no place on the other side")


def _drop_unused(combined, same, children, near, touched) -> None:
    """Rebuilds the arrays from the split children, without the vertices that became others."""
    corners = [c for found in children.values() for child in found for c in child]
    parents = np.array([t for t, found in children.items() for _ in found], np.int64)
    parent_face = np.concatenate([combined.parent_face[~near], parents])
    order = np.argsort(parent_face, kind="stable")

    def rebuilt(old, at, *shape):
        new = np.array([c[at] for c in corners], old.dtype).reshape(-1, *shape)
        return np.concatenate([old[~near], new])[order]

    faces = rebuilt(combined.faces, 0, 3)
    combined.uv = rebuilt(combined.uv, 1, 3, 2)
    combined.stored = rebuilt(combined.stored, 2, 3, 2)
    combined.parent_face = parent_face[order]
    kept = same == np.arange(len(same))
    combined.faces = (np.cumsum(kept) - 1)[faces].astype(np.int32)
    combined.vertices = combined.vertices[kept]
    combined.vertex_parent = combined.vertex_parent[kept]
    combined.vertex_barycentric = combined.vertex_barycentric[kept]
    combined.seam_triangles = np.array(sorted(touched), np.int64)


def turned_like(uv: np.ndarray, like: np.ndarray, where: np.ndarray) -> np.ndarray:
    """uv (m, 3, 2) turned and scaled about the origin to what fits `like` best at the corners `where` (m, 3), whatever place
    that is at; unchanged if `like` has no size or no direction."""
    ours = uv[where] @ [1.0, 1.0j]
    theirs = like[where].astype(np.float64) @ [1.0, 1.0j]
    factor = np.vdot(ours - ours.mean(), theirs - theirs.mean())
    factor /= max(np.linalg.norm(ours - ours.mean()) ** 2, np.finfo(float).tiny)
    if not (np.isfinite(factor) and 1e-6 < abs(factor) < 1e6):
        return uv
    product = (uv @ [1.0, 1.0j]) * factor
    return np.stack([product.real, product.imag], axis=-1)
