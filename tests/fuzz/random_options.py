"""Random arguments for every parameter of the package's functions, most of them sensible."""

from __future__ import annotations

import inspect
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np

import flipfree as ff

from hostile_values import FUNCTIONS, VALUES
from random_meshes import Mesh

Random = np.random.Generator
ENGINES = ("auto", "first try", "outline", "arms", "matchmaker")
SEAMLESS_ENGINES = ("auto", "penner", "padding")
BOUNDARIES = ("aligned", "aligned_or_free", "free")
HOSTILE = list(VALUES.values())


def edges(mesh: Mesh, random: Random) -> Any:
    if len(mesh.faces) == 0:
        return []
    pick = random.integers(len(mesh.faces), size=random.integers(0, 8))
    corner = random.integers(3, size=len(pick))
    pairs = np.stack([mesh.faces[pick, corner], mesh.faces[pick, (corner + 1) % 3]], -1)
    return pairs if random.random() < 0.95 else random.integers(0, len(mesh.vertices), (2, 2))


def weighted_edges(mesh: Mesh, random: Random) -> Any:
    pairs = edges(mesh, random)
    return pairs, random.choice([0.0, 0.5, 1.0, 10.0, np.inf], len(pairs))


def vertices_of(mesh: Mesh, random: Random, most: int = 5) -> list[int]:
    count = min(int(random.integers(0, most)), len(mesh.vertices))
    return [int(v) for v in random.choice(len(mesh.vertices), count, replace=False)]


def place(random: Random) -> tuple[float, float]:
    if random.random() < 0.3:
        return tuple(map(float, random.integers(-1, 2, 2)))  # these meet each other
    size = 1.0 if random.random() < 0.9 else 10.0 ** random.integers(-40, 39)
    return tuple(map(float, random.normal(size=2) * size))


def pins(mesh: Mesh, random: Random) -> Any:
    if random.random() < 0.15 and len(mesh.faces):
        return {(int(random.integers(len(mesh.faces))), int(random.integers(3))): place(random)}
    return {v: place(random) for v in vertices_of(mesh, random)}


def lines(mesh: Mesh, random: Random) -> Any:
    if random.random() < 0.5 or len(mesh.faces) == 0:
        return None
    face = mesh.faces[random.integers(len(mesh.faces))]
    count = int(random.integers(1, 4))
    return [([int(v) for v in face[:count]], [place(random) for _ in range(random.integers(1, 5))])]


def loop_of(mesh: Mesh) -> list[int]:
    """One boundary loop, surface on the left."""
    halfedges = {(int(f[k]), int(f[(k + 1) % 3])) for f in mesh.faces for k in range(3)}
    after = {a: b for a, b in halfedges if (b, a) not in halfedges}
    loop = [min(after)] if after else []
    while loop and after.get(loop[-1], loop[0]) != loop[0] and len(loop) <= len(after):
        loop.append(after[loop[-1]])
    return loop


def polygon(mesh: Mesh, random: Random) -> Any:
    """For the boundary: round, a line now and then, or scattered."""
    count = len(loop_of(mesh)) + int(random.random() < 0.05)
    angle = np.sort(random.uniform(0, 2 * np.pi, count))
    if random.random() < 0.5:
        angle = 2 * np.pi * np.arange(count) / max(count, 1)
    points = np.stack([np.cos(angle), np.sin(angle)], -1) * 10.0 ** random.integers(-3, 4)
    if random.random() < 0.2:
        points = random.normal(size=(count, 2))
    return np.round(points, 2) if random.random() < 0.3 else points


def corner_uv(mesh: Mesh, random: Random) -> Any:
    """The map of an unwrap, a projection, a scatter: with and without folds."""
    kind = random.random()
    if kind < 0.6:
        try:
            return ff.unwrap(
                mesh.vertices, mesh.faces, iterations=3, max_seconds=1.0, seams="given"
            ).uv64
        except ff.FlipfreeError:
            pass
    try:
        projected = np.array(mesh.vertices)[mesh.faces][:, :, :2]
    except IndexError:
        projected = np.zeros((len(mesh.faces), 3, 2))
    return projected if kind < 0.9 else random.normal(size=projected.shape)


def angles(mesh: Mesh, random: Random) -> Any:
    """What adds up, from the package itself; or all alike; or scattered."""
    kind = random.random()
    if kind < 0.7:
        try:
            boundary = ("free", "straight")[random.integers(2)]
            return ff.boundary_angles(mesh.vertices, mesh.faces, boundary)
        except ff.FlipfreeError:
            pass
    count = len(mesh.vertices)
    share = np.pi * len(mesh.faces) / max(count, 1)
    if kind < 0.9:
        return np.full(count, share)
    return share * np.exp(random.normal(size=count) * random.integers(0, 4))


def lengths(mesh: Mesh, random: Random) -> Any:
    if random.random() < 0.7:
        return None
    return np.exp(random.normal(size=mesh.faces.shape) * random.choice([0.0, 0.1, 1.0]))


def parent(mesh: Mesh, _random: Random) -> Any:
    vertex_parent = np.zeros(len(mesh.vertices), int)
    barycentric = np.zeros((len(mesh.vertices), 3))
    for f, face in enumerate(mesh.faces):
        for k, v in enumerate(face):
            if 0 <= v < len(mesh.vertices):
                vertex_parent[v], barycentric[v] = f, np.eye(3)[k]
    return mesh.vertices, mesh.faces, np.arange(len(mesh.faces)), vertex_parent, barycentric


def boundary(name: str, mesh: Mesh, random: Random) -> Any:
    if name == "embed":
        words: list[Any] = ["circle", "square", "triangle"]
        return polygon(mesh, random) if random.random() < 0.4 else words[random.integers(3)]
    if name == "cross_field":
        return flag(mesh, random)
    if name == "seamless":
        return BOUNDARIES[random.integers(len(BOUNDARIES))]
    if name == "field_aligned":
        return ["aligned", "free"][random.integers(2)]
    return ["free", "straight", "circle"][random.integers(3)]


def turns(mesh: Mesh, random: Random) -> Any:
    """Quarter turns: none, what sums up for one of the first genera, or scattered."""
    kind = random.random()
    chosen = vertices_of(mesh, random, 13)
    if kind < 0.3 or not chosen:
        return None if kind < 0.15 else {}
    values = random.choice([1, 2, 3, 3, 3, 5, 5, 6, 9], len(chosen))
    if kind < 0.9:  # the last one takes what is missing, if it can
        values[-1] = max(1, 4 - (8 - 8 * random.integers(0, 2) - (4 - values[:-1]).sum()))
    return {v: int(k) for v, k in zip(chosen, values, strict=True)}


def field(mesh: Mesh, random: Random) -> Any:
    """Scattered directions, matched by the nearest or at random."""
    matching = random.integers(0, 4, mesh.faces.shape) if random.random() < 0.2 else None
    return ff.CrossField(random.normal(size=mesh.faces.shape), matching)


def signature(mesh: Mesh, random: Random) -> Any:
    """That of a scattered field, or a scattered one."""
    if random.random() < 0.8:
        try:
            return ff.signature(mesh.vertices, mesh.faces, field(mesh, random))
        except ff.FlipfreeError:
            pass
    cones = {v: int(random.integers(-1, 9)) for v in vertices_of(mesh, random)}
    strip = [int(f) for f in random.integers(0, max(len(mesh.faces), 1), random.integers(1, 5))]
    return ff.Signature(cones, [(strip, int(random.integers(-3, 4)))])


def parametrization(mesh: Mesh, random: Random) -> Any:
    """A map with cells of any size, or one that is not seamless, or none."""
    try:
        if random.random() < 0.2:
            return ff.unwrap(mesh.vertices, mesh.faces, max_seconds=1.0)
        map = ff.field_aligned(mesh.vertices, mesh.faces, max_seconds=1.0)
    except ff.FlipfreeError:
        return None
    finer = 2.0 ** random.integers(0, 20)
    return replace(map, uv=map.uv * finer, _uv32=map.uv32() * np.float32(finer))


def flag(_mesh: Mesh, random: Random) -> bool:
    return bool(random.integers(2))


def one_of(*choices: Any) -> Callable[[Mesh, Random], Any]:
    return lambda _mesh, random: choices[random.integers(len(choices))]


def vertex_map(values: Callable[[Random], Any]) -> Callable[[Mesh, Random], Any]:
    return lambda mesh, random: {v: values(random) for v in vertices_of(mesh, random)}


#: parameter -> (how often it is given, what is given). Required ones are always given.
PARAMETERS: dict[str, tuple[float, Callable[[Mesh, Random], Any]]] = {
    "uv": (1.0, corner_uv),
    "target_angles": (1.0, angles),
    "parametrization": (1.0, parametrization),
    "target": (0.9, one_of(1, 30, 300, 1e4)),
    "edge_length": (0.1, one_of(0.1, 1.0, 1e3)),
    "map_or_arrays": (1.0, lambda mesh, random: (mesh.vertices, mesh.faces, corner_uv(mesh, random))),
    "pins": (0.4, pins),
    "points": (0.7, lambda mesh, random: {v: place(random) for v in vertices_of(mesh, random)}),
    "cuts": (0.4, edges),
    "uncuttable": (0.2, edges),
    "seams": (0.3, one_of("given", "auto")),
    "stretch": (0.3, one_of(1.01, 1.1, 1.25, 2.0)),
    "sharp_angle": (0.2, one_of(0.1, 1.0, 3.0)),
    "weights": (0.3, weighted_edges),
    "lines": (0.3, lines),
    "boundary_uv": (0.4, polygon),
    "boundary_loop": (0.15, lambda mesh, _random: loop_of(mesh)),
    "paths": (0.1, lambda mesh, random: {v: [v, *vertices_of(mesh, random)] for v in loop_of(mesh)[:2]}),
    "movable": (0.1, lambda mesh, random: loop_of(mesh)[: random.integers(1, 4)]),
    "initial_uv": (0.2, lambda mesh, random: random.normal(size=(len(mesh.vertices), 2))),
    "place_like": (0.15, corner_uv),
    "cones": (0.3, vertex_map(lambda random: float(random.uniform(0.5, 7)))),
    "corners": (0.3, lambda mesh, random: loop_of(mesh)[: random.integers(1, 5)]),
    "lengths": (0.2, lengths),
    "parent": (0.3, parent),
    "obstacles": (0.2, lambda _mesh, random: random.uniform(-0.5, 1.5, (random.integers(0, 4), 3, 2))),
    "density": (0.2, lambda _mesh, random: float(10.0 ** random.integers(-9, 10))),
    "unmoved": (0.2, lambda mesh, random: list(range(int(random.integers(0, 4))))),
    "field": (0.5, field),
    "signature": (0.2, signature),
    "sizing": (0.2, lambda mesh, random: np.exp(random.normal(size=len(mesh.vertices)))),
    "sharp_edges": (0.3, edges),
    "features": (0.3, edges),
    "alignment": (0.3, one_of(0.0, 0.1, 0.9, 0.999999)),
    "edge_weight": (0.3, one_of(1.0, 0.5, 1e-9)),
    "simplify": (0.4, flag),
    "reroute": (0.3, flag),
    "bijective": (0.5, flag),
    "keep_bijective": (0.5, flag),
    "cut_extremities": (0.3, flag),
    "may_add_cuts": (0.3, flag),
    "disjoint": (0.3, flag),
    "overlaps": (0.5, one_of("cut", "open", "keep")),
    "stretched": (0.5, one_of("keep", "improve")),
    "repair": (0.3, flag),
    "optimise": (0.4, flag),
    "seamless": (0.2, flag),
    "tiled": (0.2, flag),
    "prefer_translations": (0.4, flag),
    "with_map": (0.3, flag),
    "adaptive": (0.3, lambda mesh, random: float(random.choice([0.0, 30.0, 100.0]))),
    "symmetry": (0.2, one_of("x", "y", "z")),
    "together": (0.4, flag),
    "scale_true": (0.4, flag),
    "quarter_turns": (0.4, flag),
    "require_convergence": (0.4, flag),
    "original_triangles": (0.4, one_of("auto", True, False)),
    "intrinsic_refinement": (0.3, one_of("auto", "on", "off")),
    "method": (0.4, one_of("ladder", "progressive", "tutte")),
    "start": (0.3, one_of("tutte", "nothing")),
    "engine": (0.3, one_of(*ENGINES)),
    "precision": (0.2, one_of("auto", 53, 100, 200)),
    "max_iterations": (0.3, one_of(1, 2, 30)),
    "exact": (0.3, flag),
    "iterations": (0.4, one_of(0, 1, 2, 5, 30)),
    "max_cones": (0.3, one_of(1, 3, 20)),
    "bound": (0.3, one_of(1.01, 1.5, 4.0, 1e3)),
    "least_angle": (0.2, one_of(0.1, 1.0, 3.0)),
    "tolerance": (0.2, one_of(1e-2, 1e-6, 1e-14)),
    "margin": (0.3, one_of(0.0, 0.01, 0.3)),
    "margin_pixels": (0.3, one_of(0.0, 2.0, 64)),
    "texture_size": (0.2, one_of(1, 256, 4096)),
    "rotation": (0.3, one_of("free", "straight", "quarters", "none")),
    "layouts": (0.1, lambda mesh, random: random.integers(0, 3, len(mesh.faces))),
    "share_tile": (0.2, flag),
    "groups": (0.1, lambda mesh, random: random.integers(-1, 3, len(mesh.faces))),
    "stack_similar": (0.2, flag),
    "stack_mirrored": (0.5, flag),
    "mirrored": (0.2, lambda mesh, random: "islands" if random.random() < 0.5 else random.integers(0, 2, len(mesh.faces))),
    "tile": (0.2, one_of(1001, 1010, 1100)),
    "tiles": (0.2, one_of(1, 2, 7, 100)),
    "aspect": (0.2, one_of(1.0, 2.0, 0.5, 16 / 9, 0.1)),
    "effort": (0.5, one_of(0.0, 0.01, 0.3)),
    "materials": (0.2, lambda mesh, random: random.integers(0, 3, len(mesh.faces))),
    "polygons": (0.2, lambda mesh, random: np.arange(len(mesh.faces)) // random.integers(1, 4)),
    "max_seconds": (0.5, lambda _mesh, random: float(10.0 ** random.uniform(-5, 0))),
    "threads": (0.4, one_of(1, 2, 3)),
}  # fmt: skip


def random_arguments(
    name: str, mesh: Mesh, random: Random, hostile: float = 1 / 12
) -> dict[str, Any]:
    """Arguments for the function; so often one of them has a hostile value."""
    arguments: dict[str, Any] = {}
    parameters = inspect.signature(FUNCTIONS[name]).parameters
    for key, parameter in parameters.items():
        if key in ("vertices", "faces"):
            arguments[key] = getattr(mesh, key)
        elif key == "boundary":
            if random.random() < 0.7:
                arguments[key] = boundary(name, mesh, random)
        elif name == "embed" and key == "corners":
            if random.random() < 0.2:
                loop = loop_of(mesh)[:: random.integers(1, 4)]
                turn = 2 * np.pi * np.arange(len(loop)) / max(len(loop), 1)
                places = zip(np.cos(turn).tolist(), np.sin(turn).tolist(), strict=True)
                arguments |= {"boundary": "corners", key: dict(zip(loop, places, strict=True))}
        elif name == "fit_tiles" and key == "tile":
            arguments[key] = 10.0 ** random.uniform(-2.0, 1.0)
        elif name == "fit_tiles" and key == "map_or_arrays" and random.random() < 0.7:
            arguments[key] = parametrization(mesh, random)
        elif name in ("seamless", "field_aligned", "admissible_cut") and key in ("cones", "engine"):
            choose = turns if key == "cones" else one_of(*SEAMLESS_ENGINES)
            if random.random() < 0.6:
                arguments[key] = choose(mesh, random)
        elif key in PARAMETERS:
            often, make = PARAMETERS[key]
            if parameter.default is inspect.Parameter.empty or random.random() < often:
                arguments[key] = make(mesh, random)
    if random.random() < hostile:
        keys = [key for key in parameters if key != "progress"]
        key = keys[random.integers(len(keys))]
        arguments[key] = HOSTILE[random.integers(len(HOSTILE))]()
    return arguments
