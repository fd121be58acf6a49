# SPDX-License-Identifier: GPL-3.0-or-later
"""Draws pictures of docs/images anew: maps on their surfaces, and maps in the plane.

    PYTHONPATH=build/python:tests:tests/python:benchmarks python3 scripts/pictures.py FOLDER [NAME ...]

On surfaces: the chart beside the surface, a checker through the seams, seams red, cones red (sharp) and green (saddles). In the
plane: colour is the logarithm of a face's symmetric Dirichlet energy, flipped faces are red, pins blue. Needs matplotlib and the
shared data folder (FLIPFREE_DATA). Look at them before committing.
"""

from __future__ import annotations

import sys
from collections.abc import Callable
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import matplotlib
import numpy as np

matplotlib.use("Agg")
import matplotlib.pyplot as plt
from map_damage import DAMAGES, map_of
from match import into_hilbert, overlapping, prescribed
from matplotlib.collections import LineCollection, PolyCollection
from render_conformal import View, camera, rasterise, shade
from test_pinned_seams import pins_near

import flipfree as ff
from flipfree.separated import folds

from judges.unfoldings import SHAPES, unfolding
from mesh_files import data_folder, read_mesh
from surfaces import areas_of, bumpy_grid, cylinder, torus

LIGHT, DARK = np.array([0.93, 0.90, 0.82]), np.array([0.33, 0.42, 0.52])
RED, GREEN, BLUE = "#d4261c", "#1f9d3a", "#1030c0"
Drawing = Callable[[Path], None]


def data() -> Path:
    folder = data_folder()
    if folder is None:
        sys.exit("The shared data folder is not here (FLIPFREE_DATA).")
    return folder


def model(path: str) -> Any:
    return read_mesh(data() / path)


def checker(uv: np.ndarray, size: float) -> np.ndarray:
    """(..., 3) colours: fields of this size, a corner at the origin."""
    odd = (np.floor(uv / size + 1e-5).sum(-1) % 2)[..., None]
    return LIGHT * (1 - odd) + DARK * odd


def bricks(uv: np.ndarray, size: float) -> np.ndarray:
    """As checker(): four rows of two bricks, dark at their lower left, so that mirrored and turned ones are told apart."""
    row = np.floor(4 * uv[..., 1] / size)
    along, up = (2 * uv[..., 0] / size + row % 2 / 2), 4 * uv[..., 1] / size - row
    x = along % 1
    shade = 1.0 - 0.12 * ((2 * np.floor(along) + row) % 4) - 0.35 * ((x < 0.3) & (up < 0.55))
    joint = (x < 0.06) | (up < 0.12)
    return np.where(joint[..., None], LIGHT, shade[..., None] * np.array([0.82, 0.42, 0.30]))


def draw_surface(
    panel: Any, map: ff.Parametrization, view: View, size: float, texture: Any = checker
) -> None:
    cones = map.certificate.quarter_cones
    ends = map.vertices[map.cut_edges]
    pieces = np.linspace(ends[:, 0], ends[:, 1], 9).transpose(1, 0, 2).reshape(-1, 3)
    every = np.concatenate([map.vertices, pieces, map.vertices[cones[:, 0]]])
    screen = camera(every, view)
    n, m = len(map.vertices), len(map.vertices) + len(pieces)
    face, weights, depth = rasterise(screen[:n], map.faces)
    light = shade(map.vertices, map.faces, view)[face][..., None]
    colour = texture((weights[..., None] * map.uv[face]).sum(2), size)
    panel.imshow(np.where(face[..., None] < 0, 1.0, colour * light))
    x, y = (np.clip(np.rint(screen[:, k]).astype(int), 0, len(depth) - 1) for k in (0, 1))
    seen = screen[:, 2] > depth[y, x] - 0.01 * np.ptp(screen[:n, 2])
    lines = screen[n:m, :2].reshape(-1, 9, 2)
    shown = seen[n:m].reshape(-1, 9)
    segments = np.stack([lines[:, :-1], lines[:, 1:]], 2)[shown[:, :-1] & shown[:, 1:]]
    panel.add_collection(LineCollection(segments, colors=RED, linewidths=1.2))
    colours = np.where(cones[:, 1] < 4, RED, GREEN)[seen[m:]]
    panel.scatter(*screen[m:][seen[m:], :2].T, s=22, c=colours, zorder=3, edgecolors="white")


def energies(map: ff.Parametrization, uv: np.ndarray) -> np.ndarray:
    """Of every face at the map's best scale; nan where flipped."""
    p = map.vertices[map.faces]
    e, d = p[:, 1] - p[:, 0], p[:, 2] - p[:, 0]
    length = np.linalg.norm(e, axis=1)
    x = (e * d).sum(1) / length
    y = np.linalg.norm(np.cross(e, d), axis=1) / length
    a = (uv[:, 1] - uv[:, 0]) / length[:, None]
    b = (uv[:, 2] - uv[:, 0] - a * x[:, None]) / y[:, None]
    square, det = (a**2 + b**2).sum(1), a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]
    inverse = np.where(det > 0, square / np.where(det > 0, det, 1.0) ** 2, np.nan)
    weight = length * y
    scale = np.sqrt(np.nansum(weight * inverse) / (weight * square)[det > 0].sum())
    return np.where(det > 0, (square * scale + inverse / scale) / 4, np.nan)


def draw_plane(panel: Any, map: ff.Parametrization, uv: Any, title: str, pins: Any = None) -> None:
    triangles = np.asarray(uv, np.float64)
    value = np.log10(energies(map, triangles))
    faces = PolyCollection(triangles, array=value, cmap="viridis", edgecolors="#00000060", lw=0.2)
    faces.set_clim(0.0, 1.0)
    panel.add_collection(faces)
    wrong = triangles[np.isnan(value)]
    panel.add_collection(PolyCollection(wrong, facecolors=RED, edgecolors=RED, lw=0.6))
    if pins:
        panel.plot(*np.array(list(pins.values())).T, "s", color=BLUE, markersize=4)
    panel.autoscale_view()
    panel.set_title(title, fontsize=11)


def saved(path: Path, figure: Any, panels: Any) -> None:
    for panel in np.atleast_1d(panels).ravel():
        panel.set_aspect("equal")
        panel.set_axis_off()
    figure.savefig(path, dpi=90, bbox_inches="tight")
    plt.close(figure)


def on_surface(make: Callable[[], ff.Parametrization], view: View, size: float = 0.0) -> Drawing:
    def draw(path: Path) -> None:
        map = make()
        figure, (left, right) = plt.subplots(1, 2, figsize=(11, 5))
        draw_plane(left, map, map.uv, f"energy {map.certificate.energy:.3f}")
        draw_surface(right, map, view, size or float(np.ptp(map.vertices, axis=0).max()) / 30)
        saved(path, figure, (left, right))

    return draw


def matched(case: Callable[[], Any]) -> Drawing:
    def draw(path: Path) -> None:
        name, vertices, faces, request = case()
        map = ff.match(vertices, faces, **request)
        figure, panel = plt.subplots(figsize=(6, 6))
        draw_plane(panel, map, map.uv, name, request.get("points"))
        saved(path, figure, panel)

    return draw


def named(name: str) -> Callable[[], Any]:
    return lambda: next(case for case in [*prescribed(), *overlapping()] if case[0] == name)


def extremities(path: Path) -> None:
    figure, rows = plt.subplots(2, 2, figsize=(9, 8))
    for row, name in zip(rows, ("octopus_f500", "human_f10575"), strict=True):
        mesh = model(f"embedding/{name}.obj")
        for panel, slit in zip(row, (False, True), strict=True):
            map = ff.unwrap(mesh.vertices, mesh.faces, cut_extremities=slit, seams="given")
            title = f"{len(map.cut_edges)} edges cut, energy {map.certificate.energy:.2f}"
            draw_plane(panel, map, map.uv, title)
    saved(path, figure, rows)


def repaired(path: Path) -> None:
    mesh = model("general/camel_f_withSUV.obj")
    base = ff.unwrap(mesh.vertices, mesh.faces, cuts=mesh.seams, seams="given")
    given = map_of(mesh.faces, base.uv.astype(np.float64))
    for damage in ("drag_over", "mirror_part", "mirror_faces"):
        DAMAGES[damage](given, np.random.default_rng(3))
    map = ff.repair(mesh.vertices, mesh.faces, given.uv)
    figure, panels = plt.subplots(1, 2, figsize=(11, 5))
    draw_plane(panels[0], base, given.uv, "spoilt")
    draw_plane(panels[1], map, map.uv, f"repaired, {map.stats['corners_kept']} corners kept")
    saved(path, figure, panels)


def auto(make: Callable[[], Any]) -> Callable[[], ff.Parametrization]:
    def unwrapped() -> ff.Parametrization:
        mesh = make()
        vertices, faces = mesh if isinstance(mesh, tuple) else (mesh.vertices, mesh.faces)
        return ff.unwrap(vertices, faces, seams="auto")

    return unwrapped


def hard_surfaces(path: Path) -> None:
    """As in Blender: polygons stay whole."""
    figure, rows = plt.subplots(2, 4, figsize=(16, 7.5))
    names = "crate", "barrel", "pipe", "gear"
    for panels, name in zip(rows.reshape(4, 2), names, strict=True):
        mesh = ff.read(str(data() / f"hard/{name}.obj"))
        map = ff.unwrap(mesh.vertices, mesh.faces, polygons=mesh.polygons)
        draw_plane(panels[0], map, map.uv, f"energy {map.certificate.energy:.3f}")
        size = float(np.ptp(map.vertices, axis=0).max()) / 30
        draw_surface(panels[1], map, View(30, 25, "y"), size)
    saved(path, figure, rows)


def of_mesh(call: Callable[..., ff.Parametrization], make: Callable[[], Any]) -> Any:
    def mapped() -> ff.Parametrization:
        mesh = make()
        return call(mesh.vertices, mesh.faces)

    return mapped


def bare(vertices: Any, faces: Any, cuts: Any = (), cones: Any = (), uv: Any = None) -> Any:
    """A surface with marks, in the shape of a map."""
    ends = np.array(cuts, int).reshape(-1, 2)
    told = SimpleNamespace(quarter_cones=np.array(list(cones), int).reshape(-1, 2))
    uv = np.zeros((len(faces), 3, 2)) + 0.01 if uv is None else uv
    return SimpleNamespace(vertices=vertices, faces=faces, cut_edges=ends, certificate=told, uv=uv)


def operators(path: Path) -> None:
    """One panel for each operator that the dissertation has and no other page draws."""
    figure, rows = plt.subplots(2, 4, figsize=(16, 8.4))
    plane, lines, cut, cones, along, free, pinned, carried = rows.ravel()
    camel, eight = model("constraints/camel_b_uv.obj"), model("fields/eight.obj")
    view = View(20, 30)
    shape = ff.embed(camel.vertices, camel.faces, boundary="triangle", optimise=True)
    draw_plane(plane, shape, shape.uv, "Embed in Polygon: triangle")

    vertices, faces = bumpy_grid(14, 14)
    row, places = [15 * 7 + k for k in range(2, 13)], np.array([[0.1, 0.4], [0.5, 0.8], [0.9, 0.4]])
    bent = ff.match(vertices, faces, lines=[(row, places)], points={7: (0.5, 0.0)})
    draw_plane(lines, bent, bent.uv, "Match Pins: a line onto a bend", {7: (0.5, 0.0)})
    lines.plot(*places.T, color=BLUE, lw=1.5)

    suggested = ff.suggest_cones(eight.vertices, eight.faces, bound=2.0, quarter_turns=True)
    quarters = {v: k for v, k in suggested.quarter_turns.items() if k != 4}
    marked = bare(eight.vertices, eight.faces, cones=quarters.items())
    draw_surface(cones, marked, view, 1.0)
    cones.set_title("Suggest Cones", fontsize=11)
    opened = ff.admissible_cut(eight.vertices, eight.faces, quarters)
    branches = [np.column_stack([b[:-1], b[1:]]) for b in opened.branches]
    draw_surface(cut, bare(opened.vertices, opened.faces, np.concatenate(branches)), view, 1.0)
    cut.set_title(f"Admissible Cut: {len(branches)} branches", fontsize=11)

    ring = torus(48, 24)
    wanted = ff.Signature({0: 3, 300: 3, 600: 5, 900: 5}, [])
    draw_surface(along, ff.field_aligned(*ring, signature=wanted), View(35, 40), 0.12)
    along.set_title("Field-Aligned Map: a signature", fontsize=11)

    before = ff.seamless(*torus(), {0: 3, 60: 3, 130: 5, 200: 5})
    start = {v: tuple(before.uv[before.faces == v][0]) for v in pins_near(before, 4, 7)}
    step = 0.05 * float(np.ptp(before.uv[..., 0]))
    points = {v: (u, w + step * (-1) ** k) for k, (v, (u, w)) in enumerate(start.items())}
    draw_plane(free, before, before.uv, "Seamless Map", start)
    after = before.with_pins(points)
    draw_plane(pinned, after, after.uv, "... Meet Pins", points)

    maps = []
    for name in ("camel_b", "cow"):
        mesh = model(f"constraints/{name}_uv.obj")
        maps.append(ff.embed(mesh.vertices, mesh.faces, boundary="square", optimise=True))
    face, weights = ff.compose(*maps).map_corners()
    at = np.einsum("mcw,mcwd->mcd", weights, maps[1].vertices[maps[1].input_faces[face]])
    moved = maps[0].vertices[: maps[0].input_faces.max() + 1].copy()
    moved[maps[0].input_faces] = at
    uv = maps[0].map_points(np.repeat(np.arange(len(face)), 3), np.tile(np.eye(3), (len(face), 1)))
    draw_surface(carried, bare(moved, maps[0].input_faces, uv=uv.reshape(-1, 3, 2)), view, 0.05)
    carried.set_title("Transfer Through UVs: a camel like a cow", fontsize=11)
    saved(path, figure, rows)


#: Model, view, and whether its sharp edges are features.
QUADS = (
    ("fields/fertility_input.obj", View(20, 70), False),
    ("fields/rocker-arm2500.obj", View(110, 20, "y"), False),
    ("general/horse_quad.obj", View(60, 10, "y"), False),
    ("seams/bunny.obj", View(20, 20, "y"), False),
    ("seams/planck1.obj", View(200, 10, "y"), False),
    ("hard/gear.obj", View(30, 40), True),
    ("hard/mug.obj", View(20, 25, "y"), True),
    ("hard/flange.obj", View(30, 40), True),
)


def draw_quads(panels: Any, path: str, view: View, features: bool) -> None:
    """Isolines of the integer map; the quads; the quads shaded, irregular vertices red (fewer than four) and green."""
    given = model(path)
    sharp = folds(given.vertices, given.faces, np.radians(40.0)) if features else None
    made = ff.quads(given.vertices, given.faces, target=1000, features=sharp, with_map=True)
    map = made.map
    assert map is not None
    face, weights, _ = rasterise(camera(map.vertices, view), map.faces)
    uv = (weights[..., None] * map.uv[face]).sum(2)
    line = (np.abs(uv - np.rint(uv)).min(-1) < 0.06)[..., None]
    grown = 800.0 / np.ptp(given.vertices, axis=0).max()  # as deep as it is wide on the screen
    light = shade(map.vertices * grown, map.faces, view)[face][..., None]
    panels[0].imshow(np.where(face[..., None] < 0, 1.0, np.where(line, DARK, LIGHT) * light))
    corners = made.quads
    halves = corners[:, [0, 1, 2, 0, 2, 3]].reshape(-1, 3)
    screen = camera(made.vertices, view)
    face, _, depth = rasterise(screen, halves)
    light = shade(made.vertices * grown, halves, view)[face][..., None]
    panels[1].imshow(np.ones((*depth.shape, 3)))
    panels[2].imshow(np.where(face[..., None] < 0, 1.0, LIGHT * light))
    ends = np.unique(
        np.sort(np.stack([corners, np.roll(corners, -1, 1)], -1).reshape(-1, 2)), axis=0
    )
    pieces = np.linspace(screen[ends[:, 0]], screen[ends[:, 1]], 9).transpose(1, 0, 2)
    irregular = made.certificate.irregular

    def seen(places: np.ndarray) -> np.ndarray:
        x, y = (np.clip(np.rint(places[..., k]).astype(int), 0, len(depth) - 1) for k in (0, 1))
        return places[..., 2] > depth[y, x] - 0.02 * np.ptp(screen[:, 2])

    shown = seen(pieces)
    segments = np.stack([pieces[:, :-1, :2], pieces[:, 1:, :2]], 2)[shown[:, :-1] & shown[:, 1:]]
    panels[1].add_collection(LineCollection(segments, colors="#203040", linewidths=0.5))
    dots = screen[irregular[:, 0]]
    colours = np.where(irregular[:, 1] < 4, RED, GREEN)[seen(dots)]
    panels[2].scatter(*dots[seen(dots), :2].T, s=6, c=colours, zorder=3)
    panels[1].set_title(f"{len(corners)} quads, {len(irregular)} irregular", fontsize=8)


def quad_sheet(path: Path) -> None:
    figure, panels = plt.subplots(4, 6, figsize=(15, 10))
    for place, case in zip(panels.reshape(8, 3), QUADS, strict=True):
        draw_quads(place, *case)
    saved(path, figure, panels)


#: The models of fields/ and hard/.
TILES = (
    "fertility_input cup_input_simple_10000 holes3_libigl rocker-arm2500 elephant crate flange house "
    "1146164 eight766 gtorus004_fine bumpy barrel bolt bracket chair gear eight torus mug phone pipe stairs"
).split()


def tile_sheet(names: list[str]) -> Drawing:
    """200 tiles of bricks as Fit Tiles makes them by itself; red: seams that turn them, the only ones where they may break."""

    def draw(path: Path) -> None:
        figure, panels = plt.subplots(2, 4, figsize=(20, 10))
        for panel, name in zip(panels.ravel(), names, strict=False):
            found = min(data().glob(f"[fh]*/{name}.o[bf][jf]"))
            mesh = read_mesh(found)
            given = ff.separate(mesh.vertices, mesh.faces)  # edges of length zero are mended
            grown = given.vertices * (800.0 / np.ptp(given.vertices, axis=0).max())
            field = ff.cross_field(grown, given.faces, alignment=0.5, simplify=True)
            map = ff.field_aligned(grown, given.faces, field=field)
            tile = float(np.sqrt(areas_of(grown, given.faces).sum() / 200))
            map = ff.fit_tiles(map, tile=tile, prefer_translations=True)
            told = map.certificate
            turned = map.cut_edges[map.transitions.quarter_turns != 0]
            marked = bare(map.vertices, map.faces, turned, told.quarter_cones, map.uv)
            draw_surface(panel, marked, View(30, 25, "zy"[found.match("fields/*")]), 1.0, bricks)
            whole = "" if told.ok and told.tile_failures == 0 else "NOT "
            panel.set_title(f"{name}: {map.stats['tiles']:.0f} tiles, {whole}certified")
        saved(path, figure, panels)

    return draw


PICTURES: dict[str, Drawing] = {
    **{
        name: tile_sheet(TILES[8 * k :][:8])
        for k, name in enumerate(("tiles", "tiles_2", "tiles_3"))
    },
    "operators": operators,
    "quads": quad_sheet,
    "auto_seams_hard": hard_surfaces,
    "auto_seams_cylinder": on_surface(auto(cylinder), View(20, 20)),
    **{
        f"auto_seams_{name}": on_surface(auto(lambda n=name: model(f"seams/{n}.obj")), view)
        for name, view in (
            ("horse_f10000", View(60, 10, "y")),
            ("planck1", View(20, 10, "y")),
        )
    },
    "seamless_frame": on_surface(
        of_mesh(ff.seamless, lambda: unfolding(SHAPES["two holes"], 6, 1)), View(25, 52), 0.25
    ),
    "seamless_eight": on_surface(
        of_mesh(ff.seamless, lambda: model("fields/eight.obj")), View(20, 30)
    ),
    "field_fertility": on_surface(
        of_mesh(ff.field_aligned, lambda: model("fields/fertility_input.obj")), View(20, 70)
    ),
    "unwrap_extremities": extremities,
    "repair": repaired,
    "match_camel_b_comb": matched(named("camel_b comb")),
    "match_cow_S": matched(named("cow S")),
    "match_cow_spiral": matched(named("cow spiral")),
    "match_ribbon_2.4": matched(named("ribbon 2.4")),
    "match_lobes_one": matched(named("lobes one")),
    "match_lobes_other": matched(named("lobes other")),
    "match_doodle_one": matched(named("doodle one")),
    "match_doodle_other": matched(named("doodle other")),
    "match_hilbert_3": matched(
        lambda: next(iter(into_hilbert("constraints/camel_b_uv.obj", 3, 1)))
    ),
}


def main(folder: str, *names: str) -> None:
    for name in names or PICTURES:
        PICTURES[name](Path(folder) / f"{name}.png")
        print(name, flush=True)


if __name__ == "__main__":
    main(*sys.argv[1:])
