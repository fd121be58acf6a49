# SPDX-License-Identifier: GPL-3.0-or-later
"""Adds up JUnit reports: totals.py FOLDER SUITE...; a suite without a report counts as one failure.

Prints a line per suite and last the totals; the exit status is 0 only if nothing failed.
"""

import sys
import xml.etree.ElementTree as ET
from pathlib import Path


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


def main(folder: str, *suites: str) -> int:
    totals = [0, 0, 0]
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
    sys.exit(main(*sys.argv[1:]))
