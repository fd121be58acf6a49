"""The best whole numbers of all for a seamless map, by HiGHS: a mixed-integer program without a coarse surface.

After Bommes, Zimmer, Kobbelt, "Mixed-Integer Quadrangulation" (2009), section 4, with the sum of absolute values in place of
squares: places of all vertices in their charts are free, cones and translations across seams are whole.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import numpy.typing as npt
from scipy.optimize import Bounds, LinearConstraint, milp
from scipy.sparse import coo_array

Array = npt.NDArray[np.float64]
#: Places lie this near to where they were, in tiles.
REACH = 4.0


class Program:
    """Variables: u and v of every vertex in its chart, both translations of every seam edge, and how far each edge is off."""

    def __init__(self, faces: npt.NDArray[np.int32], uv: Array, cones: Sequence[int]) -> None:
        corners = faces.size
        flat = uv.reshape(-1, 2)
        self.corner = np.arange(corners)  # one of each vertex in its chart
        sides = {
            (int(f[k - 1]), int(f[k])): (3 * i + (k - 1) % 3, 3 * i + k)
            for i, f in enumerate(faces)
            for k in range(3)
        }
        self.edges, seams = [], []
        for (a, b), ends in sides.items():
            if (b, a) in sides and a > b:
                continue
            self.edges.append(ends)
            if (b, a) not in sides:
                continue
            other = sides[b, a][::-1]
            if (flat[list(ends)] == flat[list(other)]).all():
                for one, two in zip(ends, other, strict=True):
                    self._join(one, two)
            else:
                seams.append((ends, other))
        self.corner = np.array([self._root(c) for c in range(corners)])
        self.seams = len(seams)
        self.first_seam = 2 * corners
        self.first_off = self.first_seam + 2 * self.seams
        self.count = self.first_off + 2 * len(self.edges)
        self.integral = np.zeros(self.count)
        whole = self.corner[np.isin(faces.reshape(-1), cones)]
        for c in whole:
            self.integral[2 * c : 2 * c + 2] = 1
        # Where there are cones, seams end at some: then their translations are whole as well.
        self.integral[self.first_seam : self.first_off] = 0 if len(whole) else 1
        # One place of each chart is held, as charts may lie anywhere.
        chart = np.arange(corners)
        for a, b in [(3 * i, 3 * i + k) for i in range(len(faces)) for k in (1, 2)]:
            one, two = chart[self.corner[a]], chart[self.corner[b]]
            chart[chart == two] = one
        order = np.unique(self.corner)
        order = order[np.argsort(-self.integral[2 * order], kind="stable")]
        _, first = np.unique(chart[order], return_index=True)
        self.held = order[first]
        self.rows: list[tuple[list[int], list[float]]] = []
        for number, (ends, other) in enumerate(seams):
            ahead, along = (np.diff(flat[list(e)], axis=0)[0] @ [1, 1j] for e in (ends, other))
            turn = 1j ** (round(np.angle(along / ahead) / (np.pi / 2)) % 4)
            for one, two in zip(ends, other, strict=True):
                for k, (x, y) in enumerate(((turn.real, -turn.imag), (turn.imag, turn.real))):
                    self.rows.append(
                        (
                            [
                                self.at(two, k),
                                self.at(one, 0),
                                self.at(one, 1),
                                self.first_seam + 2 * number + k,
                            ],
                            [1.0, -round(x), -round(y), -1.0],
                        )
                    )

    def _root(self, c: int) -> int:
        while self.corner[c] != c:
            c = int(self.corner[c])
        return c

    def _join(self, a: int, b: int) -> None:
        self.corner[self._root(a)] = self._root(b)

    def at(self, corner: int, k: int) -> int:
        return 2 * int(self.corner[corner]) + k

    def least(
        self, uv: Array, whole: Array | None = None, seconds: float = 20.0
    ) -> tuple[float, Array] | None:
        """The least sum, over edges and coordinates, of how far they are from those of uv, and its map; with the whole
        numbers of another map where one is given. None where it is not found in time."""
        rows, below = list(self.rows), [0.0] * len(self.rows)
        above = list(below)
        flat = uv.reshape(-1, 2)
        for number, (a, b) in enumerate(self.edges):
            for k in range(2):
                off = self.first_off + 2 * number + k
                for sign in (1.0, -1.0):
                    rows.append(([self.at(b, k), self.at(a, k), off], [sign, -sign, -1.0]))
                    below.append(-np.inf)
                    above.append(sign * (flat[b, k] - flat[a, k]))
        low, high = np.full(self.count, -np.inf), np.full(self.count, np.inf)
        low[self.first_off :] = 0.0
        places = 2 * self.corner[:, None] + [0, 1]
        low[places], high[places] = np.floor(flat) - REACH, np.ceil(flat) + REACH
        for c in self.held if whole is None else ():
            low[2 * c : 2 * c + 2] = high[2 * c : 2 * c + 2] = np.round(flat[c])
        if whole is not None:
            given = whole.reshape(-1)
            fixed = np.flatnonzero(self.integral[: self.first_seam])
            low[fixed] = high[fixed] = given[fixed]
        size = [len(columns) for columns, _ in rows]
        matrix = coo_array(
            (
                np.concatenate([values for _, values in rows]),
                (np.repeat(np.arange(len(rows)), size), np.concatenate([c for c, _ in rows])),
            ),
            shape=(len(rows), self.count),
        )
        cost = np.zeros(self.count)
        cost[self.first_off :] = 1.0
        found = milp(
            cost,
            constraints=LinearConstraint(matrix.tocsr(), below, above),
            bounds=Bounds(low, high),
            integrality=self.integral,
            options={"time_limit": seconds},
        )
        if found.status != 0:
            return None
        return float(found.fun), found.x[places].reshape(uv.shape)
