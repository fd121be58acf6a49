# SPDX-License-Identifier: GPL-3.0-or-later
"""The field over the model: a cross on each face that has a direction in the attribute `flipfree_field`."""

import numpy as np

from .. import compat
from ..meshes import fields
from . import shapes

COLOUR = (0.05, 0.25, 0.75, 1.0)
# Relative to the square root of a face's area: half a cross, half a line's width, above the face.
_ARM, _WIDTH, _LIFT = 0.38, 0.035, 0.04


def draw(read, drawing: shapes.Drawing) -> None:
    direction = _directions(read.mesh)
    if direction is None:
        drawing.notes.append((COLOUR, f"no field in the attribute {fields.NAME}"))
        return
    drawing.shapes.append(
        shapes.Shape(shapes.SURFACE, "TRIS", _crosses(read.mesh, direction), COLOUR)
    )


def there_is(mesh) -> bool:
    return _directions(mesh) is not None


def _directions(mesh) -> np.ndarray | None:
    return compat.attribute(mesh, fields.NAME, "FACE", "FLOAT_VECTOR")


def _crosses(mesh, direction: np.ndarray) -> np.ndarray:
    """Two thin rectangles on each face that has a direction."""
    centre, normal = (compat.values(mesh.polygons, n, np.float32, 3) for n in ("center", "normal"))
    area = compat.values(mesh.polygons, "area", np.float32)
    along = direction - normal * np.einsum("ij,ij->i", direction, normal)[:, None]
    length = np.linalg.norm(along, axis=1)
    good = (length > 1e-6) & np.isfinite(length) & (area > 0)
    x = along[good] / length[good, None]
    y = np.cross(normal[good], x)
    unit = np.sqrt(area[good])[:, None]
    middle = centre[good] + _LIFT * unit * normal[good]
    parts = []
    for a, b in ((x, y), (y, x)):
        arm, side = _ARM * unit * a, _WIDTH * unit * b
        p, q, r, s = (
            middle - arm - side,
            middle + arm - side,
            middle + arm + side,
            middle - arm + side,
        )
        parts += [p, q, r, p, r, s]
    return np.stack(parts, axis=1).reshape(-1, 3).astype(np.float32)
