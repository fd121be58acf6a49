"""Random damage to meshes and arguments: the result is a certified map or one of our own exceptions, nothing else."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import flipfree as ff

from judges.rational import overlapping_pairs
from surfaces import bumpy_grid, cylinder, octahedron_sphere, torus

SHAPES = [
    lambda: bumpy_grid(7, 6),
    lambda: cylinder(9, 3),
    lambda: torus(8, 6),
    lambda: octahedron_sphere(2),
]


def damaged(random: np.random.Generator) -> tuple[Any, Any, dict[str, Any]]:
    vertices, faces = SHAPES[random.integers(len(SHAPES))]()
    vertices, faces = vertices.copy(), faces.astype(np.int64)
    arguments: dict[str, Any] = {}
    for _ in range(random.integers(1, 4)):
        f = random.integers(len(faces))
        v = random.integers(len(vertices))
        kind = random.integers(14)
        if kind == 0:
            faces[f, random.integers(3)] = random.integers(-2, len(vertices) + 2)
        elif kind == 1:
            faces = np.delete(faces, random.integers(0, len(faces), 5), axis=0)
        elif kind == 2:
            faces = np.vstack([faces, faces[f]])
        elif kind == 3:
            faces[f] = faces[f, ::-1]
        elif kind == 4:
            vertices[v] = [np.nan, np.inf, -np.inf][random.integers(3)]
        elif kind == 5:
            vertices[faces[f, 0]] = vertices[faces[f, 1]]
        elif kind == 6:
            vertices[v] = vertices[random.integers(len(vertices))]
        elif kind == 7:
            vertices *= 10.0 ** random.integers(-200, 150)
        elif kind == 8:
            vertices[:, random.integers(3)] = 0.0
        elif kind == 9:
            arguments["cuts"] = random.integers(0, len(vertices), (random.integers(1, 9), 2))
        elif kind == 10:
            corner = random.integers(len(faces), size=6), random.integers(3, size=6)
            arguments["cuts"] = np.stack([faces[corner], faces[corner[0], (corner[1] + 1) % 3]], -1)
        elif kind == 11:
            chosen = random.choice(len(vertices), random.integers(1, 5), replace=False)
            arguments["pins"] = {int(p): tuple(random.uniform(-1, 1, 2)) for p in chosen}
        elif kind == 12:
            arguments["bijective"] = bool(random.integers(2))
        else:
            vertices += random.normal(size=vertices.shape) * 10.0 ** random.integers(-6, 1)
    return vertices, faces, arguments


@pytest.mark.sample(60)
@pytest.mark.parametrize("seed", range(150))
def test_damaged_meshes_are_unwrapped_or_refused(seed: int) -> None:
    vertices, faces, arguments = damaged(np.random.default_rng(seed))
    try:
        result = ff.unwrap(vertices, faces, **arguments)
    except ff.FlipfreeError as error:
        assert len(str(error)) > 20
        return
    assert result.certificate.ok
    check = ff.certify(vertices, faces, result.uv32(), bijective=arguments.get("bijective", True))
    if any(mend.what == "edges with more than two faces" for mend in check.mends):
        # Which of them are joined, the map knows and its coordinates alone do not: what lies on what is judged instead.
        assert check.flips32 == 0 and overlapping_pairs(result.uv32().astype(np.float64)) == []
    else:
        assert check.ok, check.failures


@pytest.mark.parametrize(
    "arguments",
    [
        {"vertices": None},
        {"faces": None},
        {"faces": [[0, 1, 2**40]]},
        {"faces": "abc"},
        {"cuts": [[0.5, 1]]},
        {"cuts": [0, 1]},
        {"pins": {"abc": (0, 0)}},
        {"pins": {0: "ab"}},
        {"pins": {0: (1, 2, 3)}},
        {"pins": {(0, 5): (1, 2)}},
        {"pins": {(0, 1, 2): (1, 2)}},
        {"pins": [1, 2]},
        {"tolerance": 0.0},
        {"tolerance": np.nan},
        {"margin": -1.0},
        {"iterations": -1},
        {"threads": -1},
        {"place_like": np.zeros((1, 3, 2))},
    ],
)
def test_malformed_arguments_are_refused_by_name(arguments: dict[str, Any]) -> None:
    vertices, faces = bumpy_grid(3, 3)
    with pytest.raises(ff.InvalidInput):
        ff.unwrap(**{"vertices": vertices, "faces": faces, **arguments})
