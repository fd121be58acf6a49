"""Runs inside Blender: Smart UV Project on meshes.

    blender -b --factory-startup --python-exit-code 1 --python benchmarks/blender_smart_worker.py -- FOLDER

FOLDER has NAME.npz with `vertices` and `faces`; each gets NAME.smart.npz with `uv` (m, 3, 2) and `seconds` (wall clock, CPU). Part of
auto_seams.py.
"""

import os
import sys
import time
from pathlib import Path

import bpy
import numpy as np


def project(source: Path) -> None:
    data = np.load(source)
    mesh = bpy.data.meshes.new("model")
    mesh.from_pydata(data["vertices"].tolist(), [], data["faces"].tolist())
    mesh.uv_layers.new(name="UVMap")
    ob = bpy.data.objects.new("model", mesh)
    bpy.context.collection.objects.link(ob)
    bpy.context.view_layer.objects.active = ob
    ob.select_set(True)
    bpy.ops.object.mode_set(mode="EDIT")
    bpy.ops.mesh.select_all(action="SELECT")
    wall, cpu = time.perf_counter(), time.process_time()
    bpy.ops.uv.smart_project()  # 66 degrees
    seconds = [time.perf_counter() - wall, time.process_time() - cpu]
    bpy.ops.object.mode_set(mode="OBJECT")
    uv = np.empty(2 * len(mesh.loops), np.float32)
    mesh.uv_layers.active.uv.foreach_get("vector", uv)
    np.savez(source.with_suffix(".smart.npz"), uv=uv.reshape(-1, 3, 2), seconds=seconds)
    bpy.data.objects.remove(ob)


def main() -> None:
    folder = Path(sys.argv[sys.argv.index("--") + 1])
    for source in sorted(folder.glob("*.npz")):
        project(source)
    sys.stdout.flush()
    os._exit(0)


main()
