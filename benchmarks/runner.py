"""What every benchmark shares: its options, what a piece of work costs, tables on the screen and as JSON.

    export PYTHONPATH=build/python:tests:tests/python:tests/fuzz:benchmarks
    python3 benchmarks/NAME.py TABLE [--only TEXT] [--limit N] [--json benchmarks/results/NAME_TABLE.json]

A script declares its tables by `@table(...)`, functions that yield a row per case, and ends in `main(__doc__)`. Needed for most: the
shared data folder (FLIPFREE_DATA). The exit status is 1 if a table called `Options.fail`.
"""

from __future__ import annotations

import argparse
import datetime
import json
import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from itertools import islice
from pathlib import Path
from typing import Any, NoReturn

import numpy as np

from flipfree.batch.child import peak_megabytes

from mesh_files import data_folder

Row = Iterable[Any]
WORKER = Path(__file__).resolve().parent / "blender_worker.py"


@dataclass
class Cost:
    """Seconds; those of processors are of all threads. Known when the block has ended, however it ended."""

    wall: float = 0.0
    cpu: float = 0.0  # user and system


@contextmanager
def timed() -> Iterator[Cost]:
    cost = Cost()
    wall, cpu = time.perf_counter(), time.process_time()
    try:
        yield cost
    finally:
        cost.wall, cost.cpu = time.perf_counter() - wall, time.process_time() - cpu


def peak_gigabytes() -> float:
    """The most memory that this process has held."""
    return peak_megabytes() / 2**10


class Options(argparse.Namespace):
    """What was asked for on the command line."""

    failed = False

    def cases(self, found: Iterable[Any], name: Callable[[Any], str] = str) -> Iterator[Any]:
        """Those whose name holds the text of --only, --limit of them at most."""
        return islice((case for case in found if self.only in name(case)), self.limit)

    def fail(self, text: str) -> None:
        print(text, file=sys.stderr, flush=True)
        self.failed = True


@dataclass
class Table:
    columns: str  # divided by |
    rows: Callable[[Options], Iterator[Row]]


TABLES: dict[str, Table] = {}


def table(columns: str) -> Callable[[Callable[[Options], Iterator[Row]]], Callable[..., Any]]:
    """Declares the table that a function makes, under the function's name."""

    def declare(rows: Callable[[Options], Iterator[Row]]) -> Callable[..., Any]:
        TABLES[rows.__name__] = Table(columns, rows)
        return rows

    return declare


def data() -> Path:
    folder = data_folder()
    if folder is None:
        sys.exit("The shared data folder is not here (FLIPFREE_DATA).")
    return folder


def cell(value: Any) -> str:
    if value is None:
        return ""
    if isinstance(value, bool | np.bool_):
        return "yes" if value else "no"
    return f"{value:.4g}" if isinstance(value, float) else str(value)


def machine() -> str:
    """As much as a reader of the figures has to know."""
    known = Path("/proc/cpuinfo")
    lines = known.read_text().splitlines() if known.exists() else []
    models = [line.split(":")[1].split() for line in lines if line.startswith("model name")]
    return f"{os.cpu_count()} cores, {' '.join(models[0][:2]) if models else 'unknown'}"


def in_blender(program: str, verb: str, *arguments: Any) -> None:
    """Runs one of the verbs of blender_worker.py."""
    command = [program, "-b", "--factory-startup", "--python-exit-code", "1", "--python", WORKER]
    subprocess.run(
        list(map(str, [*command, "--", verb, *arguments])), check=True, stdout=subprocess.DEVNULL
    )


def from_blender(program: str, verb: str, *arguments: Any) -> dict[str, Any]:
    """The arrays that such a verb writes into the file that is its first argument."""
    with tempfile.TemporaryDirectory() as folder:
        out = Path(folder) / "out.npz"
        in_blender(program, verb, out, *arguments)
        return dict(np.load(out))


def numbers(text: str) -> list[float]:
    return [float(word) for word in text.split(",")]


def parse(doc: str, more: Mapping[str, tuple[Any, ...]]) -> Options:
    parser = argparse.ArgumentParser(
        description=doc, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("table", choices=list(TABLES))
    parser.add_argument("--only", default="", help="cases whose name holds this text")
    parser.add_argument("--limit", type=int, help="the first so many cases")
    parser.add_argument("--seconds", type=float, default=120.0, help="most of each call")
    parser.add_argument("--blender", default="", help="program, for tables beside it")
    parser.add_argument("--json", type=Path, help="writes the table into this file as well")
    for name, (default, text, *choices) in more.items():
        how: dict[str, Any] = dict(default=default, type=type(default), choices=choices or None)
        if isinstance(default, bool):
            how = {"action": "store_true"}
        parser.add_argument(f"--{name}", help=text, **how)
    return parser.parse_args(namespace=Options())


def main(doc: str | None, **more: tuple[Any, ...]) -> NoReturn:
    """Ends the process. more: a script's own options by their names: (default, which has the type, help, and what a choice has)."""
    options = parse(doc or "", more)
    chosen = TABLES[options.table]
    columns = [name.strip() for name in chosen.columns.split("|")]
    print(f"| {' | '.join(columns)} |\n{'|---' * len(columns)}|", flush=True)
    rows = []
    for row in chosen.rows(options):
        rows.append([cell(value) for value in row])
        print(f"| {' | '.join(rows[-1])} |", flush=True)
    if options.json:
        named = [word for word in sys.argv[1:] if word not in ("--json", str(options.json))]
        write(
            options.json, " ".join(["benchmarks/" + Path(sys.argv[0]).name, *named]), columns, rows
        )
    sys.exit(options.failed)


def write(path: Path, command: str, columns: list[str], rows: list[list[str]]) -> None:
    """As scripts/benchmark_page.py reads it."""
    head = {"command": command, "date": str(datetime.date.today()), "machine": machine()}
    text = json.dumps(head | {"columns": columns}, indent=1, ensure_ascii=False)[:-2]
    lines = ",\n  ".join(json.dumps(row, ensure_ascii=False) for row in rows)
    path.write_text(f'{text},\n "rows": [\n  {lines}\n ]\n}}\n')
