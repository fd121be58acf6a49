"""Maps every pair mesh / angles of the shared data folder's conformal/ and tabulates certificates and times.

    PYTHONPATH=build/python python3 benchmarks/conformal_maps.py [--seconds 60] [--only TEXT] [--markdown] [--repeat N]

Each case is mapped or refused with its reason; the exit status is 1 if one is neither, or if a certificate that is
not ok was returned without an error. `reference` is the time of the public code of the thesis' authors for metric and
overlay where the data folder's README has it. With `--repeat` the fastest of N runs is shown, for busy machines.
"""

from __future__ import annotations

import argparse
import sys
import time
from pathlib import Path

import numpy as np

import flipfree as ff

from mesh_files import data_folder, read_mesh

REFERENCE_SECONDS = {"aircraft": 0.48, "fertility_tri": 4.3, "elephant": 9.2}


def cases(folder: Path) -> list[tuple[str, Path, Path]]:
    """(name, mesh, angles): X_Th_hat or X_<case>_Th_hat belongs to the longest X.obj that fits."""
    meshes = sorted(folder.glob("*.obj"), key=lambda p: -len(p.stem))
    found = []
    for angles in sorted(folder.glob("*_Th_hat")):
        name = angles.name.removesuffix("_Th_hat")
        mesh = next((m for m in meshes if name == m.stem or name.startswith(m.stem + "_")), None)
        if mesh is not None:
            found.append((name, mesh, angles))
    return found


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seconds", type=float, default=60.0, help="give a case up after so long")
    parser.add_argument("--only", default="", help="cases whose name contains this")
    parser.add_argument("--markdown", action="store_true")
    parser.add_argument(
        "--repeat", type=int, default=1, help="runs of each case that can be mapped"
    )
    arguments = parser.parse_args()
    folder = data_folder()
    if folder is None:
        sys.exit("The shared data folder is not here (FLIPFREE_DATA).")
    failed = 0
    print(
        "| case | V | iterations | bits | angle error | log scale range | outcome | added V | flips 64 / 32 | metric s | map s | reference s |"
    )
    if arguments.markdown:
        print("|" + "---|" * 12)
    for name, mesh_path, angles_path in cases(folder / "conformal"):
        if arguments.only not in name:
            continue
        mesh = read_mesh(mesh_path)
        target = np.loadtxt(angles_path)
        start = time.perf_counter()

        def in_time(stage: str, fraction: float, start: float = start) -> bool:
            return time.perf_counter() - start < arguments.seconds

        row = f"| {name} | {len(mesh.vertices)} |"
        try:
            result = ff.conformal(mesh.vertices, mesh.faces, target, progress=in_time)
        except ff.Cancelled:
            print(f"{row} | | | | no result in {arguments.seconds:.0f} s | | | | | |", flush=True)
            continue
        except ff.NotConverged as error:
            seconds = time.perf_counter() - start
            metric = getattr(error, "metric", None)
            if metric is None:
                print(f"{row} | | | | refused: {error} | | | {seconds:.2f} | | |", flush=True)
                continue
            certificate = error.certificate
            flips = f"{certificate.flips64} / {certificate.flips32}" if certificate else ""
            print(
                f"{row} {metric.iterations} | {metric.bits} | {metric.angle_error:.1e} | {metric.scale_range:.1f} | "
                f"metric only: {error.code} ({len(error.elements)} faces) | | {flips} | {seconds:.2f} | | "
                f"{REFERENCE_SECONDS.get(name, '')} |",
                flush=True,
            )
            continue
        s, c = result.stats, result.certificate
        failed += not c.ok
        seconds = time.perf_counter() - start
        own = s["seconds_map"]
        for _ in range(arguments.repeat - 1):
            start = time.perf_counter()
            again = ff.conformal(mesh.vertices, mesh.faces, target).stats["seconds_map"]
            seconds, own = min((seconds, own), (time.perf_counter() - start, again))
        print(
            f"{row} {s['iterations']} | {s['bits']} | {s['angle_error']:.1e} | {s['scale_range']:.1f} | "
            f"{'certified' if c.ok else '**NOT CERTIFIED**'} | {s['added_vertices']} | {c.flips64} / {c.flips32} | "
            f"{seconds - own:.3f} | {own:.3f} | {REFERENCE_SECONDS.get(name, '')} |",
            flush=True,
        )
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
