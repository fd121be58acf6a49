# SPDX-License-Identifier: GPL-3.0-or-later
"""What `blender -b -c flipfree ... --json FILE` writes: one record per mesh object, in numbers instead of a report line."""

import json
import math
import sys

from flipfree.distortion import LEVELS

from . import mends
from .operators import common

_COUNTS = (
    "triangles flips32 mirrored_islands turned overlaps island_overlaps seam_edges seams_exact32"
).split()
# Of Repair Flips: islands that are stretched more than they have to be, and what became of such.
_REPAIRED = {
    "stretched_islands": "stretched_charts",
    "improved_islands": "charts_improved",
    "islands_unwrapped_again": "charts_stretched_anew",
}


def of_task(task, line: str, advice: str) -> dict:
    """Certificates of several parts are added up: counts are sums (-1: not measured), energies the worst part's."""
    certificates = task.certificates
    record = {
        "object": task.snapshot.object_name,
        "ok": all(c.ok for c in certificates),
        "report": line,
        "islands": task.island_count() if hasattr(task, "island_count") else 0,
        "added_vertices": getattr(task, "new_vertices", 0),
    }
    for name in _COUNTS:
        values = [getattr(c, name) for c in certificates]
        record[name] = sum(values) if values and min(values) >= 0 else -1
    if hasattr(task, "island_overlaps"):
        record["island_overlaps"] = common.own_overlaps(task)
    record["object_overlaps"] = task.object_overlaps
    for name in ("energy", "energy_p99", "max_energy"):
        record[name] = _worst([getattr(c, name) for c in certificates])
    stats = getattr(getattr(task, "result", None), "stats", {})
    record["fill"] = float(stats["fill"]) if "fill" in stats else None
    for field, stat in _REPAIRED.items():
        if stat in stats:
            record[field] = int(stats[stat])
    record["stretched"] = common.by_area(certificates, "stretched")
    level = max((c.level for c in certificates), default=0)
    record["poor"], record["level"] = level > 0, LEVELS[level]
    record["needles"] = sum(c.needles for c in certificates)
    record["poor_islands"] = common.poor_islands([task])
    record["separated"] = common.mends(certificates)
    record["mends"] = [
        {"what": m.what, "count": m.count, "kind": m.kind, "elements": m.elements.tolist()}
        for m in mends.of_task(task)
    ]
    record["warnings"] = [advice] if advice else []
    record["errors"] = []
    return record


def of_failure(failure) -> dict:
    place = failure.elements.tolist() if failure.has_place else []
    return {
        "object": failure.object_name,
        "ok": False,
        "warnings": [],
        "errors": [{"message": str(failure), "kind": failure.kind, "elements": place}],
    }


def _worst(values) -> float | None:
    """JSON has no infinity and no NaN: null, as for what was not measured (-1)."""
    finite = [value for value in values if math.isfinite(value) and value >= 0]
    return max(finite) if finite and len(finite) == len(values) else None


def write(records: list[dict], target: str) -> None:
    """target: a path, or - for the standard output."""
    text = json.dumps(records, indent=1, allow_nan=False) + "\n"
    if target == "-":
        sys.stdout.write(text)
    else:
        with open(target, "w", encoding="utf-8") as file:
            file.write(text)
