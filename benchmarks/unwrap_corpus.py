"""Unwraps every mesh of the shared data folder's embedding/ and general/ (or the files given) and tabulates the certificates.

    PYTHONPATH=build/python python3 benchmarks/unwrap_corpus.py [--markdown] [FILE ...]

Exit status 1 if any mesh is neither certified nor refused with InvalidInput.
"""

from __future__ import annotations

import argparse
import sys
import time
from pathlib import Path

import flipfree as ff

from mesh_files import data_folder, read_mesh


def default_files() -> list[Path]:
    folder = data_folder()
    if folder is None:
        sys.exit("The shared data folder is not here (FLIPFREE_DATA); name files instead.")
    return [
        path
        for part in ("embedding", "general")
        for path in sorted((folder / part).iterdir())
        if path.suffix in (".obj", ".off")
    ]


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("files", nargs="*", type=Path)
    parser.add_argument("--markdown", action="store_true")
    parser.add_argument("--overlap", action="store_true", help="bijective=False")
    arguments = parser.parse_args()
    failed = 0
    header = (
        "| mesh | triangles | charts | added cuts | flips 64 / 32 | overlaps | energy | worst | s |"
    )
    if arguments.markdown:
        print(header)
        print("|---|---|---|---|---|---|---|---|---|")
    for path in arguments.files or default_files():
        mesh = read_mesh(path)
        start = time.perf_counter()
        try:
            result = ff.unwrap(
                mesh.vertices,
                mesh.faces,
                cuts=mesh.seams,
                bijective=not arguments.overlap,
                seams="given",
            )
        except ff.InvalidInput as error:
            print(f"| {path.name} | {len(mesh.faces)} | refused: {error} |")
            continue
        except ff.FlipfreeError as error:
            failed += 1
            print(
                f"| {path.name} | {len(mesh.faces)} | **FAILED** {type(error).__name__}: {str(error)[:300]} |"
            )
            continue
        c = result.certificate
        seconds = time.perf_counter() - start
        failed += not c.ok
        print(
            f"| {path.name} | {c.triangles} | {result.stats['charts']} | {result.stats['added_cuts']} "
            f"| {c.flips64} / {c.flips32} | {c.overlaps} | {c.energy:.4f} | {c.max_energy:.3g} | {seconds:.2f} |",
            flush=True,
        )
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
