# SPDX-License-Identifier: GPL-3.0-or-later
"""`blender -b -c flipfree field-aligned`: its arguments."""

import math

from flipfree.batch import numbers

from ..meshes import fields
from . import field_aligned, sources

_FLAGS = {
    "keep_near_cones": "do not merge near cones that bend opposite ways",
    "no_optimise": "leave the map as the engine makes it",
    "no_seams": "do not mark the cuts as seams, nor their quarter turns",
    "no_cones": "do not mark the field's cones",
    "no_field": "do not store the field",
    "surface_scale": "one UV unit is one unit of the object; otherwise the map fits the unit square",
}


def add_arguments(parser) -> None:
    parser.add_argument(
        "--field",
        choices=[name for name, _, _ in field_aligned.FIELDS],
        default="curvature",
        help="what the map's lines run along (default %(default)s)",
    )
    parser.add_argument(
        "--curvature", type=numbers.real(0.0, 1.0), default=0.5, help="its weight, 0 to 1"
    )
    parser.add_argument(
        "--sharp-from",
        type=numbers.real(0.0, 180.0),
        default=math.degrees(sources.SHARP),
        help="degrees by which the surface folds at edges that are followed, where none is marked as sharp",
    )
    parser.add_argument(
        "--edge-weight", type=numbers.real(0.01, 1.0), default=1.0, help="of edges, 0.01 to 1"
    )
    parser.add_argument(
        "--attribute", default=fields.NAME, help="with a vector per face (default %(default)s)"
    )
    parser.add_argument(
        "--density",
        choices=[name for name, _, _ in field_aligned.DENSITIES],
        default="uniform",
        help="painted: by a vertex group; attribute: by a number per point or face",
    )
    parser.add_argument("--density-from", default="", help="name of the group or attribute")
    parser.add_argument(
        "--density-ratio",
        type=numbers.real(0.1, 10.0),
        default=2.0,
        help="where the group has its full weight",
    )
    parser.add_argument(
        "--boundary",
        choices=[name for name, _, _ in field_aligned.BOUNDARIES],
        default="aligned",
        help="of open surfaces: along u and v, or free",
    )
    for name, text in _FLAGS.items():
        parser.add_argument(f"--{name.replace('_', '-')}", action="store_true", help=text)


def options(given):
    """Parsed arguments -> (task maker, summary, options of the task)."""
    return (
        field_aligned.make_task,
        field_aligned.summary,
        {
            "field_from": given.field,
            "curvature": given.curvature,
            "sharp_angle": math.radians(given.sharp_from),
            "edge_weight": given.edge_weight,
            "attribute": given.attribute,
            "merge_cones": not given.keep_near_cones,
            "density": given.density,
            "density_name": given.density_from,
            "density_ratio": given.density_ratio,
            "boundary": given.boundary,
            "optimise": not given.no_optimise,
            "mark_cuts": not given.no_seams,
            "mark_cones": not given.no_cones,
            "write_field": not given.no_field,
            "fit": not given.surface_scale,
        },
    )
