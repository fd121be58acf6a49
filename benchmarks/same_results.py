"""Have results changed? Every public call over the corpus, compared to the last bit with what an earlier build gave.

    same_results.py write FILE [--only TEXT] [--faces 5000]
    same_results.py compare BEFORE AFTER

`write` notes a row per case: a hash of all arrays of the result, its energy, or the error's text. Calls and meshes are those of
deadlines.py, up to --faces triangles, without a limit of time. `compare` prints the rows that differ; exit status 1 if there are any.
"""

from __future__ import annotations

import argparse
import dataclasses
import hashlib
import json
import sys
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

import numpy as np
from deadlines import Maps, corpus, public_calls
from runner import timed

import flipfree as ff


def parts(value: Any) -> Iterator[Any]:
    """All arrays, numbers and texts of a result but what clocks say."""
    if dataclasses.is_dataclass(value):
        value = {field.name: getattr(value, field.name) for field in dataclasses.fields(value)}
    if isinstance(value, Mapping):
        for key in value:
            if "seconds" not in str(key):
                yield from parts(value[key])
    elif isinstance(value, tuple | list):
        for one in value:
            yield from parts(one)
    elif isinstance(value, int) and not isinstance(value, bool):
        yield np.asarray(value, np.int64)  # of 32 bits on Windows otherwise
    elif isinstance(value, np.ndarray | bool | float | str):
        yield np.asarray(value)


def row(result: Any) -> dict[str, str]:
    text = hashlib.sha256()
    for array in map(np.ascontiguousarray, parts(result)):
        text.update(f"{array.dtype}{array.shape}".encode())
        text.update(array.tobytes())
    certificate = getattr(result, "certificate", None)
    return {"values": text.hexdigest()[:16], "energy": repr(getattr(certificate, "energy", None))}


def write(path: Path, only: str, most_faces: int) -> int:
    meshes = [case for case in corpus() if len(case[2]) <= most_faces]
    rows: dict[str, Any] = {}
    for name, (call, takes) in public_calls(Maps()).items():
        for case in filter(takes, meshes):
            if only not in (key := f"{name}: {case[0]}"):
                continue
            with timed() as cost:
                try:
                    rows[key] = row(call(case, 0.0))
                except ff.FlipfreeError as error:
                    rows[key] = {"error": type(error).__name__, "text": str(error)}
            rows[key]["seconds"] = round(cost.cpu, 2)
            path.write_text(json.dumps(rows, indent=1))
    total = sum(r["seconds"] for r in rows.values())
    refused = sum("error" in r for r in rows.values())
    print(f"{len(rows)} cases, {refused} of them errors, {total:.0f} CPU s")
    return 0


def compare(before: Path, after: Path) -> int:
    old, new = json.loads(before.read_text()), json.loads(after.read_text())
    names = [name for name in old if name in new]
    different, most = 0, 0.0
    for name in names:
        changed = [
            key
            for key in sorted({*old[name], *new[name]} - {"seconds"})
            if old[name].get(key) != new[name].get(key)
        ]
        if changed:
            different += 1
            print(f"{name}: {', '.join(changed)}")
            energies = old[name].get("energy"), new[name].get("energy")
            if "energy" in changed and None not in energies and "None" not in energies:
                one, other = map(float, energies)
                apart = abs(other - one) / max(abs(one), 1e-300)
                most = max(most, apart)
                print(f"    energy {energies[0]} -> {energies[1]}, relative difference {apart:.0e}")
    seconds = [sum(rows[name]["seconds"] for name in names) for rows in (old, new)]
    print(
        f"{len(names)} cases in both, {different} differ, energies by at most {most:.0e}; "
        f"CPU s {seconds[0]:.0f} -> {seconds[1]:.0f}"
    )
    return 1 if different or not names else 0


def main() -> int:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawTextHelpFormatter
    )
    parser.add_argument("verb", choices=("write", "compare"))
    parser.add_argument("files", type=Path, nargs="+")
    parser.add_argument("--only", default="", help="cases with this text in their names")
    parser.add_argument("--faces", type=int, default=5000)
    given = parser.parse_args()
    if given.verb == "compare":
        return compare(*given.files)
    return write(*given.files, given.only, given.faces)


if __name__ == "__main__":
    sys.exit(main())
