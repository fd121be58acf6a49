# SPDX-License-Identifier: GPL-3.0-or-later
"""Puts the demo's picture together: picture.py FOLDER OUT.png (FOLDER as in_blender.py left it)."""

import sys
from pathlib import Path

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt  # noqa: E402
import numpy as np  # noqa: E402
from matplotlib.axes import Axes  # noqa: E402
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


def draw_layout(axes: Axes, data: dict[str, np.ndarray], maker: str) -> None:
    """Islands by distortion, what touches a seam as a line."""
    uv = data[f"{maker}_uv"]
    axes.add_collection(
        PolyCollection(uv, facecolors=data[f"{maker}_colour"], edgecolors="none", rasterized=True)
    )
    seams = island_borders(data[f"{maker}_corners"], uv)
    axes.add_collection(LineCollection(seams, colors="#0d3368", linewidths=0.7))
    axes.set(xlim=(-0.01, 1.01), ylim=(-0.01, 1.01), aspect="equal", xticks=[], yticks=[])
    for side in axes.spines.values():
        side.set_color("#bbbbbb")


def main(folder: str, out: str) -> None:
    models = sorted(Path(folder).glob("*.npz"), key=lambda path: path.stat().st_mtime)
    beside = 1 if len(models) < 5 else 2
    rows = -(-len(models) // beside)
    figure = plt.figure(figsize=(12 * beside + 1, 3.5 * rows + 0.5), dpi=80, facecolor="white")
    widths = [1] * 4 * beside + [0.03]
    grid = figure.add_gridspec(rows, len(widths), width_ratios=widths, wspace=0.05)
    figure.subplots_adjust(left=0.01, right=0.94, top=0.95, bottom=0.03)
    for place, path in enumerate(models):
        row, first = place // beside, 4 * (place % beside)
        data = dict(np.load(path))
        for column, (maker, title) in enumerate(
            (("smart", "Smart UV Project"), ("auto", "Auto Unwrap"))
        ):
            layout = figure.add_subplot(grid[row, first + 2 * column])
            draw_layout(layout, data, maker)
            axes = figure.add_subplot(grid[row, first + 2 * column + 1])
            axes.imshow(
                plt.imread(path.with_name(f"{path.stem}_{maker}.png")), interpolation="lanczos"
            )
            axes.set_axis_off()
            if row == 0:
                layout.set_title(title, fontsize=13, loc="left")
        values = data["auto_value"]
        took = f", {float(data['seconds']):.1f} s" if beside == 1 else ""
        said = f"{path.stem}: {len(values)} triangles, {str(data['certificate']).split(':')[0]}, "
        layout.text(
            0.0,
            -0.03,
            f"{said}worst triangle {np.nanmax(values):.2f}{took}",
            transform=layout.transAxes,
            va="top",
            fontsize=9.5,
            color="#222222",
        )
    top = float(data["top"])
    bar = figure.colorbar(
        plt.cm.ScalarMappable(
            LogNorm(1.0, top), LinearSegmentedColormap.from_list("distortion", data["scale"])
        ),
        cax=figure.add_subplot(grid[:, -1]),
        extend="max",
    )
    bar.ax.yaxis.set_major_locator(FixedLocator(np.geomspace(1.0, top, 5)))
    bar.ax.yaxis.set_minor_locator(NullLocator())
    bar.ax.yaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:.3g}"))
    bar.set_label("symmetric Dirichlet energy, 1 = isometric", fontsize=9)
    figure.savefig(out)


if __name__ == "__main__":
    main(*sys.argv[1:])
