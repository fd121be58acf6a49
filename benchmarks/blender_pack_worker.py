"""Runs inside Blender: packs a flat mesh's islands with Blender's own Pack Islands and times it.

    blender -b --factory-startup --python-exit-code 1 --python benchmarks/blender_pack_worker.py -- IN.npz OUT.npz GAP

IN has `vertices`, `faces` and `uv` (m, 3, 2); OUT gets `uv` and `seconds` (wall clock, CPU). GAP: between islands, as a share of the
square; margins as fractions leave twice the number, so half of it is asked for. Part of packing.py.
"""

import os
import sys
import time

import bpy
import numpy as np


def main() -> None:
    source, out, gap = sys.argv[sys.argv.index("--") + 1 :]
    data = np.load(source)
    vertices, faces, uv = data["vertices"], data["faces"], data["uv"]
    mesh = bpy.data.meshes.new("layout")
    mesh.from_pydata(vertices.tolist(), [], faces.tolist())
    layer = mesh.uv_layers.new(name="UVMap")
    layer.uv.foreach_set("vector", uv.astype(np.float32).ravel())
    ob = bpy.data.objects.new("layout", mesh)
    bpy.context.collection.objects.link(ob)
    bpy.context.view_layer.objects.active = ob
    ob.select_set(True)
    bpy.ops.object.mode_set(mode="EDIT")
    bpy.ops.mesh.select_all(action="SELECT")
    bpy.ops.uv.select_all(action="SELECT")
    wall, cpu = time.perf_counter(), time.process_time()
    bpy.ops.uv.pack_islands(
        rotate=True,
        rotate_method="ANY",
        scale=True,
        margin_method="FRACTION",
        margin=0.5 * float(gap),
        shape_method="CONCAVE",
    )
    seconds = [time.perf_counter() - wall, time.process_time() - cpu]
    bpy.ops.object.mode_set(mode="OBJECT")
    packed = np.empty(2 * len(mesh.loops), np.float32)
    mesh.uv_layers.active.uv.foreach_get("vector", packed)
    np.savez(out, uv=packed.reshape(-1, 3, 2), seconds=seconds)
    sys.stdout.flush()
    os._exit(0)


main()
