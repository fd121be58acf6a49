# SPDX-License-Identifier: GPL-3.0-or-later
"""Faces in the colours of a measure: values of a mesh, their place on a scale, its colours."""

import math
from dataclasses import dataclass

import numpy as np

from .. import aspect, scene, texture
from . import measures, shapes, state

ALPHA = 0.85
BEYOND = (0.95, 0.0, 0.85, ALPHA)  # flipped: no value
UNKNOWN = (0.45, 0.45, 0.45, ALPHA)  # no area on the surface
_LOW_TO_HIGH = np.array(
    [(0.10, 0.28, 0.58), (0.16, 0.62, 0.58), (0.96, 0.86, 0.32), (0.84, 0.16, 0.10)]
)
_BOTH_WAYS = np.array([(0.10, 0.25, 0.75), (0.88, 0.88, 0.86), (0.80, 0.12, 0.08)])


@dataclass(frozen=True)
class Scale:
    """Logarithmic, from low to high; for the latter ends times the mean if `relative`."""

    title: str
    low: float
    high: float
    colours: np.ndarray
    relative: bool = False
    unit: str = ""
    last: str = "worst"  # what the largest value is called

    def place(self, values: np.ndarray, reference: float) -> np.ndarray:
        """0 to 1 along the scale, less and more beyond it; inf and nan stay."""
        with np.errstate(divide="ignore", invalid="ignore"):
            along = np.log(values / (reference if self.relative else 1.0) / self.low)
        return along / math.log(self.high / self.low)

    def value(self, place: float, reference: float) -> float:
        start = self.low * (reference if self.relative else 1.0)
        return start * (self.high / self.low) ** place


SCALES = {
    "distortion": Scale("Symmetric Dirichlet (1: none)", 1.0, 5.0, _LOW_TO_HIGH),
    "angle": Scale("Shear (1: none)", 1.0, 5.0, _LOW_TO_HIGH),
    "area": Scale("Area in the map (1: mean)", 0.25, 4.0, _BOTH_WAYS, last="largest"),
    "density": Scale(
        "Texel density", 0.25, 4.0, _BOTH_WAYS, relative=True, unit="px", last="largest"
    ),
}


def measure(what: str, found: measures.Stretch, pixels: int) -> np.ndarray:
    """(t,) values of one of SCALES. found: of the surface in the scene for texel density, else of the object."""
    if what == "density":
        return measures.density(found, pixels)
    return {
        "distortion": measures.dirichlet,
        "angle": measures.angle,
        "area": measures.area,
    }[what](found)


def draw(read, drawing: shapes.Drawing) -> None:
    """The values; `colour` gives them their colours once it is known what they are relative to."""
    if not read.layer or not len(read.loops):
        return
    uv = read.uv[read.loops]
    seen = uv * aspect.sides(aspect.shown(read.ob))
    in_scene = measures.stretch(scene.placed(read.corner_points, read.ob), seen)
    what = state.current.faces
    found = in_scene if what == "density" else measures.stretch(read.corner_points, seen)
    drawing.values = measure(what, found, texture.size())
    drawing.face_values = measures.of_faces(drawing.values, found.area, read.faces)
    # Of one object as in its certificate, of several by their sizes in the scene.
    grown = float(in_scene.area.sum()) / max(float(found.area.sum()), 1e-300)
    drawing.weights = found.area * grown
    drawing.shapes.insert(
        0,
        shapes.Shape(
            shapes.SURFACE, "TRIS", read.corner_points.reshape(-1, 3), BEYOND, raised=True
        ),
    )
    finite = np.where(np.isfinite(uv), uv, 0.0)
    drawing.shapes.insert(1, shapes.Shape(shapes.MAP, "TRIS", shapes.in_plane(finite), BEYOND))


def colour(drawing: shapes.Drawing, scale: Scale, reference: float) -> None:
    """Of the two shapes that `draw` made."""
    if drawing.values is None:
        return
    corners = np.repeat(colours(scale, scale.place(drawing.face_values, reference)), 3, axis=0)
    for shape in drawing.shapes[:2]:
        shape.colour = corners


def colours(scale: Scale, places: np.ndarray) -> np.ndarray:
    """(k, 4) float32 of places along the scale."""
    anchors = scale.colours
    steps = len(anchors) - 1
    finite = np.isfinite(places)
    at = np.clip(np.where(finite, places, 0.0), 0.0, 1.0) * steps
    left = np.minimum(at.astype(np.int64), steps - 1)
    share = (at - left)[:, None]
    result = np.empty((len(places), 4), np.float32)
    result[:, :3] = anchors[left] * (1 - share) + anchors[left + 1] * share
    result[:, 3] = ALPHA
    # No texels at all are the scale's low end; flipped faces have no place on it.
    result[np.isneginf(places)] = (*anchors[0], ALPHA)
    result[np.isposinf(places)] = BEYOND
    result[np.isnan(places)] = UNKNOWN
    return result
