"""One call of every kind that takes a moment: for tests of what may come in between."""

from __future__ import annotations

import numpy as np

import flipfree as ff

from surfaces import bumpy_grid, octahedron_sphere

GRID = bumpy_grid(40, 40)
BALL = octahedron_sphere(4)


def cones() -> np.ndarray:
    angles = np.full(len(BALL[0]), 2 * np.pi)
    angles[[0, 1, 2, 3]] = np.pi
    return angles


#: Name -> call with options of every call (max_seconds, progress), which returns an array.
CALLS = {
    "unwrap": lambda **options: ff.unwrap(*BALL, seams="given", **options).uv,
    "seams": lambda **options: ff.auto_seams(*BALL, **options),
    "auto": lambda **options: ff.unwrap(*BALL, seams="auto", **options).uv,
    "embed": lambda **options: ff.embed(*GRID, optimise=True, **options).uv,
    "match": lambda **options: (
        ff.match(*GRID, points={0: (0, 0), 700: (1, 0.3), 900: (0.2, 1)}, **options).uv
    ),
    "metric": lambda **options: ff.conformal_metric(*BALL, cones(), **options).scale_factors,
    "conformal": lambda **options: ff.conformal(*BALL, cones(), **options).uv,
    "seamless": lambda **options: ff.seamless(*BALL, {v: 3 for v in range(8)}, **options).uv,
    "angles": lambda **options: ff.boundary_angles(*GRID, "circle", **options),
    "field": lambda **options: ff.cross_field(*BALL, **options).directions,
    "aligned": lambda **options: ff.field_aligned(*BALL, **options).uv,
    "quads": lambda **options: ff.quads(*BALL, target=100, **options).vertices,
    "tiles": lambda **options: ff.fit_tiles(ff.field_aligned(*BALL), tile=0.1, **options).uv,
    "repair": lambda **options: ff.repair(*BALL, np.zeros((len(BALL[1]), 3, 2)), **options).uv,
    "cones": lambda **options: np.asarray(ff.suggest_cones(*GRID, **options)),
}
