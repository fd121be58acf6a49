"""Pure progressive embedding, the ladder, and the ladder with optimisation, beside published codes' seconds on the same task.

    PYTHONPATH=build/python python3 benchmarks/embedding_speed.py [--repeat N]

Task: embed into the equilateral triangle (closed meshes, last face deleted), or keep the given circle (Retinal). Ours: user
+ system CPU seconds of the whole call including certificate, best of N. Theirs: user seconds from the shared data folder's
README (same kind of machine) and thesis Table 3.1. Energies: mean symmetric Dirichlet (1 = isometric) of the certified 32-bit result.
"""

from __future__ import annotations

import argparse
import time

import numpy as np
from embedding_meshes import corpus

import flipfree as ff

# name: (authors' progressive embedding, foldover-free maps, thesis Table 3.1); None: no figure
THEIRS = {
    "62415_sf": (13.8, 10.4, 11.6),
    "retinal_random_init": (42.0, 2.9, 95.0),
    "octopus_f500": (18.0, 44.0, None),
    "human_f10575": (759.0, 289.0, None),
    "scorpion_f12624": (1200.0, 222.0, None),
    "tube_n8_L60": (16.8, None, None),
    "nested_tri_200": (18.5, None, None),
    "stacked_100": (0.35, None, None),
}


def best(repeat: int, call):
    seconds, result = [], None
    for _ in range(repeat):
        start = time.process_time()
        result = call()
        seconds.append(time.process_time() - start)
        assert result.certificate.ok
    return min(seconds), result


def ratio(theirs: float | None, ours: float) -> str:
    return "" if theirs is None else f"{theirs:g} ({theirs / ours:.0f} x)"


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--repeat", type=int, default=3)
    arguments = parser.parse_args()
    print(
        "| mesh | triangles | progressive from Tutte s, E | from nothing s, E | random s | authors' code (ratio) | Table 3.1 "
        "(ratio) | ladder s, rung | foldover-free (ratio) | ladder + optimisation s, E start, E, worst |"
    )
    print("|---|---|---|---|---|---|---|---|---|---|")
    for disk in corpus():
        if disk.name == "retinal_miq":
            continue
        options: dict = dict(boundary="triangle")
        if disk.name == "retinal_random_init":
            options = dict(boundary=disk.uv[disk.loop], boundary_loop=disk.loop)
        if disk.name.startswith("fingers"):
            options = dict(boundary="circle")
        random = np.random.default_rng(0).random((len(disk.vertices), 2))
        if disk.uv is not None:
            random = disk.uv  # the file's own random start

        def embed(options=options, disk=disk, **more):
            return ff.embed(disk.vertices, disk.faces, **options, **more)

        n = arguments.repeat
        tutte_s, tutte = best(n, lambda embed=embed: embed(method="progressive"))
        nothing_s, nothing = best(
            n, lambda embed=embed: embed(method="progressive", start="nothing")
        )
        random_s, _ = best(
            n, lambda embed=embed, random=random: embed(method="progressive", initial_uv=random)
        )
        ladder_s, ladder = best(n, lambda embed=embed: embed())
        optimised_s, optimised = best(1, lambda embed=embed: embed(optimise=True))
        authors, foldover, table = THEIRS.get(disk.name, (None, None, None))
        print(
            f"| {disk.name} | {len(disk.faces)} | {tutte_s:.3f}, {tutte.certificate.energy:.3g} "
            f"| {nothing_s:.3f}, {nothing.certificate.energy:.3g} | {random_s:.3f} "
            f"| {ratio(authors, max(tutte_s, nothing_s, random_s))} | {ratio(table, max(tutte_s, nothing_s, random_s))} "
            f"| {ladder_s:.4f}, {ladder.stats['rung']} | {ratio(foldover, ladder_s)} "
            f"| {optimised_s:.2f}, {optimised.stats['energy_embedding']:.3g}, {optimised.certificate.energy:.4g}, "
            f"{optimised.certificate.max_energy:.3g} |",
            flush=True,
        )


if __name__ == "__main__":
    main()
