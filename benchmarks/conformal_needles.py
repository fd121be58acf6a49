"""What intrinsic refinement of the start does for metrics and maps of needle-shaped triangulations (thesis 4.6.4).

    PYTHONPATH=build/python python3 benchmarks/conformal_needles.py metric|map|cones [--only TEXT]

`cones`: what suggest_cones reaches with whole quarter turns, on surfaces of the shared data folder. Else: prisms as CAD
programs write them (caps fanned from one vertex), and hulls of points on a sphere in clusters 100 and 10 000 times
smaller than their distance. "few": twelve cones of quarter turns, "random": every angle random. And strips of needles with
a boundary and four steep random cones. Seeds are fixed, times are CPU seconds of all threads. Exit status 1 if a
metric misses its tolerance. Needs scipy. "map s" is by the clock.
"""

from __future__ import annotations

import argparse
import sys
import time
from collections.abc import Iterator
from typing import Any

import numpy as np
import numpy.typing as npt

import flipfree as ff

from mesh_files import data_folder, read_mesh
from surfaces import prism, strip_of_needles

Case = tuple[str, npt.NDArray[np.float64], npt.NDArray[np.int32], npt.NDArray[np.float64]]


def clusters(size: float, seed: int = 1) -> tuple[npt.NDArray[np.float64], npt.NDArray[np.int32]]:
    from scipy.spatial import ConvexHull

    random = np.random.default_rng(seed)
    centres = random.normal(size=(6, 3))
    centres /= np.linalg.norm(centres, axis=1)[:, None]
    points = np.concatenate(
        [c + size * random.normal(size=(100, 3)) for c in centres] + [random.normal(size=(20, 3))]
    )
    points /= np.linalg.norm(points, axis=1)[:, None]
    faces = ConvexHull(points).simplices.astype(np.int32)
    p = points[faces]
    inward = np.einsum("ij,ij->i", np.cross(p[:, 1] - p[:, 0], p[:, 2] - p[:, 0]), p.sum(1)) < 0
    faces[inward] = faces[inward][:, ::-1]
    return points, faces


def few(count: int, random: np.random.Generator) -> npt.NDArray[np.float64]:
    """Ten cones of a quarter turn and two of minus one on a sphere."""
    angles = np.full(count, 2 * np.pi)
    angles[random.choice(count, 12, replace=False)] -= np.pi / 2 * np.array([1] * 10 + [-1] * 2)
    return angles


def every(count: int, random: np.random.Generator) -> npt.NDArray[np.float64]:
    angles = random.uniform(np.pi, 3 * np.pi, count)
    return angles * (2 * np.pi * count - 4 * np.pi) / angles.sum()


def cases() -> Iterator[Case]:
    meshes = {f"prism {n}": prism(n) for n in (200, 2000, 8000)}
    meshes |= {f"clusters {size:g}": clusters(size) for size in (1e-2, 1e-4)}
    for name, (vertices, faces) in meshes.items():
        for kind, targets in {"few": few, "random": every}.items():
            yield (
                f"{name}, {kind}",
                vertices,
                faces,
                targets(len(vertices), np.random.default_rng(0)),
            )
    for seed in range(9):
        yield (f"strip {seed}, random", *strip_of_needles(seed))


def row(*cells: Any) -> None:
    print("|", " | ".join(str(c) for c in cells), "|", flush=True)


def metrics(only: str) -> bool:
    row(
        "case",
        "V",
        "refined",
        "added",
        "steps",
        "relaxed",
        "bits",
        "flips",
        "range of u",
        "error",
        "CPU s",
    )
    row(*["---"] * 11)
    good = True
    for name, vertices, faces, angles in cases():
        if only not in name:
            continue
        for mode in ("off", "on"):
            start = time.process_time()
            m = ff.conformal_metric(
                vertices, faces, angles, intrinsic_refinement=mode, require_convergence=False
            )
            seconds = time.process_time() - start
            good = good and m.converged
            row(
                name, len(vertices), mode, m.stats["intrinsic_refinement"], m.iterations, m.stats["relaxed_iterations"],
                m.bits, m.flips, f"{m.scale_range:.1f}", f"{m.angle_error:.1e}", f"{seconds:.2f}",
            )  # fmt: skip
    return good


def maps(only: str) -> bool:
    row("case", "V", "refined", "outcome", "crossings", "added V", "stored angle error", "map s")
    row(*["---"] * 8)
    for name, vertices, faces, angles in cases():
        if only not in name or "random" in name or len(vertices) > 1000:
            continue
        for mode in ("off", "on"):
            try:
                p = ff.conformal(vertices, faces, angles, intrinsic_refinement=mode)
                outcome = "certified"
            except ff.NotConverged as error:
                p, outcome = error.parametrization, str(error.code)
            s = p.stats
            row(
                name, len(vertices), mode, outcome, s["overlay_crossings"], s["added_vertices"],
                f"{s['stored_angle_error']:.1e}", f"{s['seconds_map']:.3f}",
            )  # fmt: skip
    return True


def cones(only: str) -> bool:
    row("surface", "bound", "ratio", "holds", "cones", "CPU s")
    row(*["---"] * 6)
    folder = data_folder()
    for name in ("elephant", "fertility_tri", "aircraft", "gtorus003"):
        if folder is None or only not in name:
            continue
        mesh = read_mesh(folder / "conformal" / f"{name}.obj")
        for bound in (4.0, 3.0, 2.0):
            start = time.process_time()
            s = ff.suggest_cones(mesh.vertices, mesh.faces, bound=bound, quarter_turns=True)
            seconds = time.process_time() - start
            row(name, bound, f"{s.scale_ratio:.2f}", s.bound_holds, len(s.cones), f"{seconds:.1f}")
    return True


def main() -> int:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    runs = {"metric": metrics, "map": maps, "cones": cones}
    parser.add_argument("experiment", choices=runs)
    parser.add_argument("--only", default="")
    arguments = parser.parse_args()
    return 0 if runs[arguments.experiment](arguments.only) else 1


if __name__ == "__main__":
    sys.exit(main())
