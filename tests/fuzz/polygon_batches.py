"""Random polygon files through the batch: what comes out has the polygons, their order and all other data of what went
in, and the map has the areas of the polygons.

    PYTHONPATH=build/python:tests:tests/fuzz python3 tests/fuzz/polygon_batches.py [--files N] [--seed S] [--jobs J]

The judge (tests/judges/polygon_files.py) reads both files on its own. The files' polygons are planar and lie in sheets
that can be laid flat, so that a polygon's area in the map is its own, in one scale for the file, up to 1e-6 and to what
32 bits round off along its sides. Prints what is found and ends with status 1 if there is anything.
"""

from __future__ import annotations

import argparse
import json
import sys
import tempfile
from pathlib import Path

from flipfree.__main__ import main as run_batch

from judges import polygon_files as judge
from random_polygons import files

NEAR = 1e-6
STORED = 2.0**-24  # of coordinates up to 1


def differences(source: Path, target: Path) -> list[str]:
    """In what the output is not the input's mesh and data."""
    given = {".obj": judge.obj, ".ply": judge.ply, ".off": judge.off}.get(source.suffix)
    found = (judge.obj if target.suffix == ".obj" else judge.ply)(target.read_bytes())
    said = []
    if given is not None:
        old = given(source.read_bytes())
        said += ["points"] if found.points != old.points else []
        said += ["polygons"] if found.polygons != old.polygons else []
        if source.suffix == target.suffix:
            said += ["other data"] if found.rest != old.rest else []
    said += ["a polygon without a map"] if None in found.uv else []
    said += ["the old map stays"] if b"property float s\n" in target.read_bytes() else []
    return said


def worst_area(target: Path) -> float:
    """The largest difference of a polygon's area from that in the file's scale, in units of what is allowed."""
    found = (judge.obj if target.suffix == ".obj" else judge.ply)(target.read_bytes())
    maps = [uv for uv in found.uv if uv is not None]
    areas = [judge.area([found.points[v] for v in polygon]) for polygon in found.polygons]
    if len(maps) < len(areas):
        return float("inf")
    mapped = [judge.area_of_map(uv) for uv in maps]
    scale = sum(mapped) / sum(areas)
    if not scale > 0.0:
        return float("inf")
    return max(
        abs(m - scale * a) / (NEAR * scale * a + STORED * judge.length(uv))
        for m, a, uv in zip(mapped, areas, maps, strict=True)
    )


def run(seeds: range, folder: Path, jobs: int = 1, *, concave: bool = True) -> dict[str, list[str]]:
    """{what is wrong: names of files}."""
    names = []
    for name, content in files(seeds, concave=concave):
        kind = "keeping" if name.endswith((".obj", ".ply")) else "changing"
        (folder / kind).mkdir(parents=True, exist_ok=True)
        (folder / kind / name).write_bytes(content)
        names.append((kind, name))
    findings: dict[str, list[str]] = {}
    records = {}
    for kind in sorted({kind for kind, _ in names}):
        suffix = ["--suffix", ".ply"] if kind == "changing" else []
        results = folder / f"{kind}.jsonl"
        words = ["unwrap", str(folder / kind), "--out", str(folder / "uv"), "--json", str(results)]
        assert run_batch([*words, *suffix, "--jobs", str(jobs), "--quiet"]) == 0
        for line in results.read_text().splitlines():
            record = json.loads(line)
            records[Path(record["input"]).name] = record
    for kind, name in names:
        record = records[name]
        if not record["written"]:
            findings.setdefault(f"no map: {record['reason']}", []).append(name)
            continue
        target = Path(record["output"])
        for what in differences(folder / kind / name, target):
            findings.setdefault(f"different: {what}", []).append(name)
        if worst_area(target) > 1.0:
            findings.setdefault("areas", []).append(name)
    return findings


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--files", type=int, default=500)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--jobs", type=int, default=1)
    parser.add_argument("--folder", type=Path, help="keeps the files there")
    given = parser.parse_args()
    with tempfile.TemporaryDirectory() as made:
        folder = given.folder or Path(made)
        found = run(range(given.seed, given.seed + given.files), folder, given.jobs)
    for what, names in sorted(found.items()):
        print(f"{what}: {len(names)}, such as {', '.join(names[:5])}")
    print(f"{given.files} files from seed {given.seed} on, {len(found)} kinds of findings")
    return 1 if found else 0


if __name__ == "__main__":
    sys.exit(main())
