# SPDX-License-Identifier: GPL-3.0-or-later
"""Batches: blender -b -c flipfree ..., as a process of its own."""

import os
import subprocess

import bpy
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
