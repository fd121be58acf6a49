"""Draws docs/images/auto_seams_*.png: models with the seams that were found, and their islands, stretch coloured.

    PYTHONPATH=build/python python3 benchmarks/auto_seams_pictures.py [--out FOLDER] [NAME ...]

Needs the shared data folder (FLIPFREE_DATA). Names: of its folder seams, or of the shapes made here.
"""

from __future__ import annotations

import argparse
import sys
from pathlib import Path
from typing import Any

import matplotlib
import numpy as np

matplotlib.use("Agg")
import matplotlib.pyplot as plt
from auto_seams import seams_and_islands, singular_values
from matplotlib.collections import LineCollection, PolyCollection

import flipfree as ff

from mesh_files import ROOT, data_folder, read_mesh

MODELS = (
    "horse_f10000",
    "bunny",
    "hand_1_i_f5000",
    "cow2",
    "statue_1_i_f8000",
    "octopus_mainComp_f6000",
)
SHAPES = ("cube", "cylinder", "cone", "torus", "ball")


def revolved(profile: Any, sectors: int, closed: bool = False) -> tuple[Any, Any, Any]:
    """Points (radius, height) turned around the axis; points of radius 0 are one vertex. Quads with their diagonals."""
    vertices, rings = [], []
    for radius, height in profile:
        count = sectors if radius > 0 else 1
        angle = 2 * np.pi * np.arange(count) / sectors
        rings.append(np.arange(count) + len(vertices))
        vertices += np.stack(
            [radius * np.cos(angle), radius * np.sin(angle), np.full(count, float(height))], -1
        ).tolist()
    if closed:
        rings.append(rings[0])
    faces, diagonals = [], []
    for low, high in zip(rings[:-1], rings[1:], strict=True):
        for i in range(sectors):
            a, b, c, d = (
                r[k % len(r)] for r, k in ((low, i), (low, i + 1), (high, i + 1), (high, i))
            )
            faces += [f for f in ([a, b, c], [a, c, d]) if len(set(f)) == 3]
            if len({a, b, c, d}) == 4:
                diagonals.append([a, c])
    return np.array(vertices), np.array(faces), np.array(diagonals).reshape(-1, 2)


def shape(name: str) -> tuple[Any, Any, Any]:
    turn = np.linspace(0, np.pi, 13)
    if name == "cube":
        vertices = np.array([[x, y, z] for x in (0, 1) for y in (0, 1) for z in (0, 1)], float)
        quads = [[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]]
        faces = [[q[0], q[i], q[i + 1]] for q in quads for i in (1, 2)]
        return vertices, np.array(faces), np.array([[q[0], q[2]] for q in quads])
    if name == "cylinder":
        return revolved([(0, 0), (1, 0), (1, 2), (0, 2)], 24)
    if name == "cone":
        return revolved([(0, 0), (1, 0), (0, 2)], 24)
    if name == "torus":
        angle = 2 * np.pi * np.arange(12) / 12
        return revolved(np.stack([1 + 0.35 * np.cos(angle), 0.35 * np.sin(angle)], -1), 36, True)
    return revolved(np.round(np.stack([np.sin(turn), -np.cos(turn)], -1), 12), 24)


def draw_model(panel: Any, vertices: Any, faces: Any, seams: Any, colour: Any, turn: float) -> None:
    """From the side, the nearest faces last; hidden seams faintly."""
    centred = vertices - 0.5 * (vertices.min(0) + vertices.max(0))
    up = 1 if np.ptp(vertices[:, 1]) >= np.ptp(vertices[:, 2]) else 2
    flat = [i for i in range(3) if i != up]
    c, s = np.cos(turn), np.sin(turn)
    x = c * centred[:, flat[0]] + s * centred[:, flat[1]]
    z = -s * centred[:, flat[0]] + c * centred[:, flat[1]]
    if up == 1:
        z = -z
    tilt = 0.25
    y, z = centred[:, up] - tilt * z * 0.5, z * (-1 if up == 2 else -1)
    places = np.stack([x, y], -1)
    order = np.argsort(z[faces].mean(1))
    a, b = (vertices[faces[:, k]] - vertices[faces[:, 0]] for k in (1, 2))
    normal = np.cross(a, b)
    normal /= np.maximum(np.linalg.norm(normal, axis=1, keepdims=True), 1e-300)
    light = 0.62 + 0.38 * normal @ np.array([0.5, 0.7, 0.5]) / np.linalg.norm([0.5, 0.7, 0.5])
    shaded = np.clip(colour[:, :3] * light[:, None], 0, 1)
    panel.add_collection(
        PolyCollection(
            places[faces][order], facecolors=shaded[order], edgecolors=shaded[order], linewidths=0.3
        )
    )
    panel.add_collection(LineCollection(places[seams], colors="black", linewidths=1.4))
    panel.autoscale_view()
    panel.set_aspect("equal")
    panel.axis("off")


def draw(name: str, out: Path) -> None:
    folder = data_folder()
    if name in SHAPES:
        vertices, faces, diagonals = shape(name)
    elif folder is None:
        sys.exit("The shared data folder is not here (FLIPFREE_DATA).")
    else:
        mesh = read_mesh(folder / "seams" / f"{name}.obj")
        vertices, faces, diagonals = mesh.vertices, mesh.faces, None
    result = ff.unwrap(vertices, faces, seams="auto", uncuttable=diagonals)
    uv = np.asarray(result.uv)
    seams, island = seams_and_islands(faces, uv)
    colours = plt.get_cmap("tab10")(np.unique(island, return_inverse=True)[1] % 10)
    s, area = singular_values(vertices, faces, uv)
    scale = np.sqrt(area.sum() / (area * s.prod(1)).sum())
    figure, axes = plt.subplots(1, 4, figsize=(15, 4.4), dpi=80)
    for panel, turn in zip(axes[:3], (0.4, 0.4 + 2 * np.pi / 3, 0.4 + 4 * np.pi / 3), strict=True):
        draw_model(panel, vertices, faces, seams, 0.55 + 0.45 * colours, turn)
    shown = PolyCollection(
        uv, array=np.log2((s * scale)[:, 0]), cmap="coolwarm", edgecolors="face", linewidths=0.2
    )
    shown.set_clim(-0.6, 0.6)
    axes[3].add_collection(shown)
    axes[3].autoscale_view()
    axes[3].set_aspect("equal")
    axes[3].axis("off")
    energy, islands = result.certificate.energy, len(np.unique(island))
    axes[3].set_title(
        f"{name}: {islands} island{'s' * (islands > 1)}, energy {energy:.4f}", fontsize=10
    )
    figure.tight_layout()
    figure.savefig(out / f"auto_seams_{name}.png")
    plt.close(figure)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("names", nargs="*", default=[*MODELS, *SHAPES])
    parser.add_argument("--out", type=Path, default=ROOT / "docs/images")
    arguments = parser.parse_args()
    for name in arguments.names:
        draw(name, arguments.out)


if __name__ == "__main__":
    main()
