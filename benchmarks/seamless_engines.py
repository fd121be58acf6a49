"""The engines of ff.seamless beside each other and beside the conformal map: energy, added vertices, time.

    PYTHONPATH=build/python:tests:benchmarks python3 benchmarks/seamless_engines.py [--only TEXT] [--seconds 60]

Cases: the models of fields/ and the shared g-tori with the cones beside them, then the closed models of general/ and embedding/ with suggested cones.
A row per model. Energies are symmetric Dirichlet, 1 is isometric; `conformal` is that of the conformal map with the same cones; `over` is by how
many per cent auto's is above the better engine's. CPU seconds are those of all threads. The exit status is 1 unless auto has
a certified map of each model, no more than 5 % above the better engine's.
"""

from __future__ import annotations

import argparse
import sys
import time
from collections.abc import Iterator

from seamless_call import conformal_energy
from seamless_maps import Case, genus_of, prescribed, suggested

import flipfree as ff

from mesh_files import data_folder

ENGINES = ("penner", "padding", "auto")
MOST_OVER = 5.0  # per cent


def tried(case: Case, engine: str, seconds: float) -> tuple[float | None, str]:
    """The map's energy, and the cells of the table."""
    cpu = time.process_time()
    try:
        result = ff.seamless(
            case.vertices, case.faces, case.cones, engine=engine, max_seconds=seconds
        )
    except ff.FlipfreeError as error:
        return None, f"{error.code} | | {time.process_time() - cpu:.2f}"
    cpu = time.process_time() - cpu
    c = result.certificate
    if not c.ok or dict(c.quarter_cones) != {v: k for v, k in case.cones.items() if k != 4}:
        return None, f"not certified | | {cpu:.2f}"
    return c.energy, f"{c.energy:.4g} | {len(result.vertices) - len(case.vertices)} | {cpu:.2f}"


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--only", default="", help="cases whose name contains this")
    parser.add_argument("--seconds", type=float, default=60.0, help="most of each call")
    options = parser.parse_args()
    folder = data_folder()
    if folder is None:
        sys.exit("The shared data folder is not here (FLIPFREE_DATA).")

    def cases() -> Iterator[Case]:
        yield from prescribed(folder)
        yield from suggested(folder)

    columns = "model | F | genus | cones"
    for engine in ENGINES:
        columns += f" | {engine}: energy | added | CPU s"
    columns += " | over | conformal"
    print(f"| {columns} |")
    print("|" + "---|" * (columns.count("|") + 1))
    total = good = 0
    found = dict.fromkeys(ENGINES, 0)
    for case in cases():
        if options.only not in case.name:
            continue
        results = {engine: tried(case, engine, options.seconds) for engine in ENGINES}
        energies = {engine: energy for engine, (energy, _) in results.items() if energy is not None}
        for engine in energies:
            found[engine] += 1
        over = (
            100.0 * (energies["auto"] / min(energies.values()) - 1) if "auto" in energies else None
        )
        total += 1
        good += over is not None and over <= MOST_OVER
        print(
            f"| {case.name} | {len(case.faces)} | {genus_of(case.faces)} | {len(case.cones)} | "
            + " | ".join(cells for _, cells in results.values())
            + f" | {'' if over is None else f'{over:.1f} %'} | {conformal_energy(case, options.seconds)} |",
            flush=True,
        )
    print(
        "\n"
        + ", ".join(f"{engine}: {count} of {total} certified" for engine, count in found.items())
    )
    print(f"auto at most {MOST_OVER:g} % above the better engine: {good} of {total}")
    return int(good < total)


if __name__ == "__main__":
    sys.exit(main())
