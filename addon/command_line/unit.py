# SPDX-License-Identifier: GPL-3.0-or-later
"""One model of a batch, in a Blender of its own that goes from model to model (flipfree.batch)."""

import argparse
import platform
import sys
from pathlib import Path

import bpy
import numpy as np

import flipfree
from flipfree.batch.child import Engine
from flipfree.batch.run import STATUSES, not_written

from . import files
from .commands import COMMANDS
from .solving import Ended, solve

_SUMS = (
    *("triangles", "flips32", "mirrored_islands", "turned", "overlaps", "island_overlaps"),
    *("islands", "added_vertices"),
)
_WORST = ("energy", "energy_p99", "max_energy")


def versions() -> dict[str, str]:
    return {
        "flipfree": flipfree.__version__,
        "python": platform.python_version(),
        "numpy": np.__version__,
        "blender": bpy.app.version_string,
    }


def engine_of(settings) -> Engine:
    """Children are this Blender again, with the same options before the command."""
    return Engine([*_blender(), "--worker"], {}, settings)


def _blender() -> list[str]:
    package = __package__.rpartition(".")[0]
    if not bpy.app.binary_path:  # the package bpy: no Blender, but a Python that has one
        code = (
            f"import sys, bpy, addon_utils; module = addon_utils.enable({package!r}, default_set=True); "
            "sys.exit(module.command_line.main(sys.argv[1:]))"
        )
        return [sys.executable, "-c", code]
    words = [bpy.app.binary_path, "-b", "-c", "flipfree"]
    try:  # whatever it was started through: a launcher, a dynamic loader, options before -c
        said = Path("/proc/self/cmdline").read_bytes().decode().split("\0")
        at = next(i for i, word in enumerate(said) if word in ("-c", "--command"))
        words = [*said[:at], "-c", "flipfree"]
    except (OSError, StopIteration):
        pass
    return words


def unit_of(settings):
    command = COMMANDS[settings["command"]]
    given = argparse.Namespace(**settings["options"])

    def solve_file(source: Path, target: Path | None) -> dict:
        try:
            objects = files.read(source, merge=not given.no_merge)
        except (RuntimeError, ValueError) as error:
            return _refused("malformed file", f"Blender cannot read this file: {error}")
        if not objects:
            return _refused("empty mesh", "no meshes are in this file")
        _prefer(settings["threads"], given.max_seconds)
        ended = solve(objects, command, given)
        record = record_of(ended)
        if target is None or not any(one.task for one in ended):
            return record
        try:
            files.write(target)
        except (OSError, RuntimeError, ValueError) as error:
            return not_written(target, error)
        return record | {"written": True}

    return solve_file


def _refused(reason, message):
    return {"status": "refused", "reason": reason, "message": message.strip()}


def _prefer(threads, max_seconds) -> None:
    """For this process; nothing is saved."""
    package = __package__.rpartition(".")[0]
    addon = bpy.context.preferences.addons.get(package)
    if addon is not None:
        addon.preferences.threads = threads
        addon.preferences.max_seconds = max_seconds or 0.0


def status_of(one: Ended) -> str:
    if one.failure is not None:
        return "refused" if one.failure.refused else "failed"
    if not one.record["ok"]:
        return "refused"
    return "warned" if one.record["warnings"] else "certified"


def record_of(ended: list[Ended]) -> dict:
    """The file's status is that of its worst object; counts are sums, distortions those of the worst object."""
    objects = [one.record | {"status": status_of(one)} for one in ended]
    worst = max(objects, key=lambda found: STATUSES.index(found["status"]))
    mapped = [found for found in objects if "triangles" in found]
    message = "; ".join(
        text
        for found in objects
        for text in [*found["warnings"], *(error["message"] for error in found["errors"])]
    )
    if worst["status"] == "refused" and not message:
        message = worst.get("report", "")
    codes = [one.failure.code for one in ended if one.failure is not None and one.failure.code]
    record = {
        "status": worst["status"],
        "reason": codes[0] if codes else "",
        "message": message,
        "objects": objects,
        "certificate": {name: sum(found[name] for found in mapped) for name in _SUMS}
        | {"ok": bool(mapped) and all(found["ok"] for found in objects)},
    }
    for name in _WORST:
        values = [found[name] for found in mapped if found[name] is not None]
        record["certificate"][name] = max(values) if values else None
    return record | {"energy": record["certificate"]["energy"]}
