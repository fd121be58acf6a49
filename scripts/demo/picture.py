# SPDX-License-Identifier: GPL-3.0-or-later
"""Puts the demo's picture together: picture.py FOLDER OUT.png (FOLDER as in_blender.py left it)."""

import sys
from pathlib import Path

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt  # noqa: E402
import numpy as np  # noqa: E402
from matplotlib.collections import LineCollection, PolyCollection  # noqa: E402
from matplotlib.colors import LinearSegmentedColormap, LogNorm  # noqa: E402
from matplotlib.ticker import FixedLocator, FuncFormatter, NullLocator  # noqa: E402


def island_borders(corners: np.ndarray, uv: np.ndarray) -> np.ndarray:
    """(k, 2, 2) UV segments: edges whose other side, if there is one, has other UVs."""
    a = np.concatenate([corners[:, k] for k in range(3)])
    b = np.concatenate([corners[:, (k + 1) % 3] for k in range(3)])
    p = np.concatenate([uv[:, k] for k in range(3)])
    q = np.concatenate([uv[:, (k + 1) % 3] for k in range(3)])
    forward = {
        (i, j, *pi, *qi) for i, j, pi, qi in zip(a, b, map(tuple, p), map(tuple, q), strict=True)
    }
    keep = [
        (j, i, *qi, *pi) not in forward
        for i, j, pi, qi in zip(a, b, map(tuple, p), map(tuple, q), strict=True)
    ]
    return np.stack([p[keep], q[keep]], axis=1)


def main(folder: str, out: str) -> None:
    data = np.load(Path(folder, "demo.npz"))
    scale = LinearSegmentedColormap.from_list("distortion", data["scale"])
    figure = plt.figure(figsize=(15, 5.4), dpi=100, facecolor="white")
    grid = figure.add_gridspec(1, 4, width_ratios=[1, 1, 1, 0.035], wspace=0.06)
    figure.subplots_adjust(left=0.02, right=0.945, top=0.93, bottom=0.10)

    layout = figure.add_subplot(grid[0])
    layout.add_collection(
        PolyCollection(data["uv"], facecolors=data["colour"], edgecolors="none", rasterized=True)
    )
    seams = island_borders(data["corners"], data["uv"])
    layout.add_collection(LineCollection(seams, colors="#0d3368", linewidths=0.9))
    layout.set(xlim=(-0.01, 1.01), ylim=(-0.01, 1.01), aspect="equal", xticks=[0, 1], yticks=[0, 1])
    layout.tick_params(length=0, labelsize=9, colors="#666666")
    for side in layout.spines.values():
        side.set_color("#bbbbbb")
    layout.set_title("UV islands with their seams", fontsize=12)

    for cell, name, title in (
        (1, "checker", "Checker on the model"),
        (2, "distortion", "Distortion"),
    ):
        axes = figure.add_subplot(grid[cell])
        axes.imshow(plt.imread(Path(folder, f"{name}.png")), interpolation="lanczos")
        axes.set_axis_off()
        axes.set_title(title, fontsize=12)

    top = float(data["top"])
    bar = figure.colorbar(
        plt.cm.ScalarMappable(LogNorm(1.0, top), scale),
        cax=figure.add_subplot(grid[3]),
        extend="max",
    )
    ticks = np.geomspace(1.0, top, 5)
    bar.ax.yaxis.set_major_locator(FixedLocator(ticks))
    bar.ax.yaxis.set_minor_locator(NullLocator())
    bar.ax.yaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:.3g}"))
    bar.ax.tick_params(labelsize=9)
    bar.set_label("symmetric Dirichlet energy, 1 = isometric", fontsize=9)

    first = str(data["certificate"]).splitlines()[0]
    figure.text(
        0.5,
        0.035,
        f"{data['name']}: {first}. Solved in {float(data['seconds']):.1f} s, Blender {data['blender']}",
        ha="center",
        fontsize=10.5,
        color="#222222",
    )
    figure.savefig(out)


if __name__ == "__main__":
    main(*sys.argv[1:])
