"""Automatic seams on the shared models beside Smart UV Project and xatlas: islands, seams, distortion, seconds.

    PYTHONPATH=build/python:XATLAS python3 benchmarks/auto_seams.py [--blender build/blender-5.2/blender] [--stretch S ...]
        [NAME ...]

XATLAS: a folder with xatlas from PyPI; left out if it is not there. Needs the shared data folder (FLIPFREE_DATA). Seam length: of
the edges whose sides differ, each once, over the square root of the surface's area. Energy: mean at the map's best scale, and the
worst island at its own. 99 %: the longest singular value and the area ratio that a hundredth of the area is above, either way,
at the map's best scale; for the worst island at its own, the larger of both. Exit status 1 if one of ours is not certified, or an
island of it above its bounds.
"""

from __future__ import annotations

import argparse
import subprocess
import sys
import tempfile
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

import flipfree as ff

from cost import timed
from mesh_files import data_folder, read_mesh

Array = npt.NDArray[np.float64]
WORKER = Path(__file__).resolve().parent / "blender_smart_worker.py"


def most_ratio(stretch: float) -> float:
    """The factor by which all but a hundredth of an island may change in length or area (stretch_bound in the solver)."""
    return 1.0 + 3.0 * (stretch - 1.0)


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


def percentile(values: Array, weights: Array, share: float) -> float:
    order = np.argsort(values)
    reached = np.cumsum(weights[order]) >= share * weights.sum()
    return float(values[order][np.argmax(reached)])


def energy_at_best_scale(s: Array, area: Array) -> tuple[float, float]:
    """The mean, and the factor on the UVs that attains it."""
    growing, shrinking = ((area * (s**p).sum(1)).sum() / (4.0 * area.sum()) for p in (2, -2))
    return 2.0 * float(np.sqrt(growing * shrinking)), float((shrinking / growing) ** 0.25)


def ratios99(s: Array, area: Array) -> tuple[float, float]:
    """Of lengths and of areas, up or down: what a hundredth of the area is above."""
    grown = s.prod(1)
    return (
        percentile(np.maximum(s, 1.0 / s).max(1), area, 0.99),
        percentile(np.maximum(grown, 1.0 / grown), area, 0.99),
    )


def seams_and_islands(faces: Any, uv: Array) -> tuple[Any, Any]:
    """Edges (vertex pairs) whose sides differ, and each face's island."""
    halfedge = {}
    parent = np.arange(len(faces))

    def find(i: int) -> int:
        while parent[i] != i:
            parent[i] = parent[parent[i]]
            i = parent[i]
        return int(i)

    seams = []
    rows = uv.reshape(len(faces), 3, 2).tolist()
    for f, face in enumerate(faces.tolist()):
        for k in range(3):
            halfedge[face[k], face[(k + 1) % 3]] = f, k
    for (a, b), (f, k) in halfedge.items():
        if a > b or (b, a) not in halfedge:
            continue
        g, j = halfedge[b, a]
        if rows[f][k] == rows[g][(j + 1) % 3] and rows[f][(k + 1) % 3] == rows[g][j]:
            parent[find(f)] = find(g)
        else:
            seams.append((a, b))
    return np.array(seams, int).reshape(-1, 2), np.array([find(i) for i in range(len(faces))])


def judge(vertices: Array, faces: Any, uv: Any, seconds: float) -> Figures:
    """Islands that are mirrored as a whole are judged as they look from behind."""
    uv = np.array(uv, np.float64)
    seams, island = seams_and_islands(faces, uv)
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
        worst = max(energy for energy, _ in own)
        length99, area99 = ratios99(s * scale, area)
        worst99 = max(
            max(ratios99(part * unit, size))
            for (part, size), (_, unit) in zip(parts, own, strict=True)
        )
    certificate = ff.certify(vertices, faces, uv, bijective=True, disjoint=not mirrored.any())
    return Figures(
        len(faces),
        len(np.unique(island)),
        float(np.linalg.norm(np.subtract(*vertices[seams.T]), axis=1).sum() / np.sqrt(area.sum())),
        energy,
        worst,
        length99,
        area99,
        worst99,
        fill,
        certificate.ok,
        seconds,
    )


def ours(vertices: Array, faces: Any, stretch: float) -> Figures:
    with timed() as cost:
        result = ff.unwrap(vertices, faces, seams="auto", stretch=stretch)
    return judge(vertices, faces, result.uv32(), cost.cpu)


def xatlas(vertices: Array, faces: Any) -> Figures | None:
    """None if it is not installed. Its maps are in pixels."""
    try:
        import xatlas as peer
    except ImportError:
        return None
    atlas = peer.Atlas()
    atlas.add_mesh(vertices.astype(np.float32), faces.astype(np.uint32))
    with timed() as cost:
        atlas.generate()
    _, corners, uv = atlas.get_mesh(0)
    pixels = uv.astype(np.float64) * [atlas.width, atlas.height]
    return judge(vertices, faces, pixels[corners.reshape(-1, 3)], cost.cpu)


def smart(program: str, models: dict[str, tuple[Array, Any]]) -> dict[str, Figures]:
    """Smart UV Project on all models, in one Blender."""
    found = {}
    with tempfile.TemporaryDirectory() as folder:
        for name, (vertices, faces) in models.items():
            np.savez(Path(folder) / f"{name}.npz", vertices=vertices, faces=faces)
        command = [program, "-b", "--factory-startup", "--python-exit-code", "1", "--python"]
        subprocess.run([*command, str(WORKER), "--", folder], check=True, capture_output=True)
        for name, (vertices, faces) in models.items():
            data = np.load(Path(folder) / f"{name}.smart.npz")
            found[name] = judge(vertices, faces, data["uv"], float(data["seconds"][1]))
    return found


def row(f: Figures) -> str:
    return (
        f"{f.islands} | {f.seam:.2f} | {f.energy:.4f} | {f.worst:.4f} | {f.length99:.2f} | {f.area99:.2f} | {f.worst99:.2f} | "
        f"{f.fill:.2f} | {'yes' if f.valid else 'no'} | {f.seconds:.2f}"
    )


def summary(name: str, all_of: Iterable[Figures]) -> str:
    figures = list(all_of)

    def median(key: str) -> float:
        return float(np.median([getattr(f, key) for f in figures]))

    islands, seams = [f.islands for f in figures], [f.seam for f in figures]
    per_10k = 1e4 * sum(f.seconds for f in figures) / sum(f.faces for f in figures)
    return (
        f"| {name} | {np.median(islands):g} / {np.mean(islands):.1f} / {max(islands)} | {np.median(seams):.2f} / "
        f"{np.mean(seams):.2f} / {max(seams):.2f} | {median('energy'):.4f} / {max(f.energy for f in figures):.4f} | "
        f"{max(f.worst for f in figures):.4f} | {median('length99'):.2f} | {median('area99'):.2f} | {max(f.worst99 for f in figures):.2f} | {median('fill'):.2f} | "
        f"{sum(f.valid for f in figures)} of {len(figures)} | {median('seconds'):.2f} / {per_10k:.2f} |"
    )


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("names", nargs="*")
    parser.add_argument("--blender")
    parser.add_argument("--stretch", type=float, nargs="+", default=[1.25])
    arguments = parser.parse_args()
    folder = data_folder()
    if folder is None:
        sys.exit("The shared data folder is not here (FLIPFREE_DATA).")
    models = {}
    for path in sorted((folder / "seams").glob("*.obj")):
        if not arguments.names or path.stem in arguments.names:
            mesh = read_mesh(path)
            models[path.stem] = mesh.vertices, mesh.faces
    found: dict[str, dict[str, Figures]] = {}
    wrong = 0
    print(
        "| model | triangles | islands | seam | energy | worst island | 99 % length | 99 % area | 99 % worst island | fill | valid | CPU s |"
    )
    print("|---|---|---|---|---|---|---|---|---|---|---|---|")
    for stretch in arguments.stretch:
        name = f"ours, {stretch:g}"
        found[name] = {}
        bound = 0.5 * (stretch + 1.0 / stretch)
        for model, (vertices, faces) in models.items():
            figures = ours(vertices, faces, stretch)
            found[name][model] = figures
            wrong += not figures.valid or figures.worst > bound + 1e-5
            wrong += figures.worst99 > most_ratio(stretch) + 1e-4
            print(f"| {model} | {figures.faces} | {row(figures)} |", flush=True)
    if arguments.blender:
        found["Smart UV Project"] = smart(arguments.blender, models)
    peers = {model: xatlas(*arrays) for model, arrays in models.items()}
    found["xatlas"] = {model: f for model, f in peers.items() if f is not None}
    print(
        "\n| method | islands: median / mean / most | seam: median / mean / most | energy: median / most | worst island | "
        "99 % length | 99 % area | 99 % worst island | fill | valid | CPU s: median / per 10 000 |"
    )
    print("|---|---|---|---|---|---|---|---|---|---|---|")
    for name, figures_of in found.items():
        if figures_of:
            print(summary(name, figures_of.values()))
    return int(wrong > 0)


if __name__ == "__main__":
    sys.exit(main())
