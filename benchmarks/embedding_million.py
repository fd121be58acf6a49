"""Disks of up to a million triangles onto the circle: seconds and peak memory, one process per size.

PYTHONPATH=build/python python3 benchmarks/embedding_million.py [--triangles N ...] [--method ...] [--start nothing] [--strip]

--strip: squares in one row, nothing but edges between boundary vertices.
"""

from __future__ import annotations

import argparse
import multiprocessing

from embedding_meshes import wavy_grid

from cost import peak_gigabytes, timed


def run(triangles: int, method: str, start_from: str, strip: bool) -> None:
    import flipfree as ff

    side = round((triangles / 2) ** 0.5)
    disk = wavy_grid(triangles // 2, 1) if strip else wavy_grid(side, side)
    if strip:
        disk.vertices[:, 1] /= triangles // 2
    base = 1024 * peak_gigabytes()
    with timed() as cost:
        result = ff.embed(disk.vertices, disk.faces, method=method, start=start_from)
    peak = 1024 * peak_gigabytes()
    c, s = result.certificate, result.stats
    print(
        f"| {len(disk.faces)} | {s['rung']} | {c.flips64} / {c.flips32} | {s['seconds_embedding']:.2f} | {cost.wall:.2f} "
        f"| {cost.cpu:.2f} | {peak:.0f} ({base:.0f} before) | {c.energy:.4g} |",
        flush=True,
    )


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--triangles", type=int, nargs="+", default=[10_000, 100_000, 1_000_000])
    parser.add_argument("--method", default="ladder")
    parser.add_argument("--start", default="tutte")
    parser.add_argument("--strip", action="store_true")
    arguments = parser.parse_args()
    print(
        "| triangles | rung | flips 64 / 32 | embedding s | whole call s | CPU s | peak MB | energy |"
    )
    print("|---|---|---|---|---|---|---|---|")
    for triangles in arguments.triangles:
        process = multiprocessing.get_context("spawn").Process(
            target=run, args=(triangles, arguments.method, arguments.start, arguments.strip)
        )
        process.start()
        process.join()


if __name__ == "__main__":
    main()
