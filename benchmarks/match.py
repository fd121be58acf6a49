"""Match Pins: prescribed outlines and pins, random pins, space-filling targets, large surfaces, Blender beside it.

    match.py constraints [--engine matchmaker]        outlines and pins of the shared data folder, targets that overlap themselves
    match.py random [--pins 10,50] [--seeds 1]        random pins, free boundary, on all disks of the folder (thesis 3.4.2)
    match.py hilbert [--orders 3] [--seeds 1] [--engine matchmaker]   a surface into Hilbert's curve, thickened, with three inner pins
    match.py large [--triangles 100000] [--seeds 5]   ten random pins on a bumpy square
    match.py blender --blender PROGRAM                six pins moved by a share of the square, on a monkey's largest island

Faces are against the input's. blender: flips, overlaps and energy of both sides are measured by ff.certify on the stored values; the
pin error is the largest distance between a stored UV and its pin.
"""

from __future__ import annotations

import heapq
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
from embedding_meshes import boundary_loop
from runner import Options, Row, data, from_blender, main, numbers, table, timed

import flipfree as ff

from immersed_curves import PINS, curve
from mesh_files import cut_corners, cut_pieces, read_mesh
from surfaces import Mesh, bumpy_grid, disk_of_rings, euler, open_edges

Array = npt.NDArray[Any]
Pins = dict[int, tuple[float, float]]
Case = tuple[str, Array, Array, dict[str, Any]]
SHAPES = ("G", "S", "comb", "spiral")
SPOKES, RINGS = 80, 12
FOLDERS = ("constraints", "conformal", "embedding", "general")
HILBERT = ("constraints/camel_b_uv.obj", "constraints/cow_uv.obj", "conformal/disk5k.obj")


def pinned(ids: Array, places: Array) -> Pins:
    """Vertex ids (k,) with places (k, 2), as ff.match takes them."""
    return {int(v): (float(p[0]), float(p[1])) for v, p in zip(ids, places, strict=True)}


def pins_in_square(ids: Array, count: int, random: np.random.Generator) -> Pins:
    """`count` of the vertices, at places in the unit square."""
    chosen = random.choice(ids, count, replace=False)
    return pinned(chosen, random.random((count, 2)))


def read_targets(path: Path) -> Pins:
    rows = [line.split() for line in path.read_text().splitlines() if not line.startswith("#")]
    return {int(row[0]): (float(row[1]), float(row[2])) for row in rows}


def held(target: Pins) -> dict[str, Any]:
    return {"boundary_loop": list(target), "boundary_uv": list(target.values())}


COLUMNS = "case | faces | certified | faces x | added V | energy | engine | CPU s | wall s"


def rows(cases: Iterator[Case], options: Options) -> Iterator[Row]:
    engine = {"engine": options.engine} if options.engine else {}
    for name, vertices, faces, request in cases:
        with timed() as cost:
            try:
                result = ff.match(vertices, faces, max_seconds=options.seconds, **request, **engine)
            except ff.FlipfreeError as error:
                result, code = None, error.code
        seconds = f"{cost.cpu:.2f}", f"{cost.wall:.2f}"
        if result is None:
            yield name, len(faces), code, "", "", "", "", *seconds
            continue
        c, s = result.certificate, result.stats
        figures = f"{len(result.faces) / len(faces):.3f}", s["added_vertices"], c.energy
        yield name, len(faces), c.ok, *figures, s["engine"], *seconds


def prescribed() -> Iterator[Case]:
    folder = data() / "constraints"
    for mesh in ("camel_b", "cow"):
        file = read_mesh(folder / f"{mesh}_uv.obj")
        for shape in (*SHAPES, "circ2"):
            target = held(read_targets(folder / f"{mesh}_uv_bd_{shape}.txt"))
            yield f"{mesh} {shape}", file.vertices, file.faces, target
        for count in (3, 10, 30):
            points = {"points": read_targets(folder / f"{mesh}_uv_pins{count}.txt")}
            yield f"{mesh} {count} free", file.vertices, file.faces, points
            yield f"{mesh} {count} circle", file.vertices, file.faces, target | points


def overlapping() -> Iterator[Case]:
    """A strip laid along a spiral that drifts by less than its width, a figure eight, and curves that bound two disks each."""
    vertices, faces = bumpy_grid(80, 6, height=0.0)
    vertices[:, 0] = np.tile(np.linspace(0, 10, 81), 7)
    loop = boundary_loop(faces).tolist()
    along, across = vertices[loop, 0] / 10, vertices[loop, 1]
    targets = {}
    for turns in (1.4, 2.4):
        angle, radius = 2 * np.pi * turns * along, 2.0 - across + 0.35 * turns * along
        targets[f"ribbon {turns}"] = [radius * np.cos(angle), radius * np.sin(angle)]
    angle = 2 * np.pi * np.arange(len(loop)) / len(loop) + 0.01
    targets["figure eight"] = [np.sin(2 * angle), np.sin(angle)]
    for name, target in targets.items():
        yield name, vertices, faces, {"boundary_loop": loop, "boundary_uv": np.stack(target, 1)}
    vertices, faces = disk_of_rings(SPOKES, RINGS)
    for name, pin in PINS.items():
        for side, i in (("one", 8), ("other", SPOKES - 1 - 8)):
            request = {
                "boundary_loop": list(range(len(vertices) - SPOKES, len(vertices))),
                "boundary_uv": curve(name, SPOKES),
                "points": {0: pin},
                "paths": {0: [0] + [1 + r * SPOKES + i for r in range(RINGS)]},
            }
            yield f"{name} {side}", vertices, faces, request


@table(COLUMNS)
def constraints(options: Options) -> Iterator[Row]:
    cases = [*prescribed(), *overlapping()]
    yield from rows(options.cases(cases, lambda case: case[0]), options)


def is_disk(vertices: Array, faces: Array) -> bool:
    """One piece, one boundary loop, no handle, nothing to be cured: `match` takes it as it is."""
    if euler(faces) != 1 or len(open_edges(faces)) == 0:
        return False
    try:
        ff.match(vertices, faces, points={int(faces[0, 0]): (0.0, 0.0)}, optimise=False)
    except ff.FlipfreeError:
        return False
    return True


def disks(options: Options) -> Iterator[tuple[str, Mesh]]:
    """Meshes that are disks, and disks that the seams of a file's texture coordinates cut out, the largest piece first."""
    paths = sorted(p for folder in FOLDERS for p in (data() / folder).glob("*.obj"))
    for path in options.cases(paths):
        pieces = sorted(cut_pieces(read_mesh(path)), key=lambda piece: -len(piece[1]))
        for i, piece in enumerate(pieces):
            if is_disk(*piece):
                yield path.stem + (f":{i}" if len(pieces) > 1 else ""), piece


@table(COLUMNS)
def random(options: Options) -> Iterator[Row]:
    def cases() -> Iterator[Case]:
        for name, (vertices, faces) in disks(options):
            ids = np.unique(faces)
            for count in map(int, numbers(options.pins)):
                for seed in range(options.seeds if count < len(ids) else 0):
                    points = pins_in_square(ids, count, np.random.default_rng(1000 * count + seed))
                    yield f"{name}, {count} pins, {seed}", vertices, faces, {"points": points}

    yield from rows(cases(), options)


def hilbert_cells(order: int) -> Array:
    """Centres of the cells in the order in which Hilbert's curve visits them, (4^order, 2)."""
    points = np.zeros((1, 2))
    for size in 2 ** np.arange(order):
        turned = points[:, ::-1]
        last = np.array([2 * size - 1, size - 1]) - turned
        points = np.concatenate([turned, points + [0, size], points + [size, size], last])
    return points


def hilbert_outline(order: int, count: int) -> Array:
    """`count` points, counter-clockwise, on the outline of the curve thickened to half a cell."""
    centres = hilbert_cells(order)
    before = np.vstack([centres[:1] * 2 - centres[1:2], centres[:-1]])
    after = np.vstack([centres[1:], centres[-1:] * 2 - centres[-2:-1]])
    first, second = centres - before, after - centres
    normal = np.stack([-first[:, 1] - second[:, 1], first[:, 0] + second[:, 0]], 1)
    straight = (first == second).all(1)
    offset = np.where(straight[:, None], normal / 2, normal) * 0.25
    ring = np.concatenate([centres - offset, (centres + offset)[::-1]])
    following = np.roll(ring, -1, 0)
    side = np.linalg.norm(following - ring, axis=1)
    # Every corner gets a point, longer sides the rest.
    share = np.floor(np.cumsum(side) / side.sum() * (count - len(ring)) + 1e-9).astype(int)
    more = np.diff(np.concatenate([[0], share]))
    parts = [
        ring[i] + (following[i] - ring[i]) * np.arange(more[i] + 1)[:, None] / (more[i] + 1)
        for i in range(len(ring))
    ]
    return np.concatenate(parts)


def with_boundary(vertices: Array, faces: Array, count: int) -> tuple[Array, Array, list[int]]:
    """The surface with at least `count` vertices on its boundary: the longest edges there are halved."""
    loop = boundary_loop(faces).tolist()
    corner = {(int(f[k]), int(f[(k + 1) % 3])): i for i, f in enumerate(faces) for k in range(3)}
    points, triangles = list(vertices), [tuple(map(int, f)) for f in faces]
    follows = dict(zip(loop, loop[1:] + loop[:1], strict=True))
    queue = [(-float(np.linalg.norm(points[a] - points[b])), a, b) for a, b in follows.items()]
    heapq.heapify(queue)
    while len(follows) < count:
        length, a, b = heapq.heappop(queue)
        i, m = corner[(a, b)], len(points)
        (c,) = (v for v in triangles[i] if v not in (a, b))
        points.append((points[a] + points[b]) / 2)
        triangles[i] = (a, m, c)
        corner[(a, m)], corner[(m, b)] = i, len(triangles)
        corner[(b, c)] = len(triangles)
        triangles.append((m, b, c))
        follows[a], follows[m] = m, b
        heapq.heappush(queue, (length / 2, a, m))
        heapq.heappush(queue, (length / 2, m, b))
    ordered = [loop[0]]
    while follows[ordered[-1]] != ordered[0]:
        ordered.append(follows[ordered[-1]])
    return np.array(points), np.array(triangles, np.int32), ordered


def into_hilbert(path: str, order: int, seeds: int) -> Iterator[Case]:
    mesh = read_mesh(data() / path)
    # Every corner needs a boundary vertex.
    vertices, faces, loop = with_boundary(mesh.vertices, mesh.faces, 2 * 4**order)
    inner = np.setdiff1d(np.unique(faces), loop)
    for seed in range(seeds):
        chance = np.random.default_rng(seed)
        cells = hilbert_cells(order)[chance.choice(4**order, 3, replace=False)]
        places = cells + chance.uniform(-0.15, 0.15, (3, 2))
        points = pinned(chance.choice(inner, 3, replace=False), places)
        target = {"boundary_loop": loop, "boundary_uv": hilbert_outline(order, len(loop))}
        name = f"{Path(path).stem}, order {order}, {seed}"
        yield name, vertices, faces, target | {"points": points}


@table(COLUMNS)
def hilbert(options: Options) -> Iterator[Row]:
    for order in map(int, numbers(options.orders)):
        for path in options.cases(HILBERT):
            yield from rows(into_hilbert(path, order, options.seeds), options)


@table(COLUMNS)
def large(options: Options) -> Iterator[Row]:
    n = round((options.triangles / 2) ** 0.5)
    vertices, faces = bumpy_grid(n, n)
    x, y = vertices[:, 0], vertices[:, 1]
    vertices[:, 2] = 0.1 * np.sin(7 * np.pi * x) * np.sin(5 * np.pi * y)
    ids = np.arange(len(vertices))
    seeds = [(i, pins_in_square(ids, 10, np.random.default_rng(i))) for i in range(options.seeds)]
    yield from rows(((f"seed {i}", vertices, faces, {"points": p}) for i, p in seeds), options)


@table(
    "moved by | seed | method | flips | overlaps | pin error | energy | wall s | CPU s | added V"
)
def blender(options: Options) -> Iterator[Row]:
    found = from_blender(options.blender, "match", options.level, "1,2,3", "0.02,0.2")
    corner, _ = cut_corners(found["faces"], found["seams"])
    first, faces = np.unique(corner, return_inverse=True)
    faces = faces.reshape(-1, 3).astype(np.int32)
    origin = found["faces"].ravel()[first]
    vertices = found["vertices"][origin]

    def row(case: str, method: str, given: Any, uv: Array, points: Pins, seconds: Any) -> Row:
        c = ff.certify(*given, uv, bijective=True)
        errors = [
            np.abs(uv[given[1] == v].astype(float) - place).max() for v, place in points.items()
        ]
        figures = c.flips32, c.overlaps, f"{max(errors):.0e}", c.energy
        yield from (*case.split("_"), method, *figures, *[f"{s:.2f}" for s in seconds])
        yield len(given[0]) - len(vertices)

    for case in options.cases(f"{share}_{seed}" for share in ("0.02", "0.2") for seed in (1, 2, 3)):
        ids = np.array([np.flatnonzero(origin == v)[0] for v in found[f"{case}_pins"]])
        points = pinned(ids, found[f"{case}_targets"].astype(np.float64))
        for name in found["methods"].tolist():
            uv, seconds = found[f"{case}_{name}_uv"], found[f"{case}_{name}_seconds"]
            yield row(case, f"Blender {name}", (vertices, faces), uv, points, seconds)
        for name, one_to_one in (("Match Pins", True), ("Match Pins, overlaps allowed", False)):
            with timed() as cost:
                result = ff.match(vertices, faces, points=points, bijective=one_to_one)
            given = result.vertices, result.faces
            yield row(case, name, given, result.uv32(), points, (cost.wall, cost.cpu))


if __name__ == "__main__":
    main(
        __doc__,
        engine=("", "alone"),
        pins=("10,50", "of random"),
        seeds=(1, ""),
        orders=("3", "of hilbert"),
        triangles=(100_000, "of large"),
        level=("3", "of subdivision: 40k triangles in the island"),
    )
