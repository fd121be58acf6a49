# SPDX-License-Identifier: GPL-3.0-or-later
"""Batches: blender -b -c flipfree ..., as a process of its own."""

import os
import subprocess

import bpy
import numpy as np
import pytest
import shapes


def command(*arguments):
    return subprocess.run(
        [os.environ["FLIPFREE_BLENDER"], "-b", "-c", "flipfree", *map(str, arguments)],
        capture_output=True,
        text=True,
        timeout=300,
    )


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


def test_a_bad_mesh_gives_status_1_and_no_file(tmp_path):
    path = tmp_path / "bad.obj"
    path.write_text("v 0 0 0\nv 1 0 0\nv 2 0 0\nf 1 2 3\n")
    result = command("unwrap", path, tmp_path / "out.obj")
    assert result.returncode == 1 and "without area" in result.stdout + result.stderr
    assert not (tmp_path / "out.obj").exists()


def test_unknown_files_and_arguments_are_refused_with_words(tmp_path):
    result = command("unwrap", tmp_path / "mesh.xyz", tmp_path / "out.obj")
    assert result.returncode == 1 and "cannot be read" in result.stderr
    result = command("fold", "x")
    assert result.returncode == 2 and "invalid choice" in result.stderr


@pytest.fixture
def pinned_blend(tmp_path):
    """A .blend with a sheet of which two vertices are pinned, one of them elsewhere."""
    ob = shapes.grid(8, bump=0.2, uv=True)
    corner = np.array([loop.vertex_index for loop in ob.data.loops])
    uv = np.array([ob.data.vertices[v].co[:2] for v in corner], np.float32)
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
        ["conformal", "--boundary", "circle"],
    ],
)
def test_every_map_can_be_made_in_batches(pinned_blend, tmp_path, arguments):
    out = tmp_path / "out.blend"
    result = command(arguments[0], pinned_blend, out, *arguments[1:])
    assert result.returncode == 0, result.stdout + result.stderr
    assert "0 flips" in result.stdout
    again = command("check", out)
    assert again.returncode == 0 and "Nothing wrong" in again.stdout


def test_pins_that_contradict_give_status_1_and_no_file(pinned_blend, tmp_path):
    bpy.ops.wm.open_mainfile(filepath=str(pinned_blend))
    ob = next(ob for ob in bpy.data.objects if ob.type == "MESH")
    corner = np.array([loop.vertex_index for loop in ob.data.loops])
    uv = shapes.uv_of(ob)
    uv[np.isin(corner, [0, 40])] = 0.5
    shapes.set_uv(ob, uv)
    path = tmp_path / "bad.blend"
    bpy.ops.wm.save_as_mainfile(filepath=str(path), copy=True)
    result = command("match", path, tmp_path / "out.blend")
    assert result.returncode == 1 and "contradict" in result.stderr
    assert not (tmp_path / "out.blend").exists()
