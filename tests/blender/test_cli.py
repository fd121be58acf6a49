# SPDX-License-Identifier: GPL-3.0-or-later
"""Batches: blender -b -c flipfree ..., as a process of its own."""

import json
import re

import bpy
import numpy as np
import pytest
import shapes
from shapes import command

pytestmark = pytest.mark.sample(6)  # a Blender of its own each


@pytest.fixture
def bumpy_obj(tmp_path):
    shapes.grid(6, uv=False)
    path = tmp_path / "bumpy.obj"
    bpy.ops.wm.obj_export(filepath=str(path), export_materials=False)
    return path


def test_unwrap_reads_and_writes_files(bumpy_obj, tmp_path):
    out = tmp_path / "out.obj"
    result = command("unwrap", bumpy_obj, out)
    assert result.returncode == 0, result.stdout + result.stderr
    assert "0 flips, 0 overlaps" in result.stdout
    assert out.read_text().count("\nvt ") == 49
    again = command("check", out)
    assert again.returncode == 0 and "Nothing wrong" in again.stdout


@pytest.fixture
def two_sheets(tmp_path):
    """A .blend with two objects whose maps lie on top of each other."""
    for i in range(2):
        ob = shapes.grid(6, f"Sheet {i}", bump=0.0, uv=True)
        square = [ob.data.vertices[loop.vertex_index].co.xy * 0.1 for loop in ob.data.loops]
        shapes.set_uv(ob, np.array(square, np.float32) + np.float32(0.4))
    path = tmp_path / "two.blend"
    bpy.ops.wm.save_as_mainfile(filepath=str(path), copy=True)
    return path


def boxes(path):
    bpy.ops.wm.open_mainfile(filepath=str(path))
    uvs = [shapes.uv_of(ob) for ob in bpy.data.objects if ob.type == "MESH"]
    return [(uv.min(axis=0), uv.max(axis=0)) for uv in uvs]


@pytest.mark.parametrize("arguments", [[], ["--keep-placement"]])
def test_unwrap_packs_all_objects_of_a_file_together(two_sheets, tmp_path, arguments):
    out = tmp_path / "out.blend"
    result = command("unwrap", two_sheets, out, *arguments)
    assert result.returncode == 0, result.stdout + result.stderr
    (low, high), (other_low, other_high) = boxes(out)
    assert (low > other_high).any() or (other_low > high).any(), "their places overlap"
    assert min(low.min(), other_low.min()) >= 0.0 and max(high.max(), other_high.max()) <= 1.0


def test_a_bad_mesh_gives_status_1_and_no_file(tmp_path):
    path = tmp_path / "bad.obj"
    path.write_text("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n")
    result = command("seamless", path, tmp_path / "out.obj", "--boundary", "aligned")
    assert (
        result.returncode == 1 and "cannot turn by 4 quarter turns" in result.stdout + result.stderr
    )
    assert not (tmp_path / "out.obj").exists()
    result = command("seamless", path, tmp_path / "out.obj")  # where the boundary may be free
    assert result.returncode == 0 and "1 part has a free boundary" in result.stdout + result.stderr


def test_records_have_the_numbers_of_the_certificate(bumpy_obj, tmp_path):
    out, record = tmp_path / "out.obj", tmp_path / "record.json"
    assert command("unwrap", bumpy_obj, out, "--json", record).returncode == 0
    (found,) = json.loads(record.read_text())
    assert found["ok"] and not found["poor"] and found["poor_islands"] == []
    assert found["islands"] == 1 and found["triangles"] == 72
    assert found["flips32"] == found["overlaps"] == found["island_overlaps"] == 0
    assert 1.0 <= found["energy"] <= found["energy_p99"] <= found["max_energy"] < 5.0
    assert found["warnings"] == found["errors"] == []
    printed = command("check", out, "--json", "-").stdout
    (again,) = json.loads(printed[printed.index("[") : printed.rindex("]") + 1])
    assert again["ok"] and "Nothing wrong" in again["report"]
    out.write_text(re.sub(r"(?m)^vt .*", "vt 0 0", out.read_text()))
    wrong = command("check", out)
    assert wrong.returncode == 1 and "72 flips" in wrong.stdout + wrong.stderr


def test_records_say_what_is_poor_and_what_failed(tmp_path):
    ob = shapes.grid(4, "Flat", bump=0.0, uv=True)
    flat = shapes.plane(ob)
    shapes.set_uv(ob, flat * np.float32([1.0, 0.01]))
    shapes.add("Line", [(0, 0, 0), (1, 0, 0), (2, 0, 0)], [(0, 1, 2)], uv=True)
    bad = shapes.add("Bad", [(0, 0, 0), (1, 0, 0), (1, 1, 0)], [(0, 1, 2)], uv=True)
    bad.data.vertices[2].co.x = float("nan")
    path, record = tmp_path / "two.blend", tmp_path / "record.json"
    bpy.ops.wm.save_as_mainfile(filepath=str(path), copy=True)
    assert command("check", path, "--json", record).returncode == 1
    found = {entry["object"]: entry for entry in json.loads(record.read_text())}
    assert not found["Bad"]["ok"] and "no number" in found["Bad"]["errors"][0]["message"]
    assert found["Flat"]["poor"] and found["Flat"]["poor_islands"] == [0]
    assert found["Flat"]["stretched"] == 1.0
    assert "Select Stretched Islands" in found["Flat"]["warnings"][0]
    out = tmp_path / "out.blend"
    assert command("unwrap", path, out, "--json", record).returncode == 1
    found = {entry["object"]: entry for entry in json.loads(record.read_text())}
    assert found["Flat"]["ok"] and not found["Flat"]["poor"]
    (error,) = found["Bad"]["errors"]
    assert not found["Bad"]["ok"] and "no number" in error["message"]
    assert error["kind"] == "vertex" and error["elements"] == [2]
    # A surface without area has no distortion that could be measured.
    assert found["Line"]["ok"] and found["Line"]["energy"] is None
    assert "distortion" not in found["Line"]["report"]


def test_unknown_files_and_arguments_are_refused_with_words(tmp_path):
    result = command("unwrap", tmp_path / "mesh.xyz", tmp_path / "out.obj")
    assert result.returncode == 1 and "cannot be read" in result.stderr
    result = command("fold", "x")
    assert result.returncode == 2 and "invalid choice" in result.stderr


@pytest.mark.parametrize(
    ("given", "option"),
    [
        (["unwrap", "--margin-pixels", "nan"], "--margin-pixels: must be"),
        (["pack", "--effort", "-1"], "--effort: must be"),
        (["field", "--density-ratio", "0"], "--density-ratio: must be"),
        (["match", "--max-seconds", "inf"], "--max-seconds: must be"),
        (["conformal", "--precision", "52"], "--precision: must be"),
        (["pack", "--margin-pixels", "512"], "--margin-pixels 512: it must be below"),
    ],
)
def test_numbers_that_suit_no_model_are_refused_before_any_is_read(bumpy_obj, given, option):
    for places in ([bumpy_obj, bumpy_obj.with_name("out.obj")], [bumpy_obj, "--out", "out"]):
        result = command(given[0], *places, *given[1:])
        assert result.returncode == 2 and option in result.stderr, result.stderr
        assert not bumpy_obj.with_name("out.obj").exists()


def test_cures_are_options_of_the_command_line(pinned_blend, tmp_path):
    result = command("match", pinned_blend, tmp_path / "out.blend", "--max-seconds", "1e-9")
    assert result.returncode == 1
    assert "--max-seconds" in result.stderr and "redo panel" not in result.stderr


@pytest.fixture
def pinned_blend(tmp_path):
    """A .blend with a sheet of which two vertices are pinned, one of them elsewhere."""
    ob = shapes.grid(8, bump=0.2, uv=True)
    corner = shapes.corners(ob)
    uv = shapes.plane(ob)
    uv[corner == 40] += np.float32([0.1, 0.05])
    shapes.set_uv(ob, uv)
    shapes.set_pins(ob, np.isin(corner, [0, 40]))
    path = tmp_path / "pinned.blend"
    bpy.ops.wm.save_as_mainfile(filepath=str(path), copy=True)
    return path


@pytest.mark.parametrize(
    "arguments",
    [
        ["match", "--unwrap-rest", "--cut-open", "--max-seconds", "100"],
        ["improve", "--pack", "--ignore-pins", "--iterations", "20"],
        ["repair", "--overlaps", "open", "--move-apart", "--mark-seams"],
        ["repair", "--stretched", "improve", "--ignore-pins"],
        ["conformal", "--boundary", "circle", "--precision", "113"],
        ["embed", "--boundary", "triangle", "--no-pack"],
    ],
)
def test_every_map_can_be_made_in_batches(pinned_blend, tmp_path, arguments):
    out = tmp_path / "out.blend"
    result = command(arguments[0], pinned_blend, out, *arguments[1:])
    assert result.returncode == 0, result.stdout + result.stderr
    assert "0 flips" in result.stdout
    again = command("check", out)
    assert again.returncode == 0
    assert "Nothing wrong" in again.stdout or "No flips and no overlaps" in again.stdout


@pytest.mark.parametrize(
    ("arguments", "said"),
    [(["seams"], "marked as seams"), (["cones", "--bound", "3"], "scales differ by")],
)
def test_what_prepares_maps_is_a_command_too(pinned_blend, tmp_path, arguments, said):
    out, report = tmp_path / "out.blend", tmp_path / "r.json"
    result = command(arguments[0], pinned_blend, out, *arguments[1:], "--json", report)
    assert result.returncode == 0 and said in result.stdout, result.stdout + result.stderr
    (record,) = json.loads(report.read_text())
    assert record["ok"] and record["errors"] == [] and out.exists()


def test_an_object_of_a_file_takes_the_shape_of_another(tmp_path):
    bpy.ops.wm.read_homefile(use_empty=True)
    for n, name, bump in ((4, "Low", 0.0), (6, "High", 0.5)):
        shapes.flat(shapes.grid(n, name, bump=bump, uv=True))
    path, out = tmp_path / "two.blend", tmp_path / "out.blend"
    bpy.ops.wm.save_as_mainfile(filepath=str(path), copy=True)
    result = command("transfer", path, out, "--source", "High")
    assert result.returncode == 0 and "like High" in result.stdout, result.stdout + result.stderr
    bpy.ops.wm.open_mainfile(filepath=str(out))
    key = bpy.data.objects["Low"].data.shape_keys.key_blocks["High"]
    assert 0.3 < max(point.co.z for point in key.data) <= 0.5001


@pytest.mark.parametrize(
    ("given", "wrong"),
    [
        (["seamless", "--cones", "marked"], "quarter turns"),
        (["field-aligned", "--field", "flow"], "no attribute"),
    ],
)
def test_seamless_maps_of_a_file_are_made_or_refused(tmp_path, given, wrong):
    bpy.ops.wm.read_homefile(use_empty=True)
    bpy.ops.mesh.primitive_torus_add()
    path, out, report = tmp_path / "torus.blend", tmp_path / "out.blend", tmp_path / "r.json"
    bpy.ops.wm.save_as_mainfile(filepath=str(path), copy=True)
    result = command(given[0], path, out, *given[1:], "--json", report)
    assert result.returncode == 0, result.stdout + result.stderr
    assert "0 flips" in result.stdout
    (record,) = json.loads(report.read_text())
    assert record["ok"] and record["islands"] == 1 and record["flips32"] == 0
    assert record["seams_exact32"] == record["seam_edges"] > 0
    bpy.context.object.vertex_groups.new(name="Cone +1").add([0], 1.0, "REPLACE")
    bpy.ops.wm.save_as_mainfile(filepath=str(path), copy=True)
    words = [] if given[0] == "seamless" else ["--field", "attribute"]
    refused = command(given[0], path, tmp_path / "no.blend", *words)
    assert refused.returncode == 1 and wrong in refused.stderr
    assert not (tmp_path / "no.blend").exists()
    bpy.ops.wm.open_mainfile(filepath=str(out))
    (ob,) = (ob for ob in bpy.data.objects if ob.type == "MESH")
    assert shapes.exact_flips(ob) == 0 and "seam_turns" in ob.data.attributes
