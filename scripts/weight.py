# SPDX-License-Identifier: GPL-3.0-or-later
"""How much there is to read: lines of code, files and depth of every part of the house, and its budget.

    python3 scripts/weight.py [--rooms] [--strict]

Lines of code are those that hold more than comments, docstrings and blanks. Depth is how many folders lie between a part's
stages and its files. Counts what git tracks. --rooms: the solver's stages as well. --strict: status 1 above the budget.
"""

from __future__ import annotations

import argparse
import ast
import io
import re
import subprocess
import tokenize
from dataclasses import dataclass
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent

#: Name of a part -> its folders.
PARTS = {
    "solver": ("native/flipfree",),
    "bindings and package": ("native/python",),
    "add-on": ("addon",),
    "tests": ("tests",),
    "benchmarks": ("benchmarks",),
    "scripts and build": ("scripts", "cmake", "CMakeLists.txt"),
}
#: Name of a part -> most (lines of code, files); None where there is no bound.
BUDGET: dict[str, tuple[int, int | None]] = {
    "solver": (42_000, 330),
    "bindings and package": (5_000, None),
    "add-on": (9_500, None),
    "tests": (32_000, None),
    "benchmarks": (3_500, 25),
}
DOCUMENTATION = (2_500, 25)  # lines, pages

_CPP = re.compile(
    r'R"(?P<delimiter>[^(\s]*)\(.*?\)(?P=delimiter)"|"(?:\\.|[^"\\\n])*"|\'(?:\\[^\n]|[^\'\\\n])\'|(?P<comment>//[^\n]*|/\*.*?\*/)',
    re.DOTALL,
)
_HASH = re.compile(r"^\s*#.*$", re.MULTILINE)


@dataclass
class Weight:
    lines: int = 0
    files: int = 0
    depth: int = 0

    def add(self, lines: int, depth: int) -> None:
        self.lines += lines
        self.files += 1
        self.depth = max(self.depth, depth)


def code_lines(path: str, text: str) -> int:
    """Lines of a source with more than comments, docstrings and blanks; 0 for what is no source."""
    match Path(path).suffix:
        case ".cpp" | ".h" | ".js":
            bare = _CPP.sub(
                lambda m: "\n" * m[0].count("\n") if m["comment"] is not None else m[0], text
            )
            return _filled(bare)
        case ".py":
            return len(_python_lines(text))
        case ".sh" | ".cmake" | ".txt":
            return _filled(_HASH.sub("", text))
        case _:
            return 0


def _filled(text: str) -> int:
    return sum(1 for line in text.splitlines() if line.strip())


def _python_lines(text: str) -> set[int]:
    skipped = {tokenize.COMMENT, tokenize.NL, tokenize.NEWLINE, tokenize.INDENT, tokenize.DEDENT}
    lines: set[int] = set()
    for token in tokenize.generate_tokens(io.StringIO(text).readline):
        if token.type not in skipped and token.type != tokenize.ENDMARKER:
            lines.update(range(token.start[0], token.end[0] + 1))
    for node in ast.walk(ast.parse(text)):
        if not isinstance(node, ast.Module | ast.ClassDef | ast.FunctionDef | ast.AsyncFunctionDef):
            continue
        first = node.body[0] if node.body else None
        if (
            isinstance(first, ast.Expr)
            and isinstance(first.value, ast.Constant)
            and isinstance(first.value.value, str)
        ):
            lines.difference_update(range(first.lineno, (first.end_lineno or first.lineno) + 1))
    return lines


def tracked(*folders: str) -> list[str]:
    command = ["git", "-C", str(ROOT), "ls-files", "--", *folders]
    return subprocess.run(command, capture_output=True, text=True, check=True).stdout.splitlines()


def weigh(folders: tuple[str, ...], stages: int) -> Weight:
    """stages: folders between the part's own and those from which depth counts."""
    total = Weight()
    for path in tracked(*folders):
        lines = code_lines(path, (ROOT / path).read_text(errors="replace"))
        if lines:
            total.add(lines, max(0, path.count("/") - folders[0].count("/") - 1 - stages))
    return total


def row(name: str, weight: Weight, lines: int | None, files: int | None) -> str:
    def bound(most: int | None) -> str:
        return "" if most is None else f"{most:,}"

    return (
        f"{name:24}{weight.lines:9,}{bound(lines):>9}{weight.files:7}{bound(files):>7}"
        f"{weight.depth:7}"
    )


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--rooms", action="store_true", help="the solver's stages as well")
    parser.add_argument("--strict", action="store_true", help="status 1 above the budget")
    options = parser.parse_args()
    print(f"{'':24}{'lines':>9}{'budget':>9}{'files':>7}{'budget':>7}{'depth':>7}")
    over = []
    everything = Weight()
    for name, folders in PARTS.items():
        weight = weigh(folders, 1 if name == "solver" else 0)
        lines, files = BUDGET.get(name, (None, None))
        print(row(name, weight, lines, files))
        everything.lines += weight.lines
        everything.files += weight.files
        everything.depth = max(everything.depth, weight.depth)
        if lines is not None and (
            weight.lines > lines or (files is not None and weight.files > files)
        ):
            over.append(name)
    print(row("all", everything, None, None))
    pages = [path for path in tracked("docs", "README.md") if path.endswith(".md")]
    text = sum(_filled((ROOT / path).read_text()) for path in pages)
    print(row("documentation", Weight(text, len(pages)), *DOCUMENTATION))
    if text > DOCUMENTATION[0] or len(pages) > DOCUMENTATION[1]:
        over.append("documentation")
    if options.rooms:
        stages = sorted({path.split("/")[2] for path in tracked("native/flipfree")})
        for stage in stages:
            print(row(f"  {stage}", weigh((f"native/flipfree/{stage}",), 0), None, None))
    if over:
        print(f"above the budget: {', '.join(over)}")
    return int(options.strict and bool(over))


if __name__ == "__main__":
    raise SystemExit(main())
