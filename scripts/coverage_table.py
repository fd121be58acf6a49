# SPDX-License-Identifier: GPL-3.0-or-later
"""Branches taken per file and room, from gcovr's JSON. coverage_table.py COVERAGE.json (scripts/coverage.sh calls it)"""

import json
import sys
from collections import defaultdict
from pathlib import Path

Counts = tuple[int, int]


def branches(file: dict) -> tuple[Counts, list[str]]:
    """Branches taken and all there are; lines with some that were not taken."""
    taken = total = 0
    missed = []
    for line in file["lines"]:
        if line.get("gcovr/noncode"):
            continue
        own = [
            b
            for b in line.get("branches", [])
            if not b.get("throw") and not b.get("gcovr/excluded")
        ]
        hit = sum(b["count"] > 0 for b in own)
        taken += hit
        total += len(own)
        if hit < len(own):
            missed.append(f"{file['file']}:{line['line_number']}: {len(own) - hit} of {len(own)}")
    return (taken, total), missed


def row(name: str, counts: Counts) -> str:
    taken, total = counts
    return f"{name:<48}{taken:>6} of {total:>5}{100 * taken / max(total, 1):>9.1f} %"


def main(path: str) -> None:
    rooms: dict[str, list[tuple[str, Counts]]] = defaultdict(list)
    missed_in_certify = []
    for file in json.loads(Path(path).read_text())["files"]:
        counts, missed = branches(file)
        if counts[1] == 0:
            continue
        room = Path(file["file"]).parts[2]
        rooms[room].append((file["file"].removeprefix("native/flipfree/"), counts))
        if room == "certify":
            missed_in_certify += missed
    for room, files in sorted(rooms.items()):
        for name, counts in sorted(files):
            print(row(name, counts))
        print(row(f"{room}/ in all", (sum(c[0] for _, c in files), sum(c[1] for _, c in files))))
        print()
    if missed_in_certify:
        print("Branches of certify/ not taken:")
        print("\n".join(missed_in_certify))


main(sys.argv[1])
