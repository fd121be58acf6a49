"""Ways to spoil a UV map: what hands, importers and other tools leave behind."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

Corners = npt.NDArray[np.float64]
Ints = npt.NDArray[np.int64]
Random = np.random.Generator


@dataclass
class Map:
    """A map (m, 3, 2) of faces (m, 3), and which corners are one place: point (m, 3), island (m,)."""

    faces: Ints
    uv: Corners
    point: Ints
    island: Ints

    @property
    def points(self) -> int:
        return int(self.point.max()) + 1

    def places(self) -> Corners:
        """(points, 2)"""
        at = np.zeros((self.points, 2))
        at[self.point] = self.uv
        return at

    def put(self, places: Corners) -> None:
        self.uv = places[self.point]


def map_of(faces: npt.ArrayLike, uv: Corners) -> Map:
    """Corners of one vertex at one place are one point; faces that share points an island."""
    triangles = np.asarray(faces, np.int64)
    key = np.column_stack([triangles.ravel(), uv.reshape(-1, 2)])
    _, point = np.unique(key, axis=0, return_inverse=True)
    point = point.reshape(triangles.shape)
    label = np.arange(point.max() + 1)
    while True:
        least = label[point].min(axis=1)
        new = label.copy()
        for k in range(3):
            np.minimum.at(new, point[:, k], least)
        if (new == label).all():
            break
        label = new
    _, island = np.unique(label[point[:, 0]], return_inverse=True)
    return Map(triangles, uv.copy(), point, island)


def throw_points(given: Map, random: Random) -> None:
    """Up to a hundredth of all, and one at least, anywhere."""
    places = given.places()
    count = int(random.integers(1, 2 + given.points // 100))
    chosen = random.choice(given.points, count, replace=False)
    places[chosen] = random.uniform(-1, 2, (count, 2))
    given.put(places)


def nudge_points(given: Map, random: Random) -> None:
    """A tenth of all, about as far as their neighbours are."""
    places = given.places()
    edge = np.linalg.norm(given.uv - np.roll(given.uv, 1, axis=1), axis=2).mean()
    chosen = random.random(given.points) < 0.1
    places[chosen] += random.normal(size=(int(chosen.sum()), 2)) * edge
    given.put(places)


def mirror_part(given: Map, random: Random) -> None:
    """Points within a circle, left for right."""
    places = given.places()
    middle = places[random.integers(given.points)]
    radius = 0.15 * float(random.random()) * np.ptp(places, axis=0).max()
    inside = np.linalg.norm(places - middle, axis=1) <= radius
    places[inside, 0] = 2 * middle[0] - places[inside, 0]
    given.put(places)


def mirror_faces(given: Map, random: Random) -> None:
    """Single faces, each torn off its neighbours."""
    for f in random.choice(len(given.faces), int(random.integers(1, 4))):
        middle = given.uv[f, :, 0].mean()
        given.uv[f, :, 0] = 2 * middle - given.uv[f, :, 0]


def mirror_islands(given: Map, random: Random) -> None:
    chosen = random.random(given.island.max() + 1) < 0.5
    chosen[random.integers(len(chosen))] = True
    of_faces = chosen[given.island]
    given.uv[of_faces, :, 0] = 1 - given.uv[of_faces, :, 0]


def collapse_islands(given: Map, random: Random) -> None:
    """Some to a point, some to a line."""
    for i in range(given.island.max() + 1):
        of_faces = given.island == i
        kind = random.integers(4)
        if kind == 0:
            given.uv[of_faces] = random.uniform(0, 1, 2)
        elif kind == 1:
            given.uv[of_faces, :, 1] = random.uniform(0, 1)


def zero_half(given: Map, random: Random) -> None:
    """Half of the points at the origin."""
    places = given.places()
    places[random.random(given.points) < 0.5] = 0
    given.put(places)


def zero_corners(given: Map, random: Random) -> None:
    """A fiftieth of the corners at the origin, torn off."""
    given.uv[random.random(given.faces.shape) < 0.02] = 0


def lose_values(given: Map, random: Random) -> None:
    """Not a number, infinite, beyond 32 bits; points and single corners."""
    places = given.places()
    nothing = [np.nan, np.inf, -np.inf, 1e39]
    chosen = random.random(given.points) < 0.02
    places[chosen, random.integers(2)] = nothing[random.integers(4)]
    given.put(places)
    given.uv[random.random(given.faces.shape) < 0.01] = np.nan


def stack_islands(given: Map, random: Random) -> None:
    """One island on another."""
    a, b = random.integers(given.island.max() + 1, size=2)
    shift = given.uv[given.island == b].mean((0, 1)) - given.uv[given.island == a].mean((0, 1))
    given.uv[given.island == a] += shift


def fold_over(given: Map, random: Random) -> None:
    """What lies on one side of a line, turned over on the other side."""
    normal = random.normal(size=2)
    normal /= np.linalg.norm(normal)
    beyond = given.uv @ normal - random.uniform(-0.5, 1.0)
    given.uv -= 2 * np.maximum(beyond, 0)[:, :, None] * normal


def squash(given: Map, random: Random) -> None:
    """Coordinates on a coarse grid, as few bits leave them."""
    cells = float(2 ** random.integers(3, 8))
    given.uv = np.round(given.uv * cells) / cells


def scatter(given: Map, random: Random) -> None:
    given.put(random.uniform(0, 1, (given.points, 2)))


def drag_over(given: Map, random: Random) -> None:
    """A point of an island's border and what is near it, dragged over the island."""
    places = given.places()
    start = places[random.integers(given.points)]
    reach = 0.3 * float(random.random())
    weight = np.maximum(0, 1 - np.linalg.norm(places - start, axis=1) / reach)[:, None]
    places += weight * random.normal(size=2) * reach
    given.put(places)


DAMAGES: dict[str, Callable[[Map, Random], None]] = {
    damage.__name__: damage
    for damage in (
        throw_points,
        nudge_points,
        mirror_part,
        mirror_faces,
        mirror_islands,
        collapse_islands,
        zero_half,
        zero_corners,
        lose_values,
        stack_islands,
        fold_over,
        squash,
        scatter,
        drag_over,
    )
}
