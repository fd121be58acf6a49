"""The commands of `python -m flipfree`, and one model of a batch, from its file to its map's file."""

from __future__ import annotations

import glob
import json
import math
import os
import platform
import sys
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from ... import _native
from ...calls.mesh_files import write
from ...distortion import LEVELS, derivatives, percentiles
from ...errors import InvalidInput
from ...results import Certificate, Parametrization
from ...texts import above_bound, turned_over
from ..child import Engine
from ..plan import Formats
from ..results import Record, beside
from ..run import not_written
from ..worker import Unit
from . import any_mesh as any_mesh  # they declare their commands
from . import surfaces as surfaces
from .model import COMMANDS as COMMANDS
from .model import Command, Solved, arguments, as_written, read_model

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
    command, options = COMMANDS[settings["command"]], arguments(settings["options"])

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
            same = source.suffix.lower() == target.suffix.lower()
            of_source = solved.map is model.file or isinstance(solved.map, Parametrization)
            keep = source if same and of_source else None
            write(target, as_written(model, solved.map), keep=keep)
            for kind, told in solved.beside.items():
                beside(target, kind).write_text(json.dumps(told) + "\n", encoding="utf-8")
        except (OSError, InvalidInput) as error:
            return not_written(target, error)
        surface = solved.map
        vertices = surface[0] if isinstance(surface, tuple) else surface.vertices
        added = len(vertices) - len(model.vertices)
        return record | {"written": True, "vertices_added": added}

    return solve


def record_of(command: Command, solved: Solved, options: Mapping[str, Any]) -> Record:
    certificate, found = solved.certificate, solved.map
    warnings = list(solved.warnings)
    if certificate is not None and certificate.poor:
        warnings.append(
            f"The map is {LEVELS[certificate.level]}: {above_bound(certificate.stretched)} "
            f"(mean energy {certificate.energy:.3g}, 1 is none): {command.cure}."
        )
    if certificate is not None and certificate.turned:
        warnings.append(f"{turned_over(certificate.turned)}. Recalculate normals.")
    if isinstance(found, Parametrization) and found.stats.get("time_limit_reached", 0):
        warnings.append("Time was over (--max-seconds); this is the best map by then.")
    status = "warned" if warnings else "certified"
    record: Record = {"status": status, "message": " ".join(warnings), "reason": ""}
    if certificate is not None:
        if not certificate.ok:
            why = "; ".join(certificate.failures)
            record = {"status": "refused", "message": why, "reason": "certificate failed"}
        told = of_certificate(certificate)
        record |= {"certificate": told, "energy": told["energy"]}
    record |= solved.figures
    if isinstance(found, Parametrization):
        record["percentiles"] = _percentiles(found, options.get("aspect", 1.0))
    return record


#: Percentiles by area.
_SHARES = (5, 50, 95, 99)

_COUNTS = (
    "triangles flips64 flips32 mirrored_islands turned overlaps island_overlaps "
    "winding_failures pin_failures seam_failures cone_failures seam_edges seams_exact32"
).split()


def of_certificate(certificate: Certificate) -> dict[str, Any]:
    """Counts of -1: not measured; figures that were not: null, as JSON has no NaN."""
    found: dict[str, Any] = {"ok": certificate.ok}
    found |= {name: int(getattr(certificate, name)) for name in _COUNTS}
    for name in ("energy", "energy_p99", "max_energy"):
        value = float(getattr(certificate, name))
        found[name] = value if math.isfinite(value) and value >= 0 else None
    found["stretched"] = certificate.stretched if certificate.stretched >= 0 else None
    found["poor"], found["level"] = certificate.poor, LEVELS[certificate.level]
    found["poor_islands"] = certificate.poor_islands.tolist()
    found["needles"] = certificate.needles
    found["mends"] = {mend.what: mend.count for mend in certificate.mends}
    found["failures"] = list(certificate.failures)
    return found


def _percentiles(found: Parametrization, aspect: float) -> dict[str, dict[str, float]] | None:
    """{"energy" | "angle" | "area": {"p5": ..., ...}} over the surface by area, at the scale that keeps the whole area.

    energy: (|J|^2 + |J^-1|^2) / 4; angle: larger by smaller stretch; area: UV area by surface area. 1 is isometric. None for a
    surface without area.
    """
    squares, area, twice = derivatives(found.vertices, found.faces, found.uv * [aspect, 1.0])
    good = (twice > 0) & (area > 0)
    if not good.any():
        return None
    squares, area, twice = squares[good], area[good], twice[good]
    with np.errstate(all="ignore"):
        scale = twice.sum() / (area * twice).sum()
        squares, area = squares * scale, area * scale
        root = np.sqrt(np.maximum(squares**2 - 4 * area**2, 0.0))
        values = {
            "energy": (squares + squares / area**2) / 4,
            "angle": (squares + root) / (2 * area),
            "area": area,
        }
        return {
            name: {
                f"p{share}": at if math.isfinite(at) else -1.0
                for share, at in zip(_SHARES, percentiles(value, twice, _SHARES), strict=True)
            }
            for name, value in values.items()
        }
