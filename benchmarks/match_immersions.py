"""Issue 5, case 4: closed curves that bound two different immersed disks each; a path chooses the disk.

    PYTHONPATH=build/python python3 benchmarks/match_immersions.py [--pictures FOLDER]

The curves are symmetric about the vertical axis, the two disks of each are mirror images. The disk's centre is pinned to
a point of the axis and joined to boundary vertex i by a path, then to its mirror image.
"""

from __future__ import annotations

import argparse
from pathlib import Path

from match_constraints import report

from immersed_curves import PINS, curve
from surfaces import disk_of_rings

SPOKES, RINGS = 80, 12


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--pictures", type=Path, default=None)
    options = parser.parse_args()
    vertices, faces = disk_of_rings(SPOKES, RINGS)
    loop = list(range(len(vertices) - SPOKES, len(vertices)))
    for name, pin in PINS.items():
        target = curve(name, SPOKES)
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
