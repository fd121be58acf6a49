"""What separating costs: CPU seconds of ff.separate, and of the unwrap of the same mesh.

    PYTHONPATH=build/python:tests python3 benchmarks/separated_cost.py [--triangles 1000000]

A bumpy sheet with irregular vertices, as it is, and spoilt: every hundredth face turned over, every thousandth edge with a third
face, every thousandth face there twice. Each cost is the least of three, the unwrap's of one.
"""

from __future__ import annotations

import argparse

import numpy as np
import numpy.typing as npt
from unwrap_scale import sheet

import flipfree as ff

from cost import timed

Mesh = tuple[npt.NDArray[np.float64], npt.NDArray[np.int32]]


def spoilt(mesh: Mesh) -> Mesh:
    vertices, given = mesh
    faces = given.copy()
    faces[::100, 1:] = faces[::100, 2:0:-1]
    crowded = faces[500::1000, :2]
    tips = vertices[crowded].mean(axis=1) + [0.0, 0.0, 1e-3]
    wings = np.column_stack([crowded, len(vertices) + np.arange(len(tips))]).astype(np.int32)
    return np.vstack([vertices, tips]), np.vstack([faces, wings, faces[250::1000]])


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--triangles", type=int, default=1_000_000)
    options = parser.parse_args()
    clean = sheet(options.triangles)
    print("| mesh | triangles | mended | ff.separate CPU s | per million | ff.unwrap CPU s |")
    print("|---|---|---|---|---|---|")
    for name, (vertices, faces) in {"clean": clean, "spoilt": spoilt(clean)}.items():
        least = float("inf")
        for _ in range(3):
            with timed() as cost:
                ff.separate(vertices, faces)
            least = min(least, cost.cpu)
        with timed() as cost:
            result = ff.unwrap(vertices, faces, seams="given")
        mended = sum(mend.count for mend in result.certificate.mends)
        million = 1e6 * least / len(faces)
        print(
            f"| {name} | {len(faces)} | {mended} | {least:.2f} | {million:.2f} | {cost.cpu:.1f} |",
            flush=True,
        )


if __name__ == "__main__":
    main()
