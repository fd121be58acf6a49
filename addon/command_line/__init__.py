# SPDX-License-Identifier: GPL-3.0-or-later
"""Without a window:

    blender -b -c flipfree COMMAND IN OUT [options]                     one file
    blender -b -c flipfree COMMAND INPUT... --out FOLDER [options]      batches: flipfree.batch, docs/batch.md
    blender -b -c flipfree check IN

Of one file, one line per object is printed, or `--json FILE` (- is stdout) gets a record for each; the exit status is 0 only if
every object got its map (otherwise nothing is written) or has nothing wrong (check).
"""

import argparse
import glob
import sys
from pathlib import Path

import bpy

from flipfree.batch import arguments, child
from flipfree.batch.plan import PlanError

from .. import records
from . import files, unit
from .commands import COMMANDS, add_to
from .solving import solve

_handles = []

# Options of a run that one file has no use for: with them it is a batch of one.
_OF_BATCHES = ("resume", "retry", "timeout", "memory", "shard", "list", "quiet")


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog="blender -b -c flipfree",
        description="Flip-free UV maps without a window",
    )
    add_to(parser.add_subparsers(dest="command", required=True))
    return parser


def _one_file(given) -> bool:
    """Whether the command line is of the first or last kind above."""
    if any(getattr(given, name) for name in _OF_BATCHES):
        return False
    if COMMANDS[given.command].writes:
        return arguments.is_one_file(given)
    (first, *others) = given.inputs
    return not others and not Path(first).is_dir() and not glob.has_magic(first)


def _run_one_file(given) -> int:
    command = COMMANDS[given.command]
    arguments.refuse_together(vars(given))
    objects = files.read(Path(given.inputs[0]), merge=not given.no_merge)
    if not objects:
        print(f"{given.inputs[0]}: no meshes in this file", file=sys.stderr)
        return 1
    ended = solve(objects, command, given)
    for one in ended:
        if one.failure is not None:
            print(one.text, file=sys.stderr)
        elif given.json != "-":
            print(one.text)
    if given.json:
        records.write([one.record for one in ended], given.json)
    if any(one.failure is not None for one in ended):
        return 1
    if not command.writes:
        return 0 if all(one.record["ok"] for one in ended) else 1
    files.write(Path(given.inputs[1]))
    if given.json != "-":
        print(f"Written: {given.inputs[1]}")
    return 0


def main(argv: list[str]) -> int:
    """The command; returns its exit status."""
    if argv == ["--worker"]:
        return child.serve(unit.unit_of)
    try:
        given = _parser().parse_args(arguments.with_lists(argv))
    except PlanError as error:
        print(f"flipfree: {error}", file=sys.stderr)
        return 2
    except SystemExit as stop:  # argparse has said why
        return int(stop.code or 0)
    try:
        if _one_file(given):
            return _run_one_file(given)
        return arguments.main(given, files.formats(), unit.engine_of, unit.versions())
    except PlanError as error:
        print(f"flipfree: {error}", file=sys.stderr)
        return 2
    except (ValueError, RuntimeError, OSError) as error:
        print(str(error).strip(), file=sys.stderr)
        return 1


def register():
    _handles.append(bpy.utils.register_cli_command("flipfree", main))


def unregister():
    while _handles:
        bpy.utils.unregister_cli_command(_handles.pop())
