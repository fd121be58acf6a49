"""Issue 5, case 4: closed curves that bound two different immersed disks each; a path chooses the disk.

    PYTHONPATH=build/python python3 benchmarks/match_immersions.py [--pictures FOLDER]

The curves are symmetric about the vertical axis, the two disks of each are mirror images. The disk's centre is pinned to
a point of the axis and joined to boundary vertex i by a path, then to its mirror image.
"""

from __future__ import annotations

import argparse
from pathlib import Path

import numpy as np
from match_constraints import report

SPOKES, RINGS = 80, 12
# x is a sum of sines, y one of cosines of the frequencies 1 to 5. The second is a doodle after Milnor's.
CURVES = {
    "lobes": (
        (0.827, 0.036, 1.328, -0.240, -2.113),
        (0.402, -0.234, -2.061, 0.048, 0.469),
        (0.0, 0.9),
    ),
    "doodle": (
        (0.328, -0.398, 2.009, -0.521, 0.591),
        (-0.153, -0.810, -1.184, -0.280, -1.236),
        (0.0, -1.0),
    ),
}


def disk() -> tuple[np.ndarray, np.ndarray, list[int]]:
    """Vertex 0 in the middle, then rings from the inside out; the last one is the boundary."""
    angle = 2 * np.pi * np.arange(SPOKES) / SPOKES
    circle = np.stack([np.cos(angle), np.sin(angle), 0 * angle], 1)
    vertices = np.concatenate([np.zeros((1, 3)), *(circle * (r + 1) / RINGS for r in range(RINGS))])
    i = np.arange(SPOKES)
    j = (i + 1) % SPOKES
    faces = [np.stack([0 * i, 1 + i, 1 + j], 1)]
    for r in range(RINGS - 1):
        a, b = 1 + r * SPOKES + i, 1 + r * SPOKES + j
        faces += [np.stack([a, a + SPOKES, b + SPOKES], 1), np.stack([a, b + SPOKES, b], 1)]
    return vertices, np.concatenate(faces).astype(np.int32), (1 + (RINGS - 1) * SPOKES + i).tolist()


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--pictures", type=Path, default=None)
    options = parser.parse_args()
    vertices, faces, loop = disk()
    angle = 2 * np.pi * (np.arange(SPOKES) + 0.5) / SPOKES
    frequency = np.arange(1, 6)[:, None]
    for name, (sines, cosines, pin) in CURVES.items():
        target = np.stack(
            [np.array(sines) @ np.sin(frequency * angle), np.array(cosines) @ np.cos(frequency * angle)], 1
        )
        for side, i in (("one", 8), ("other", SPOKES - 1 - 8)):
            report(
                f"{name} {side}",
                options.pictures,
                vertices,
                faces,
                boundary_loop=loop,
                boundary_uv=target,
                points={0: pin},
                paths={0: [0] + [1 + r * SPOKES + i for r in range(RINGS)]},
            )


if __name__ == "__main__":
    main()
