"""Embeds every disk of the corpus (shared data folder's embedding/ and synthetic ones) onto circle, square, triangle and
a given polygon, from Tutte and from three random starts, with the ladder and with pure progressive embedding.

    PYTHONPATH=build/python python3 benchmarks/embedding_corpus.py [--no-synthetic] [--seeds N]

One row per disk and polygon; the status is 1 if anything is not certified in 64 and in 32 bits.
"""

from __future__ import annotations

import argparse
import sys
import time

import numpy as np
from embedding_meshes import Disk, boundary_loop, corpus, synthetic

import flipfree as ff


def polygons(disk: Disk, count: int):
    """(name, boundary argument)"""
    yield "circle", "circle"
    if count >= 4:
        yield "square", "square"
    yield "triangle", "triangle"
    if disk.uv is not None and disk.loop is not None and disk.name == "retinal_random_init":
        yield "given", disk.uv[disk.loop]
    else:
        # A slanted convex polygon away from the origin: an ellipse through the points.
        angle = 2 * np.pi * np.arange(count) / count
        yield (
            "given",
            np.stack([3 + 2 * np.cos(angle) + 0.3 * np.sin(angle), 1 + 0.5 * np.sin(angle)], -1),
        )


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--no-synthetic", action="store_true")
    parser.add_argument("--seeds", type=int, default=3)
    arguments = parser.parse_args()
    disks = list(corpus()) + [d for d in corpus(2) if len(boundary_loop(d.faces)) == 4]
    if not arguments.no_synthetic:
        disks += list(synthetic())
    failed = runs = 0
    print(
        "| disk | triangles | onto | rung | ladder s | added | random starts, progressive: ok, slowest s |"
    )
    print("|---|---|---|---|---|---|---|")
    for disk in disks:
        loop = boundary_loop(disk.faces) if disk.loop is None else disk.loop
        for name, boundary in polygons(disk, len(loop)):
            if len(loop) == 4 and name != "square":
                continue
            options = dict(boundary=boundary, boundary_loop=loop)
            start = time.process_time()
            try:
                runs += 1
                result = ff.embed(disk.vertices, disk.faces, **options)
                c = result.certificate
                assert c.ok and c.flips64 == 0 and c.flips32 == 0, c.failures
                row = f"{result.stats['rung']} | {time.process_time() - start:.3f} | {result.stats['added_vertices']}"
            except ff.FlipfreeError as error:
                failed += 1
                row = f"**{type(error).__name__}** {error} | | "
            good, slowest = 0, 0.0
            for seed in range(arguments.seeds):
                random = np.random.default_rng(seed).random((len(disk.vertices), 2))
                start = time.process_time()
                runs += 1
                try:
                    result = ff.embed(
                        disk.vertices,
                        disk.faces,
                        initial_uv=random,
                        method="progressive",
                        **options,
                    )
                    good += result.certificate.ok
                    failed += not result.certificate.ok
                except ff.FlipfreeError as error:
                    failed += 1
                    print(f"{disk.name} {name} seed {seed}: {error}", file=sys.stderr)
                slowest = max(slowest, time.process_time() - start)
            print(
                f"| {disk.name} | {len(disk.faces)} | {name} | {row} | {good}/{arguments.seeds}, {slowest:.3f} |",
                flush=True,
            )
    print(f"\n{runs} runs, {failed} failed (user + system CPU seconds)")
    return int(failed > 0)


if __name__ == "__main__":
    sys.exit(main())
