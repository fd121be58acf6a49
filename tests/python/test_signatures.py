"""Signatures of which only some loops are given, their files, and maps whose loops turn as they happen to."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from commands import mapped, put, run

import flipfree as ff
from flipfree.calls.seamless import halfedges_of_strip

from judges import fields
from mesh_files import read_mesh, shared
from surfaces import bumpy_grid, compact, cylinder, open_edges, torus


def turns_of(vertices: np.ndarray, faces: np.ndarray, field: ff.CrossField, strip: object) -> int:
    loop = halfedges_of_strip(faces, strip, "strip").tolist()
    assert field.rotation is not None
    return fields.judge(vertices, faces, field.rotation, [loop]).turns[0]


@pytest.mark.parametrize("turns", [-2, 0, 1, 4])
@pytest.mark.parametrize("which", [0, 1])
def test_one_loop_of_a_torus_turns_as_asked_and_the_other_as_it_likes(
    turns: int, which: int
) -> None:
    vertices, faces = torus()
    cones = {0: 3, 60: 3, 130: 5, 200: 5}
    basis = ff.signature(
        vertices, faces, ff.cross_field(vertices, faces, signature=ff.Signature(cones, []))
    ).loops
    strip = basis[which][0]
    field = ff.cross_field(vertices, faces, signature=ff.Signature(cones, [(strip, turns)]))
    assert turns_of(vertices, faces, field, strip) == turns
    assert ff.signature(vertices, faces, field).cones == cones


def test_some_loops_of_two_handles_are_met_and_all_of_them_as_before() -> None:
    mesh = read_mesh(shared("fields/eight766.obj"))
    vertices, faces = mesh.vertices, mesh.faces
    cones = {int(v): 5 for v in np.random.default_rng(3).permutation(len(vertices))[:8]}
    near = ff.cross_field(vertices, faces, signature=ff.Signature(cones, []))
    loops = ff.signature(vertices, faces, near).loops
    for count in range(1, 5):
        asked = [(strip, turns + i + 1) for i, (strip, turns) in enumerate(loops[:count])]
        field = ff.cross_field(vertices, faces, signature=ff.Signature(cones, asked))
        found = ff.signature(vertices, faces, field)
        assert found.cones == cones
        for strip, turns in asked:
            assert turns_of(vertices, faces, field, strip) == turns


def without(mesh: tuple[np.ndarray, np.ndarray], vertices: list[int]) -> Any:
    """With a hole at each of these vertices, and (n,) the vertices of the boundary."""
    points, faces = compact(mesh[0], mesh[1][~np.isin(mesh[1], vertices).any(axis=1)])
    return points, faces, np.unique(open_edges(faces))


OPEN = {
    "disk": lambda: without(bumpy_grid(16, 16), []),
    "cylinder": lambda: without(cylinder(), []),
    "disk with a hole": lambda: without(bumpy_grid(16, 16), [144]),
    "torus with two holes": lambda: without(torus(), [100, 10]),
}


@pytest.mark.parametrize("name", OPEN)
def test_signatures_of_open_surfaces_are_met(name: str) -> None:
    vertices, faces, rim = OPEN[name]()
    inner = np.setdiff1d(np.arange(len(vertices)), rim)
    places = np.random.default_rng(1).choice(inner, 3, replace=False).tolist()
    cones = dict(zip(places, (3, 5, 3), strict=True))
    near = ff.cross_field(vertices, faces, signature=ff.Signature(cones, []), boundary=True)
    loops = ff.signature(vertices, faces, near).loops
    wanted = [(strip, turns + (i == 0)) for i, (strip, turns) in enumerate(loops[:-1])]
    signature = ff.Signature(cones, wanted)
    field = ff.cross_field(vertices, faces, signature=signature, boundary=True)
    found = ff.signature(vertices, faces, field)
    assert {v: k for v, k in found.cones.items() if v not in rim} == cones
    for strip, turns in wanted:
        assert turns_of(vertices, faces, field, strip) == turns
    again = ff.cross_field(vertices, faces, signature=found, boundary=True)
    assert [t for _, t in ff.signature(vertices, faces, again).loops] == [t for _, t in found.loops]
    for boundary in ("aligned", "free"):
        made = ff.field_aligned(vertices, faces, signature=signature, boundary=boundary)
        certificate = made.certificate
        assert certificate.ok and certificate.holonomy_failures == 0
        assert made.stats["engine"] == "penner" and made.stats["loops_checked"] == len(loops)
        assert dict(certificate.quarter_cones.tolist()) == cones
    # The loop along the last boundary turns as cones and the other loops leave it.
    strip, turns = found.loops[-1]
    with pytest.raises(ff.InvalidInput, match="turns as the cones forbid"):
        ff.cross_field(
            vertices, faces, signature=ff.Signature(cones, [*wanted, (strip, turns + 1)])
        )


def test_padding_has_no_signatures_of_open_surfaces() -> None:
    vertices, faces, rim = OPEN["disk"]()
    with pytest.raises(ff.InvalidInput, match="padding.*boundary"):
        ff.field_aligned(vertices, faces, signature=ff.Signature({}, []), engine="padding")
    corners = dict.fromkeys(rim[:5].tolist(), 1)
    with pytest.raises(ff.Infeasible, match="Gauss-Bonnet"):
        ff.cross_field(vertices, faces, signature=ff.Signature(corners, []))


def test_a_signature_comes_back_from_its_file(tmp_path: Path) -> None:
    vertices, faces = torus()
    whole = ff.signature(vertices, faces, ff.cross_field(vertices, faces))
    whole.write(tmp_path / "s.json")
    again = ff.Signature.read(tmp_path / "s.json")
    assert again.cones == whole.cones
    for (strip, turns), (other, same) in zip(whole.loops, again.loops, strict=True):
        assert np.array_equal(strip, other) and turns == same
    assert ff.field_aligned(vertices, faces, signature=again).certificate.ok
    for text in ("[]", '{"cones": [1]}', '{"loops": [{"faces": [1]}]}', "{", '{"loops": [3]}'):
        (tmp_path / "bad.json").write_text(text)
        with pytest.raises(ff.InvalidInput, match="bad.json"):
            ff.Signature.read(tmp_path / "bad.json")
    with pytest.raises(ff.InvalidInput, match="missing.json"):
        ff.Signature.read(tmp_path / "missing.json")


def test_without_rerouting_the_map_has_the_cones_alone() -> None:
    vertices, faces = torus()
    cones = {0: 3, 60: 3, 130: 5, 200: 5}
    near = ff.cross_field(vertices, faces, signature=ff.Signature(cones, []))
    odd = [(strip, turns + 1) for strip, turns in ff.signature(vertices, faces, near).loops]
    field = ff.cross_field(vertices, faces, signature=ff.Signature(cones, odd))
    kept = ff.field_aligned(vertices, faces, field=field, engine="padding")
    bare = ff.field_aligned(vertices, faces, field=field, engine="padding", reroute=False)
    assert kept.certificate.ok and bare.certificate.ok
    assert kept.certificate.holonomy_failures == 0 and bare.certificate.holonomy_failures <= 0
    assert dict(bare.certificate.quarter_cones.tolist()) == cones
    assert kept.stats["reroutings.guided"] + kept.stats["reroutings.fallback"] > 0
    assert bare.stats["reroutings.guided"] + bare.stats["reroutings.fallback"] == 0
    with pytest.raises(ff.InvalidInput, match="reroute"):
        ff.field_aligned(vertices, faces, field=field, reroute="no")


@pytest.mark.parametrize("kind", ["rawfield", "ffield", "rotation", "signature", "cones"])
def test_the_command_takes_fields_and_signatures_of_files(here: Path, kind: str) -> None:
    vertices, faces = torus()
    put("torus.obj", (vertices, faces))
    field = ff.cross_field(vertices, faces, alignment=0.5)
    beside = f"torus.obj.{kind}" + (".json" if kind in ("signature", "cones") else "")
    if kind == "signature":
        ff.signature(vertices, faces, field).write(beside)
    elif kind == "cones":
        Path(beside).write_text(json.dumps({"0": 270, "100": 450, "9": 270, "50": 450}))
    else:
        field.write(beside, vertices, faces)
    words = ["--field", kind if beside.endswith(".json") else "file", "--engine", "penner"]
    assert mapped("field", "torus.obj", "uv.obj", *words)["degrees_off_field"] < 30
    Path(beside).unlink()
    assert kind == "cones" or run("field", "torus.obj", "no.obj", *words)["status"] == "refused"
