# SPDX-License-Identifier: GPL-3.0-or-later
"""Meshes that are no clean surface are unwrapped, improved, packed and checked like all others, and stay as they are."""

import json
import os
import subprocess

import bpy
import numpy as np
import pytest
import shapes
from broken_meshes import KINDS

from judges.any_triangles import judge_any


def add(vertices, faces):
    mesh = bpy.data.meshes.new("broken")
    mesh.from_pydata(np.asarray(vertices).tolist(), [], np.asarray(faces).tolist())
    ob = bpy.data.objects.new("broken", mesh)
    bpy.context.collection.objects.link(ob)
    bpy.context.view_layer.objects.active = ob
    ob.select_set(True)
    return ob


def faces_and_uv(ob):
    corners = np.array([loop.vertex_index for loop in ob.data.loops]).reshape(-1, 3)
    return corners, shapes.uv_of(ob).reshape(-1, 3, 2)


def whole(mesh):
    """Blender takes no face that uses a vertex twice."""
    vertices, faces = mesh
    return vertices, faces[[len(set(face)) == 3 for face in faces.tolist()]]


@pytest.mark.parametrize("kind", KINDS, ids=lambda kind: kind.__name__)
def test_every_face_of_a_broken_mesh_gets_a_place_of_its_own(kind):
    vertices, faces = whole(kind(np.random.default_rng(5)))
    ob = add(vertices, faces)
    assert bpy.ops.uv.flipfree_unwrap() == {"FINISHED"}
    corners, uv = faces_and_uv(ob)
    assert corners.tolist() == faces.tolist()
    assert judge_any(corners, uv) == []
    assert bpy.ops.uv.flipfree_improve() == {"FINISHED"}
    assert judge_any(corners, faces_and_uv(ob)[1], disjoint=False) == []
    assert bpy.ops.uv.flipfree_check() == {"FINISHED"}


def test_the_report_names_what_was_separated(tmp_path):
    add(*KINDS[1](np.random.default_rng(5)))
    blend, target = tmp_path / "wall.blend", tmp_path / "record.json"
    bpy.ops.wm.save_as_mainfile(filepath=str(blend))
    done = subprocess.run(
        [os.environ["FLIPFREE_BLENDER"], "-b", "-c", "flipfree", "unwrap", blend, tmp_path / "out.blend", "--json", target],
        capture_output=True, text=True, timeout=300, check=False,
    )  # fmt: skip
    assert done.returncode == 0, done.stdout + done.stderr
    (record,) = json.loads(target.read_text())
    assert record["ok"]
    assert list(record["separated"]) == ["edges with more than two faces"]
    assert "separated: " in record["report"]
