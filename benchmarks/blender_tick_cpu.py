# SPDX-License-Identifier: GPL-3.0-or-later
"""What the ticks of a run take of Blender's own thread while a large mesh is unwrapped: CPU seconds, on a machine however busy.

    blender -b --python benchmarks/blender_tick_cpu.py -- [FACES TO A SIDE [never | always]]

The extension must be enabled. Beside it blender_tick.py, which asks a window's clock and so counts drawing as well.
"""

import importlib
import os
import sys
import time

import bpy
import numpy as np

EXTENSION = "bl_ext.user_default.flipfree_uv"
arguments = sys.argv[sys.argv.index("--") + 1 :] if "--" in sys.argv else []
SIDE = int(arguments[0]) if arguments else 1000
SEPARATE = arguments[1] if len(arguments) > 1 else "never"


def part(name):
    return importlib.import_module(f"{EXTENSION}.{name}")


def sheet():
    bpy.data.batch_remove(list(bpy.data.objects))
    bpy.ops.mesh.primitive_grid_add(x_subdivisions=SIDE, y_subdivisions=SIDE)
    mesh = bpy.context.object.data
    places = np.empty((len(mesh.vertices), 3), np.float32)
    mesh.vertices.foreach_get("co", places.ravel())
    places[:, 2] = 0.1 * np.sin(9 * places[:, 0]) * np.cos(7 * places[:, 1])
    mesh.vertices.foreach_set("co", places.ravel())
    mesh.update()
    return bpy.context.object


def of_thread(call):
    """(what it returns, CPU seconds of this thread)."""
    begin = time.thread_time()
    found = call()
    return found, time.thread_time() - begin


bpy.context.preferences.addons[EXTENSION].preferences.separate = SEPARATE
ob = sheet()
snapshot, reading = of_thread(lambda: part("meshes.mesh_io").read(ob, only_selected=False))
layout = part("operators.layout").joint_of(bpy.context, [snapshot])
run = part("modal").Run([part("operators.unwrap").UnwrapTask(snapshot)], [], layout=layout)
ticks = []
while True:
    ended, seconds = of_thread(lambda: run.advance(0.0))
    ticks.append(seconds)
    if ended:
        break
    time.sleep(0.1)
_, writing = of_thread(run.finish)
assert run.done and not run.failures, [str(failure) for failure in run.failures]
print(
    f"{len(ob.data.polygons)} faces, separate process {SEPARATE}: reading {reading:.2f}, first tick {ticks[0]:.2f}, longest of "
    f"{len(ticks) - 2} others {max(ticks[1:-1]):.4f}, last {ticks[-1]:.2f}, writing {writing:.2f} CPU s, "
    f"Blender {bpy.app.version_string}",
    flush=True,
)
os._exit(0)
