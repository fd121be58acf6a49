# SPDX-License-Identifier: GPL-3.0-or-later
"""What the views hand to the drawing callbacks: arrays and texts, nothing of Blender's."""

from dataclasses import dataclass, field

import numpy as np

SURFACE, MAP = "SURFACE", "MAP"  # in the 3D viewport, in object coordinates; in the UV editor


@dataclass
class Shape:
    """kind: TRIS or LINES. pos (k, 3) float32. colour: one of four numbers, or (k, 4) float32. raised: what lies exactly on the
    model is drawn in front of it."""

    place: str
    kind: str
    pos: np.ndarray
    colour: tuple | np.ndarray
    raised: bool = False


@dataclass
class Mark:
    """A place to be pointed at, with a text or none; of the same size at every zoom. normal: of the surface; places that it
    turns away from the viewer are not shown."""

    place: str
    at: tuple  # (x, y, z)
    colour: tuple
    text: str = ""
    normal: tuple | None = None


@dataclass
class Drawing:
    """Of one object. values, weights: (t,) of the triangles whose distribution the legend shows; face_values: (t,) what each
    one's face is coloured by, the mean of its triangles. notes: lines of the legend."""

    shapes: list[Shape] = field(default_factory=list)
    marks: list[Mark] = field(default_factory=list)
    # (colour of a square before it, text)
    notes: list[tuple[tuple, str]] = field(default_factory=list)
    values: np.ndarray | None = None
    weights: np.ndarray | None = None
    face_values: np.ndarray | None = None


def in_plane(uv: np.ndarray) -> np.ndarray:
    """(..., 2) -> (k, 3) float32 with a zero."""
    flat = uv.reshape(-1, 2).astype(np.float32)
    return np.column_stack([flat, np.zeros(len(flat), np.float32)])
