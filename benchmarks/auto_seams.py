"""Automatic seams: 49 models beside Smart UV Project and xatlas, each by itself, and large ones.

    auto_seams.py peers [--blender PROGRAM] [--stretch 1.25]    a row per method
    auto_seams.py models [--stretch 1.25]                       a row per model
    auto_seams.py hard [--blender PROGRAM]                      hard surfaces: what lies along the axes, beside Smart UV Project
    auto_seams.py large      models subdivided (Loop 1987, package trimesh), from mesh to packed islands

Models: the shared data folder's seams/. xatlas is left out where it cannot be imported. Seam: length of the edges whose sides differ,
each once, over the square root of the surface's area. Energy: mean at the map's best scale, the worst island at its own. 99 %: the
longest singular value and the area ratio that a hundredth of the area is above, either way, at the map's best scale; for the worst
island at its own, the larger of both. hard: islands, energy, share of the border's length within 1 degree of the axes, seam, slivers (islands
with less than 0.2 % of the area), seam edges without a mirror image (across the first of the planes x, y, z that maps vertices
to vertices), fill; polygons stay whole. Exit status 1 if one of ours is not certified, or an island of it above its bounds.
"""

from __future__ import annotations

import tempfile
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
from runner import Options, Row, data, in_blender, main, numbers, table, timed
from scipy.spatial import cKDTree

import flipfree as ff
from flipfree.distortion import percentiles

from mesh_files import read_mesh
from surfaces import areas_of

Array = npt.NDArray[np.float64]
Model = tuple[str, Array, Any]
LARGE = "bunny:0 bunny:1 bunny:2 horse_f10000:2 bunny:3 face_f10000:3 cat_noUV:3 kingkong_f20000:3"


@dataclass
class Figures:
    faces: int
    islands: int
    seam: float
    energy: float
    worst: float
    length99: float
    area99: float
    worst99: float
    fill: float
    valid: bool
    seconds: float

    def cells(self) -> list[Any]:
        ratios = [f"{x:.2f}" for x in (self.length99, self.area99, self.worst99, self.fill)]
        energies = f"{self.energy:.4f}", f"{self.worst:.4f}"
        return [self.faces, self.islands, f"{self.seam:.2f}", *energies, *ratios, self.valid]


def singular_values(vertices: Array, faces: Any, uv: Array) -> tuple[Array, Array]:
    """(m, 2) of the maps from the surface to the plane, and the areas on the surface."""
    a, b = (vertices[faces[:, k]] - vertices[faces[:, 0]] for k in (1, 2))
    length = np.linalg.norm(a, axis=1)
    x = a / length[:, None]
    bx = (b * x).sum(1)
    by = np.linalg.norm(b - bx[:, None] * x, axis=1)
    d1, d2 = uv[:, 1] - uv[:, 0], uv[:, 2] - uv[:, 0]
    j1 = d1 / length[:, None]
    j2 = (d2 - j1 * bx[:, None]) / by[:, None]
    return np.linalg.svd(np.stack([j1, j2], -1), compute_uv=False), 0.5 * length * by


def energy_at_best_scale(s: Array, area: Array) -> tuple[float, float]:
    """The mean, and the factor on the UVs that attains it."""
    growing, shrinking = ((area * (s**p).sum(1)).sum() / (4.0 * area.sum()) for p in (2, -2))
    return 2.0 * float(np.sqrt(growing * shrinking)), float((shrinking / growing) ** 0.25)


def ratios99(s: Array, area: Array) -> tuple[float, float]:
    """Of lengths and of areas, up or down: what a hundredth of the area is above."""
    grown = s.prod(1)
    either = np.maximum(s, 1.0 / s).max(1), np.maximum(grown, 1.0 / grown)
    lengths, areas = (percentiles(values, area, (99,))[0] for values in either)
    return lengths, areas


def seams_and_islands(vertices: Array, faces: Any, uv: Array) -> tuple[Any, Any]:
    """Edges (vertex pairs) whose sides differ, and each face's island."""
    file = ff.MeshFile(vertices, faces, uv, np.arange(len(faces)))
    return file.seams(), ff.islands(faces, uv)[0]


def seam_length(vertices: Array, seams: Any, area: Array) -> float:
    """Over the square root of the surface's area."""
    return float(np.linalg.norm(np.diff(vertices[seams], axis=1), axis=2).sum() / area.sum() ** 0.5)


def judge(vertices: Array, faces: Any, uv: Any, seconds: float) -> Figures:
    """Islands that are mirrored as a whole are judged as they look from behind."""
    uv = np.array(uv, np.float64)
    seams, island = seams_and_islands(vertices, faces, uv)
    d1, d2 = uv[:, 1] - uv[:, 0], uv[:, 2] - uv[:, 0]
    signed = 0.5 * (d1[:, 0] * d2[:, 1] - d1[:, 1] * d2[:, 0])
    mirrored = np.bincount(island, signed)[island] < 0.0
    fill = float(np.abs(signed).sum() / max(np.ptp(uv.reshape(-1, 2), axis=0)) ** 2)
    uv[mirrored, :, 0] *= -1.0
    s, area = singular_values(vertices, faces, uv)
    with np.errstate(all="ignore"):
        energy, scale = energy_at_best_scale(s, area)
        parts = [(s[island == i], area[island == i]) for i in np.unique(island)]
        own = [energy_at_best_scale(*part) for part in parts]
        length99, area99 = ratios99(s * scale, area)
        worst99 = max(
            max(ratios99(part * unit, size))
            for (part, size), (_, unit) in zip(parts, own, strict=True)
        )
    certificate = ff.certify(vertices, faces, uv, bijective=True, disjoint=not mirrored.any())
    return Figures(
        len(faces),
        len(np.unique(island)),
        seam_length(vertices, seams, area),
        energy,
        max(energy for energy, _ in own),
        length99,
        area99,
        worst99,
        fill,
        certificate.ok,
        seconds,
    )


def ours(model: Model, stretch: float, options: Options) -> Figures:
    name, vertices, faces = model
    with timed() as cost:
        result = ff.unwrap(vertices, faces, seams="auto", stretch=stretch)
    found = judge(vertices, faces, result.uv32(), cost.cpu)
    # The solver's stretch_bound: the mean energy, and what all but a hundredth of an island may change by.
    above = found.worst > 0.5 * (stretch + 1.0 / stretch) + 1e-5
    if not found.valid or above or found.worst99 > 1.0 + 3.0 * (stretch - 1.0) + 1e-4:
        options.fail(f"{name}, stretch {stretch:g}: {found}")
    return found


def by_xatlas(model: Model) -> Figures:
    """Its maps are in pixels."""
    import xatlas

    _, vertices, faces = model
    atlas = xatlas.Atlas()
    atlas.add_mesh(vertices.astype(np.float32), faces.astype(np.uint32))
    with timed() as cost:
        atlas.generate()
    _, corners, uv = atlas.get_mesh(0)
    pixels = uv.astype(np.float64) * [atlas.width, atlas.height]
    return judge(vertices, faces, pixels[corners.reshape(-1, 3)], cost.cpu)


def smart_maps(program: str, models: list[Model]) -> Iterator[tuple[Any, float]]:
    """Smart UV Project's corner UVs and CPU seconds, all models in one Blender."""
    with tempfile.TemporaryDirectory() as folder:
        for name, vertices, faces in models:
            np.savez(Path(folder) / f"{name}.npz", vertices=vertices, faces=faces)
        in_blender(program, "smart", folder)
        for name, _, _ in models:
            found = np.load(Path(folder) / f"{name}.smart.npz")
            yield found["uv"], float(found["seconds"][1])


def chosen(options: Options) -> list[Model]:
    paths = options.cases(sorted((data() / "seams").glob("*.obj")))
    meshes = [(path.stem, read_mesh(path)) for path in paths]
    return [(name, mesh.vertices, mesh.faces) for name, mesh in meshes]


def summary(name: str, figures: list[Figures]) -> Row:
    def median(key: str, digits: int = 2) -> str:
        return f"{np.median([getattr(f, key) for f in figures]):.{digits}f}"

    islands, seams = [f.islands for f in figures], [f.seam for f in figures]
    per_10k = 1e4 * sum(f.seconds for f in figures) / sum(f.faces for f in figures)
    yield name
    yield f"{np.median(islands):g} / {np.mean(islands):.1f} / {max(islands)}"
    yield f"{np.median(seams):.2f} / {np.mean(seams):.2f} / {max(seams):.2f}"
    yield f"{median('energy', 4)} / {max(f.energy for f in figures):.4f}"
    yield f"{max(f.worst for f in figures):.4f}"
    yield median("length99")
    yield median("area99")
    yield f"{max(f.worst99 for f in figures):.2f}"
    yield median("fill")
    yield f"{sum(f.valid for f in figures)} of {len(figures)}"
    yield f"{median('seconds')} / {per_10k:.2f}"


@table(
    "method | islands: median / mean / most | seam: median / mean / most | energy: median / most"
    " | worst island | 99 % length | 99 % area | 99 % worst island | fill | valid"
    " | CPU s: median / per 10 000 triangles"
)
def peers(options: Options) -> Iterator[Row]:
    found = chosen(options)
    for stretch in numbers(options.stretch):
        yield summary(f"ours, {stretch:g}", [ours(model, stretch, options) for model in found])
    if options.blender:
        maps = zip(found, smart_maps(options.blender, found), strict=True)
        yield summary("Smart UV Project", [judge(*model[1:], *map) for model, map in maps])
    try:
        import xatlas as _  # noqa: F401
    except ImportError:
        return
    yield summary("xatlas", [by_xatlas(model) for model in found])


COLUMNS = (
    "model | triangles | islands | seam | energy | worst island | 99 % length | 99 % area"
    " | 99 % worst island | fill | valid | CPU s"
)


@table(COLUMNS)
def models(options: Options) -> Iterator[Row]:
    for stretch in numbers(options.stretch):
        for model in chosen(options):
            found = ours(model, stretch, options)
            yield model[0], *found.cells(), f"{found.seconds:.2f}"


def hard_figures(vertices: Array, faces: Any, uv: Any) -> str:
    uv = np.array(uv, np.float64)
    seams, island = seams_and_islands(vertices, faces, uv)
    cut = {frozenset(edge) for edge in seams.tolist()}
    edges = np.stack([faces, np.roll(faces, -1, axis=1)], axis=-1)
    border = np.array([[frozenset(e) in cut for e in face] for face in edges.tolist()])
    sides = (np.roll(uv, -1, axis=1) - uv)[border]
    angle = np.degrees(np.arctan2(sides[:, 1], sides[:, 0])) % 90.0
    length = np.linalg.norm(sides, axis=1)
    upright = 100.0 * length[np.minimum(angle, 90.0 - angle) < 1.0].sum() / length.sum()
    area = areas_of(vertices, faces)
    own = np.bincount(np.unique(island, return_inverse=True)[1], area)
    found = ff.certify(vertices, faces, uv)
    slivers = (own < 0.002 * area.sum()).sum()
    figures = f"{len(own)}, {found.energy:.4f}, {upright:.0f} %, {seam_length(vertices, seams, area):.1f}, {slivers}"
    return f"{figures}, {without_image(vertices, seams)}"


def without_image(vertices: Array, seams: Any) -> str:
    """How many of these edges; - where no plane maps the mesh to itself."""
    middle = 0.5 * (vertices.min(0) + vertices.max(0))
    for axis in range(3):
        image = np.where(np.arange(3) == axis, 2 * middle - vertices, vertices)
        distance, at = cKDTree(vertices).query(image)
        if distance.max() < 1e-5 * np.ptp(vertices):
            edges = {frozenset(edge) for edge in seams.tolist()}
            return str(sum(frozenset(edge) not in edges for edge in at[seams].tolist()))
    return "-"


@table(
    "model | triangles | islands, energy, upright, seam, slivers, no image | fill | CPU s"
    " | Smart UV Project"
)
def hard(options: Options) -> Iterator[Row]:
    paths = options.cases(sorted((data() / "hard").glob("*.obj")))
    meshes = {path.stem: ff.read(path) for path in paths}
    models = [(name, mesh.vertices, mesh.faces) for name, mesh in meshes.items()]
    peers = list(smart_maps(options.blender, models)) if options.blender else []
    for i, (name, vertices, faces) in enumerate(models):
        with timed() as cost:
            result = ff.unwrap(vertices, faces, polygons=meshes[name].polygons)
        cells = hard_figures(vertices, faces, result.uv32()), f"{result.stats['fill']:.2f}"
        smart = hard_figures(vertices, faces, peers[i][0]) if peers else ""
        yield name, len(faces), *cells, f"{cost.cpu:.2f}", smart


@table(COLUMNS)
def large(options: Options) -> Iterator[Row]:
    from trimesh.remesh import subdivide_loop

    for case in options.cases(LARGE.split()):
        name, levels = case.split(":")
        mesh = read_mesh(data() / "seams" / f"{name}.obj")
        finer = subdivide_loop(mesh.vertices, mesh.faces, int(levels))
        found = ours((case, *finer), 1.25, options)
        yield f"{name}, {levels} times", *found.cells(), f"{found.seconds:.1f}"


if __name__ == "__main__":
    main(__doc__, stretch=("1.25", "or several, by commas"))
