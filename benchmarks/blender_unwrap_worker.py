"""Runs inside Blender: builds a subdivided monkey with its own islands as seams and times Blender's unwrap on it.

    blender -b --factory-startup --python-exit-code 1 --python benchmarks/blender_unwrap_worker.py -- LEVELS OUT.npz [METHOD ...]

Writes the triangles, the seams and, per method, the UVs with wall-clock and CPU seconds. Part of unwrap_vs_blender.py.
"""

import os
import sys
import time
from pathlib import Path

import bpy
import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parent))
sys.dont_write_bytecode = True

from blender_monkey import subdivided_monkey  # noqa: E402


def main() -> None:
    arguments = sys.argv[sys.argv.index("--") + 1 :]
    levels, out, methods = int(arguments[0]), arguments[1], arguments[2:]
    monkey = subdivided_monkey(levels)
    mesh = monkey.data
    count = len(mesh.polygons)
    vertices = np.empty(3 * len(mesh.vertices), np.float32)
    mesh.vertices.foreach_get("co", vertices)
    corners = np.empty(len(mesh.loops), np.int32)
    mesh.loops.foreach_get("vertex_index", corners)
    assert len(corners) == 3 * count
    seam = np.empty(len(mesh.edges), bool)
    mesh.edges.foreach_get("use_seam", seam)
    ends = np.empty(2 * len(mesh.edges), np.int32)
    mesh.edges.foreach_get("vertices", ends)
    data = {
        "vertices": vertices.reshape(-1, 3).astype(np.float64),
        "faces": corners.reshape(-1, 3),
        "seams": ends.reshape(-1, 2)[seam],
    }
    bpy.ops.object.mode_set(mode="EDIT")
    bpy.ops.mesh.select_all(action="SELECT")
    for method in methods:
        wall, cpu = time.perf_counter(), time.process_time()
        bpy.ops.uv.unwrap(method=method, margin=0.001)
        data[f"{method}_seconds"] = np.array(
            [time.perf_counter() - wall, time.process_time() - cpu]
        )
        bpy.ops.object.mode_set(mode="OBJECT")
        uv = np.empty(2 * len(corners), np.float32)
        mesh.uv_layers.active.uv.foreach_get("vector", uv)
        data[f"{method}_uv"] = uv.reshape(-1, 3, 2)
        bpy.ops.object.mode_set(mode="EDIT")
    np.savez(out, **data)
    sys.stdout.flush()
    # 4.3.2 can crash while Python is torn down after long scripts; everything is written.
    os._exit(0)


main()
