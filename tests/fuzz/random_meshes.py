"""Small random meshes: sound ones, ones at the edge of arithmetic, and damaged ones."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from surfaces import bumpy_grid, cylinder, joined, octahedron_sphere, shuffled, torus


@dataclass
class Mesh:
    vertices: Any
    faces: Any
    what: list[str]  # how it came about, for the report


def triangle(_random: np.random.Generator) -> tuple[Any, Any]:
    return np.array([[0, 0, 0], [1, 0, 0], [0.3, 0.8, 0.0]]), np.array([[0, 1, 2]], np.int32)


def strip(random: np.random.Generator) -> tuple[Any, Any]:
    """Very long and thin, or the other way round."""
    vertices, faces = bumpy_grid(int(random.integers(1, 12)), int(random.integers(1, 3)), 0.0)
    return vertices * [10.0 ** random.integers(-16, 17), 1.0, 1.0], faces


def fan(random: np.random.Generator) -> tuple[Any, Any]:
    """A closed fan whose spokes have random lengths: a disk with one inner vertex."""
    n = int(random.integers(3, 12))
    angle = 2 * np.pi * np.arange(n) / n
    rim = np.stack([np.cos(angle), np.sin(angle), random.normal(size=n)], 1)
    rim *= 10.0 ** random.uniform(-2, 2, (n, 1))
    faces = [[0, 1 + i, 1 + (i + 1) % n] for i in range(n)]
    return np.vstack([np.zeros(3), rim]), np.array(faces, np.int32)


def two_components(random: np.random.Generator) -> tuple[Any, Any]:
    a, f = bumpy_grid(int(random.integers(1, 4)), int(random.integers(1, 4)))
    b, g = octahedron_sphere(0) if random.random() < 0.5 else bumpy_grid(2, 2)
    b = b * 10.0 ** random.integers(-12, 13) + 3
    return joined((a, f), (b, g))


def closed_surface(random: np.random.Generator) -> tuple[Any, Any]:
    """A torus, a sphere, or both; seldom with a hole."""
    meshes = [torus(int(random.integers(3, 8)), int(random.integers(3, 6))), octahedron_sphere(1)]
    vertices, faces = meshes[random.integers(2)]
    if random.random() < 0.3:
        other = meshes[random.integers(2)]
        beside = other[0] * 10.0 ** random.integers(-6, 7) + 3
        vertices, faces = joined((vertices, faces), (beside, other[1]))
    return vertices, faces


def handles(random: np.random.Generator) -> tuple[Any, Any]:
    """A torus, with a hole now and then."""
    vertices, faces = torus(int(random.integers(3, 8)), int(random.integers(3, 6)))
    keep = random.permutation(len(faces))[: len(faces) - int(random.integers(0, 4))]
    return vertices, faces[np.sort(keep)]


SHAPES = [
    triangle,
    strip,
    fan,
    two_components,
    handles,
    lambda random: bumpy_grid(int(random.integers(1, 8)), int(random.integers(1, 8))),
    lambda random: bumpy_grid(3, 3, float(random.uniform(0, 5)), float(random.uniform(1, 6))),
    lambda random: cylinder(int(random.integers(3, 10)), int(random.integers(1, 4))),
    lambda random: octahedron_sphere(int(random.integers(0, 3))),
]


def _squash(vertices: Any, _faces: Any, random: np.random.Generator) -> None:
    vertices[:, random.integers(3)] *= 10.0 ** -random.integers(5, 301)


def _approach(vertices: Any, faces: Any, random: np.random.Generator) -> None:
    """One vertex on another, but for less than doubles resolve or little more."""
    a, b = faces[random.integers(len(faces))][:2]
    vertices[a] = vertices[b] + random.normal(size=3) * 10.0 ** -random.integers(10, 20)


def _throw(vertices: Any, _faces: Any, random: np.random.Generator) -> None:
    vertices[random.integers(len(vertices))] *= 10.0 ** random.integers(3, 290)


def _rescale(vertices: Any, _faces: Any, random: np.random.Generator) -> None:
    vertices *= 10.0 ** random.integers(-300, 300)


def _move_away(vertices: Any, _faces: Any, random: np.random.Generator) -> None:
    vertices += random.normal(size=3) * 10.0 ** random.integers(0, 20)


def _jitter(vertices: Any, _faces: Any, random: np.random.Generator) -> None:
    vertices += random.normal(size=vertices.shape) * 10.0 ** random.integers(-9, 1)


def _break_value(vertices: Any, _faces: Any, random: np.random.Generator) -> None:
    vertices[random.integers(len(vertices)), random.integers(3)] = random.choice(
        [np.nan, np.inf, -np.inf, 1e308, -1e308, 5e-324]
    )


def _break_index(_vertices: Any, faces: Any, random: np.random.Generator) -> None:
    faces[random.integers(len(faces)), random.integers(3)] = random.integers(-2, len(_vertices) + 2)


def _reverse(_vertices: Any, faces: Any, random: np.random.Generator) -> None:
    f = random.integers(len(faces))
    faces[f] = faces[f, ::-1].copy()


DEGENERATIONS = [_squash, _approach, _throw, _rescale, _move_away, _jitter]
DAMAGES = [_break_value, _break_index, _reverse]


def random_mesh(random: np.random.Generator, closed: float = 0.0) -> Mesh:
    """One half is sound, most others degenerate, some damaged; now and then with vertices that no face uses. `closed`: how
    often the surface is closed on purpose."""
    shape = SHAPES[random.integers(len(SHAPES))]
    if closed > 0.0 and random.random() < closed:
        shape = closed_surface
    vertices, faces = shape(random)
    if random.random() < 0.3:
        vertices, faces = shuffled((vertices, faces), int(random.integers(2**31)))
    vertices, faces = np.array(vertices, float), np.array(faces, np.int64)
    what = [getattr(shape, "__name__", "shape")]
    kind = random.random()
    changes = [] if kind < 0.5 else DEGENERATIONS if kind < 0.9 else DAMAGES
    for _ in range(int(random.integers(1, 3)) if changes else 0):
        change = changes[random.integers(len(changes))]
        with np.errstate(all="ignore"):
            change(vertices, faces, random)
        what.append(change.__name__)
    if random.random() < (0.1 if shape is not closed_surface else 0.03):
        faces = np.delete(faces, random.integers(len(faces)), axis=0)
        what.append("a face less")
    if random.random() < (0.1 if shape is not closed_surface else 0.03):
        loose = random.normal(size=(int(random.integers(1, 4)), 3))
        vertices = np.vstack([vertices, loose * 10.0 ** random.integers(-300, 308)])
        what.append("loose vertices")
    return Mesh(vertices, faces.astype(np.int32), what)
