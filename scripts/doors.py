# SPDX-License-Identifier: GPL-3.0-or-later
"""Every algorithm and its doors: dissertation -> C++ -> Python -> operator -> commands, as a table in docs/scripting.md.

    python3 scripts/doors.py [--write]

What each row names is looked up in the code, and so is whether everything there has a row. Status 1, with what is missing, if a
door is, or if the table is not the one in the page; --write puts it there.
"""

from __future__ import annotations

import argparse
import ast
import re
from dataclasses import dataclass
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
PAGE = ROOT / "docs" / "scripting.md"
BEGIN, END = "<!-- scripts/doors.py -->\n", "<!-- end -->\n"
PACKAGE = ROOT / "native" / "python" / "flipfree"


#: Algorithm | section of the dissertation, none where it is not its own | header or module, and function | of the
#: package, or of its results | operator without "uv.flipfree_" | of both command lines, or of Blender's and of Python's
_ROWS = """
[disk onto a convex polygon](method/pins.md#embedding) | 3.2 | embedding/embed_surface embed_surface | embed | embed | embed
[pins, lines, outlines](method/pins.md) | 3.3 | matchmaker/match match | match | match | match
[one surface onto another](match-pins.md#transfer) | 3.4.1 | python/flipfree/points.py compose | compose | transfer | transfer
conformal metric | 4.3, 4.4 | conformal/metric compute_refined_metric | conformal_metric | conformal | conformal
[conformal map](method/conformal.md) | 4.5 | conformal/map conformal_map | conformal | conformal | conformal
angles of a boundary | 4.4 | conformal/boundary_angles boundary_angles | boundary_angles | conformal | conformal
cones that bound the scale | | conformal/suggest_cones suggest_cones | suggest_cones | suggest_cones | cones
admissible cut | 5.2.1, 5.3 | seamless/padding/padding make_admissible_cut | admissible_cut | cut | cut
[seamless map](method/seamless.md) | 5 | seamless/exact/seamless_map compute_seamless_map | seamless | seamless | seamless
seamless map with pins | figure 3.9 | python/flipfree/calls/matching.py with_pins | result.with_pins | seamless | seamless
[cross field](method/field-aligned.md) | 6.3 | field/compute compute_cross_field | cross_field | field_aligned | field
signature of a field | 6.2 | field/cross_field signature_of | signature | field_aligned | field
field with a signature | 6.3 | field/prescribed field_with_signature | Signature | field_aligned | field
rerouted cut | 6.5 | holonomy/field_aligned field_cut | admissible_cut | cut | cut
map along a field | 6 | holonomy/field_aligned compute_field_aligned_map | field_aligned | field_aligned | field
tiles through seams | | quads/tiles fit_tiles | fit_tiles | fit_tiles | tiles
[mesh of quads](quads.md) | | quads/quads quads_of_surface | quads | quads | quads
[islands onto the plane](method/unwrap.md) | | unwrap/unwrap unwrap | unwrap | unwrap | unwrap
[short seams](auto-seams.md) | | unwrap/seams/auto_islands find_seams | auto_seams | auto_seams | seams unwrap
less distortion | | unwrap/repair/improve improve | improve | improve | improve
[flips mended](method/repair.md) | | unwrap/repair/repair repair | repair | repair | repair
[packing](pack.md#how-it-works) | | unwrap/packing/pack pack | pack | pack | pack
[strips and grids](panel.md#arrange) | | unwrap/islands/grids rectify | rectify | rectify | rectify
[certificate](guarantees.md) | | certify/certify certify | certify | check | check
"""


@dataclass(frozen=True)
class Door:
    algorithm: str
    section: str
    header: str
    function: str
    python: str
    operator: str
    commands: tuple[str, str]


def _door(row: str) -> Door:
    algorithm, section, place, python, operator, command = (cell.strip() for cell in row.split("|"))
    header, function = place.split()
    header = header if header.endswith(".py") else f"flipfree/{header}.h"
    words = command.split()
    return Door(algorithm, section, header, function, python, operator, (words[0], words[-1]))


DOORS = tuple(map(_door, _ROWS.strip().splitlines()))

#: Of the package, what is no algorithm.
_HELPERS = set("islands jobs quads_from_map read separate split_fans write".split())
#: Of the compiled module, what a door of another name calls.
_PARTS = {
    "certify_quads": "quads",
    "field_signature": "signature",
    "judged": "compose",
    "quads_from_map": "quads",
}


def _public() -> set[str]:
    tree = ast.parse((PACKAGE / "__init__.py").read_text())
    imported = (node.names for node in tree.body if isinstance(node, ast.ImportFrom))
    names = {str(alias.asname) for aliases in imported for alias in aliases}
    results = (PACKAGE / "results.py").read_text()
    return names | {f"result.{name}" for name in re.findall(r"    def (\w+)\(", results)}


def _package_commands() -> set[str]:
    """Functions that are declared as commands."""
    return {
        node.name
        for path in (PACKAGE / "batch" / "models").glob("*.py")
        for node in ast.parse(path.read_text()).body
        if isinstance(node, ast.FunctionDef)
        and any(ast.unparse(one).startswith("command(") for one in node.decorator_list)
    }


def _tools() -> dict[str, str]:
    """Operator without its prefix -> its command of Blender, "" where it has none."""
    text = (ROOT / "addon" / "ui" / "tools.py").read_text()
    rows = re.findall(r'Tool\(\w+, "\w+\.flipfree_(\w+)", "\w+"(?:, "([\w -]+)")?\)', text)
    return {name: command.split(" ")[0] for name, command in rows}


def _labels() -> dict[str, str]:
    found = {}
    for path in (ROOT / "addon").rglob("*.py"):
        pairs = re.findall(
            r'bl_idname = "uv\.flipfree_(\w+)"\s+bl_label = "([^"]+)"', path.read_text()
        )
        found |= dict(pairs)
    return found


def _bound() -> set[str]:
    """Solvers of the compiled module."""
    text = (ROOT / "native" / "python" / "module.cpp").read_text()
    return set(re.findall(r'def_job\(\s*module, "(\w+)"', text))


def missing() -> list[str]:
    """What a row names and the code has not, and the other way round."""
    public, commands, tools, labels = _public(), _package_commands(), _tools(), _labels()
    found = []
    for door in DOORS:
        header = ROOT / "native" / door.header
        if not header.exists() or not re.search(rf"\b{door.function}\(", header.read_text()):
            found.append(f"{door.algorithm}: no {door.function}() in {door.header}")
        if door.python not in public:
            found.append(f"{door.algorithm}: the package has no {door.python}")
        if door.operator not in tools or door.operator not in labels:
            found.append(f"{door.algorithm}: no operator uv.flipfree_{door.operator}")
        of_blender, of_python = door.commands
        if tools.get(door.operator) != of_blender:
            found.append(f"{door.algorithm}: blender -c flipfree has no {of_blender}")
        if of_python not in commands:
            found.append(f"{door.algorithm}: python -m flipfree has no {of_python}")
    functions = {
        name for name in public if name.islower() and not name.startswith(("_", "result."))
    }
    doors = {door.python for door in DOORS}
    found += [f"{name} of the package has no row" for name in functions - _HELPERS - doors]
    found += [
        f"{name} of the module has no row" for name in {_PARTS.get(n, n) for n in _bound()} - doors
    ]
    found += [
        f"{name} of python -m flipfree has no row"
        for name in commands - {d.commands[1] for d in DOORS}
    ]
    rows = {door.commands[0] for door in DOORS}
    found += [
        f"{name} of blender -c flipfree has no row" for name in set(tools.values()) - rows - {""}
    ]
    return sorted(found)


def table() -> str:
    labels = _labels()
    lines = [
        "| algorithm | dissertation | C++ | Python | operator | commands |",
        "|---|---|---|---|---|---|",
    ]
    for door in DOORS:
        room = door.header.removeprefix("flipfree/").rpartition("/")[0]
        package = "" if "." in door.python else "ff."
        commands = " / ".join(f"`{name}`" for name in dict.fromkeys(door.commands))
        cells = (
            door.algorithm,
            door.section,
            f"`{room}/` `{door.function}`",
            f"`{package}{door.python}`",
            labels.get(door.operator, "?"),
            commands,
        )
        lines.append(f"| {' | '.join(cells)} |")
    return "\n".join(lines) + "\n"


def main(words: list[str] | None = None) -> int:
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--write", action="store_true", help="put the table into the page")
    options = parser.parse_args(words)
    problems = missing()
    page = PAGE.read_text()
    before, _, rest = page.partition(BEGIN)
    _, _, after = rest.partition(END)
    wanted = before + BEGIN + table() + END + after
    if options.write:
        PAGE.write_text(wanted)
    elif wanted != page:
        problems.append(f"{PAGE.name} has another table: run scripts/doors.py --write")
    print("\n".join(problems) or f"{len(DOORS)} algorithms, all doors open")
    return int(bool(problems))


if __name__ == "__main__":
    raise SystemExit(main())
