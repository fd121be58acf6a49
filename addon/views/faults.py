# SPDX-License-Identifier: GPL-3.0-or-later
"""Flipped, degenerate and overlapping faces, by exact arithmetic: for drawing them and for selecting them.

Overlaps come from a certificate, which a solver thread computes; it names a thousand faces of them at most, and all of islands
that lie on each other.
"""

from dataclasses import dataclass

import numpy as np

from .. import solver
from ..meshes import labels
from ..operators import common
from . import measures, shapes

FLIPPED = (1.0, 0.05, 0.05, 0.9)
DEGENERATE = (1.0, 0.0, 0.95, 0.95)
OVERLAPPING = (1.0, 0.6, 0.0, 0.85)


@dataclass
class Faults:
    """(k,) faces of the mesh; `overlapping` has those that are no more than that."""

    flipped: np.ndarray
    degenerate: np.ndarray
    overlapping: np.ndarray
    stacked_pairs: int  # of islands that share area


def start(snapshot):
    """Starts the certificate that `collect` wants."""
    return solver.certify(
        snapshot,
        snapshot.corner_uv.astype(np.float64),
        bijective=True,
        disjoint=True,
        mirrored="islands",
    )


def sides(snapshot) -> tuple[np.ndarray, np.ndarray]:
    """(#St,) each: the sign of the triangle's area in the map, exactly; whether its whole island is mirrored."""
    sign = measures.orientation(snapshot.corner_uv)
    label = labels.island_labels(snapshot.triangles, snapshot.corner_uv)
    return sign, ~np.isin(label, label[sign >= 0])


def collect(snapshot, certificate) -> Faults:
    sign, mirrored = sides(snapshot)
    flipped = np.unique(snapshot.triangle_face[(sign < 0) & ~mirrored])
    degenerate = np.setdiff1d(snapshot.triangle_face[sign == 0], flipped)
    label = labels.island_labels(snapshot.triangles, snapshot.corner_uv)
    wrong = np.isin(label, np.unique(label[certificate.island_overlap_faces]))
    wrong[certificate.failed_faces] = True
    named = np.unique(snapshot.triangle_face[wrong])
    overlapping = np.setdiff1d(named, np.concatenate([flipped, degenerate]))
    return Faults(flipped, degenerate, overlapping, max(certificate.island_overlaps, 0))


def draw(snapshot, found: Faults, drawing: shapes.Drawing) -> None:
    """On the snapshot's triangles, in object coordinates and in the map."""
    rows = (
        (OVERLAPPING, found.overlapping, "overlapping"),
        (FLIPPED, found.flipped, "flipped"),
        (DEGENERATE, found.degenerate, "without area in the map"),
    )
    for colour, faces, text in rows:
        drawing.notes.append((colour, f"{common.plural(len(faces), 'face')} {text}"))
        chosen = np.isin(snapshot.triangle_face, faces)
        if not chosen.any():
            continue
        corners = snapshot.vertices[snapshot.triangles[chosen]].reshape(-1, 3).astype(np.float32)
        uv = snapshot.corner_uv[chosen]
        drawing.shapes += [
            shapes.Shape(shapes.SURFACE, "TRIS", corners, colour, raised=True),
            shapes.Shape(shapes.MAP, "TRIS", shapes.in_plane(uv), colour),
            shapes.Shape(shapes.MAP, "LINES", shapes.in_plane(uv[:, [0, 1, 1, 2, 2, 0]]), colour),
        ]
    if found.stacked_pairs:
        text = common.overlaps_text(0, found.stacked_pairs)
        drawing.notes.append((OVERLAPPING, text))
