"""Growth of ff.seamless with the number of triangles: subdivided eight and elephant, log-log, with the slopes. Needs matplotlib.

    export FLIPFREE_DATA=... PYTHONPATH=build/python:tests:benchmarks
    seamless_growth.py measure MODEL LEVEL     a line "MODEL faces CPU-seconds" for that many subdivisions, to be collected in a file
    seamless_growth.py draw FILE [--out docs/images]

One measurement per process, so that none finds memory that another left; CPU seconds of all threads, from arrays to certified arrays.
"""

from __future__ import annotations

import argparse
import sys
import time
from pathlib import Path

import numpy as np

GOAL = 1.2  # of the slope
# A colour per model, in the order of their names.
COLOURS = ("#1f77b4", "#d62728")


def measure(model: str, level: int) -> None:
    from seamless_call import subdivided
    from seamless_maps import prescribed

    import flipfree as ff

    from mesh_files import data_folder

    folder = data_folder()
    if folder is None:
        sys.exit("The shared data folder is not here (FLIPFREE_DATA).")
    case = next(c for c in prescribed(folder) if c.name == model)
    for _ in range(level):
        case = subdivided(case)
    start = time.process_time()
    found = ff.seamless(case.vertices, case.faces, case.cones)
    seconds = time.process_time() - start
    assert found.certificate.seams_exact32 == found.certificate.seam_edges
    print(f"{model} {len(case.faces)} {seconds:.3g}")


def draw(path: Path, out: Path) -> None:
    import matplotlib

    matplotlib.use("Agg")
    import matplotlib.pyplot as plt

    points: dict[str, list[tuple[float, float]]] = {}
    for line in path.read_text().splitlines():
        model, faces, seconds = line.split()
        points.setdefault(model, []).append((float(faces), float(seconds)))
    figure, axes = plt.subplots(figsize=(6.4, 4.4), layout="constrained")
    for colour, (model, measured) in zip(COLOURS, sorted(points.items()), strict=False):
        faces, seconds = np.array(sorted(measured)).T
        slope = np.polyfit(np.log(faces), np.log(seconds), 1)[0]
        axes.loglog(faces, seconds, "o-", color=colour, label=f"{model}: slope {slope:.2f}")
        goal = seconds[0] * (faces / faces[0]) ** GOAL
        axes.loglog(
            faces, goal, ":", color=colour, label=f"{model}: slope {GOAL} from its first point"
        )
        print(f"{model}: slope {slope:.2f}")
    axes.set_xlabel("triangles")
    axes.set_ylabel("CPU seconds, arrays to certified arrays")
    axes.grid(True, which="major", alpha=0.4)
    axes.legend()
    figure.savefig(out / "seamless_growth.png", dpi=110)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0] if __doc__ else None)
    commands = parser.add_subparsers(dest="command", required=True)
    one = commands.add_parser("measure")
    one.add_argument("model", choices=("eight", "elephant"))
    one.add_argument("level", type=int)
    picture = commands.add_parser("draw")
    picture.add_argument("file", type=Path)
    picture.add_argument("--out", type=Path, default=Path("docs/images"))
    options = parser.parse_args()
    if options.command == "measure":
        measure(options.model, options.level)
    else:
        draw(options.file, options.out)


if __name__ == "__main__":
    main()
