"""Runs inside Blender: packs a flat mesh's islands with Blender's own Pack Islands, several times, and times it.

    blender -b --factory-startup --python-exit-code 1 --python benchmarks/blender_pack_worker.py -- IN.npz OUT.npz GAP SECONDS

IN has `vertices`, `faces` and `uv` (m, 3, 2); OUT gets `uv` (p, m, 3, 2) and `seconds` (p, 2), wall clock and CPU, of p presses from the
same UVs. What Blender makes of them differs from press to press within a session, and by the rotations that it may take, so that all
are tried, until SECONDS of CPU are over. The margin method is Add, whose margin is added on either side of an island before all are
scaled to the square: for GAP, a share of the square, it follows from the fill, of which that of the press before is the guess. Part of
packing.py.
"""

import os
import sys
import time

import bpy
import numpy as np

PRESSES = 4
ROTATIONS = ("ANY", "AXIS_ALIGNED", "CARDINAL")


def area(uv) -> float:
    a, b = uv[:, 1] - uv[:, 0], uv[:, 2] - uv[:, 0]
    return float(np.abs(a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]).sum() / 2)


def press(mesh, uv, rotation: str, margin: float):
    mesh.uv_layers.active.uv.foreach_set("vector", uv.astype(np.float32).ravel())
    bpy.ops.object.mode_set(mode="EDIT")
    bpy.ops.mesh.select_all(action="SELECT")
    bpy.ops.uv.select_all(action="SELECT")
    wall, cpu = time.perf_counter(), time.process_time()
    bpy.ops.uv.pack_islands(
        rotate=True,
        rotate_method=rotation,
        scale=True,
        margin_method="ADD",
        margin=margin,
        shape_method="CONCAVE",
    )
    seconds = [time.perf_counter() - wall, time.process_time() - cpu]
    bpy.ops.object.mode_set(mode="OBJECT")
    packed = np.empty(2 * len(mesh.loops), np.float32)
    mesh.uv_layers.active.uv.foreach_get("vector", packed)
    return packed.reshape(-1, 3, 2), seconds


def main() -> None:
    source, out, gap, most = sys.argv[sys.argv.index("--") + 1 :]
    data = np.load(source)
    vertices, faces, uv = data["vertices"], data["faces"], data["uv"]
    mesh = bpy.data.meshes.new("layout")
    mesh.from_pydata(vertices.tolist(), [], faces.tolist())
    mesh.uv_layers.new(name="UVMap")
    ob = bpy.data.objects.new("layout", mesh)
    bpy.context.collection.objects.link(ob)
    bpy.context.view_layer.objects.active = ob
    ob.select_set(True)
    packed, seconds = [], []
    before = area(uv)
    fill = dict.fromkeys(ROTATIONS, 0.6)
    for _ in range(PRESSES):
        for rotation in ROTATIONS:
            if seconds and np.sum(seconds, axis=0)[1] > float(most):
                break
            margin = 0.5 * float(gap) * np.sqrt(before / (0.98 * fill[rotation]))
            made, took = press(mesh, uv, rotation, float(margin))
            fill[rotation] = area(made.astype(np.float64))
            packed.append(made)
            seconds.append(took)
    np.savez(out, uv=np.stack(packed), seconds=seconds)
    sys.stdout.flush()
    os._exit(0)


main()
