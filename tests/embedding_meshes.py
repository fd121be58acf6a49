"""Disks for the embedding benchmarks and tests: the shared data folder's cases and synthetic ones of any size."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import numpy.typing as npt

from mesh_files import data_folder, read_mesh
from surfaces import bumpy_grid, open_edges


@dataclass
class Disk:
    name: str
    vertices: npt.NDArray[np.float64]
    faces: npt.NDArray[np.int32]
    uv: npt.NDArray[np.float64] | None = None  # (n, 2), given with the file
    loop: npt.NDArray[np.int32] | None = None


def boundary_loop(faces: npt.NDArray[np.int32]) -> npt.NDArray[np.int32]:
    """The single boundary loop, surface on the left; empty if closed."""
    following = dict(open_edges(faces).tolist())
    if not following:
        return np.zeros(0, np.int32)
    start = min(following)
    loop = [start]
    while following[loop[-1]] != start and len(loop) <= len(following):
        loop.append(following[loop[-1]])
    assert len(loop) == len(following), "several boundary loops"
    return np.array(loop, np.int32)


def tube(sectors: int, rings: int) -> Disk:
    """Tube closed at its far end, open at ring 0; uniform Tutte maps decay exponentially with `rings`."""
    index = np.arange(sectors * rings).reshape(rings, sectors)
    angle = 2 * np.pi * np.arange(sectors) / sectors
    ring = np.column_stack([np.cos(angle), np.sin(angle)])
    points = np.column_stack([np.tile(ring, (rings, 1)), index.ravel() // sectors])
    points = np.vstack([points, [[0, 0, rings]]])
    a, c = index[:-1], index[1:]
    b, d = np.roll(a, -1, 1), np.roll(c, -1, 1)
    sides = np.concatenate(
        [np.stack([a, b, d], -1).reshape(-1, 3), np.stack([a, d, c], -1).reshape(-1, 3)]
    )
    last = index[-1]
    fan = np.stack([last, np.roll(last, -1), np.full(sectors, sectors * rings)], -1)
    return Disk(f"tube {sectors} x {rings}", points, np.vstack([sides, fan]).astype(np.int32))


def stacked(vertices: int, kind: str = "random", seed: int = 1) -> Disk:
    """Apollonian triangulation: each vertex is put into a random face, the newest ("deep") or one of the three newest
    ("mixed"); placed by an equal-area subdivision on a paraboloid, so that the surface has ordinary triangles."""
    random = np.random.default_rng(seed)
    faces = [(0, 1, 2)]
    for v in range(3, vertices):
        newest = min(len(faces), 3)
        k = {
            "random": int(random.integers(len(faces))),
            "deep": len(faces) - 1,
            "mixed": len(faces) - 1 - int(random.integers(newest)),
        }[kind]
        a, b, c = faces[k]
        faces[k] = (a, b, v)
        faces += [(b, c, v), (c, a, v)]
    return Disk(
        f"stacked {vertices} {kind}",
        random.normal(size=(vertices, 3)),
        np.array(faces, np.int32),
    )


def wavy_grid(columns: int, rows: int) -> Disk:
    """A disk with 2 columns rows triangles over the unit square."""
    vertices, faces = bumpy_grid(columns, rows, 0.0)
    x, y, _ = vertices.T
    vertices[:, 2] = 0.1 * np.sin(5 * np.pi * x) * np.sin(4 * np.pi * y)
    return Disk(f"grid {columns} x {rows}", vertices, faces)


def _of_quads(corners: npt.ArrayLike) -> tuple[npt.NDArray[np.int64], npt.NDArray[np.int32]]:
    """Places and triangles of quads that are given by the places of their corners, (q, 4, d)."""
    places = np.asarray(corners)
    points, index = np.unique(places.reshape(-1, places.shape[2]), axis=0, return_inverse=True)
    quad = index.reshape(-1, 4)
    return points, np.concatenate([quad[:, [0, 1, 2]], quad[:, [0, 2, 3]]]).astype(np.int32)


def _by_texture(name: str, path: Path) -> Disk:
    """The disk that a file's texture coordinates describe: corners with equal vertex and texture are one vertex."""
    mesh = read_mesh(path)
    assert mesh.uv is not None
    key = np.concatenate([mesh.faces.reshape(-1, 1), mesh.uv.reshape(-1, 2)], 1)
    _, first, inverse = np.unique(key, axis=0, return_index=True, return_inverse=True)
    faces = inverse.reshape(-1, 3).astype(np.int32)
    vertices = mesh.vertices[mesh.faces.reshape(-1)[first]]
    return Disk(name, vertices, faces, mesh.uv.reshape(-1, 2)[first], boundary_loop(faces))


def corpus() -> Iterator[Disk]:
    """The cases of the shared data folder's embedding/; closed ones without their last face."""
    folder = data_folder()
    if folder is None:
        raise SystemExit("The shared data folder is not here (FLIPFREE_DATA).")
    for path in sorted((folder / "embedding").glob("*.obj")):
        if path.stem.startswith("retinal"):
            yield _by_texture(path.stem, path)
            continue
        mesh = read_mesh(path)
        closed = len(boundary_loop(mesh.faces)) == 0
        yield Disk(path.stem, mesh.vertices, mesh.faces[:-1] if closed else mesh.faces)


def fingers(levels: int, rings: int) -> Disk:
    """Four fingers on every finger, `levels` deep and each `rings` unit squares high, on a square: a terrain whose steps
    are walls. Tutte's map shrinks every finger by orders of magnitude, and those on it by as many again."""
    width = 2**levels + 1
    height = np.zeros((width, width), np.int64)

    def grow(x: int, y: int, size: int) -> None:
        height[x : x + size, y : y + size] += rings
        half = size // 2
        if half == 0:
            return
        for dx in (0, half + 1):
            for dy in (0, half + 1):
                grow(x + dx, y + dy, half)

    grow(1, 1, width - 2)
    quads: list[list[tuple[int, int, int]]] = []
    for x in range(width):
        for y in range(width):
            z = height[x, y]
            quads.append([(x, y, z), (x + 1, y, z), (x + 1, y + 1, z), (x, y + 1, z)])
    # Walls run where the height changes, seen from outside: from the lower cell.
    for x in range(1, width):
        for y in range(width):
            a, b = int(height[x - 1, y]), int(height[x, y])
            for z in range(a, b):
                quads.append([(x, y + 1, z), (x, y, z), (x, y, z + 1), (x, y + 1, z + 1)])
            for z in range(b, a):
                quads.append([(x, y, z), (x, y + 1, z), (x, y + 1, z + 1), (x, y, z + 1)])
    for x in range(width):
        for y in range(1, width):
            a, b = int(height[x, y - 1]), int(height[x, y])
            for z in range(a, b):
                quads.append([(x, y, z), (x + 1, y, z), (x + 1, y, z + 1), (x, y, z + 1)])
            for z in range(b, a):
                quads.append([(x + 1, y, z), (x, y, z), (x, y, z + 1), (x + 1, y, z + 1)])
    points, faces = _of_quads(quads)
    return Disk(f"fingers {levels} x {rings}", points.astype(np.float64), faces)


def corridors(width: int, size: int, seed: int = 0) -> Disk:
    """A random tree of corridors in the plane, `size` x `size` crossings, `width` squares wide: fingers on fingers. Its
    boundary is nearly as long as the disk is large."""
    random = np.random.default_rng(seed)
    seen, path, cells = {(0, 0)}, [(0, 0)], {(0, 0)}
    while path:
        x, y = path[-1]
        around = [(x + 1, y), (x - 1, y), (x, y + 1), (x, y - 1)]
        free = [p for p in around if min(p) >= 0 and max(p) < size and p not in seen]
        if not free:
            path.pop()
            continue
        at = free[random.integers(len(free))]
        seen.add(at)
        path.append(at)
        cells |= {(x + at[0], y + at[1]), (2 * at[0], 2 * at[1])}
    corners = [
        [(i, j), (i + 1, j), (i + 1, j + 1), (i, j + 1)]
        for x, y in sorted(cells)
        for i in range(x * width, (x + 1) * width)
        for j in range(y * width, (y + 1) * width)
    ]
    points, faces = _of_quads(corners)
    flat = np.column_stack([points / width, np.zeros(len(points))])
    return Disk(f"corridors {width} x {size}", flat, faces)
