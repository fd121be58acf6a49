"""Compares the certificate's verdict on overlaps with a slow second judge (tests/judges) on maps at random.

    PYTHONPATH=build/python python3 benchmarks/overlap_judges.py [--maps 20000] [--seed 1] [--jobs 2] [--generator NAME]

Qualified are maps with positive triangles that wind once around inner vertices, given and stored; only of these are overlaps asked.
A disagreement is printed with what reproduces it: judges.comparison.map_number(GENERATOR, SEED, NUMBER). Exit status 1 if there is one.
"""

from __future__ import annotations

import argparse
import multiprocessing
import sys
from collections import Counter

from mesh_files import ROOT

sys.path.insert(0, str(ROOT / "tests"))
from judges.comparison import GENERATORS, compare, map_number  # noqa: E402

_BATCH = 50
Task = tuple[str, int, int, int]
COLUMNS = {
    "qualified": "qualified",
    "twice": "covered twice (judge)",
    "touching": "only touching (judge)",
    "refused": "overlaps > 0 (certificate)",
    "islands": "islands overlap (judge)",
    "islands measured": "islands measured (certificate)",
    "disagreements": "disagreements",
}


def run(task: Task) -> tuple[str, Counter[str], list[str]]:
    generator, seed, first, last = task
    counts: Counter[str] = Counter()
    said = []
    for number in range(first, last):
        verdict = compare(map_number(generator, seed, number))
        counts["maps"] += 1
        counts["qualified"] += verdict.qualified
        counts["twice"] += verdict.covered_twice
        counts["touching"] += verdict.touching and not verdict.covered_twice
        counts["refused"] += verdict.refused
        counts["islands"] += verdict.islands > 0
        counts["islands measured"] += verdict.islands_measured
        counts["disagreements"] += bool(verdict.disagreements)
        if verdict.disagreements:
            said.append(f'("{generator}", {seed}, {number}): {"; ".join(verdict.disagreements)}')
    return generator, counts, said


def tasks(generators: list[str], maps: int, seed: int) -> list[Task]:
    each = -(-maps // len(generators))
    return [
        (generator, seed, first, min(each, first + _BATCH))
        for generator in generators
        for first in range(0, each, _BATCH)
    ]


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument(
        "--maps", type=int, default=20000, help="in all, the same for each generator"
    )
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--jobs", type=int, default=2)
    parser.add_argument("--generator", choices=list(GENERATORS))
    parser.add_argument("--shown", type=int, default=20, help="disagreements to print")
    arguments = parser.parse_args()
    generators = [arguments.generator] if arguments.generator else list(GENERATORS)
    total: dict[str, Counter[str]] = {generator: Counter() for generator in generators}
    said: list[str] = []
    with multiprocessing.get_context("spawn").Pool(arguments.jobs) as pool:
        work = tasks(generators, arguments.maps, arguments.seed)
        for generator, counts, sentences in pool.imap(run, work):
            total[generator] += counts
            said += sentences
    print(
        f"| generator | maps | {' | '.join(COLUMNS.values())} |\n|---|---|{'---|' * len(COLUMNS)}"
    )
    for name, counts in [*total.items(), ("all", sum(total.values(), Counter()))]:
        print(f"| {name} | {counts['maps']} | {' | '.join(str(counts[c]) for c in COLUMNS)} |")
    if not any(counts["islands measured"] for counts in total.values()):
        print("\nThis certificate does not measure island_overlaps: that half was not compared.")
    if said:
        print(f"\n{len(said)} disagreements; judges.comparison.map_number(...) makes these maps:")
        print("\n".join(said[: arguments.shown]))
    return 1 if said else 0


if __name__ == "__main__":
    sys.exit(main())
