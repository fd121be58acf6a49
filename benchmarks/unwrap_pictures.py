"""Draws docs/images/unwrap_extremities.png: closed models with one short automatic cut, and cut to their extremities.

    PYTHONPATH=build/python python3 benchmarks/unwrap_pictures.py

Needs the shared data folder (FLIPFREE_DATA).
"""

from __future__ import annotations

import sys

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt
from embedding_pictures import distortion, draw
from matplotlib.colors import Normalize

import flipfree as ff

from mesh_files import ROOT, data_folder, read_mesh

MODELS = ("octopus_f500.obj", "human_f10575.obj")


def main() -> None:
    folder = data_folder()
    if folder is None:
        sys.exit("The shared data folder is not here (FLIPFREE_DATA).")
    figure, axes = plt.subplots(len(MODELS), 2, figsize=(9, 8), squeeze=False)
    norm = Normalize(0.0, 1.0)
    for row, name in zip(axes, MODELS, strict=True):
        mesh = read_mesh(folder / "embedding" / name)
        for panel, slit in zip(row, (False, True), strict=True):
            result = ff.unwrap(mesh.vertices, mesh.faces, cut_extremities=slit, seams="given")
            colour = distortion(mesh.vertices, mesh.faces, result.uv)
            energy = result.certificate.energy
            title = f"{len(result.cut_edges)} edges cut, energy {energy:.2f}"
            shown = draw(panel, result.uv, colour, norm, title)
    figure.colorbar(shown, ax=axes, shrink=0.6, label="log10 of a face's energy")
    figure.savefig(ROOT / "docs/images/unwrap_extremities.png", dpi=110, bbox_inches="tight")


if __name__ == "__main__":
    main()
