"""Draws docs/images/repair.png: a map with flipped, collapsed and stray faces, and the same repaired.

    PYTHONPATH=build/python python3 benchmarks/repair_pictures.py

Needs the shared data folder (FLIPFREE_DATA).
"""

from __future__ import annotations

import sys

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt
import numpy as np
import numpy.typing as npt
from map_damage import Map, map_of
from matplotlib.collections import PolyCollection

import flipfree as ff

from mesh_files import ROOT, data_folder, read_mesh

SOUND, FLIPPED, CHANGED = "#9fb6cd", "#d62728", "#f2b134"


def damaged(faces: npt.NDArray[np.int32], uv: npt.NDArray[np.float64]) -> Map:
    """Points thrown about, a part mirrored in place, values lost."""
    random = np.random.default_rng(3)
    given = map_of(faces, uv)
    places = given.places()
    chosen = random.choice(given.points, 12, replace=False)
    places[chosen] += random.normal(size=(12, 2)) * 0.12
    middle = places[np.linalg.norm(places - places.mean(axis=0), axis=1).argmin()]
    inside = np.linalg.norm(places - middle, axis=1) < 0.07
    places[inside, 0] = 2 * middle[0] - places[inside, 0]
    given.put(places)
    return given


def draw(
    panel: plt.Axes, uv: npt.NDArray[np.float64], colours: npt.NDArray[np.str_], title: str
) -> None:
    panel.add_collection(PolyCollection(list(uv), facecolors=colours, edgecolors="black", lw=0.15))
    panel.autoscale()
    panel.set_aspect("equal")
    panel.axis("off")
    panel.set_title(title, fontsize=10)


def main() -> None:
    folder = data_folder()
    if folder is None:
        sys.exit("The shared data folder is not here (FLIPFREE_DATA).")
    mesh = read_mesh(folder / "general" / "octopus.obj")
    base = ff.unwrap(mesh.vertices, mesh.faces, seams="given")
    given = damaged(mesh.faces, base.uv32().astype(np.float64))
    result = ff.repair(mesh.vertices, mesh.faces, given.uv)
    e, d = given.uv[:, 1] - given.uv[:, 0], given.uv[:, 2] - given.uv[:, 0]
    flipped = e[:, 0] * d[:, 1] - e[:, 1] * d[:, 0] <= 0
    changed = (result.uv != given.uv).any(axis=(1, 2))
    stats = result.stats
    kept = 100 * stats["corners_kept"] / (3 * len(mesh.faces))
    figure, (left, right) = plt.subplots(1, 2, figsize=(11, 5.5), sharex=True, sharey=True)
    draw(
        left,
        given.uv,
        np.where(flipped, FLIPPED, SOUND),
        f"{stats['flips_before']} faces flipped (red)",
    )
    draw(
        right,
        result.uv,
        np.where(changed, CHANGED, SOUND),
        f"0 flipped; {kept:.1f} % of the UVs bit for bit as before (blue)",
    )
    figure.tight_layout()
    figure.savefig(ROOT / "docs/images/repair.png", dpi=110)
    print(stats)


if __name__ == "__main__":
    main()
