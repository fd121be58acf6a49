# SPDX-License-Identifier: GPL-3.0-or-later
"""What a field follows and how dense its map shall be, as the mesh says it."""

import math
from dataclasses import dataclass

import bpy
import numpy as np

import flipfree

from ..meshes import fields, marks, mesh_io
from ..operators import cone_sums

# Edges at which the surface folds by more are sharp, radians.
SHARP = math.radians(30.0)

# Full alignment to curvature is no number below 1.
_MOST_CURVATURE = 0.99


@dataclass
class Given:
    """What was read from the mesh."""

    follow: dict  # arguments of solver.cross_field
    features: bool = False  # are its sharp edges lines that the map shall have?
    field: flipfree.CrossField | None = None  # itself
    cones: dict[int, float] | None = None  # {submesh vertex: angle}: those of the field
    signature: flipfree.Signature | None = None  # cones and loops of it
    loops: list | tuple = ()  # [(triangles, quarter turns)], with cones
    sizing: np.ndarray | None = None  # (#Sv,)


def look(
    snapshot,
    *,
    field_from="curvature",
    curvature=0.5,
    sharp_angle=SHARP,
    edge_weight=1.0,
    attribute=fields.NAME,
    field_file="",
    merge_cones=True,
    density="uniform",
    density_name="",
    density_ratio=2.0,
) -> Given:
    """Reads from the mesh what the field follows and how dense the map shall be. Raises MeshProblem."""
    ob = bpy.data.objects[snapshot.object_name]
    given = Given(
        {
            "sharp_edges": None,
            "edge_weight": edge_weight,
            "alignment": min(curvature, _MOST_CURVATURE) if field_from == "curvature" else 0.0,
            "simplify": merge_cones and field_from not in {"cones", "signature"},
        }
    )
    if field_from == "edges":
        given.features = True
        sharp = fields.marked_sharp(ob, snapshot)
        given.follow["sharp_edges"] = (
            sharp if len(sharp) else fields.sharper_than(snapshot, sharp_angle)
        )
    elif field_from == "flow":
        given.follow["sharp_edges"] = fields.flow(snapshot)
    elif field_from == "attribute":
        given.field = flipfree.CrossField(fields.read(ob, snapshot, attribute))
    elif field_from == "cones":
        given.cones, _ = cone_sums.marked(snapshot)
        given.loops = marks.loops(ob, snapshot)
    elif field_from == "file":
        given.field = _in_file(snapshot, field_file, flipfree.CrossField.read)
    elif field_from == "signature":
        given.signature = _in_file(
            snapshot, field_file, lambda path, *_: flipfree.Signature.read(path)
        )
    if density == "painted":
        given.sizing = fields.painted(ob, snapshot, density_name, density_ratio)
    elif density == "attribute":
        given.sizing = fields.densities(ob, snapshot, density_name)
    return given


def _in_file(snapshot, path: str, read):
    """What a file says of the triangles of a whole mesh. Raises MeshProblem."""
    name = snapshot.object_name
    if not path:
        raise mesh_io.MeshProblem(
            f"{name}: no file is named. Choose one under File in the redo panel"
        )
    if snapshot.clean is not None or len(snapshot.other_loops):
        why = "some faces are left out" if snapshot.clean is None else "it is no clean surface"
        raise mesh_io.MeshProblem(
            f"{name}: a file is about all triangles of a mesh, and {why}. Select all faces, and merge what lies on each other"
        )
    try:
        return read(bpy.path.abspath(path), snapshot.vertices, snapshot.triangles)
    except flipfree.FlipfreeError as error:
        raise mesh_io.MeshProblem(f"{name}: {error}") from error
