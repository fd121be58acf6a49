"""Surfaces with integer maps made by hand, every face in a chart of its own."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import numpy.typing as npt

import flipfree as ff

#: vertices (n, 3), faces (m, 3), uv (m, 3, 2).
Mapped = tuple[npt.NDArray[np.float64], npt.NDArray[np.int32], npt.NDArray[np.float64]]


def _joined(points: npt.NDArray[np.float64], uv: npt.NDArray[np.float64]) -> Mapped:
    """Triangles by the places of their corners, (m, 3, 3)."""
    rounded = np.round(points.reshape(-1, 3), 9) + 0.0
    vertices, ids = np.unique(rounded, axis=0, return_inverse=True)
    return vertices, ids.reshape(-1, 3).astype(np.int32), uv


def _sheet(u: float, v: float, columns: int, rows: int) -> npt.NDArray[np.float64]:
    """The triangles of a rectangle u x v, (m, 3, 2); diagonals alternate."""
    triangles = []
    for j in range(rows):
        for i in range(columns):
            c = [(i, j), (i + 1, j), (i + 1, j + 1), (i, j + 1)]
            if (i + j) % 2:
                c = c[1:] + c[:1]
            triangles += [[c[0], c[1], c[2]], [c[0], c[2], c[3]]]
    return np.array(triangles) * [u / columns, v / rows]


def box(sizes: tuple[int, int, int], cells: tuple[int, int, int]) -> Mapped:
    """A box of these sizes, its edges divided into so many."""
    points, uv = [], []
    for axis in range(3):
        a, b = (axis + 1) % 3, (axis + 2) % 3
        for far in (False, True):
            # Seen from outside u, v turn counter-clockwise.
            u, v = (a, b) if far else (b, a)
            flat = _sheet(sizes[u], sizes[v], cells[u], cells[v])
            place = np.zeros((*flat.shape[:2], 3))
            place[..., u], place[..., v] = flat[..., 0], flat[..., 1]
            place[..., axis] = sizes[axis] if far else 0.0
            points.append(place)
            uv.append(flat)
    return _joined(np.concatenate(points), np.concatenate(uv))


def twisted_torus(k: int, rise: int, twist: int, columns: int, rows: int) -> Mapped:
    """k x rise cells; what leaves at the top comes back at the bottom `twist` cells further. Precondition: the columns' width
    divides the twist."""
    uv = _sheet(k, rise, columns, rows)
    along, across = (
        2 * np.pi * (uv[..., 0] - twist * uv[..., 1] / rise) / k,
        2 * np.pi * uv[..., 1] / rise,
    )
    ring = 2.0 + 0.7 * np.cos(across)
    points = np.stack([ring * np.cos(along), ring * np.sin(along), 0.7 * np.sin(across)], -1)
    return _joined(points, uv)


def pillow(n: int, cells: int) -> Mapped:
    """Two squares of n x n: four cones of two quarter turns."""
    top = _sheet(n, n, cells, cells)
    bump = (top * (n - top)).prod(-1, keepdims=True) / n**3
    bottom = top[:, ::-1]
    points = np.concatenate(
        [np.concatenate([top, bump], -1), np.concatenate([bottom, -bump[:, ::-1]], -1)]
    )
    # Seen from below the square is mirrored.
    return _joined(points, np.concatenate([top, bottom * [-1.0, 1.0]]))


def annulus(inner: int, width: int) -> Mapped:
    """A square with a square hole, without its charts: one for all."""
    outer = inner + 2 * width
    flat = _sheet(outer, outer, outer, outer)
    middle = flat.mean(1)
    hole = ((middle > width) & (middle < width + inner)).all(-1)
    flat = flat[~hole]
    return _joined(np.concatenate([flat, np.zeros((*flat.shape[:2], 1))], -1), flat)


def in_random_charts(mapped: Mapped, seed: int) -> Mapped:
    """The same with every face turned by quarters and shifted, exactly."""
    random = np.random.default_rng(seed)
    vertices, faces, uv = mapped
    turned = uv[..., 0] + 1j * uv[..., 1]
    turned = turned * 1j ** random.integers(0, 4, len(uv))[:, None]
    turned = np.round(turned.real * 1024) / 1024 + 1j * np.round(turned.imag * 1024) / 1024
    shift = random.integers(-640, 640, (2, len(uv))) / 64
    turned += (shift[0] + 1j * shift[1])[:, None]
    return vertices, faces, np.stack([turned.real, turned.imag], -1)


def parametrization(mapped: Mapped) -> ff.Parametrization:
    """As the solvers return maps."""
    vertices, faces, uv = mapped
    some = ff.unwrap(vertices, faces)
    assert (some.faces == faces).all()
    return replace(some, uv=uv, uv64=uv, _uv32=uv.astype(np.float32))
