"""One chart of N triangles: end-to-end seconds, peak memory, progress, and how fast it cancels.

    PYTHONPATH=build/python python3 benchmarks/unwrap_scale.py [--triangles 100000 1000000] [--cancels 6]

The mesh is a bumpy sheet with irregular vertices. Each size runs in a process of its own, so that the peak is its own.
Progress: calls per second, and whether the fraction never fell. Cancel: the call is cancelled at evenly
spread times; the figure is the longest time from the request to ff.Cancelled.
"""

from __future__ import annotations

import argparse
import subprocess
import sys
import time

import numpy as np

import flipfree as ff

from cost import peak_gigabytes, timed
from surfaces import bumpy_grid


def sheet(triangles: int) -> tuple[np.ndarray, np.ndarray]:
    side = round((triangles / 2) ** 0.5)
    vertices, faces = bumpy_grid(side, side, 0.1, 5.0)
    jitter = np.random.default_rng(1).uniform(-0.3, 0.3, (len(vertices), 2)) / side
    rim = (vertices[:, :2] <= 0).any(1) | (vertices[:, :2] >= 1).any(1)
    vertices[:, :2] += np.where(rim[:, None], 0.0, jitter)
    return vertices, faces


def measure(triangles: int, cancels: int) -> None:
    vertices, faces = sheet(triangles)
    calls: list[float] = []
    fractions: list[float] = []

    def watch(stage: str, fraction: float) -> bool:
        calls.append(time.perf_counter())
        fractions.append(fraction)
        return True

    start = time.perf_counter()
    with timed() as cost:
        result = ff.unwrap(vertices, faces, progress=watch, seams="given")
    longest_gap = max(np.diff([start, *calls]))
    monotone = fractions == sorted(fractions)
    peak = peak_gigabytes()
    latencies = []
    for i in range(cancels):
        job = ff.jobs.unwrap(vertices, faces, seams="given")
        job.wait(cost.wall * (i + 0.5) / cancels)
        asked = time.perf_counter()
        job.cancel()
        try:
            job.result()
        except ff.Cancelled:
            latencies.append(time.perf_counter() - asked)
    c = result.certificate
    latency = f"{max(latencies):.3f}" if latencies else "-"
    print(
        f"| {len(faces)} | {cost.wall:.2f} | {cost.cpu:.2f} | {peak:.2f} | {c.flips64} / {c.flips32} | {c.overlaps} "
        f"| {c.energy:.4f} | {result.stats.get('distortion.iterations')} | {len(calls) / cost.wall:.1f}, longest gap {longest_gap:.2f} s, "
        f"{'monotone' if monotone else 'NOT MONOTONE'} | {latency} |",
        flush=True,
    )


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--triangles", nargs="+", type=int, default=[100_000, 1_000_000])
    parser.add_argument("--cancels", type=int, default=6)
    parser.add_argument("--one", type=int, help=argparse.SUPPRESS)
    arguments = parser.parse_args()
    if arguments.one:
        measure(arguments.one, arguments.cancels)
        return
    print(
        "| triangles | wall s | cpu s | peak GB | flips 64 / 32 | overlaps | energy | iterations | progress calls per s "
        "| longest cancel s |"
    )
    print("|---|---|---|---|---|---|---|---|---|---|")
    sys.stdout.flush()
    for triangles in arguments.triangles:
        command = [
            sys.executable,
            __file__,
            "--one",
            str(triangles),
            "--cancels",
            str(arguments.cancels),
        ]
        subprocess.run(command, check=True)


if __name__ == "__main__":
    main()
