"""A map of any triangles, clean surface or not: is every face mapped, one side up within each island, no point covered twice?

Shares no code with the certificate, nor with what separates meshes: faces are joined wherever they share an edge and its two
UVs, however many there are, and everything is decided triangle by triangle.
"""

from __future__ import annotations

from collections import Counter, defaultdict

import numpy as np
import numpy.typing as npt

from .coverage import overlapping_triangles
from .exact import turns


def judge_any(faces: npt.ArrayLike, uv: npt.ArrayLike, *, disjoint: bool = True) -> list[str]:
    """What is wrong with the map, in words; empty if nothing is. Faces (m, 3), corner UVs (m, 3, 2). Faces that use a vertex
    twice need finite UVs only. Cost: pairs of triangles whose boxes meet."""
    corners = np.asarray(faces)
    points = np.asarray(uv).astype(np.float64)
    if not np.isfinite(points).all():
        return ["a coordinate is not finite"]
    solid = np.array([len(set(face)) == 3 for face in corners.tolist()], bool)
    orientation = turns(points[:, 0], points[:, 1], points[:, 2])
    wrong = []
    flat = np.flatnonzero(solid & (orientation == 0))
    if len(flat):
        wrong.append(f"{len(flat)} triangles without area, first {flat[0]}")
    sides = defaultdict(list)
    for f in np.flatnonzero(solid).tolist():
        for k in range(3):
            a, b = corners[f, k], corners[f, (k + 1) % 3]
            p, q = points[f, k].tolist(), points[f, (k + 1) % 3].tolist()
            forward = a < b
            key = (min(a, b), max(a, b), *(p + q if forward else q + p))
            # On which side of the edge, from its lower vertex to the higher one, the face lies in the map.
            sides[key].append((orientation[f] if forward else -orientation[f], f))
    # Where sheets may lie on each other, of three faces at an edge any two may be on one side, and so may two faces of the same
    # vertices.
    at_edge = Counter(key[:2] for key, side in sides.items() for _ in side)

    def may_be_stacked(key: tuple, side: list[tuple[int, int]]) -> bool:
        same = len({frozenset(corners[f].tolist()) for _, f in side}) == 1
        return not disjoint and (at_edge[key[:2]] > 2 or same)

    folded = sum(
        1
        for key, side in sides.items()
        if len({s for s, _ in side}) < len(side) and not may_be_stacked(key, side)
    )
    if folded:
        wrong.append(f"{folded} edges with two faces of one island on the same side")
    if disjoint:
        pairs = overlapping_triangles(points, np.where(solid, orientation, 0).astype(np.int8))
        if len(pairs):
            wrong.append(f"{len(pairs)} pairs of triangles overlap, first {pairs[0].tolist()}")
    return wrong
