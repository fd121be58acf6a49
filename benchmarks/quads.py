"""ff.quads beside Blender's QuadriFlow and Instant Meshes (package pynanoinstantmeshes, where it is there).

    quads.py models [--targets 2000,10000] [--folders fields,general,hard] [--sample N]
             [--blender PROGRAM] [--json FILE]
    quads.py peers [--of benchmarks/results/quads_models.json] [--json FILE]
    quads.py certified [--targets 500,2000,10000] [--folders fields,general,embedding,seams,hard] [--json FILE]
    quads.py features [--targets 2000] [--folders fields,hard] [--blender PROGRAM] [--json FILE]
    quads.py tiles [--targets 200] [--folders fields,hard] [--json FILE]
    quads.py many [--targets 20000] [--json FILE]      (package trimesh)

Instant Meshes is asked for a quarter of the count, as it divides each face into four at the end. Angles: degrees that corners are off 90. Irregular: inner vertices with other than 4 quads, those of the border with other than 2. Kept:
manifold, and Euler characteristic and number of components as the surface has them. Turned: quads that look against the surface where
it is nearest to their middles. Off: the largest distance from the surface's vertices to the quads, as two triangles each, and from the
quads' corners and middles to the surface, % of its size. Of each point the distance to the triangles of the 16 nearest of 400 000 points
on them. CPU s: ours with the map; theirs of the call. peers: medians of a table of models, and of ours divided by the peer's, model by
model, where both made quads. certified: ff.quads on every model; within: counts within 5 % of the target.
"""

from __future__ import annotations

import json
import random
import sys
import tempfile
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
from runner import Options, Row, data, from_blender, main, numbers, table, timed
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import connected_components
from scipy.spatial import cKDTree

import flipfree as ff
from flipfree.separated import folds

from mesh_files import MeshFile
from surfaces import areas_of

POINTS = 400_000


class Points:
    """Points on triangles, by area, by which the triangle that is nearest to another point is found."""

    def __init__(self, vertices: Any, faces: Any) -> None:
        self.corners = vertices[faces]
        a, b, c = np.moveaxis(self.corners, 1, 0)
        self.normal = np.cross(b - a, c - a)
        area = np.linalg.norm(self.normal, axis=1)
        generator = np.random.default_rng(0)
        self.face = generator.choice(len(faces), POINTS, p=area / area.sum())
        u, v = np.sort(generator.random((2, POINTS)), axis=0)
        weights = np.stack([u, v - u, 1 - v], -1)[..., None]
        self.tree = cKDTree((self.corners[self.face] * weights).sum(1))

    def nearest(self, points: Any) -> tuple[Any, Any]:
        """Distances, and the faces."""
        faces = self.face[self.tree.query(points, k=16)[1]]
        distance = to_triangles(points[:, None], self.corners[faces])
        best = distance.argmin(1)[:, None]
        return (np.take_along_axis(x, best, 1)[:, 0] for x in (distance, faces))


def to_triangles(points: Any, corners: Any) -> Any:
    """Distances of points (..., 3) to triangles (..., 3, 3): to the nearest side, or to the plane above the inside."""
    sides = np.roll(corners, -1, axis=-2) - corners
    normal = np.cross(sides[..., 0, :], sides[..., 1, :])
    from_corners = points[..., None, :] - corners
    with np.errstate(all="ignore"):
        share = (from_corners * sides).sum(-1) / (sides * sides).sum(-1)
        share = np.clip(np.nan_to_num(share), 0.0, 1.0)[..., None]
        size = np.linalg.norm(normal, axis=-1)
        above = np.abs((from_corners[..., 0, :] * normal).sum(-1)) / size
    to_sides = np.linalg.norm(from_corners - share * sides, axis=-1).min(-1)
    left_of = (np.cross(sides, from_corners) * normal[..., None, :]).sum(-1)
    return np.where((left_of > 0).all(-1) & (size > 0), above, to_sides)


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


def measured(surface: Points, vertices: Any, faces: Any, made: Any, quads: Any) -> Row:
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
    to_middle, nearest = surface.nearest(corners.mean(1))
    normal = np.cross(corners[:, 2] - corners[:, 0], corners[:, 3] - corners[:, 1])
    turned = ((normal * surface.normal[nearest]).sum(1) <= 0).sum()
    to_corner, _ = surface.nearest(made[np.unique(quads)])
    halves = np.concatenate([quads[:, :3], quads[:, [0, 2, 3]]])
    back, _ = Points(made, halves).nearest(vertices[np.unique(faces)])
    distance = max(to_middle.max(), to_corner.max(), back.max())
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


def targets_of(options: Options) -> list[int]:
    return list(map(int, numbers(options.targets)))


def models_of(options: Options, only: str = "") -> Iterator[Path]:
    names = (only or options.folders).split(",")
    folders = [sorted((data() / name).glob("*.o[bf][jf]")) for name in names]
    paths = [path for paths in folders for path in paths]
    if options.sample:
        paths = sorted(random.Random(0).sample(paths, options.sample))
    return options.cases(paths, lambda p: p.name)


def median(values: Any) -> str:
    return f"{np.median(values):.2f}" if len(values) else ""


@table(
    "model | target | tool | quads | angles mean / p95 | irregular | kept | turned | off % | CPU s"
)
def models(options: Options) -> Iterator[Row]:
    tools: dict[str, Any] = {"ours": ours}
    if options.blender:
        tools["QuadriFlow"] = quadriflow
    try:
        __import__("pynanoinstantmeshes")
        tools["Instant Meshes"] = instant
    except ImportError:
        pass
    for path in models_of(options):
        mesh = ff.read(path)
        surface = Points(mesh.vertices, mesh.faces)
        for target in targets_of(options):
            for name, tool in tools.items():
                head = (path.name, target, name)
                try:
                    made, quads, cpu = tool(mesh.vertices, mesh.faces, target, options)
                    if len(quads) == 0:
                        raise RuntimeError("no quads")
                except Exception as error:
                    yield (*head, str(error).split(". ")[0][:80])
                    continue
                yield (
                    *head,
                    *measured(surface, mesh.vertices, mesh.faces, made, quads),
                    cpu,
                )


@table(
    "tool | target | models | kept | with turned quads | angles mean / p95 | irregular | off % | CPU s; largest | models of both | "
    "ours / its: mean | p95 | irregular | off | CPU"
)
def peers(options: Options) -> Iterator[Row]:
    made: dict[tuple[str, str], dict[str, list[str]]] = {}
    for model, target, tool, *figures in json.loads(options.of.read_text())["rows"]:
        runs = made.setdefault((target, tool), {})
        if len(figures) == 7:  # else why there are none
            runs[model] = figures

    def figures_of(runs: dict[str, list[str]], models: Any) -> Any:
        rows = [runs[model] for model in models]
        return np.array([[*row[1].split(" / "), row[2], row[5], row[6]] for row in rows], float)

    for (target, tool), runs in made.items():
        figures = figures_of(runs, runs)
        mean, p95, irregular, off, cpu = (median(column) for column in figures.T)
        kept, turned = (
            sum(row[k] != "0" and row[k] != "no" for row in runs.values()) for k in (3, 4)
        )
        head = (tool, target, len(runs), kept, turned, f"{mean} / {p95}", irregular, off)
        ratios: list[Any] = []
        if tool != "ours":
            both = sorted(runs.keys() & made[target, "ours"].keys())
            pairs = zip(
                figures_of(made[target, "ours"], both).T, figures_of(runs, both).T, strict=True
            )
            ratios = [len(both), *[median(own[its > 0] / its[its > 0]) for own, its in pairs]]
        yield (*head, f"{cpu}; {figures[:, 4].max():.1f}", *(ratios or [""] * 6))


def off_count(made: ff.QuadMesh, target: int) -> bool:
    return abs(made.certificate.quads / target - 1) > 0.05


@table(
    "folder | target | models | certified | refused | within | raised | with turned quads; turned of all | off % median; largest | "
    "CPU s median; largest"
)
def certified(options: Options) -> Iterator[Row]:
    for folder in options.folders.split(","):
        for target in targets_of(options):
            paths = list(models_of(options, folder))
            meshes, costs = [], []
            for path in paths:
                try:
                    mesh = ff.read(path)
                    with timed() as cost:
                        made = ff.quads(
                            mesh.vertices, mesh.faces, target=target, max_seconds=options.seconds
                        )
                    meshes.append(made)
                    costs.append(cost.cpu)
                    told = str(made.certificate) if off_count(made, target) else ""
                except ff.FlipfreeError as error:
                    told = str(error)
                if told:
                    print(f"{path.name}, {target}: {told}", file=sys.stderr, flush=True)
            told = [made.certificate for made in meshes]
            off = [100 * c.hausdorff for c in told]
            turned = [len(c.turned) for c in told]
            share = 100 * sum(turned) / sum(c.quads for c in told)
            yield (
                *(folder, target, len(paths), sum(c.ok for c in told), len(paths) - len(told)),
                sum(not off_count(made, target) for made in meshes),
                sum(made.stats["count_raised"] for made in meshes),
                f"{np.count_nonzero(turned)}; {share:.2g} %",
                f"{median(off)}; {max(off):.2f}",
                f"{median(costs)}; {max(costs):.1f}",
            )


def share_on_sides(mesh: ff.QuadMesh, vertices: Any, edges: Any) -> float:
    """Of the edges' length what lies within a tenth of a side from sides of quads."""
    sides = mesh.vertices[edges_of(mesh.quads)[0]]
    length = np.linalg.norm(np.diff(vertices[edges], axis=1)[:, 0], axis=1)
    side = np.linalg.norm(np.diff(sides, axis=1), axis=2).mean()
    steps = np.linspace(0.0, 1.0, 41)[:, None, None]
    tree = cKDTree((sides[:, 0] + steps * (sides[:, 1] - sides[:, 0])).reshape(-1, 3))
    ends = vertices[edges]
    near = tree.query(ends[:, 0] + steps * (ends[:, 1] - ends[:, 0]))[0] < 0.1 * side
    return 100 * float((near.mean(0) * length).sum() / length.sum())


def with_sharp_edges(options: Options) -> Iterator[tuple[str, Any]]:
    """Parts of machines by Blender, and the models."""
    if options.blender:
        arrays = from_blender(options.blender, "parts")
        for name in options.cases(sorted({key.split(".")[0] for key in arrays})):
            own = (arrays[f"{name}.{what}"] for what in ("vertices", "faces"))
            yield name, MeshFile(*own, np.zeros((0, 2), np.int32), None)
    for path in models_of(options):
        yield path.name, ff.read(path)


@table(
    "model | sharp edges | length on isolines % | on sides of quads % | energy | degrees off the field | CPU s | target | quads | "
    "angles mean / p95 | irregular | kept | turned | off %"
)
def features(options: Options) -> Iterator[Row]:
    """Edges sharper than 25 degrees of parts, 40 of models that have some; the last row: of all lengths, over their extents."""
    sums = np.zeros(3)
    for name, mesh in with_sharp_edges(options):
        sharp = folds(mesh.vertices, mesh.faces, np.radians(40.0 if "." in name else 25.0))
        if len(sharp) == 0:
            continue
        surface = Points(mesh.vertices, mesh.faces)
        limit = options.seconds
        try:
            with timed() as cost:
                map = ff.field_aligned(mesh.vertices, mesh.faces, features=sharp, max_seconds=limit)
            missed, whole = (
                np.linalg.norm(np.diff(mesh.vertices[edges], axis=1), axis=2).sum()
                / np.ptp(mesh.vertices, axis=0).max()
                for edges in (map.certificate.features_missed, sharp)
            )
            for target in targets_of(options):
                made = ff.quads(
                    mesh.vertices, mesh.faces, target=target, features=sharp, max_seconds=limit
                )
                on_sides = share_on_sides(made, mesh.vertices, sharp)
                sums += (whole, whole - missed, whole * on_sides / 100)
                yield (
                    *(name, len(sharp), f"{100 * (1 - missed / whole):.1f}", f"{on_sides:.1f}"),
                    f"{map.certificate.energy:.3f}",
                    f"{np.degrees(map.stats['angle_mean']):.1f}",
                    *(cost.cpu, target),
                    *measured(surface, mesh.vertices, mesh.faces, made.vertices, made.quads),
                )
        except ff.FlipfreeError as error:
            yield (name, len(sharp), str(error).split(". ")[0][:80])
    yield ("all", "", *(f"{100 * part / sums[0]:.1f}" for part in sums[1:]), *[""] * 10)


def turned_length(made: ff.Parametrization) -> float:
    """Of the seams across which the map turns, by the root of the surface's area."""
    ends = made.vertices[made.cut_edges]
    turned = made.transitions.quarter_turns != 0
    length = np.linalg.norm(ends[:, 0] - ends[:, 1], axis=1)[turned].sum()
    return float(length / np.sqrt(made.stats["tiles"]) / made.stats["tile"])


@table(
    "model | tiles wanted | tiles | G9 | length of seams without a turn % | length of those with, by the area's root | "
    "with few of them | ratio | energy before | after | added vertices | CPU s"
)
def tiles(options: Options) -> Iterator[Row]:
    """Maps along each model's smoothest field, closed or with the border along the axes, then ff.fit_tiles, of few turns too."""
    ratios = []
    for path in models_of(options):
        given = ff.read(path)
        mesh = ff.separate(given.vertices, given.faces)  # edges of length zero are mended
        for target in targets_of(options):
            try:
                tile = float(np.sqrt(areas_of(mesh.vertices, mesh.faces).sum() / target))
                with timed() as cost:
                    map = ff.field_aligned(mesh.vertices, mesh.faces, max_seconds=options.seconds)
                    made = ff.fit_tiles(map, tile=tile, max_seconds=options.seconds)
                few = ff.fit_tiles(map, tile=tile, prefer_translations=True)
            except ff.FlipfreeError as error:
                yield (path.name, target, str(error).split(". ")[0][:80])
                continue
            certified = (one.certificate for one in (made, few))
            whole = all(told.ok and told.tile_failures == 0 for told in certified)
            kept, least = turned_length(made), turned_length(few)
            ratios.append(least / kept if kept else 1.0)
            yield (
                *(path.name, target, round(made.stats["tiles"]), whole),
                f"{100 * made.stats['seams_matched']:.0f}",
                *(f"{kept:.2f}", f"{least:.2f}", f"{ratios[-1]:.2f}"),
                *(f"{map.certificate.energy:.3f}", f"{made.certificate.energy:.3f}"),
                *(len(made.vertices) - len(mesh.vertices), cost.cpu),
            )
    yield ("median", *[""] * 6, f"{np.median(ratios):.2f}", *[""] * 4)


@table("model | triangles | target | quads | irregular | turned | off % | CPU s")
def many(options: Options) -> Iterator[Row]:
    """cup_input_simple_10000, each triangle 64, of other heights than before."""
    from trimesh.remesh import subdivide_loop

    mesh = ff.read(data() / "fields/cup_input_simple_10000.obj")
    vertices, faces = subdivide_loop(mesh.vertices, mesh.faces, 3)
    size = np.ptp(vertices, axis=0).max()
    vertices = vertices + 0.001 * size * np.sin(40 * vertices[:, [1, 2, 0]] / size)
    for target in targets_of(options):
        with timed() as cost:
            made = ff.quads(vertices, faces, target=target, max_seconds=options.seconds)
        told = made.certificate
        head = ("cup_input_simple_10000", len(faces), target, told.quads, len(told.irregular))
        yield (*head, len(told.turned), f"{100 * told.hausdorff:.2f}", cost.cpu)


if __name__ == "__main__":
    main(
        __doc__,
        targets=("2000,10000", ""),
        sample=(0, "so many of the models, seeded"),
        folders=("fields,general,hard", ""),
        of=(Path("benchmarks/results/quads_models.json"), "table of models"),
    )
