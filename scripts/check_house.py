# SPDX-License-Identifier: GPL-3.0-or-later
"""The house's rules as a test: floors, circles, depth of rooms, length of files, names. check_house.py [FOLDER]

A room is a folder, a module is a header with its source (or one Python file). docs/architecture.md says why.
"""

import ast
import re
import sys
from collections import defaultdict
from collections.abc import Iterable, Mapping
from pathlib import Path

# Lower floors first: a stage includes itself and what stands before it.
STAGES = (
    *("base", "numeric", "mesh", "certify", "intrinsic", "distortion", "embedding", "unwrap"),
    *("matchmaker", "conformal", "field", "seamless", "holonomy", "quads"),
)
# What decides whether a map is correct shares nothing with what makes maps.
JUDGE = {"certify": {"base", "numeric", "mesh", "certify"}}
MOST_LINES = 800
DEEPEST = 2  # rooms below a stage

Graph = Mapping[str, Iterable[str]]


def circles(graph: Graph) -> list[list[str]]:
    """Strongly connected components of more than one node (Tarjan)."""
    index: dict[str, int] = {}
    low: dict[str, int] = {}
    stack: list[str] = []
    found: list[list[str]] = []

    def visit(node: str) -> None:
        index[node] = low[node] = len(index)
        stack.append(node)
        for other in graph.get(node, ()):
            if other not in index:
                visit(other)
                low[node] = min(low[node], low[other])
            elif other in stack:
                low[node] = min(low[node], index[other])
        if low[node] == index[node]:
            component = [stack.pop()]
            while component[-1] != node:
                component.append(stack.pop())
            if len(component) > 1:
                found.append(sorted(component))

    sys.setrecursionlimit(10_000)
    for node in list(graph):
        if node not in index:
            visit(node)
    return found


def native_modules(root: Path) -> dict[str, set[str]]:
    """Module -> modules whose headers it includes, as paths below native/flipfree without suffix."""
    house = root / "native" / "flipfree"
    graph: dict[str, set[str]] = defaultdict(set)
    for path in sorted((*house.rglob("*.h"), *house.rglob("*.cpp"))):
        module = str(path.relative_to(house).with_suffix(""))
        included = re.findall(r'^#include "flipfree/([\w/]+)\.h"', path.read_text(), re.MULTILINE)
        graph[module] |= set(included) - {module}
    return dict(graph)


def room_of(module: str) -> str:
    return module.rpartition("/")[0]


def complaints_about_native(root: Path) -> list[str]:
    modules = native_modules(root)
    complaints = [f"include circle: {' '.join(c)}" for c in circles(modules)]
    rooms: dict[str, set[str]] = defaultdict(set)
    for module, others in modules.items():
        stage = module.split("/")[0]
        if stage not in STAGES:
            complaints.append(f"{module}: stage {stage} has no floor in scripts/check_house.py")
            continue
        allowed = JUDGE.get(stage, set(STAGES[: STAGES.index(stage) + 1]))
        for other in sorted(others):
            if other.split("/")[0] not in allowed:
                complaints.append(f"{module} includes {other}, which stands above it")
            if room_of(other) != room_of(module):
                rooms[room_of(module)].add(room_of(other))
    complaints += [f"rooms that include each other: {' '.join(c)}" for c in circles(rooms)]
    house = root / "native" / "flipfree"
    complaints += too_long(house, (".h", ".cpp")) + too_deep(house) + wrong_namespaces(house)
    return complaints + one_name_two_types(house) + names_that_meet(house)


def too_deep(house: Path) -> list[str]:
    return [
        f"{folder}: more than {DEEPEST} rooms deep"
        for folder in sorted(p for p in house.rglob("*") if p.is_dir())
        if len(folder.relative_to(house).parts) > 1 + DEEPEST
    ]


# What a file keeps to itself, in `namespace {` and `}  // namespace`.
HIDDEN = re.compile(r"^namespace \{$(.*?)^\}  // namespace$", re.MULTILINE | re.DOTALL)
TYPE = re.compile(r"^(?:struct|class|enum(?: class)?) (\w+)", re.MULTILINE)
CONSTANT = re.compile(r"^(?:inline )?const(?:expr)? [\w:<>, ]+? (\w+)(?: =|\[|\{|;)", re.MULTILINE)
FUNCTION = re.compile(
    r"^\w[\w:<>,&*\[\] ]*?[ &*](\w+)\(([^;{}]*?)\)(?: const)?(?: \{|;)", re.MULTILINE
)


def declared(text: str) -> set[str]:
    """Types, constants, and functions with their parameters' types, at the margin of `text`."""
    names = {*TYPE.findall(text), *CONSTANT.findall(text)}
    for name, parameters in FUNCTION.findall(text):
        types = re.sub(r"\s*\w+\s*(?=,|$)", "", " ".join(parameters.split()))
        names.add(f"{name}({types})")
    return names


def names_that_meet(house: Path) -> list[str]:
    """A unity build puts sources of a stage into one unit (cmake/unity.cmake): what they hide must not meet there, nor hide
    what the stage's headers or base/ declare."""
    complaints = []
    public: dict[str, dict[str, Path]] = defaultdict(dict)
    for path in sorted(house.rglob("*.h")):
        for name in declared(path.read_text()):
            public[path.relative_to(house).parts[0]][name] = path
    hidden: dict[tuple[str, str], Path] = {}
    for path in sorted(house.rglob("*.cpp")):
        stage = path.relative_to(house).parts[0]
        for name in sorted(declared("\n".join(HIDDEN.findall(path.read_text())))):
            other = hidden.setdefault((stage, name), path)
            other = next((p[name] for p in (public[stage], public["base"]) if name in p), other)
            if other != path:
                complaints.append(f"{path}: {name} is also declared in {other}")
    return complaints


def wrong_namespaces(house: Path) -> list[str]:
    """One namespace a stage; base/ holds the words that all share."""
    complaints = []
    for path in sorted((*house.rglob("*.h"), *house.rglob("*.cpp"))):
        stage = path.relative_to(house).parts[0]
        wanted = "flipfree" if stage == "base" else f"flipfree::{stage}"
        for found in re.findall(r"^namespace (flipfree[\w:]*) \{", path.read_text(), re.MULTILINE):
            if found != wanted and not found.startswith(wanted + "::"):
                complaints.append(f"{path}: namespace {found} instead of {wanted}")
    return complaints


def one_name_two_types(house: Path) -> list[str]:
    """Types of one name in one namespace, outside the anonymous ones: undefined behaviour that a link hides."""
    complaints, seen = [], {}
    for path in sorted([*house.rglob("*.h"), *house.rglob("*.cpp")]):
        text = re.sub(
            r"^namespace \{.*?^\}  // namespace$", "", path.read_text(), flags=re.M | re.S
        )
        spaces = re.findall(r"^namespace (flipfree[\w:]*) \{", text, re.MULTILINE)
        for name in re.findall(
            r"^(?:struct|class|enum(?: class)?) (\w+)(?: final)?(?: : [^{;]*)? \{",
            text,
            re.MULTILINE,
        ):
            if spaces and (other := seen.setdefault((spaces[0], name), path)) != path:
                complaints.append(f"{path}: {spaces[0]}::{name} is another type in {other}")
    return complaints


def too_long(folder: Path, suffixes: tuple[str, ...]) -> list[str]:
    complaints = []
    for path in sorted(p for p in folder.rglob("*") if p.suffix in suffixes):
        lines = path.read_text().count("\n")
        if lines > MOST_LINES:
            complaints.append(f"{path}: {lines} lines")
    return complaints


def python_modules(package: Path) -> dict[str, set[str]]:
    """Module -> modules of the same package that it imports when it is imported itself."""
    names = {}
    for path in sorted(package.rglob("*.py")):
        parts = path.relative_to(package).with_suffix("").parts
        names[".".join(parts[:-1] if parts[-1] == "__init__" else parts)] = path
    graph: dict[str, set[str]] = {}
    for name, path in names.items():
        inside = name.split(".") if name else []
        is_package = path.stem == "__init__"
        found: set[str] = set()
        for node in ast.parse(path.read_text()).body:
            if not isinstance(node, ast.ImportFrom) or node.level == 0:
                continue
            up = node.level - (1 if is_package else 0)
            base = [p for p in inside[: len(inside) - up] if p] + (
                node.module.split(".") if node.module else []
            )
            for alias in node.names:
                below = ".".join([*base, alias.name])
                # What a package takes from itself without naming a module is compiled (_native).
                found.add(below if below in names or node.module is None else ".".join(base))
        graph[name] = {f for f in found if f in names and f != name}
    return graph


def complaints_about_python(package: Path) -> list[str]:
    complaints = [
        f"{package}: import circle {' '.join(c)}" for c in circles(python_modules(package))
    ]
    return complaints + too_long(package, (".py",))


def names_of_what_is_gone(root: Path) -> list[str]:
    """Sources that comments of the native code name, and no folder has any more."""
    paths = [
        p for folder in ("native", "tests", "benchmarks") for p in (root / folder).rglob("*.[hc]*")
    ]
    there = {path.name for path in paths} | {"eigen.h", "stl.h"}  # pybind11's
    return [
        f"{path}:{number}: names {name}, which is no file"
        for path in sorted(paths)
        for number, line in enumerate(path.read_text().splitlines(), 1)
        for name in re.findall(r"\b\w+\.(?:h|cpp)\b", line.partition("//")[2])
        if name not in there
    ]


def complaints(root: Path) -> list[str]:
    return [
        *names_of_what_is_gone(root),
        *complaints_about_native(root),
        *too_long(root / "native" / "python", (".h", ".cpp")),
        *complaints_about_python(root / "native" / "python" / "flipfree"),
        *complaints_about_python(root / "addon"),
    ]


if __name__ == "__main__":
    found = complaints(Path(sys.argv[1] if len(sys.argv) > 1 else "."))
    print("\n".join(found))
    sys.exit(1 if found else 0)
