"""Draws docs/images/field_fertility.png and field_sources.png: fields, their cones, and checkers that run along them.

    FLIPFREE_DATA=... PYTHONPATH=build/python:tests python3 benchmarks/field_pictures.py [OUTPUT_FOLDER]

Needs the shared data folder.
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
from seamless_pictures import SADDLE, SEAM, SHARP, checker, visible

import flipfree as ff

from mesh_files import ROOT, data_folder, read_mesh

sys.path.insert(0, str(ROOT / "scripts"))
from render_conformal import View, camera, rasterise, shade  # noqa: E402

CROSS = "#123f9e"
GREY = np.array([0.86, 0.87, 0.90])


def picture_of(map: ff.Parametrization, view: View, size: float) -> np.ndarray:
    """The surface with a checker of fields of this size, or grey if that is 0."""
    screen = camera(map.vertices, view)
    face, weights, _ = rasterise(screen, map.faces)
    light = shade(map.vertices, map.faces, view)[face][..., None]
    colour = GREY if size == 0 else checker((weights[..., None] * map.uv[face]).sum(2), size)
    return np.where(face[..., None] < 0, 1.0, colour * light)


def draw_cones(panel: Any, map: ff.Parametrization, view: View) -> None:
    cones = map.certificate.quarter_cones
    at = map.vertices[cones[:, 0]]
    seen = visible(map, view, at)
    places = camera(np.concatenate([map.vertices, at]), view)[len(map.vertices) :]
    colours = np.where(cones[:, 1] < 4, SHARP, SADDLE)
    panel.scatter(
        *places[seen, :2].T, s=26, c=colours[seen], zorder=3, edgecolors="white", linewidths=0.6
    )


def draw_seams(panel: Any, map: ff.Parametrization, view: View) -> None:
    ends = map.vertices[map.cut_edges]
    shown = visible(map, view, ends.mean(1))
    places = camera(np.concatenate([map.vertices, ends.reshape(-1, 3)]), view)
    lines = places[len(map.vertices) :, :2].reshape(-1, 2, 2)[shown]
    panel.add_collection(LineCollection(lines, colors=SEAM, linewidths=0.9))


def draw_field(panel: Any, map: ff.Parametrization, field: ff.CrossField, view: View) -> None:
    """A cross on some faces, evenly spread."""
    corners = map.vertices[map.faces]
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    area = np.linalg.norm(normal, axis=1)
    count = min(len(map.faces), 2600)
    chosen = np.searchsorted(np.cumsum(area) / area.sum(), (np.arange(count) + 0.5) / count)
    chosen = np.unique(chosen)
    centre = corners[chosen].mean(1)
    chosen, centre = (x[visible(map, view, centre)] for x in (chosen, centre))
    x = field.directions[map.parent_face[chosen]]
    y = np.cross(normal[chosen] / area[chosen, None], x)
    arm = 0.36 * np.sqrt(area.sum() / 2 / count)
    ends = np.stack([centre - arm * x, centre + arm * x, centre - arm * y, centre + arm * y], 1)
    places = camera(np.concatenate([map.vertices, ends.reshape(-1, 3)]), view)
    lines = places[len(map.vertices) :, :2].reshape(-1, 2, 2)
    panel.add_collection(LineCollection(lines, colors=CROSS, linewidths=0.9))


def field_and_map(path: Path, mesh: Any, view: View, alignment: float) -> None:
    field = ff.cross_field(mesh.vertices, mesh.faces, alignment=alignment, simplify=True)
    map = ff.field_aligned(mesh.vertices, mesh.faces, field=field)
    print(path.stem, map.certificate, "off", np.degrees(map.stats["angle_mean"]))
    size = float(np.ptp(map.vertices, axis=0).max()) / 30
    figure, (left, right) = plt.subplots(1, 2, figsize=(11, 5))
    left.imshow(picture_of(map, view, 0))
    draw_field(left, map, field, view)
    draw_cones(left, map, view)
    right.imshow(picture_of(map, view, size))
    draw_seams(right, map, view)
    draw_cones(right, map, view)
    save(figure, (left, right), path)


def sources(path: Path, mesh: Any, view: View) -> None:
    """One model, three sources."""
    v, f = mesh.vertices, mesh.faces
    free = ff.seamless(v, f)
    smooth = ff.field_aligned(v, f, field=ff.cross_field(v, f, simplify=True))
    bent = ff.field_aligned(v, f, field=ff.cross_field(v, f, alignment=0.5, simplify=True))
    figure, panels = plt.subplots(1, 3, figsize=(13.5, 4.6))
    for panel, map, title in zip(
        panels, (free, smooth, bent), ("Seamless Map", "Smooth", "Curvature"), strict=True
    ):
        print(path.stem, title, map.certificate)
        panel.imshow(picture_of(map, view, float(np.ptp(v, axis=0).max()) / 30))
        draw_cones(panel, map, view)
        panel.set_title(title)
    save(figure, panels, path)


def save(figure: Any, panels: Any, path: Path) -> None:
    for panel in panels:
        panel.set_axis_off()
    figure.subplots_adjust(0.01, 0.01, 0.99, 0.93, wspace=0.03)
    figure.savefig(path, dpi=85)
    plt.close(figure)


def main() -> None:
    folder = Path(sys.argv[1]) if len(sys.argv) > 1 else ROOT / "docs/images"
    data = data_folder()
    if data is None:
        sys.exit("The shared data folder is not here (FLIPFREE_DATA).")
    field_and_map(
        folder / "field_fertility.png",
        read_mesh(data / "fields" / "fertility_input.obj"),
        View(20, 70),
        0.5,
    )
    sources(
        folder / "field_sources.png",
        read_mesh(data / "fields" / "rocker-arm2500.obj"),
        View(100, 20),
    )


if __name__ == "__main__":
    main()
