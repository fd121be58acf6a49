"""Exact seamless maps of closed surfaces of genus 0, by the conformal engine with quarter-turn cones and what follows it.

    PYTHONPATH=build/python:tests python3 benchmarks/seamless_exact.py [--only TEXT] [--cones 24] [--judge]

On a sphere every conformal map whose cones are quarter turns is seamless up to rounding. It is optimised under its seam
constraints and put on a grid; the table has flips, seam edges and how many are exact in 64 and in 32 bits, energy before
and after, and seconds of both stages. `--judge` counts the seam edges again in rationals (slow). The exit status is 1 if
a map is flipped or a seam edge not exact.
"""

from __future__ import annotations

import argparse
import sys
import time
from collections import Counter
from pathlib import Path

import numpy as np
import numpy.typing as npt

import flipfree as ff
from flipfree import _native

from mesh_files import data_folder, read_mesh


def defects(
    vertices: npt.NDArray[np.float64], faces: npt.NDArray[np.int32]
) -> npt.NDArray[np.float64]:
    """Gaussian curvature per vertex, in quarter turns."""
    angles = np.zeros(len(vertices))
    for k in range(3):
        p, a, b = (vertices[faces[:, (k + i) % 3]] for i in range(3))
        u, w = a - p, b - p
        cosine = (u * w).sum(1) / np.linalg.norm(u, axis=1) / np.linalg.norm(w, axis=1)
        np.add.at(angles, faces[:, k], np.arccos(np.clip(cosine, -1, 1)))
    return (2 * np.pi - angles) / (np.pi / 2)


def quarter_cones(
    vertices: npt.NDArray[np.float64], faces: npt.NDArray[np.int32], count: int
) -> dict[int, int]:
    """{vertex: curvature in quarter turns}, about `count` of them, sum 8: that of regions around points far apart."""
    centres = [int(np.argmax(np.linalg.norm(vertices - vertices.mean(0), axis=1)))]
    distance = np.full(len(vertices), np.inf)
    region = np.zeros(len(vertices), dtype=int)
    while True:
        to_last = np.linalg.norm(vertices - vertices[centres[-1]], axis=1)
        region[to_last < distance] = len(centres) - 1
        distance = np.minimum(distance, to_last)
        if len(centres) == count:
            break
        centres.append(int(np.argmax(distance)))
    curvature = np.bincount(region, defects(vertices, faces), minlength=count)
    whole = np.clip(np.round(curvature), -3, 3).astype(int)
    while whole.sum() != 8:
        step = 1 if whole.sum() < 8 else -1
        error = step * (curvature - whole)
        error[np.abs(whole + step) > 3] = -np.inf
        whole[int(np.argmax(error))] += step
    return {centres[i]: int(c) for i, c in enumerate(whole) if c != 0}


def is_sphere(faces: npt.NDArray[np.int32]) -> bool:
    """Closed, connected, every edge twice, Euler number 2."""
    edges = Counter(
        tuple(sorted((int(a), int(b))))
        for t in faces
        for a, b in zip(t, np.roll(t, -1), strict=True)
    )
    used = len(np.unique(faces))
    return (
        set(edges.values()) == {2}
        and used == int(faces.max()) + 1
        and used - len(edges) + len(faces) == 2
    )


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--only", default="", help="models whose name contains this")
    parser.add_argument("--cones", type=int, default=24, help="regions that may get a cone")
    parser.add_argument("--judge", action="store_true", help="count seam edges in rationals too")
    arguments = parser.parse_args()
    folder = data_folder()
    if folder is None:
        sys.exit("The shared data folder is not here (FLIPFREE_DATA).")
    print(
        "| model | faces | cones | added V | flips 64 / 32 | seam edges | exact 64 / 32 | energy before | after "
        "| folded by rounding | map s | optimise and round s | judge |"
    )
    print("|" + "---|" * 13)
    failed = 0
    paths = sorted(
        p
        for d in ("conformal", "embedding", "general", "seams")
        for p in Path(folder, d).glob("*.o[bf][jf]")
    )
    for path in paths:
        if arguments.only not in path.stem:
            continue
        mesh = read_mesh(path)
        if not is_sphere(mesh.faces):
            continue
        cones = quarter_cones(mesh.vertices, mesh.faces, arguments.cones)
        angles = np.full(len(mesh.vertices), 2 * np.pi)
        for v, curvature in cones.items():
            angles[v] -= curvature * np.pi / 2
        row = f"| {path.parent.name}/{path.stem} | {len(mesh.faces)} | {len(cones)} "
        started = time.process_time()
        try:
            given = ff.conformal(mesh.vertices, mesh.faces, angles, max_seconds=120)
            mapped = time.process_time()
            made = _native.exact_seams(
                given.vertices,
                given.faces,
                given.uv64.reshape(-1, 2),
                given.cut_edges,
                True,
                120.0,
                2,
            ).result()
        except ff.FlipfreeError as error:
            print(f"{row}| {type(error).__name__}: {str(error)[:150]} |", flush=True)
            failed += 1
            continue
        ended = time.process_time()
        c = ff.certify(
            given.vertices,
            given.faces,
            made["uv64"],
            seamless=True,
            cones={v: angles[v] for v in cones},
        )
        judged = ""
        if arguments.judge:
            from judges.seams import seam_count  # the tests' folder is needed for it alone

            counts = [seam_count(given.faces, made[name]) for name in ("uv64", "uv32")]
            judged = " / ".join(f"{s.exact} of {s.edges}" for s in counts)
        stats = made["stats"]
        print(
            f"{row}| {len(given.vertices) - len(mesh.vertices)} | {c.flips64} / {c.flips32} | {c.seam_edges} "
            f"| {c.seams_exact64} / {c.seams_exact32} | {given.certificate.energy:.4g} | {c.energy:.4g} "
            f"| {stats['rounding.folded']} | {mapped - started:.2f} | {ended - mapped:.2f} | {judged} |",
            flush=True,
        )
        failed += not c.ok
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
