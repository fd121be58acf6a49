"""Does a map cover a point twice? Decided exactly, triangle by triangle, for charts and between charts.

Shares no code with the certificate, which looks at boundary curves only: here all pairs of triangles whose boxes meet are
separated by the line of an edge or not (two convex polygons with interiors that share no point always are).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from .boxes import meeting_boxes
from .charts import Charts, charts_of
from .exact import Floats, Signs, turns

Ints = npt.NDArray[np.integer]
_CHUNK = 200_000


@dataclass(frozen=True)
class Coverage:
    """What lies on what. Pairs are sorted, lower number first."""

    charts: Charts
    flipped: Ints  # faces without positive area
    overwound: Ints  # points of charts.corner inside a chart whose angles do not sum to one turn; empty if there are flips
    within: Ints  # (k, 2) faces of one chart whose interiors share a point
    between: Ints  # (k, 2) faces of two charts whose interiors do
    islands: Ints  # (k, 2) charts with such faces
    touching: Ints  # (k, 2) boundary edges (3 f + k) of one chart that meet elsewhere than in an end that they share


def coverage(faces: npt.ArrayLike, uv: npt.ArrayLike) -> Coverage:
    """Faces (m, 3), corner UVs (m, 3, 2) in 32 or 64 bits. Charts are those of these very values: rounding can make two sides of
    a cut equal. Cost: pairs of boxes, and rational numbers where points lie on a line."""
    points = np.asarray(uv).astype(np.float64)
    if not np.isfinite(points).all() or np.abs(points).max(initial=0.0) > 1e140:
        raise ValueError("UVs must be finite and below 1e140.")
    charts = charts_of(faces, uv)
    orientation = turns(points[:, 0], points[:, 1], points[:, 2])
    flipped = np.flatnonzero(orientation <= 0)
    pairs = overlapping_triangles(points, orientation)
    of_face = charts.face[pairs]
    same = of_face[:, 0] == of_face[:, 1]
    islands = np.unique(np.sort(of_face[~same], axis=1), axis=0)
    return Coverage(
        charts,
        flipped,
        overwound(points, charts) if len(flipped) == 0 else np.zeros(0, np.int64),
        pairs[same],
        pairs[~same],
        islands,
        touching_edges(points, charts),
    )


def overlapping_triangles(points: Floats, orientation: Signs) -> npt.NDArray[np.int64]:
    """(k, 2) pairs of triangles (m, 3, 2) with a common inner point; `orientation` (m,) is 1, 0 or -1."""
    counter_clockwise = np.where((orientation < 0)[:, None, None], points[:, ::-1], points)
    solid = np.flatnonzero(orientation != 0)
    shapes = counter_clockwise[solid]
    pairs = meeting_boxes(shapes.min(1), shapes.max(1), closed=False)
    kept = [
        part[_overlap(shapes[part[:, 0]], shapes[part[:, 1]])]
        for part in (pairs[i : i + _CHUNK] for i in range(0, len(pairs), _CHUNK))
    ]
    return solid[np.concatenate(kept)] if kept else np.zeros((0, 2), np.int64)


def _overlap(s: Floats, t: Floats) -> npt.NDArray[np.bool_]:
    """Of counter-clockwise triangles s[i], t[i]: does no edge of either have the whole other triangle on its outer side?"""
    separated = np.zeros(len(s), bool)
    for first, second in ((s, t), (t, s)):
        for k in range(3):
            todo = np.flatnonzero(~separated)
            a, b = first[todo, k, None], first[todo, (k + 1) % 3, None]
            separated[todo] = (turns(a, b, second[todo]) <= 0).all(1)
    return ~separated


def overwound(points: Floats, charts: Charts) -> npt.NDArray[np.int64]:
    """Points inside a chart whose angles sum to more than one turn. Positive triangles make whole turns of them, so that sums
    in doubles decide."""
    ahead = np.roll(points, -1, 1) - points
    back = np.roll(points, 1, 1) - points
    angle = np.arctan2(
        ahead[..., 0] * back[..., 1] - ahead[..., 1] * back[..., 0], (ahead * back).sum(-1)
    )
    count = int(charts.corner.max(initial=-1)) + 1
    sums = np.bincount(charts.corner.ravel(), angle.ravel(), count)
    inner = np.ones(count, bool)
    inner[_ends(charts, charts.boundary)] = False
    return np.flatnonzero(inner & (np.rint(sums / (2 * np.pi)) != 1))


def _ends(charts: Charts, edges: Ints) -> Ints:
    """(k, 2) the points at which boundary edges begin and end."""
    f, k = edges // 3, edges % 3
    return np.stack([charts.corner[f, k], charts.corner[f, (k + 1) % 3]], 1)


def touching_edges(points: Floats, charts: Charts) -> npt.NDArray[np.int64]:
    """(k, 2) pairs of boundary edges of one chart, as corners 3 f + k, whose segments share more than the places of the points
    (of charts.corner) at which both end."""
    edges = charts.boundary
    f, k = edges // 3, edges % 3
    start, end = points[f, k], points[f, (k + 1) % 3]
    pairs = meeting_boxes(np.minimum(start, end), np.maximum(start, end), closed=True)
    pairs = pairs[charts.face[f[pairs[:, 0]]] == charts.face[f[pairs[:, 1]]]]
    i, j = pairs.T
    ends = _ends(charts, edges)
    shared = np.stack([ends[i, x] == ends[j, y] for x, y in _CORNERS], 1)
    meets = np.zeros(len(pairs), bool)
    apart = np.flatnonzero(~shared.any(1))
    meets[apart] = _segments_meet(start[i[apart]], end[i[apart]], start[j[apart]], end[j[apart]])
    for which, (x, y) in enumerate(_CORNERS):
        one = np.flatnonzero(shared[:, which] & (shared.sum(1) == 1))
        joint = (start, end)[x][i[one]]
        meets[one] = _same_ray(joint, (end, start)[x][i[one]], (end, start)[y][j[one]])
    # Straight edges with both ends in common lie on each other.
    meets[shared.sum(1) > 1] = True
    return edges[pairs[meets]]


_CORNERS = ((0, 0), (0, 1), (1, 0), (1, 1))


def _segments_meet(a: Floats, b: Floats, c: Floats, d: Floats) -> npt.NDArray[np.bool_]:
    """Closed segments a-b and c-d (n, 2), whose boxes meet."""
    ab = turns(a, b, c).astype(int) * turns(a, b, d)
    cd = turns(c, d, a).astype(int) * turns(c, d, b)
    return (ab <= 0) & (cd <= 0)


def _same_ray(joint: Floats, p: Floats, q: Floats) -> npt.NDArray[np.bool_]:
    """Do p and q lie in the same direction from the joint?"""
    side_p, side_q = np.sign(p - joint), np.sign(q - joint)
    return (turns(joint, p, q) == 0) & (side_p == side_q).all(1)


def share_covered_twice(points: Floats, within: Ints, samples: int, seed: int = 0) -> float:
    """Share of points drawn by area from the triangles (m, 3, 2) that another triangle of the chart covers too, in doubles:
    a figure for tables, not a verdict."""
    if len(within) == 0:
        return 0.0
    random = np.random.default_rng(seed)
    e, f = points[:, 1] - points[:, 0], points[:, 2] - points[:, 0]
    area = np.abs(e[:, 0] * f[:, 1] - e[:, 1] * f[:, 0])
    face = np.sort(random.choice(len(points), samples, p=area / area.sum()))
    weights = random.dirichlet(np.ones(3), samples)
    place = np.einsum("sk,skd->sd", weights, points[face])
    covered = np.zeros(samples, bool)
    for own, other in (within.T, within.T[::-1]):
        first, last = np.searchsorted(face, own), np.searchsorted(face, own, "right")
        size = last - first
        sample = (
            np.repeat(first, size) + np.arange(size.sum()) - np.repeat(size.cumsum() - size, size)
        )
        triangle = points[np.repeat(other, size)]
        p = place[sample]
        inside = np.ones(len(p), bool)
        for k in range(3):
            x, y = triangle[:, k] - p, triangle[:, (k + 1) % 3] - p
            inside &= x[:, 0] * y[:, 1] - x[:, 1] * y[:, 0] > 0
        covered[sample[inside]] = True
    return float(covered.mean())
