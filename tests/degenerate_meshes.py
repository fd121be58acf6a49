"""Small valid meshes that are as degenerate as doubles allow, and calls of the conformal half of the package on them."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping
from typing import Any

import numpy as np
import numpy.typing as npt

import flipfree as ff

from surfaces import Mesh, areas_of, bumpy_grid, open_edges, torus


def hull(count: int, random: np.random.Generator) -> Mesh:
    """Convex hull of random points on a sphere: every triangle that has all others on one side."""
    points = random.normal(size=(count, 3))
    points /= np.linalg.norm(points, axis=1)[:, None]
    faces = []
    for a in range(count):
        for b in range(count):
            for c in range(b + 1, count):
                if a >= b:
                    continue
                normal = np.cross(points[b] - points[a], points[c] - points[a])
                side = (points - points[a]) @ normal
                side[[a, b, c]] = 0.0
                if (side <= 0).all():
                    faces.append((a, b, c))
                elif (side >= 0).all():
                    faces.append((a, c, b))
    return points, np.array(faces, np.int32)


def fan(count: int, random: np.random.Generator) -> Mesh:
    """A disk of one inner vertex and a ring of `count`."""
    angle = np.sort(random.uniform(0, 2 * np.pi, count))
    ring = np.stack([np.cos(angle), np.sin(angle), random.normal(size=count)], -1)
    a = np.arange(count)
    faces = np.stack([a, np.roll(a, -1), np.full(count, count)], -1)
    return np.vstack([ring, [[0, 0, 0]]]), faces.astype(np.int32)


def base_mesh(random: np.random.Generator) -> Mesh:
    kind = random.integers(5)
    if kind == 0:
        return bumpy_grid(int(random.integers(1, 5)), int(random.integers(1, 4)))
    if kind == 1:
        return hull(int(random.integers(4, 21)), random)
    if kind == 2:
        return torus(int(random.integers(3, 6)), int(random.integers(3, 5)))
    if kind == 3:
        return fan(int(random.integers(3, 20)), random)
    points = random.normal(size=(3, 3))
    return points, np.array([[0, 1, 2]], np.int32)


def degenerate_mesh(random: np.random.Generator) -> Mesh:
    """One or two of: an axis scaled by 1e-5 to 1e-300, one vertex all but on another, one vertex thrown far."""
    vertices, faces = base_mesh(random)
    vertices = np.array(vertices, np.float64)
    if random.integers(3) == 0:
        vertices = vertices @ np.linalg.qr(random.normal(size=(3, 3)))[0]
    for _ in range(random.integers(1, 3)):
        kind = random.integers(4)
        a, b = random.choice(len(vertices), 2, replace=False)
        if kind == 0:
            vertices[:, random.integers(3)] *= 10.0 ** -random.uniform(5, 300)
        elif kind == 1:
            vertices[a] = vertices[b] + 1e-17 * random.normal(size=3)
        elif kind == 2:
            vertices[a] = random.normal(size=3) * 10.0 ** random.uniform(3, 150)
        else:
            vertices *= 10.0 ** random.uniform(-150, 100)
    return vertices, faces


def some_angles(
    faces: npt.NDArray[np.int32], count: int, random: np.random.Generator
) -> npt.NDArray[np.float64]:
    """Positive angles that meet Gauss-Bonnet: equal ones, random ones, or nearly flat ones."""
    kind = random.integers(3)
    if kind == 0:
        angles = np.ones(count)
    elif kind == 1:
        angles = random.uniform(0.05, 1.0, count)
    else:
        angles = np.full(count, 2.0)
        angles[np.unique(open_edges(faces))] = 1.0
    return angles * (np.pi * len(faces) / angles.sum())


def some_lengths(
    faces: npt.NDArray[np.int32], random: np.random.Generator
) -> npt.NDArray[np.float64]:
    """Lengths between 1 and just below 2, so that every triangle is one; some all but degenerate."""
    edges = np.sort(np.stack([faces, np.roll(faces, -1, 1)], -1), -1).reshape(-1, 2)
    _, inverse = np.unique(edges, axis=0, return_inverse=True)
    span = [1e-9, 1e-3, 1.0 - 1e-15][random.integers(3)]
    lengths = 1.0 + span * random.uniform(0, 1, inverse.max() + 1)
    lengths[random.random(len(lengths)) < 0.2] = 1.0 + span
    return lengths[inverse.reshape(-1)].reshape(-1, 3) * 10.0 ** random.uniform(-20, 20)


Call = tuple[str, Callable[..., Any], tuple[Any, ...], dict[str, Any]]


def random_call(seed: int, limit: float) -> Call:
    """A call of the conformal half: its name, function, arguments."""
    random = np.random.default_rng(seed)
    vertices, faces = degenerate_mesh(random)
    options: dict[str, Any] = {"max_seconds": limit}
    name = ["conformal_metric", "conformal", "boundary_angles", "suggest_cones"][
        random.choice(4, p=[0.3, 0.35, 0.2, 0.15])
    ]
    if name == "boundary_angles":
        shape = ["free", "straight", "circle"][random.integers(3)]
        if shape == "straight":
            rim = np.unique(open_edges(faces))
            corners = random.choice(rim, min(len(rim), 4), replace=False) if len(rim) else []
            options["corners"] = corners
        return name, ff.boundary_angles, (vertices, faces, shape), options
    if name == "suggest_cones":
        options["bound"] = float(1.0 + 10.0 ** random.uniform(-1, 3))
        options["quarter_turns"] = bool(random.integers(2))
        return name, ff.suggest_cones, (vertices, faces), options
    if random.integers(3) == 0:
        options["precision"] = [53, 200, 1000, 4096][random.integers(4)]
    if random.integers(4) == 0:
        options["tolerance"] = [1e-3, 1e-14, 1e-30][random.integers(3)]
    if random.integers(4) == 0:
        options["lengths"] = some_lengths(faces, random)
    if random.integers(3) == 0:
        options["intrinsic_refinement"] = ["on", "off"][random.integers(2)]
    if name == "conformal":
        if random.integers(3) == 0:
            corner = random.integers(len(faces), size=2), random.integers(3, size=2)
            options["cuts"] = np.stack([faces[corner], faces[corner[0], (corner[1] + 1) % 3]], -1)
        options["original_triangles"] = ["auto", True, False][random.integers(3)]
        function: Callable[..., Any] = ff.conformal
    else:
        options["require_convergence"] = bool(random.integers(2))
        function = ff.conformal_metric
    return name, function, (vertices, faces, some_angles(faces, len(vertices), random)), options


def _arrays(value: Any, path: str) -> list[tuple[str, npt.NDArray[Any]]]:
    if isinstance(value, (np.ndarray, float)):
        return [(path, np.asarray(value))]
    if isinstance(value, Mapping):
        return [found for key in value for found in _arrays(value[key], f"{path}.{key}")]
    if hasattr(value, "__dataclass_fields__"):
        return _arrays({key: getattr(value, key) for key in value.__dataclass_fields__}, path)
    return []


def has_energy(vertices: npt.NDArray[np.float64], faces: npt.NDArray[np.int32]) -> bool:
    """Whether squares of areas are numbers: given lengths ask for none of the positions' triangles."""
    return bool((areas_of(vertices, faces) ** 2 > 0).all())


def complaint(name: str, result: Any, arguments: tuple[Any, ...]) -> str:
    """What is wrong with a result; empty if nothing is."""
    for path, array in _arrays(result, name):
        if "energy" in path and not has_energy(arguments[0], arguments[1]):
            continue
        if path.endswith("seam_deviation"):  # measured of maps that are to be seamless alone
            continue
        if array.dtype.kind == "f" and not np.isfinite(array).all():
            return f"{path} is not finite"
    if name == "conformal" and not result.certificate.ok:
        return "not certified"
    return ""


def outcome(seed: int, limit: float) -> tuple[str, str, float]:
    """(call, what came of it, seconds). What came of it begins with BAD if it should not."""
    name, function, arguments, options = random_call(seed, limit)
    start = time.monotonic()
    try:
        result = function(*arguments, **options)
        seconds = time.monotonic() - start
        wrong = complaint(name, result, arguments)
        return name, f"BAD result: {wrong}" if wrong else "result", seconds
    except ff.FlipfreeError as error:
        seconds = time.monotonic() - start
        foreign = error.code == "internal error" or len(str(error)) < 20
        return name, f"{'BAD ' if foreign else ''}{type(error).__name__}: {error.code}", seconds
    except Exception as error:
        return name, f"BAD {type(error).__name__}: {error}", time.monotonic() - start
