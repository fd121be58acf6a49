"""Seamless maps made exact: the engine "penner", optimisation under the seam constraints, the grid of 32-bit values.

    PYTHONPATH=build/python:tests python3 benchmarks/seamless_exact.py [--only TEXT] [--random N] [--suggested] [--judge] [--seconds 60]

Cases are those of seamless_maps.py. The table has flips in 64 and in 32 bits, seam edges and how many are exact in 64 and in 32 bits,
energy before and after, triangles that plain rounding folds, CPU seconds of the engine, and of optimisation, rounding and
certificate. `--judge` counts seam edges and cones again in rationals (judges/seams.py; slow). The exit status is 1 unless every map is
certified with its cones.
"""

from __future__ import annotations

import argparse
import sys
import time
from collections.abc import Iterator

import numpy as np
from seamless_maps import Case, at_random, genus_of, prescribed, solve, suggested

import flipfree as ff
from flipfree import _native

from mesh_files import data_folder

COLUMNS = (
    "case | F | genus | cones | added V | flips 64 / 32 | seam edges | exact 64 / 32 | energy before | after | "
    "steps | folded | engine s | exact s | judge"
)


def row(case: Case, seconds: float, judge: bool) -> tuple[str, bool]:
    result, _, engine_cpu = solve(case, seconds)
    given = result.map
    started = time.process_time()
    job = _native.exact_seams(
        given.vertices, given.faces, given.uv64.reshape(-1, 2), given.cut_edges, True, seconds, 2
    )
    made = job.result()
    cpu = time.process_time() - started
    c = ff.certify(
        given.vertices,
        given.faces,
        made["uv64"],
        seamless=True,
        cones={v: k * np.pi / 2 for v, k in case.cones.items()},
    )
    judged, agreed = "", True
    if judge:
        from judges.seams import seam_count  # not needed otherwise

        counts = [seam_count(given.faces, made[name]) for name in ("uv64", "uv32")]
        judged = " / ".join(f"{s.exact} of {s.edges}" for s in counts)
        agreed = all(s.exact == s.edges == c.seam_edges and s.cones == case.cones for s in counts)
    stats = made["stats"]
    text = (
        f"| {case.name} | {len(case.faces)} | {genus_of(case.faces)} | {len(case.cones)} "
        f"| {len(given.vertices) - len(case.vertices)} | {c.flips64} / {c.flips32} | {c.seam_edges} "
        f"| {c.seams_exact64} / {c.seams_exact32} | {given.certificate.energy:.4g} | {c.energy:.4g} "
        f"| {stats['distortion.iterations']} | {stats['rounding.folded']} | {engine_cpu:.2f} | {cpu:.2f} | {judged} |"
    )
    return text, c.ok and agreed


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--only", default="", help="cases whose name contains this")
    parser.add_argument("--random", type=int, default=0, help="prescriptions per genus")
    parser.add_argument("--suggested", action="store_true", help="also models without own cones")
    parser.add_argument("--judge", action="store_true", help="count seam edges in rationals too")
    parser.add_argument("--seconds", type=float, default=60.0, help="most of each stage")
    arguments = parser.parse_args()
    folder = data_folder()
    if folder is None:
        sys.exit("The shared data folder is not here (FLIPFREE_DATA).")
    print(f"| {COLUMNS} |")
    print("|" + "---|" * (COLUMNS.count("|") + 1))

    def cases() -> Iterator[Case]:
        if arguments.random:
            yield from at_random(folder, arguments.random)
            return
        yield from prescribed(folder)
        if arguments.suggested:
            yield from suggested(folder)

    failed = 0
    for case in cases():
        if arguments.only not in case.name:
            continue
        try:
            text, good = row(case, arguments.seconds, arguments.judge)
        except ff.FlipfreeError as error:
            text = (
                f"| {case.name} | {len(case.faces)} | {type(error).__name__}: {str(error)[:150]} |"
            )
            good = isinstance(error, ff.Infeasible)
        print(text, flush=True)
        failed += not good
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
