"""Automatic seams on large meshes: the shared models, subdivided (Loop 1987), from mesh to packed, certified islands.

    PYTHONPATH=build/python python3 benchmarks/auto_seams_scale.py [MODEL:LEVELS ...]

Needs the shared data folder (FLIPFREE_DATA). Every level makes four triangles of one. Exit status 1 if a map is not certified or
above its bound.
"""

from __future__ import annotations

import argparse
import sys
from typing import Any

import numpy as np
from auto_seams import Array, judge

import flipfree as ff

from cost import timed
from mesh_files import data_folder, read_mesh

#: Up to 1.28 million triangles.
MODELS = (
    "bunny:0",
    "bunny:1",
    "bunny:2",
    "horse_f10000:2",
    "bunny:3",
    "face_f10000:3",
    "cat_noUV:3",
    "kingkong_f20000:3",
)
BOUND = 1.025
MOST_RATIO = 1.25**2


def subdivided(vertices: Array, faces: Any) -> tuple[Array, Any]:
    """Loop's scheme once."""
    count = len(vertices)
    halfedges = np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]])
    apexes = np.concatenate([faces[:, 2], faces[:, 0], faces[:, 1]])
    ends = np.sort(halfedges, 1).astype(np.int64)
    keys, place, sides = np.unique(
        ends[:, 0] * count + ends[:, 1], return_inverse=True, return_counts=True
    )
    a, b = keys // count, keys % count
    inner = sides == 2
    across = np.zeros((len(keys), 3))
    np.add.at(across, place, vertices[apexes])
    middle = 0.5 * (vertices[a] + vertices[b])
    middle[inner] = 0.75 * middle[inner] + 0.125 * across[inner]
    valence = np.maximum(np.bincount(np.concatenate([a, b]), minlength=count), 1)
    around = np.zeros((count, 3))
    np.add.at(around, a, vertices[b])
    np.add.at(around, b, vertices[a])
    share = (0.625 - (0.375 + 0.25 * np.cos(2 * np.pi / valence)) ** 2) / valence
    moved = (1 - valence * share)[:, None] * vertices + share[:, None] * around
    along = np.zeros((count, 3))
    np.add.at(along, a[~inner], vertices[b[~inner]])
    np.add.at(along, b[~inner], vertices[a[~inner]])
    border = np.unique(np.concatenate([a[~inner], b[~inner]]))
    moved[border] = 0.75 * vertices[border] + 0.125 * along[border]
    e = count + place.reshape(3, -1)
    corners = (
        (faces[:, 0], e[0], e[2]),
        (faces[:, 1], e[1], e[0]),
        (faces[:, 2], e[2], e[1]),
        (e[0], e[1], e[2]),
    )
    finer = np.concatenate([np.stack(c, 1) for c in corners]).astype(np.int32)
    return np.concatenate([moved, middle]), finer


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("models", nargs="*", default=MODELS)
    folder = data_folder()
    if folder is None:
        sys.exit("The shared data folder is not here (FLIPFREE_DATA).")
    wrong = 0
    print(
        "| model | triangles | islands | seam | energy | worst island | 99 % length | 99 % area | 99 % worst island | valid | wall s | CPU s |"
    )
    print("|---|---|---|---|---|---|---|---|---|---|---|---|")
    for model in parser.parse_args().models:
        name, levels = model.split(":")
        mesh = read_mesh(folder / "seams" / f"{name}.obj")
        vertices, faces = mesh.vertices, mesh.faces
        for _ in range(int(levels)):
            vertices, faces = subdivided(vertices, faces)
        with timed() as cost:
            result = ff.unwrap(vertices, faces, seams="auto")
        f = judge(vertices, faces, result.uv32(), cost.cpu)
        wrong += not f.valid or f.worst > BOUND + 1e-5 or f.worst99 > MOST_RATIO + 1e-4
        print(
            f"| {name}, {levels} times | {f.faces} | {f.islands} | {f.seam:.2f} | {f.energy:.4f} | {f.worst:.4f} | "
            f"{f.length99:.2f} | {f.area99:.2f} | {f.worst99:.2f} | {'yes' if f.valid else 'no'} | {cost.wall:.1f} | {cost.cpu:.1f} |",
            flush=True,
        )
    return int(wrong > 0)


if __name__ == "__main__":
    sys.exit(main())
