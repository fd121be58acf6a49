# SPDX-License-Identifier: GPL-3.0-or-later
"""Adds up JUnit reports: totals.py FOLDER SUITE...; a suite without a report counts as one failure.

Prints the slowest ten tests, a line per suite and last the totals; the exit status is 0 only if nothing failed.
With --table FILE what is skipped is noted with its reasons, as scripts/benchmark_page.py reads tables; rows of other suites stay.
With --slow FOLDER the names of native and Python tests of a second and more are written there, for scripts/test.sh --quick.
"""

import datetime
import json
import sys
import xml.etree.ElementTree as ET
from collections import Counter
from pathlib import Path

Case = tuple[float, str, str, str]  # seconds, suite, file or class, name


def cases(folder: Path, suite: str) -> list[Case]:
    found = []
    for case in ET.parse(folder / f"{suite}.xml").iter("testcase"):
        where = case.get("classname", "")
        found.append((float(case.get("time") or 0), suite, where, case.get("name", "")))
    return found


def print_slowest(folder: Path, suites: tuple[str, ...]) -> None:
    every = [c for s in suites if (folder / f"{s}.xml").exists() for c in cases(folder, s)]
    print("Slowest:")
    for seconds, suite, where, name in sorted(every, reverse=True)[:10]:
        print(f"  {seconds:6.1f} s  {suite}  {where}  {name}")


def write_slow(reports: Path, folder: Path) -> None:
    """Regular expressions of ctest, and pytest's node ids without their parameters' values."""
    folder.mkdir(exist_ok=True)
    native = {name for seconds, _, _, name in cases(reports, "native") if seconds >= 1}
    python = {
        f"{where.replace('.', '/')}.py::{name}"
        for seconds, _, where, name in cases(reports, "python")
        if seconds >= 1
    }
    for file, names in (("native.txt", native), ("python.txt", python)):
        (folder / file).write_text("".join(f"{name}\n" for name in sorted(names)))


def count(report: Path) -> tuple[int, int, int]:
    """(passed, failed, skipped) of one file."""
    passed = failed = skipped = 0
    for case in ET.parse(report).iter("testcase"):
        if case.find("failure") is not None or case.find("error") is not None:
            failed += 1
        elif case.find("skipped") is not None:
            skipped += 1
        else:
            passed += 1
    return passed, failed, skipped


def write_table(reports: Path, suites: list[str], table: Path) -> None:
    found = json.loads(table.read_text())
    kept = {row[0]: row for row in found["rows"]}
    for suite in suites:
        skips = ET.parse(reports / f"{suite}.xml").iter("skipped")
        reasons = Counter((skip.get("message") or "").strip() for skip in skips)
        why = "; ".join(f"{number} {reason}" for reason, number in reasons.most_common())
        counts = map(str, count(reports / f"{suite}.xml"))
        kept[suite] = [suite, *counts, why, str(datetime.date.today())]
    found["rows"] = [kept[suite] for suite in sorted(kept)]
    table.write_text(json.dumps(found, indent=1) + "\n")


def main(folder: str, *suites: str) -> int:
    totals = [0, 0, 0]
    print_slowest(Path(folder), suites)
    for suite in suites:
        report = Path(folder, f"{suite}.xml")
        try:
            counts = count(report)
        except (OSError, ET.ParseError):
            print(f"{suite}: no report, so it did not run to its end")
            counts = (0, 1, 0)
        print(f"{suite}: {counts[0]} passed, {counts[1]} failed, {counts[2]} skipped")
        totals = [a + b for a, b in zip(totals, counts, strict=True)]
    print(f"{totals[0]} passed, {totals[1]} failed, {totals[2]} skipped")
    return 1 if totals[1] or not totals[0] else 0


if __name__ == "__main__":
    if "--slow" in sys.argv:
        write_slow(Path(sys.argv[1]), Path(sys.argv[sys.argv.index("--slow") + 1]))
        sys.exit(0)
    if "--table" in sys.argv:
        at = sys.argv.index("--table")
        write_table(Path(sys.argv[1]), sys.argv[at + 2 :], Path(sys.argv[at + 1]))
        sys.exit(0)
    sys.exit(main(*sys.argv[1:]))
