"""Our unwrap and every method of Blender's own, side by side in one run, on subdivided monkeys with the same seams.

    PYTHONPATH=build/python python3 benchmarks/unwrap_vs_blender.py --blender build/blender-4.3/blender [--levels 3 4]

Energy and flips of both sides are measured by ff.certify on the stored 32-bit values. Levels 3 and 4 are 63k and 252k
triangles. Blender runs as a process of its own; only the operator is timed there, the whole call here.
"""

from __future__ import annotations

import argparse
import subprocess
import tempfile
from pathlib import Path

import numpy as np

import flipfree as ff

from cost import timed

METHODS = ["CONFORMAL", "ANGLE_BASED", "MINIMUM_STRETCH"]
WORKER = Path(__file__).resolve().parent / "blender_unwrap_worker.py"


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--blender", required=True, type=Path)
    parser.add_argument("--levels", nargs="+", type=int, default=[3, 4])
    parser.add_argument("--methods", nargs="+", default=METHODS)
    arguments = parser.parse_args()
    print("| triangles | method | wall s | cpu s | flips | overlaps | energy | worst triangle |")
    print("|---|---|---|---|---|---|---|---|")
    for level in arguments.levels:
        with tempfile.TemporaryDirectory() as folder:
            out = Path(folder) / "monkey.npz"
            subprocess.run(
                [
                    str(arguments.blender.resolve()), "-b", "--factory-startup", "--python-exit-code", "1",
                    "--python", str(WORKER), "--", str(level), str(out), *arguments.methods,
                ],
                check=True,
                stdout=subprocess.DEVNULL,
            )  # fmt: skip
            data = dict(np.load(out))
        vertices, faces = data["vertices"], data["faces"]
        for method in arguments.methods:
            wall, cpu = data[f"{method}_seconds"]
            report(
                len(faces),
                f"Blender {method}",
                wall,
                cpu,
                ff.certify(vertices, faces, data[f"{method}_uv"]),
            )
        with timed() as cost:
            result = ff.unwrap(vertices, faces, cuts=data["seams"], seams="given")
        stored = ff.certify(vertices, faces, result.uv32())
        report(
            len(faces), f"Flipfree UV, {result.stats['charts']} charts", cost.wall, cost.cpu, stored
        )


def report(triangles: int, name: str, wall: float, cpu: float, c: ff.Certificate) -> None:
    print(
        f"| {triangles} | {name} | {wall:.2f} | {cpu:.2f} | {c.flips32} | {c.overlaps} "
        f"| {c.energy:.4f} | {c.max_energy:.4g} |",
        flush=True,
    )


if __name__ == "__main__":
    main()
