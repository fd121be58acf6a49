"""python -m flipfree cones and cut: what prepares maps, in files beside the output."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from commands import mapped, put, run

import flipfree as ff

from surfaces import octahedron_sphere, torus

pytestmark = pytest.mark.usefixtures("here")


def test_suggested_cones_lie_beside_the_output_and_conformal_takes_them() -> None:
    put("m.obj", octahedron_sphere(3))
    record = run("cones", "m.obj", "--out", "cones", "--quarter-turns")
    assert record["status"] == "certified" and record["cones"] > 0 and record["scale_ratio"] <= 4.0
    told = json.loads(Path("cones/m.obj.cones.json").read_text())
    assert len(told) == record["cones"] and all(angle % 90 == 0 for angle in told.values())
    Path("m.obj.cones.json").write_text(json.dumps(told))
    mapped("conformal", "m.obj", "new.obj", "--precision", "113", "--refined-start", "off")


@pytest.mark.parametrize("follow", ["cones", "field"])
def test_cuts_lie_beside_the_refined_surface(follow: str) -> None:
    cones = {"0": 270, "60": 270, "130": 450, "200": 450}
    put("m.obj", torus(), cones=cones)
    record = run("cut", "m.obj", "--out", "cut", "--follow", follow)
    assert record["status"] == "certified" and record["written"], record["message"]
    told = json.loads(Path("cut/m.obj.cut.json").read_text())
    mesh = ff.read("cut/m.obj")
    sides = {frozenset((f[k], f[(k + 1) % 3])) for f in mesh.faces.tolist() for k in range(3)}
    for branch in told["branches"]:
        assert all(frozenset(side) in sides for side in zip(branch, branch[1:], strict=False))
    assert len(told["corners"]) == record["corners"] > 0
    assert len(mesh.vertices) == record["vertices_added"] + len(torus()[0])
