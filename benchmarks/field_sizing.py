"""How near field-aligned maps come to the sizes that they are asked for, along fields that know these sizes and along fields that do not.

    PYTHONPATH=build/python:tests:benchmarks python3 benchmarks/field_sizing.py [--only TEXT] [--ratio 4] [--seconds 120]

Cases: the models of fields/ with their smoothest field. A length in the map shall grow by `--ratio` from one end of the model's longest axis to the other.
`size`: root of the mean square, by area, of log2 of the size reached over the one asked for: 1 is a factor of two. `degrees`: mean angle between map and field.
"""

from __future__ import annotations

import argparse
import sys
import time

import numpy as np
import numpy.typing as npt
from field_aligned import Mesh, closed

import flipfree as ff

from mesh_files import data_folder

COLUMNS = "model | F | size, field as it is | degrees | cones | size, field for these sizes | degrees | cones | CPU s"


def growing(vertices: npt.NDArray[np.float64], ratio: float) -> npt.NDArray[np.float64]:
    extent = np.ptp(vertices, axis=0)
    axis = int(extent.argmax())
    along = (vertices[:, axis] - vertices[:, axis].min()) / extent[axis]
    return np.asarray(ratio**along)


def spread(
    map: ff.Parametrization, faces: npt.NDArray[np.int32], wished: npt.NDArray[np.float64]
) -> float:
    a, b = map.uv64[:, 1] - map.uv64[:, 0], map.uv64[:, 2] - map.uv64[:, 0]
    corners = map.vertices[map.faces]
    area = np.linalg.norm(
        np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1
    )
    reached = 0.5 * np.log2((a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]) / area)
    off = reached - np.log2(wished)[faces[map.parent_face]].mean(axis=1)
    return float(np.sqrt(np.average((off - np.average(off, weights=area)) ** 2, weights=area)))


def row(mesh: Mesh, ratio: float, seconds: float) -> str:
    name, vertices, faces = mesh
    sizing = growing(vertices, ratio)
    start = time.process_time()
    cells = []
    for known in (None, sizing):
        try:
            field = ff.cross_field(vertices, faces, sizing=known)
            map = ff.field_aligned(vertices, faces, field=field, sizing=sizing, max_seconds=seconds)
        except ff.FlipfreeError as error:
            cells.append(f"{error.code} | | ")
            continue
        degrees = np.degrees(map.stats["angle_mean"])
        assert field.stats is not None
        cells.append(f"{spread(map, faces, sizing):.3f} | {degrees:.2f} | {field.stats['cones']}")
    return f"| {name} | {len(faces)} | {' | '.join(cells)} | {time.process_time() - start:.2f} |"


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--only", default="", help="models whose name contains this")
    parser.add_argument("--ratio", type=float, default=4.0, help="of the largest to the least size")
    parser.add_argument("--seconds", type=float, default=120.0, help="give a map up after so long")
    arguments = parser.parse_args()
    folder = data_folder()
    if folder is None:
        sys.exit("The shared data folder is not here (FLIPFREE_DATA).")
    print(f"| {COLUMNS} |\n|" + "---|" * (COLUMNS.count("|") + 1))
    names = {path.stem for path in folder.glob("fields/*.obj")}
    for mesh in closed(folder):
        if mesh[0] in names and arguments.only in mesh[0]:
            print(row(mesh, arguments.ratio, arguments.seconds), flush=True)
    return 0


if __name__ == "__main__":
    sys.exit(main())
