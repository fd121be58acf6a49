"""Draws docs/images/embedding_*.png: failed Tutte maps beside ours. Needs matplotlib and scipy.

PYTHONPATH=build/python python3 benchmarks/embedding_pictures.py
"""

from __future__ import annotations

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt
import numpy as np
import numpy.typing as npt
import scipy.sparse as sp
import scipy.sparse.linalg as spl
from embedding_meshes import Disk, boundary_loop, corpus, tube
from matplotlib.collections import PolyCollection
from matplotlib.colors import Normalize

import flipfree as ff

from mesh_files import ROOT

Array = npt.NDArray[np.float64]


def tutte(disk: Disk, loop: npt.NDArray[np.int32], positions: Array) -> Array:
    """Uniform Tutte by a general sparse solver, in double: what everybody else does."""
    n = len(disk.vertices)
    i = disk.faces[:, [0, 1, 2]].ravel()
    j = disk.faces[:, [1, 2, 0]].ravel()
    w = sp.coo_matrix((np.ones(2 * len(i)), (np.r_[i, j], np.r_[j, i])), shape=(n, n)).tocsr()
    w.data[:] = 1.0
    laplacian = (sp.diags(np.asarray(w.sum(1)).ravel()) - w).tocsr()
    inner = np.setdiff1d(np.arange(n), loop)
    uv = np.zeros((n, 2))
    uv[loop] = positions
    right = -laplacian[inner][:, loop] @ positions
    uv[inner] = spl.spsolve(laplacian[inner][:, inner].tocsc(), right)
    return uv


def areas(triangles: Array) -> Array:
    a, b = triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0]
    return (a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]) / 2


def distortion(disk_vertices: Array, faces: npt.NDArray[np.int32], uv: Array) -> Array:
    """(|J|^2 + |J^-1|^2) / 4 per face at the best global scale; nan where flipped."""
    p = disk_vertices[faces]
    e1, e2 = p[:, 1] - p[:, 0], p[:, 2] - p[:, 0]
    length = np.linalg.norm(e1, axis=1)
    x2 = (e1 * e2).sum(1) / length
    y2 = np.linalg.norm(np.cross(e1, e2), axis=1) / length
    d1, d2 = uv[:, 1] - uv[:, 0], uv[:, 2] - uv[:, 0]
    j1 = d1 / length[:, None]
    j2 = (d2 - j1 * x2[:, None]) / y2[:, None]
    square = (j1**2).sum(1) + (j2**2).sum(1)
    det = j1[:, 0] * j2[:, 1] - j1[:, 1] * j2[:, 0]
    good = det > 0
    inverse = np.where(good, square / np.where(good, det, 1) ** 2, np.nan)
    weight = length * y2
    scale = np.sqrt(
        np.nansum(weight * inverse) / np.nansum(np.where(good, weight * square, np.nan))
    )
    return np.where(good, (square * scale + inverse / scale) / 4, np.nan)


def draw(axes, triangles: Array, colour: Array, norm: Normalize, title: str) -> PolyCollection:
    width = 0.25 if len(triangles) < 3000 else 0.1
    shown = PolyCollection(
        triangles,
        array=np.log10(colour),
        cmap="viridis",
        norm=norm,
        lw=width,
        edgecolors="#00000060",
    )
    axes.add_collection(shown)
    flipped = np.isnan(colour)
    if flipped.any():
        axes.add_collection(
            PolyCollection(triangles[flipped], facecolors="none", edgecolors="red", lw=1.0)
        )
    axes.autoscale_view()
    axes.set_aspect("equal")
    axes.axis("off")
    axes.set_title(title, fontsize=11)
    return shown


def figure(disk: Disk, boundary: str, path: str) -> None:
    loop = boundary_loop(disk.faces)
    fast = ff.embed(disk.vertices, disk.faces, boundary=boundary, boundary_loop=loop)
    nothing = ff.embed(
        disk.vertices,
        disk.faces,
        boundary=boundary,
        boundary_loop=loop,
        method="progressive",
        start="nothing",
    )
    best = ff.embed(disk.vertices, disk.faces, boundary=boundary, boundary_loop=loop, optimise=True)
    where = dict(zip(fast.faces.ravel().tolist(), fast.uv.reshape(-1, 2), strict=True))
    folded = tutte(disk, loop, np.array([where[v] for v in loop.tolist()]))[disk.faces]
    flips = int((areas(folded) <= 0).sum())
    flips32 = int((areas(folded.astype(np.float32).astype(float)) <= 0).sum())

    norm = Normalize(0, 4)
    fig = plt.figure(figsize=(13, 8.6), dpi=100)
    space = fig.add_subplot(2, 3, 1, projection="3d")
    space.plot_trisurf(
        *disk.vertices.T, triangles=disk.faces, color="#c8d4e0", edgecolor="#404040", lw=0.1
    )
    space.set_box_aspect(np.ptp(disk.vertices, 0) + 1e-9, zoom=1.4)
    space.axis("off")
    space.set_title(f"{disk.name}: {len(disk.faces)} triangles\n", fontsize=11)
    # Where the fold is, and how small: three edges around a flipped triangle.
    fold = folded[areas(folded) <= 0]
    sizes = np.linalg.norm(fold[:, 1] - fold[:, 0], axis=1)
    worst = int(np.argsort(sizes)[len(sizes) * 3 // 4])
    reach = 4 * sizes[worst]
    maps = [
        (folded, f"uniform Tutte in double: {flips} flips,\n{flips32} as stored in 32 bits"),
        (folded, f"the same, magnified {1 / reach:.0e} times:\nflips in red"),
        (
            fast.uv32(),
            f"ladder ({fast.stats['rung']}): 0 flips,\nE = {fast.certificate.energy:.3g}",
        ),
        (nothing.uv32(), f"progressive embedding: 0 flips,\nE = {nothing.certificate.energy:.3g}"),
        (best.uv32(), f"optimised, boundary fixed: 0 flips,\nE = {best.certificate.energy:.3g}"),
    ]
    for k, (uv, title) in enumerate(maps):
        axes = fig.add_subplot(2, 3, k + 2)
        triangles = np.asarray(uv, np.float64)
        shown = draw(axes, triangles, distortion(disk.vertices, disk.faces, triangles), norm, title)
        if k == 1:
            middle = fold[worst].mean(0)
            axes.set_xlim(middle[0] - reach, middle[0] + reach)
            axes.set_ylim(middle[1] - reach, middle[1] + reach)
    fig.colorbar(
        shown,
        ax=fig.axes,
        shrink=0.5,
        label="log10 of symmetric Dirichlet per triangle (0 = isometric)",
        pad=0.02,
    )
    target = ROOT / "docs" / "images" / path
    target.parent.mkdir(parents=True, exist_ok=True)
    fig.savefig(target, bbox_inches="tight")
    plt.close(fig)
    print(target.relative_to(ROOT))


def main() -> None:
    disks = {disk.name: disk for disk in corpus()}
    figure(disks["62415_sf"], "triangle", "embedding_propeller.png")
    figure(disks["octopus_f500"], "triangle", "embedding_octopus.png")
    figure(tube(8, 160), "circle", "embedding_tube.png")


if __name__ == "__main__":
    main()
