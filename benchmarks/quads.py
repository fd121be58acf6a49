"""ff.quads beside Blender's QuadriFlow and Instant Meshes (package pynanoinstantmeshes, where it is there).

    quads.py models [--targets 500,2000,10000] [--folders fields,general,hard] [--blender PROGRAM] [--json FILE]
    quads.py features [--targets 2000] [--folders fields,hard] [--json FILE]
    quads.py many [--targets 20000] [--json FILE]

Instant Meshes is asked for a quarter of the count, as it divides each face into four at the end. Angles: degrees that corners are off 90. Irregular: inner vertices with other than 4 quads, those of the border with other than 2. Kept:
manifold, and Euler characteristic and number of components as the surface has them. Turned: quads that look against the surface, which
is known by 400 000 points on it, nearest to the quad's middle. Off: the largest distance from the surface's vertices to the quads' and
from the quads' corners and middles to the surface, % of the diagonal, by the same points. CPU s: ours with the map; theirs of the call.
"""

from __future__ import annotations

import argparse
import sys
import tempfile
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
from auto_seams import subdivided
from runner import Options, Row, data, from_blender, main, numbers, table, timed
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import connected_components
from scipy.spatial import cKDTree
from unwrap import sharp_edges

import flipfree as ff

POINTS = 400_000


def surface_points(vertices: Any, faces: Any, count: int) -> tuple[Any, Any]:
    """Points on the faces, by area, and the faces' normals there."""
    a, b, c = (vertices[faces[:, k]] for k in range(3))
    normal = np.cross(b - a, c - a)
    area = np.linalg.norm(normal, axis=1)
    random = np.random.default_rng(0)
    face = random.choice(len(faces), count, p=area / area.sum())
    u, v = np.sort(random.random((2, count)), axis=0)
    weights = np.stack([u, v - u, 1 - v], -1)[..., None]
    return (vertices[faces[face]] * weights).sum(1), normal[face] / area[face, None]


def edges_of(faces: Any) -> tuple[Any, Any]:
    ends = np.stack([faces, np.roll(faces, -1, axis=1)], -1).reshape(-1, 2)
    return np.unique(np.sort(ends, axis=1), axis=0, return_counts=True)


def topology(faces: Any) -> tuple[int, int, bool]:
    """Euler characteristic, components; whether no edge has more than two faces."""
    edges, uses = edges_of(faces)
    used, ids = np.unique(edges, return_inverse=True)
    ids = ids.reshape(-1, 2)
    graph = coo_matrix((np.ones(len(ids)), ids.T), (len(used), len(used)))
    return len(used) - len(edges) + len(faces), connected_components(graph)[0], uses.max() <= 2


def measured(vertices: Any, faces: Any, made: Any, quads: Any, points: Any, tree: Any) -> Row:
    corners = made[quads]
    after, before = np.roll(corners, -1, axis=1) - corners, np.roll(corners, 1, axis=1) - corners
    with np.errstate(all="ignore"):
        size = np.linalg.norm(after, axis=2) * np.linalg.norm(before, axis=2)
        off = np.abs(np.degrees(np.arccos(np.clip((after * before).sum(2) / size, -1, 1))) - 90)
    off = np.nan_to_num(off, nan=90.0)
    edges, uses = edges_of(quads)
    around = np.bincount(quads.ravel(), minlength=len(made))
    rim = np.isin(np.arange(len(made)), edges[uses == 1])
    irregular = (around > 0) & (around != np.where(rim, 2, 4))
    middles = corners.mean(1)
    to_middle, nearest = tree.query(middles)
    normal = np.cross(corners[:, 2] - corners[:, 0], corners[:, 3] - corners[:, 1])
    turned = ((normal * points[1][nearest]).sum(1) <= 0).sum()
    halves = np.concatenate([quads[:, :3], quads[:, [0, 2, 3]]])
    back = cKDTree(surface_points(made, halves, POINTS)[0]).query(vertices[np.unique(faces)])[0]
    distance = max(to_middle.max(), tree.query(made[np.unique(quads)])[0].max(), back.max())
    euler, parts, manifold = topology(quads)
    kept = manifold and (euler, parts) == topology(faces)[:2]
    yield from (len(quads), f"{off.mean():.1f} / {np.percentile(off, 95):.1f}", irregular.sum())
    yield from (kept, turned, f"{100 * distance / np.ptp(vertices, axis=0).max():.2f}")


def ours(vertices: Any, faces: Any, target: int, options: Options) -> tuple[Any, Any, float]:
    with timed() as cost:
        mesh = ff.quads(vertices, faces, target=target, max_seconds=options.seconds)
    return mesh.vertices, mesh.quads, cost.cpu


def quadriflow(vertices: Any, faces: Any, target: int, options: Options) -> tuple[Any, Any, float]:
    with tempfile.TemporaryDirectory() as folder:
        source = Path(folder) / "in.npz"
        # Edges below 1e-4 units are refused.
        scale = 100.0 / np.ptp(vertices, axis=0).max()
        np.savez(source, vertices=vertices * scale, faces=faces)
        made = from_blender(options.blender, "quadriflow", source, target)
    return made["vertices"] / scale, made["quads"], float(made["cpu"])


def instant(vertices: Any, faces: Any, target: int, _: Options) -> tuple[Any, Any, float]:
    import pynanoinstantmeshes

    with timed() as cost:
        made, quads = pynanoinstantmeshes.remesh(
            np.asarray(vertices, np.float32), np.asarray(faces, np.uint32), max(target // 4, 1)
        )
    return np.asarray(made, np.float64), np.asarray(quads, np.int64).reshape(-1, 4), cost.cpu


@table(
    "model | target | tool | quads | angles mean / p95 | irregular | kept | turned | off % | CPU s"
)
def models(options: Options) -> Iterator[Row]:
    paths = [
        p for f in options.folders.split(",") for p in sorted((data() / f).glob("*.o[bf][jf]"))
    ]
    tools: dict[str, Any] = {"ours": ours}
    if options.blender:
        tools["QuadriFlow"] = quadriflow
    try:
        __import__("pynanoinstantmeshes")
        tools["Instant Meshes"] = instant
    except ImportError:
        pass
    for path in options.cases(paths, lambda p: p.stem):
        mesh = ff.read(path)
        points = surface_points(mesh.vertices, mesh.faces, POINTS)
        tree = cKDTree(points[0])
        for target in map(int, numbers(options.targets)):
            for name, tool in tools.items():
                head = (path.stem, target, name)
                try:
                    made, quads, cpu = tool(mesh.vertices, mesh.faces, target, options)
                    if len(quads) == 0:
                        raise RuntimeError("no quads")
                except Exception as error:
                    yield (*head, str(error).split(". ")[0][:80])
                    continue
                yield (
                    *head,
                    *measured(mesh.vertices, mesh.faces, made, quads, points, tree),
                    cpu,
                )


@table(
    "model | sharp edges | length on isolines % | energy | degrees off the field | CPU s | target | quads | "
    "angles mean / p95 | irregular | kept | turned | off %"
)
def features(options: Options) -> Iterator[Row]:
    """Edges sharper than 40 degrees, of the models that have some."""
    paths = [
        p for f in options.folders.split(",") for p in sorted((data() / f).glob("*.o[bf][jf]"))
    ]
    for path in options.cases(paths, lambda p: p.stem):
        mesh = ff.read(path)
        sharp = sharp_edges(mesh, 40.0)
        if len(sharp) == 0:
            continue
        points = surface_points(mesh.vertices, mesh.faces, POINTS)
        tree = cKDTree(points[0])

        try:
            with timed() as cost:
                map = ff.field_aligned(
                    mesh.vertices, mesh.faces, features=sharp, max_seconds=options.seconds
                )
            missed, whole = (
                np.linalg.norm(np.diff(mesh.vertices[edges], axis=1), axis=2).sum()
                for edges in (map.certificate.features_missed, sharp)
            )
            for target in numbers(options.targets):
                made = ff.quads(
                    mesh.vertices,
                    mesh.faces,
                    target=int(target),
                    features=sharp,
                    max_seconds=options.seconds,
                )
                yield (
                    path.stem,
                    len(sharp),
                    f"{100 * (1 - missed / whole):.1f}",
                    f"{map.certificate.energy:.3f}",
                    f"{np.degrees(map.stats['angle_mean']):.1f}",
                    cost.cpu,
                    target,
                    *measured(mesh.vertices, mesh.faces, made.vertices, made.quads, points, tree),
                )
        except ff.FlipfreeError as error:
            yield (path.stem, len(sharp), str(error).split(". ")[0][:80])


@table("model | triangles | target | quads | irregular | turned | off % | CPU s")
def many(options: Options) -> Iterator[Row]:
    """cup_input_simple_10000, each triangle 64, of other heights than before."""
    mesh = ff.read(data() / "fields/cup_input_simple_10000.obj")
    vertices, faces = mesh.vertices, mesh.faces
    for _ in range(3):
        vertices, faces = subdivided(vertices, faces)
    size = np.ptp(vertices, axis=0).max()
    vertices = vertices + 0.001 * size * np.sin(40 * vertices[:, [1, 2, 0]] / size)
    for target in numbers(options.targets):
        with timed() as cost:
            made = ff.quads(vertices, faces, target=int(target), max_seconds=options.seconds)
        told = made.certificate
        head = ("cup_input_simple_10000", len(faces), target, told.quads, len(told.irregular))
        yield (*head, len(told.turned), f"{100 * told.hausdorff:.2f}", cost.cpu)


def more(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("--targets", default="500,2000,10000")
    parser.add_argument("--folders", default="fields,general,hard")
    parser.add_argument("--blender", help="program")


if __name__ == "__main__":
    sys.exit(main(__doc__, more))
