# SPDX-License-Identifier: GPL-3.0-or-later
"""Writes the tables of docs/benchmarks.md, docs/thesis.md and docs/quads.md from benchmarks/results/*.json.

    python3 scripts/benchmark_page.py [--check]

Each stands below a line `<!-- table: NAME -->` or `<!-- table: NAME; ROW; ROW -->`, the rows whose first cells are named; NAME
is a file's, as a benchmark's --json writes it. The caption has its command, date, machine, and `note` if there is one. In a
cell {NAME; ROW; COLUMN} stands for that cell of another file, and {NAME} for its command. --check: status 1 if a page is
another than this makes.
"""

from __future__ import annotations

import argparse
import json
import re
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
PAGES = tuple(ROOT / "docs" / f"{name}.md" for name in ("benchmarks", "thesis", "quads"))
RESULTS = ROOT / "benchmarks" / "results"
BLOCK = re.compile(r"^<!-- table: (.*?) -->\n(?:[^\n]+\n)?(?:\n(?:\|[^\n]*\n)+)?", re.MULTILINE)


QUOTED = re.compile(r"\{([^{}]+)\}")


def quoted(found: re.Match[str]) -> str:
    name, *place = [word.strip() for word in found[1].split(";")]
    given = json.loads((RESULTS / f"{name}.json").read_text())
    if not place:
        return f"`{given['command']}`"
    row, column = place
    try:
        (cells,) = (cells for cells in given["rows"] if cells[0] == row)
        return str(cells[given["columns"].index(column)])
    except ValueError:
        raise SystemExit(f"{name} has no cell {row}, {column}") from None


def line(cells: list[str]) -> str:
    return f"| {' | '.join(QUOTED.sub(quoted, cell) for cell in cells)} |"


def block(found: re.Match[str]) -> str:
    name, *chosen = [word.strip() for word in found[1].split(";")]
    given = json.loads((RESULTS / f"{name}.json").read_text())
    rows = [row for row in given["rows"] if not chosen or row[0] in chosen]
    missing = set(chosen) - {row[0] for row in rows}
    if missing:
        raise SystemExit(f"{name} has no rows {sorted(missing)}")
    part = "" if len(rows) == len(given["rows"]) else f"{len(rows)} of {len(given['rows'])} rows, "
    caption = f"{part}`{given['command']}`, {given['date']}, {given['machine']}"
    caption += f"; {given['note']}" if given.get("note") else ""
    head = [line(given["columns"]), "|---" * len(given["columns"]) + "|"]
    table = "\n".join([*head, *[line(row) for row in rows]])
    return f"<!-- table: {found[1]} -->\n{caption}:\n\n{table}\n"


def made(page: Path) -> str:
    return BLOCK.sub(block, page.read_text())


def complaints() -> list[str]:
    wrong = [page.name for page in PAGES if made(page) != page.read_text()]
    return [f"docs/{name} is not what scripts/benchmark_page.py makes" for name in wrong]


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--check", action="store_true")
    if parser.parse_args().check:
        found = complaints()
        print("\n".join(found))
        return int(bool(found))
    for page in PAGES:
        page.write_text(made(page))
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
