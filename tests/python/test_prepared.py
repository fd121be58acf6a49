"""python -m flipfree cones and cut: what prepares maps, in files beside the output."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest

import flipfree as ff

from surfaces import octahedron_sphere, torus


def run(folder: Path, command: str, *words: str) -> dict[str, Any]:
    results = folder / f"{command}.jsonl"
    given = [sys.executable, "-m", "flipfree", command, str(folder / "in"), "--out"]
    out = [str(folder / command), "--json", str(results)]
    ended = subprocess.run([*given, *out, *words], capture_output=True, text=True)
    assert ended.returncode == 0, ended.stderr
    (record,) = map(json.loads, results.read_text().splitlines())
    return dict(record)


def write(folder: Path, mesh: Any, **beside: Any) -> None:
    (folder / "in").mkdir()
    ff.write(folder / "in" / "m.obj", mesh[:2])
    for kind, told in beside.items():
        (folder / "in" / f"m.obj.{kind}.json").write_text(json.dumps(told))


def test_suggested_cones_lie_beside_the_output_and_conformal_takes_them(tmp_path: Path) -> None:
    write(tmp_path, octahedron_sphere(3))
    record = run(tmp_path, "cones", "--quarter-turns")
    assert record["status"] == "certified" and record["cones"] > 0 and record["scale_ratio"] <= 4.0
    told = json.loads((tmp_path / "cones" / "m.obj.cones.json").read_text())
    assert len(told) == record["cones"] and all(angle % 90 == 0 for angle in told.values())
    (tmp_path / "in" / "m.obj.cones.json").write_text(json.dumps(told))
    mapped = run(tmp_path, "conformal", "--precision", "113", "--refined-start", "off")
    assert mapped["certificate"]["ok"], mapped["message"]


@pytest.mark.parametrize("follow", ["cones", "field"])
def test_cuts_lie_beside_the_refined_surface(tmp_path: Path, follow: str) -> None:
    cones = {"0": 270, "60": 270, "130": 450, "200": 450}
    write(tmp_path, torus(), cones=cones)
    record = run(tmp_path, "cut", "--follow", follow)
    assert record["status"] == "certified" and record["written"], record["message"]
    told = json.loads((tmp_path / "cut" / "m.obj.cut.json").read_text())
    mesh = ff.read(tmp_path / "cut" / "m.obj")
    sides = {frozenset((f[k], f[(k + 1) % 3])) for f in mesh.faces.tolist() for k in range(3)}
    for branch in told["branches"]:
        assert all(frozenset(side) in sides for side in zip(branch, branch[1:], strict=False))
    assert len(told["corners"]) == record["corners"] > 0
    assert len(mesh.vertices) == record["vertices_added"] + len(torus()[0])
