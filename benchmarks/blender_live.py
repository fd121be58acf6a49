# SPDX-License-Identifier: GPL-3.0-or-later
"""What one tick of Live Pins takes of Blender's own time, and one update of its solver.

    blender -b --python benchmarks/blender_live.py -- [QUADS TO A SIDE]

The extension must be enabled. Sheets with four pins, one of which is moved by a hundredth of the map, twenty times.
"""

import importlib
import sys
import time
from pathlib import Path

import bpy
import numpy as np

sys.path.insert(0, str(Path(__file__).parents[1] / "tests" / "blender"))
sys.dont_write_bytecode = True
import pinned  # noqa: E402
import shapes  # noqa: E402

live = importlib.import_module("bl_ext.user_default.flipfree_uv.live.live_pins")
side = int(sys.argv[-1]) if sys.argv[-1].isdigit() else 99
ob, at = pinned.pinned_grid(side)
place = shapes.uv_of(ob)[at[3][0]]
session = live.Session([ob])
ticks, updates = [], []
for i in range(20):
    pinned.move(ob, at[3], np.float32(place - 0.01 * (i + 1)))
    updates.append(time.process_time())
    quiet = 0
    while quiet < 3:
        begin = time.thread_time()
        session.tick(i % 2 == 0)
        ticks.append(time.thread_time() - begin)
        quiet = quiet + 1 if session.followed[0].idle else 0
        time.sleep(0.01)
    updates[-1] = time.process_time() - updates[-1]
assert session.updates == 20 and not session.problem
print(
    f"{2 * side * side} triangles: longest tick {max(ticks):.3f} CPU s, update {np.median(updates):.3f} CPU s (median, all threads), "
    f"Blender {bpy.app.version_string}",
    flush=True,
)
