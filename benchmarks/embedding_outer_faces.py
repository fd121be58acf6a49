"""Embeds a closed mesh once for every one of its faces as the outer triangle (default: the thesis' Propeller).

    PYTHONPATH=build/python python3 benchmarks/embedding_outer_faces.py [FILE] [--method ladder|schnyder|progressive|tutte]

Status 1 if any embedding is not certified. Times are user + system CPU seconds of the embedding call.
"""

from __future__ import annotations

import argparse
import sys
import time
from collections import Counter
from pathlib import Path

import numpy as np

import flipfree as ff

from mesh_files import data_folder, read_mesh


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("file", nargs="?", type=Path)
    parser.add_argument("--method", default="ladder")
    arguments = parser.parse_args()
    folder = data_folder()
    if arguments.file is None and folder is None:
        sys.exit("The shared data folder is not here (FLIPFREE_DATA); name a file.")
    mesh = read_mesh(arguments.file or folder / "embedding" / "62415_sf.obj")
    seconds, rungs, failed = [], Counter(), 0
    for f in range(len(mesh.faces)):
        faces = np.delete(mesh.faces, f, axis=0)
        start = time.process_time()
        try:
            result = ff.embed(mesh.vertices, faces, boundary="triangle", method=arguments.method)
            failed += not result.certificate.ok
            rungs[result.stats["rung"]] += 1
        except ff.FlipfreeError as error:
            failed += 1
            rungs[type(error).__name__] += 1
        seconds.append(time.process_time() - start)
    print(
        f"{len(seconds)} outer faces, {failed} not certified; rungs {dict(rungs)}; "
        f"mean {1e3 * np.mean(seconds):.2f} ms, median {1e3 * np.median(seconds):.2f}, largest {1e3 * max(seconds):.2f}"
    )
    return int(failed > 0)


if __name__ == "__main__":
    sys.exit(main())
