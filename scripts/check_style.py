# SPDX-License-Identifier: GPL-3.0-or-later
"""Style as a test: ruff and mypy over Python, clang-format over C++, links and names of the pages. check_style.py REPORT.xml"""

import re
import shutil
import subprocess
import sys
import xml.etree.ElementTree as ET
from functools import partial
from pathlib import Path

import benchmark_page
import check_docs
import check_house

# Other versions break lines differently.
CLANG_FORMAT = 14


FOLDERS = ("addon", "benchmarks", "native", "scripts", "tests")


def ruff(*command: str) -> str | None:
    """What is wrong, or None."""
    program = Path(sys.executable).with_name("ruff")
    result = subprocess.run(
        [program, *command, "--quiet", *FOLDERS], capture_output=True, text=True
    )
    return result.stdout + result.stderr if result.returncode else None


def mypy() -> str | None:
    """The package says that it is typed (py.typed)."""
    result = subprocess.run(
        [sys.executable, "-m", "mypy", "--no-incremental"], capture_output=True, text=True
    )
    return result.stdout + result.stderr if result.returncode else None


def clang_format() -> str | None:
    sources = [str(p) for p in (*Path("native").rglob("*.h"), *Path("native").rglob("*.cpp"))]
    sources += [str(p) for p in (*Path("tests").rglob("*.h"), *Path("tests").rglob("*.cpp"))]
    result = subprocess.run(
        ["clang-format", "--dry-run", "--Werror", *sorted(sources)], capture_output=True, text=True
    )
    return result.stderr if result.returncode else None


def house() -> str | None:
    """Floors, circles, namespaces, sizes of rooms and files."""
    return "\n".join(check_house.complaints(Path("."))) or None


def pages() -> str | None:
    return "\n".join(check_docs.complaints(Path(".")) + benchmark_page.complaints()) or None


def clang_format_missing() -> str | None:
    """Why clang-format cannot judge here, or None."""
    if not shutil.which("clang-format"):
        return f"clang-format {CLANG_FORMAT} is not installed"
    version = subprocess.run(["clang-format", "--version"], capture_output=True, text=True).stdout
    found = re.search(r"version (\d+)", version)
    if not found or int(found[1]) != CLANG_FORMAT:
        return f"clang-format is not version {CLANG_FORMAT}: {version.strip()}"
    return None


def main(report: str) -> int:
    suite = ET.Element("testsuite", name="style")
    failed = 0
    for name, check, missing in (
        ("ruff", partial(ruff, "check"), None),
        ("ruff format", partial(ruff, "format", "--check"), None),
        ("mypy", mypy, None),
        ("clang-format", clang_format, clang_format_missing()),
        ("house", house, None),
        ("pages", pages, None),
    ):
        case = ET.SubElement(suite, "testcase", name=name)
        if missing:
            ET.SubElement(case, "skipped", message=missing)
            print(f"{name}: skipped, {missing}")
            continue
        complaint = check()
        if complaint:
            failed += 1
            ET.SubElement(case, "failure", message="style").text = complaint
            print(complaint[:4000])
    ET.ElementTree(suite).write(report)
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main(*sys.argv[1:]))
