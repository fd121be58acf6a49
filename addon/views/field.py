# SPDX-License-Identifier: GPL-3.0-or-later
"""The field over the model: a cross on each face that has a direction in the attribute `flipfree_field`."""

from dataclasses import dataclass

import numpy as np

from ..meshes import fields
from . import shapes

COLOUR = (0.05, 0.25, 0.75, 1.0)
# Relative to the square root of a face's area: half a cross, half a line's width, above the face.
_ARM, _WIDTH, _LIFT = 0.38, 0.035, 0.04


@dataclass
class _Faces:
    """(k, 3) of the faces with a direction; area (k,)."""

    centre: np.ndarray
    normal: np.ndarray
    direction: np.ndarray
    area: np.ndarray


def draw(read, drawing: shapes.Drawing) -> None:
    found = _faces(read.mesh)
    if found is None:
        drawing.notes.append((COLOUR, f"no field in the attribute {fields.NAME}"))
        return
    drawing.shapes.append(shapes.Shape(shapes.SURFACE, "TRIS", _crosses(found), COLOUR))


def there_is(mesh) -> bool:
    attribute = mesh.attributes.get(fields.NAME)
    return attribute is not None and (attribute.domain, attribute.data_type) == (
        "FACE",
        "FLOAT_VECTOR",
    )


def _faces(mesh) -> _Faces | None:
    if not there_is(mesh):
        return None
    count = len(mesh.polygons)
    centre, normal, direction = (np.zeros((count, 3), np.float32) for _ in range(3))
    area = np.zeros(count, np.float32)
    mesh.polygons.foreach_get("center", centre.ravel())
    mesh.polygons.foreach_get("normal", normal.ravel())
    mesh.polygons.foreach_get("area", area)
    mesh.attributes[fields.NAME].data.foreach_get("vector", direction.ravel())
    return _Faces(centre, normal, direction, area)


def _crosses(read: _Faces) -> np.ndarray:
    """Two thin rectangles on each face that has a direction."""
    along = (
        read.direction - read.normal * np.einsum("ij,ij->i", read.direction, read.normal)[:, None]
    )
    length = np.linalg.norm(along, axis=1)
    good = (length > 1e-6) & np.isfinite(length) & (read.area > 0)
    x = along[good] / length[good, None]
    y = np.cross(read.normal[good], x)
    unit = np.sqrt(read.area[good])[:, None]
    middle = read.centre[good] + _LIFT * unit * read.normal[good]
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
