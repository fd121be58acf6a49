"""Issue 5, cases 1 and 4: prescribed boundaries and pins of the shared data folder, and targets that overlap themselves.

    PYTHONPATH=build/python python3 benchmarks/match_constraints.py [--data FOLDER] [--pictures FOLDER]

One line per case: what the certificate says, faces against the input's, added vertices, energy, engine, user seconds.
"""

from __future__ import annotations

import argparse
import os
from pathlib import Path
from typing import Any

import numpy as np
from embedding_meshes import boundary_loop
from match_pictures import draw

import flipfree as ff

from cost import timed
from mesh_files import read_mesh
from surfaces import bumpy_grid

SHAPES = ("G", "S", "comb", "spiral")


def read_targets(path: Path) -> dict[int, tuple[float, float]]:
    rows = [line.split() for line in path.read_text().splitlines() if not line.startswith("#")]
    return {int(row[0]): (float(row[1]), float(row[2])) for row in rows}


def strip(columns: int, rows: int) -> tuple[np.ndarray, np.ndarray, list[int]]:
    """A flat strip with its boundary loop, counter-clockwise."""
    vertices, faces = bumpy_grid(columns, rows, height=0.0)
    vertices[:, 0] = np.tile(np.linspace(0, 10, columns + 1), rows + 1)
    return vertices, faces, boundary_loop(faces).tolist()


def ribbon(vertices: np.ndarray, loop: list[int], turns: float) -> np.ndarray:
    """The strip's boundary laid along a spiral that drifts by less than its width: it overlaps itself."""
    along, across = vertices[loop, 0] / 10, vertices[loop, 1]
    angle = 2 * np.pi * turns * along
    radius = 2.0 - across + 0.35 * turns * along
    return np.stack([radius * np.cos(angle), radius * np.sin(angle)], 1)


def report(name: str, picture: Path | None, vertices: Any, faces: Any, **request: Any) -> None:
    try:
        with timed() as cost:
            result = ff.match(vertices, faces, **request)
    except ff.FlipfreeError as error:
        print(f"{name:24s} {type(error).__name__}: {error} ({cost.user:.2f} s)", flush=True)
        return
    certificate = result.certificate
    print(
        f"{name:24s} ok {certificate.ok}  faces x {len(result.faces) / len(faces):.3f}  "
        f"added {result.stats['added_vertices']:5d}  energy {certificate.energy:10.3f}  "
        f"{result.stats['engine']:23s} {cost.user:6.2f} s user {cost.wall:6.2f} s wall",
        flush=True,
    )
    if picture is not None:
        held = request.get("points") or {}
        draw(picture / f"{name.replace(' ', '_')}.png", result.uv, result.faces, held)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--data", default=os.environ.get("FLIPFREE_DATA", "../shared/data"))
    parser.add_argument("--pictures", type=Path, default=None)
    options = parser.parse_args()
    folder = Path(options.data) / "constraints"
    for mesh in ("camel_b", "cow"):
        file = read_mesh(folder / f"{mesh}_uv.obj")
        vertices, faces = file.vertices, file.faces
        for shape in SHAPES:
            target = read_targets(folder / f"{mesh}_uv_bd_{shape}.txt")
            boundary = {"boundary_loop": list(target), "boundary_uv": list(target.values())}
            report(f"{mesh} {shape}", options.pictures, vertices, faces, **boundary)
        circle = read_targets(folder / f"{mesh}_uv_bd_circ2.txt")
        boundary = {"boundary_loop": list(circle), "boundary_uv": list(circle.values())}
        report(f"{mesh} circle", options.pictures, vertices, faces, **boundary)
        for count in (3, 10, 30):
            points = read_targets(folder / f"{mesh}_uv_pins{count}.txt")
            report(f"{mesh} {count} free", options.pictures, vertices, faces, points=points)
            report(
                f"{mesh} {count} circle",
                options.pictures,
                vertices,
                faces,
                points=points,
                **boundary,
            )
    vertices, faces, loop = strip(80, 6)
    for turns in (1.4, 2.4):
        target = ribbon(vertices, loop, turns)
        report(
            f"ribbon {turns}",
            options.pictures,
            vertices,
            faces,
            boundary_loop=loop,
            boundary_uv=target,
        )
    angle = 2 * np.pi * np.arange(len(loop)) / len(loop) + 0.01
    eight = np.stack([np.sin(2 * angle), np.sin(angle)], 1)
    report("figure eight", None, vertices, faces, boundary_loop=loop, boundary_uv=eight)


if __name__ == "__main__":
    main()
