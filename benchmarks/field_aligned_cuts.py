"""What a cut looks like without and with branches rerouted, and what maps come of it (thesis figure 6.9).

Drawn by `field_aligned_rerouting.py --pictures FOLDER`.
"""

from __future__ import annotations

from pathlib import Path
from types import SimpleNamespace
from typing import Any

import matplotlib
import numpy as np

matplotlib.use("Agg")
import matplotlib.pyplot as plt
from field_aligned import Mesh
from matplotlib.collections import LineCollection
from seamless_pictures import SADDLE, SHARP, View, camera, checker, rasterise, shade, visible

import flipfree as ff
from flipfree import _native
from flipfree.arrays import as_indices, as_vertices
from flipfree.fields.cross_fields import arrays_of

BRANCH = "#b3140a"
VIEWS = {
    "eight": View(15, 35),
    "eight766": View(15, 35),
    "holes3_libigl": View(20, 50),
    "gtorus004_fine": View(20, 50),
    "1146164": View(35, 35),
}
FIELDS_ACROSS = 40  # of the checker, over the square root of the map's area


def branches_of(mesh: Mesh, field: ff.CrossField, reroute: bool) -> list[np.ndarray]:
    """The cut's branches as lines in space."""
    _, vertices, faces = mesh
    face_array = as_indices(faces, "faces", 3)
    positions = as_vertices(vertices, face_array)
    arrays = arrays_of(field, face_array)
    _, lines = _native.field_cut(positions.scaled, face_array, *arrays, reroute, 1).result()
    return [line * 2.0**positions.exponent for line in lines]


def draw_cut(panel: Any, mesh: Mesh, field: ff.CrossField, view: View, reroute: bool) -> None:
    _, vertices, faces = mesh
    surface = SimpleNamespace(vertices=vertices, faces=faces)
    face, _, _ = rasterise(camera(vertices, view), faces)
    light = shade(vertices, faces, view)[face]
    panel.imshow(np.where(face < 0, 1.0, 0.45 + 0.5 * light), cmap="gray", vmin=0, vmax=1)
    for line in branches_of(mesh, field, reroute):
        pieces = np.stack([line[:-1], line[1:]], 1)
        seen = visible(surface, view, pieces.mean(1))
        flat = camera(np.concatenate([vertices, line]), view)[len(vertices) :, :2]
        segments = np.stack([flat[:-1], flat[1:]], 1)
        panel.add_collection(LineCollection(segments[seen], colors=BRANCH, linewidths=1.6))
        panel.add_collection(
            LineCollection(segments[~seen], colors=BRANCH, linewidths=0.5, alpha=0.35)
        )
    cones = ff.signature(vertices, faces, field).cones
    at = vertices[list(cones)]
    seen = visible(surface, view, at)
    places = camera(np.concatenate([vertices, at]), view)[len(vertices) :, :2]
    colours = np.where(np.array(list(cones.values())) < 4, SHARP, SADDLE)
    panel.scatter(
        *places[seen].T, s=16, c=colours[seen], zorder=3, edgecolors="white", linewidths=0.5
    )
    panel.set_axis_off()


def draw_map(panel: Any, map: ff.Parametrization, view: View) -> None:
    face, weights, _ = rasterise(camera(map.vertices, view), map.faces)
    uv = (weights[..., None] * map.uv[face]).sum(2)
    light = shade(map.vertices, map.faces, view)[face][..., None]
    size = np.sqrt(map_area(map)) / FIELDS_ACROSS
    panel.imshow(np.where(face[..., None] < 0, 1.0, checker(uv, size) * light))
    panel.set_axis_off()


def map_area(map: ff.Parametrization) -> float:
    b, c = (map.uv[:, k] - map.uv[:, 0] for k in (1, 2))
    return float(0.5 * (b[:, 0] * c[:, 1] - b[:, 1] * c[:, 0]).sum())


def draw(path: Path, mesh: Mesh, field: ff.CrossField, maps: list[ff.Parametrization]) -> None:
    """`maps`: without rerouting, with."""
    view = VIEWS.get(mesh[0], View(20, 30, "y"))
    figure, panels = plt.subplots(2, 2, figsize=(10, 10))
    for row, (reroute, map) in enumerate(zip((False, True), maps, strict=True)):
        draw_cut(panels[row][0], mesh, field, view, reroute)
        draw_map(panels[row][1], map, view)
        degrees = np.degrees(map.stats["angle_mean"])
        panels[row][0].set_title("rerouted" if reroute else "as it is")
        panels[row][1].set_title(f"{degrees:.1f} degrees from the field")
    figure.subplots_adjust(0.01, 0.01, 0.99, 0.95, wspace=0.02, hspace=0.06)
    figure.savefig(path, dpi=80)
    plt.close(figure)
