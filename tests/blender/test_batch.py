# SPDX-License-Identifier: GPL-3.0-or-later
"""Batches in Blender: folders of files of all types, each model in a Blender of its own."""

import json
import struct
from pathlib import Path

import bpy
import numpy as np
import pytest
import shapes

pytestmark = pytest.mark.sample(2)  # a Blender of its own each


def batch(*arguments, status=0):
    process = shapes.command(*arguments)
    assert process.returncode == status, process.stdout + process.stderr
    return process.stdout + process.stderr


def records(path):
    return {
        Path(line["input"]).name: line for line in map(json.loads, path.read_text().splitlines())
    }


def scene(*makers):
    """Only what these make. No glTF is exported here: read_homefile after that ends Blender 4.3.2 under pytest."""
    bpy.ops.wm.read_homefile(use_empty=True)
    for make in makers:
        make()


def write_glb(path, positions, normals, triangles):
    """One mesh with a normal per vertex: corners of faces that differ in it are different vertices."""
    parts = [
        np.asarray(positions, np.float32).tobytes(),
        np.asarray(normals, np.float32).tobytes(),
        np.asarray(triangles, np.uint32).tobytes(),
    ]
    starts = np.cumsum([0, *map(len, parts)]).tolist()
    vectors = {"componentType": 5126, "type": "VEC3", "count": len(positions)}
    box = {"min": np.min(positions, axis=0).tolist(), "max": np.max(positions, axis=0).tolist()}
    gltf = {
        "asset": {"version": "2.0"},
        "scene": 0,
        "scenes": [{"nodes": [0]}],
        "nodes": [{"mesh": 0}],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0, "NORMAL": 1}, "indices": 2}]}],
        "accessors": [
            {"bufferView": 0, **vectors, **box},
            {"bufferView": 1, **vectors},
            {
                "bufferView": 2,
                "componentType": 5125,
                "type": "SCALAR",
                "count": np.size(triangles),
            },
        ],
        "bufferViews": [
            {"buffer": 0, "byteOffset": start, "byteLength": len(part)}
            for start, part in zip(starts, parts, strict=False)
        ],
        "buffers": [{"byteLength": starts[-1]}],
    }
    text = json.dumps(gltf).encode()
    text += b" " * (-len(text) % 4)
    chunks = struct.pack("<I4s", len(text), b"JSON") + text
    chunks += struct.pack("<I4s", starts[-1], b"BIN\0") + b"".join(parts)
    path.write_bytes(struct.pack("<4sII", b"glTF", 2, 12 + len(chunks)) + chunks)


def write_cube_glb(path):
    positions, normals, triangles = [], [], []
    for axis in range(3):
        for side in (-1.0, 1.0):
            first = len(positions)
            for a, b in ((-1, -1), (1, -1), (1, 1), (-1, 1)):
                corner = np.roll([side, a * side, b], axis)
                positions.append(corner)
                normals.append(np.roll([side, 0.0, 0.0], axis))
            triangles += [[first, first + 1, first + 2], [first, first + 2, first + 3]]
    write_glb(path, positions, normals, triangles)


def cube():
    bpy.ops.mesh.primitive_cube_add()


def sheet():
    shapes.grid(6, "Sheet", uv=False)


def broken():
    ob = shapes.add("Broken", [(0, 0, 0), (1, 0, 0), (1, 1, 0)], [(0, 1, 2)], uv=True)
    ob.data.vertices[2].co.x = float("nan")


def imported(path):
    """The mesh object of a glTF file as Blender reads it."""
    scene()
    bpy.ops.import_scene.gltf(filepath=str(path))
    (ob,) = (ob for ob in bpy.context.scene.objects if ob.type == "MESH")
    return ob


@pytest.fixture
def models(tmp_path):
    """A folder with models of several types, one of them broken, one with a broken object."""
    folder = tmp_path / "in"
    (folder / "deep").mkdir(parents=True)
    scene(cube)
    write_cube_glb(folder / "cube.glb")
    bpy.ops.export_scene.fbx(filepath=str(folder / "deep" / "cube.fbx"))
    scene(sheet)
    bpy.ops.wm.obj_export(filepath=str(folder / "deep" / "sheet.obj"), export_materials=False)
    scene(sheet, broken)
    bpy.ops.wm.save_as_mainfile(filepath=str(folder / "two.blend"), copy=True)
    (folder / "nothing.glb").write_bytes(b"no glTF at all")
    return folder


def test_a_folder_of_all_types_is_mapped_and_the_bad_ones_recorded(models, tmp_path):
    out, results = tmp_path / "out", tmp_path / "results.jsonl"
    said = batch("unwrap", models, "--out", out, "--json", results, "--jobs", 2)
    found = records(results)
    assert {name: line["status"] for name, line in found.items()} == {
        "cube.glb": "certified",
        "cube.fbx": "certified",
        "sheet.obj": "certified",
        "two.blend": "refused",
        "nothing.glb": "refused",
    }
    assert "3 certified, 2 refused" in said
    assert found["nothing.glb"]["message"] and not (out / "nothing.glb").exists()
    # The good object of a file has its map, the bad one is as it was.
    good, bad = sorted(found["two.blend"]["objects"], key=lambda one: one["object"], reverse=True)
    assert (good["status"], bad["status"]) == ("certified", "refused")
    assert found["two.blend"]["written"] and "no number" in found["two.blend"]["message"]
    assert "redo panel" not in results.read_text()
    names = sorted(p.relative_to(out).as_posix() for p in out.rglob("*") if p.is_file())
    assert [n for n in names if not n.endswith(".mtl")] == [
        "cube.glb",
        "deep/cube.fbx",
        "deep/sheet.obj",
        "two.blend",
    ]
    bpy.ops.wm.open_mainfile(filepath=str(out / "two.blend"))
    assert shapes.exact_flips(bpy.data.objects["Sheet"]) == 0
    before = results.read_text()
    assert "5 of 5 models are done already" in batch(
        "unwrap", models, "--out", out, "--json", results, "--resume"
    )
    assert results.read_text() == before


def test_split_vertices_are_merged_and_look_as_before(models, tmp_path):
    results = tmp_path / "results.jsonl"
    glb = models / "cube.glb"
    assert len(imported(glb).data.vertices) == 24
    batch("unwrap", glb, "--out", tmp_path, "--suffix", ".blend", "--json", results)
    (entry,) = records(results)["cube.glb"]["objects"]
    assert entry["islands"] < 6
    bpy.ops.wm.open_mainfile(filepath=str(tmp_path / "cube.blend"))
    (ob,) = (ob for ob in bpy.data.objects if ob.type == "MESH")
    assert (len(ob.data.vertices), len(ob.data.edges)) == (8, 18)
    assert not any(name.startswith("flipfree") for name in ob.data.attributes.keys())
    corner, flat = ob.data.corner_normals, []
    for polygon in ob.data.polygons:
        flat += [np.dot(corner[i].vector, polygon.normal) for i in polygon.loop_indices]
    assert min(flat) > 0.999  # still a cube with sharp edges
    results.unlink()
    batch("unwrap", glb, "--out", tmp_path / "apart", "--json", results, "--no-merge")
    assert records(results)["cube.glb"]["objects"][0]["islands"] == 6


def test_check_takes_folders_and_writes_nothing(models, tmp_path):
    results = tmp_path / "results.jsonl"
    batch("unwrap", models / "cube.glb", "--out", tmp_path / "out", "--suffix", ".blend")
    there = sorted(tmp_path.rglob("*"))
    batch("check", tmp_path / "out", "--json", results)
    assert records(results)["cube.blend"]["status"] == "certified"
    assert sorted(tmp_path.rglob("*")) == sorted([*there, results])


def test_external_files_of_a_gltf_come_along(models, tmp_path):
    out = tmp_path / "out"
    batch("unwrap", models / "cube.glb", "--out", out, "--suffix", ".gltf")
    assert sorted(p.name for p in out.iterdir()) == ["cube.bin", "cube.gltf"]
    batch("check", out / "cube.gltf", "--timeout", 200)


def test_usd_is_read_and_written_where_blender_can(models, tmp_path):
    try:
        bpy.ops.wm.usd_export.get_rna_type()
    except KeyError:
        said = batch("unwrap", models / "cube.glb", "--out", tmp_path, "--suffix", ".usd", status=2)
        assert "files of this type" in said
        return
    scene(cube)
    bpy.ops.wm.usd_export(filepath=str(tmp_path / "cube.usdc"))
    results, out = tmp_path / "results.jsonl", tmp_path / "out"
    batch("unwrap", tmp_path / "cube.usdc", "--out", out, "--suffix", ".usda", "--json", results)
    assert records(results)["cube.usdc"]["status"] == "certified"
    assert "texCoord2f" in (out / "cube.usda").read_text()
