"""One model of a batch, from its file to its map's file."""

from __future__ import annotations

import glob
import os
import platform
import sys
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from ... import _native
from ...calls.mesh_files import write
from ...errors import InvalidInput
from ...texts import above_bound, turned_over
from ..child import Engine
from ..plan import Formats
from ..results import Record
from ..run import not_written
from ..worker import Unit
from .commands import COMMANDS, Command
from .figures import of_certificate, percentiles
from .model import Model, Solved, as_written, read_model

FORMATS = Formats(reads=(".obj", ".off", ".ply", ".stl"), writes=(".obj", ".ply"))


def versions() -> dict[str, str]:
    return {
        "flipfree": _native.version,
        "python": platform.python_version(),
        "numpy": np.__version__,
    }


def engine_of(settings: Mapping[str, Any]) -> Engine:
    """Children are this Python again, with the package from the same place."""
    package = str(Path(__file__).resolve().parents[3])
    search = [package, *filter(None, [os.environ.get("PYTHONPATH")])]
    command = [sys.executable, "-m", "flipfree", "--worker"]
    return Engine(command, {"PYTHONPATH": os.pathsep.join(search)}, settings)


def unit_of(settings: Mapping[str, Any]) -> Unit:
    command, options = COMMANDS[settings["command"]], dict(settings["options"])

    def solve(source: Path, target: Path | None) -> Record:
        model = read_model(
            source,
            merge=not options["no_merge"],
            max_seconds=options["max_seconds"],
            threads=settings["threads"],
        )
        solved = command.solve(model, options)
        record = record_of(command, solved, options)
        if target is None or solved.map is None:
            return record
        try:
            target.parent.mkdir(parents=True, exist_ok=True)
            for left in target.parent.glob(f".{glob.escape(target.name)}.*.part"):
                left.unlink(missing_ok=True)  # of a process that was killed while it wrote
            keep = source if source.suffix.lower() == target.suffix.lower() else None
            write(target, as_written(model, solved.map), keep=keep)
        except (OSError, InvalidInput) as error:
            return not_written(target, error)
        return record | {"written": True, "vertices_added": added(model, solved)}

    return solve


def added(model: Model, solved: Solved) -> int:
    return 0 if solved.map is None else len(solved.map.vertices) - len(model.vertices)


def record_of(command: Command, solved: Solved, options: Mapping[str, Any]) -> Record:
    certificate, found = solved.certificate, solved.map
    warnings = list(solved.warnings)
    if certificate.poor:
        warnings.append(
            f"The map is valid, but {above_bound(certificate.stretched)} (mean energy {certificate.energy:.3g}, 1 is none): "
            f"{command.cure}."
        )
    if certificate.turned:
        warnings.append(f"{turned_over(certificate.turned)}. Recalculate normals.")
    if found is not None and found.stats.get("time_limit_reached", 0):
        warnings.append("Time was over (--max-seconds); this is the best map by then.")
    if not certificate.ok:
        status, message = "refused", "; ".join(certificate.failures)
    else:
        status, message = ("warned" if warnings else "certified"), " ".join(warnings)
    record: Record = {
        "status": status,
        "message": message,
        "reason": "" if certificate.ok else "certificate failed",
        "certificate": of_certificate(certificate),
        "energy": of_certificate(certificate)["energy"],
        **solved.figures,
    }
    if found is not None:
        seen = found.uv * [options.get("aspect", 1.0), 1.0]
        record["percentiles"] = percentiles(found.vertices, found.faces, seen)
    return record
