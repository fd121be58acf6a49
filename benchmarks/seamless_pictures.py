"""Draws docs/images/seamless_frame.png and seamless_eight.png: a checker through the seams of closed surfaces with holes.

    PYTHONPATH=build/python:tests python3 benchmarks/seamless_pictures.py [OUTPUT_FOLDER]

seamless_eight.png needs the shared data folder (FLIPFREE_DATA).
"""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Any

import matplotlib
import numpy as np

matplotlib.use("Agg")
import matplotlib.pyplot as plt
from matplotlib.collections import LineCollection

import flipfree as ff

from judges.unfoldings import TWO_HOLES, unfolding
from mesh_files import ROOT, data_folder, read_mesh

sys.path.insert(0, str(ROOT / "scripts"))
from render_conformal import View, camera, rasterise, shade  # noqa: E402

LIGHT, DARK = np.array([0.93, 0.90, 0.82]), np.array([0.33, 0.42, 0.52])
SEAM, SHARP, SADDLE = "#d4261c", "#d4261c", "#1f9d3a"


def checker(uv: np.ndarray, size: float) -> np.ndarray:
    """(..., 3) colours: fields of this size, a corner at the origin."""
    odd = (np.floor(uv / size + 1e-5).sum(-1) % 2)[..., None]
    return LIGHT * (1 - odd) + DARK * odd


def rendered(map: ff.Parametrization, view: View, size: float) -> np.ndarray:
    screen = camera(map.vertices, view)
    face, weights, _ = rasterise(screen, map.faces)
    uv = (weights[..., None] * map.uv[face]).sum(2)
    light = shade(map.vertices, map.faces, view)[face][..., None]
    return np.where(face[..., None] < 0, 1.0, checker(uv - origin(map), size) * light)


def visible(map: ff.Parametrization, view: View, points: np.ndarray) -> np.ndarray:
    """Which of these (n, 3) points on the surface nothing hides."""
    both = np.concatenate([map.vertices, points])
    screen = camera(both, view)  # the points lie in the box of the vertices
    _, _, depth = rasterise(screen[: len(map.vertices)], map.faces)
    seen = screen[len(map.vertices) :]
    x, y = (np.clip(np.rint(seen[:, k]).astype(int), 0, depth.shape[0] - 1) for k in (0, 1))
    around = np.stack(
        [
            depth[np.clip(y + j, 0, len(depth) - 1), np.clip(x + i, 0, len(depth) - 1)]
            for i in (-1, 0, 1)
            for j in (-1, 0, 1)
        ]
    )
    reach = np.where(np.isfinite(around), around, -np.inf).max(0)
    return seen[:, 2] > reach - 0.01 * np.ptp(screen[:, 2])


def origin(map: ff.Parametrization) -> np.ndarray:
    """A cone's place: where the surface is made of squares, all cones lie on the grid through one."""
    return map.uv[map.faces == map.certificate.quarter_cones[0, 0]][0]


def picture(path: Path, map: ff.Parametrization, view: View, size: float) -> None:
    figure, (left, right) = plt.subplots(1, 2, figsize=(11, 5), width_ratios=[1, 1.15])
    ends = map.vertices[map.cut_edges]
    pieces = np.linspace(ends[:, 0], ends[:, 1], 9).transpose(1, 0, 2)
    middles = (pieces[:, :-1] + pieces[:, 1:]) / 2
    shown = visible(map, view, middles.reshape(-1, 3)).reshape(len(ends), 8)
    lines = camera(np.concatenate([map.vertices, pieces.reshape(-1, 3)]), view)[
        len(map.vertices) :, :2
    ].reshape(len(ends), 9, 2)
    segments = np.stack([lines[:, :-1], lines[:, 1:]], 2)[shown]
    right.imshow(rendered(map, view, size))
    right.add_collection(LineCollection(segments, colors=SEAM, linewidths=1.3))
    cones = map.certificate.quarter_cones
    at = map.vertices[cones[:, 0]]
    seen = visible(map, view, at)
    places = camera(np.concatenate([map.vertices, at]), view)[len(map.vertices) :]
    colours = np.where(cones[:, 1] < 4, SHARP, SADDLE)
    right.scatter(
        *places[seen, :2].T, s=22, c=colours[seen], zorder=3, edgecolors="white", linewidths=0.6
    )
    right.set_axis_off()
    draw_layout(left, map, size)
    figure.subplots_adjust(0.01, 0.01, 0.99, 0.99, wspace=0.03)
    figure.savefig(path, dpi=85)
    plt.close(figure)


def draw_layout(panel: Any, map: ff.Parametrization, size: float) -> None:
    """The chart with the checker on it; where it covers a place twice, what comes later lies on top."""
    flat = np.concatenate([map.uv.reshape(-1, 2) * [1, -1], np.zeros((map.uv.size // 2, 1))], 1)
    low, high = flat[:, :2].min(0), flat[:, :2].max(0)
    scale = 860 / (high - low).max()
    flat[:, :2] = (flat[:, :2] - (low + high) / 2) * scale + 450
    faces = np.arange(len(flat)).reshape(-1, 3)
    face, weights, _ = rasterise(flat, faces)
    uv = (weights[..., None] * map.uv[face]).sum(2)
    panel.imshow(np.where(face[..., None] < 0, 1.0, checker(uv - origin(map), size)))
    sides = {
        (a, b): (f, k)
        for f, t in enumerate(map.faces.tolist())
        for k, (a, b) in enumerate(zip(t, t[1:] + t[:1], strict=True))
    }
    border = [
        [flat[3 * f + k, :2], flat[3 * f + (k + 1) % 3, :2]]
        for a, b in map.cut_edges.tolist()
        for f, k in (sides[a, b], sides[b, a])
    ]
    panel.add_collection(LineCollection(border, colors=SEAM, linewidths=1.0))
    panel.set_axis_off()


def main() -> None:
    folder = Path(sys.argv[1]) if len(sys.argv) > 1 else ROOT / "docs/images"
    frame = unfolding(TWO_HOLES, 6, 1)
    map = ff.seamless(frame.vertices, frame.faces)
    print("frame:", map.certificate)
    picture(folder / "seamless_frame.png", map, View(25, 52), 0.25)
    data = data_folder()
    if data is None:
        return
    mesh = read_mesh(data / "fields" / "eight.obj")
    map = ff.seamless(mesh.vertices, mesh.faces)
    print("eight:", map.certificate)
    extent = float(np.ptp(map.vertices, axis=0).max())
    picture(folder / "seamless_eight.png", map, View(20, 30), extent / 30)


if __name__ == "__main__":
    main()
