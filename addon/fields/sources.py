# SPDX-License-Identifier: GPL-3.0-or-later
"""What a field follows and how dense its map shall be, as the mesh says it."""

import math
from dataclasses import dataclass

import bpy
import numpy as np

from ..meshes import fields
from ..operators import cone_sums

# Edges at which the surface folds by more are sharp, radians.
SHARP = math.radians(30.0)

# Full alignment to curvature is no number below 1.
_MOST_CURVATURE = 0.99


@dataclass
class Given:
    """What was read from the mesh."""

    follow: dict  # arguments of solver.cross_field
    directions: np.ndarray | None = None  # (#St, 3): the field itself
    cones: dict[int, float] | None = None  # {submesh vertex: angle}: those of the field
    sizing: np.ndarray | None = None  # (#Sv,)


def look(
    snapshot,
    *,
    field_from="curvature",
    curvature=0.5,
    sharp_angle=SHARP,
    edge_weight=1.0,
    attribute=fields.NAME,
    merge_cones=True,
    density="uniform",
    density_name="",
    density_ratio=2.0,
) -> Given:
    """Reads from the mesh what the field follows and how dense the map shall be. Raises MeshProblem."""
    ob = bpy.data.objects[snapshot.object_name]
    given = Given(
        {
            "edges": None,
            "edge_weight": edge_weight,
            "curvature": min(curvature, _MOST_CURVATURE) if field_from == "curvature" else 0.0,
            "simplify": merge_cones and field_from != "cones",
        }
    )
    if field_from == "edges":
        sharp = fields.marked_sharp(ob, snapshot)
        given.follow["edges"] = sharp if len(sharp) else fields.sharper_than(snapshot, sharp_angle)
    elif field_from == "flow":
        given.follow["edges"] = fields.flow(snapshot)
    elif field_from == "attribute":
        given.directions = fields.read(ob, snapshot, attribute)
    elif field_from == "cones":
        given.cones, _ = cone_sums.marked(ob, snapshot)
    if density == "painted":
        given.sizing = fields.painted(ob, snapshot, density_name, density_ratio)
    elif density == "attribute":
        given.sizing = fields.densities(ob, snapshot, density_name)
    return given
