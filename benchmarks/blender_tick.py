# SPDX-License-Identifier: GPL-3.0-or-later
"""How long a window's session stands still while a million faces are unwrapped.

    xvfb-run -a BLENDER -p 0 0 1280 800 --python benchmarks/blender_tick.py -- [FACES TO A SIDE [never | always]]

The extension must be enabled. A timer that asks to be called at once measures from one call to the next: drawing, other
timers and events are part of it. Without a graphics card the first drawings are most of it; the same session is measured first
with the mesh at rest and drawn again.
"""

import os
import sys
import time
import traceback

import bpy
import numpy as np

arguments = sys.argv[sys.argv.index("--") + 1 :] if "--" in sys.argv else []
SIDE = int(arguments[0]) if arguments else 1000
SEPARATE = arguments[1] if len(arguments) > 1 else "always"
EXTENSION = "bl_ext.user_default.flipfree_uv"

gaps = []  # (end, seconds)
last = None


def beat():
    global last
    now = time.perf_counter()
    if last is not None:
        gaps.append((now, now - last))
    last = now
    return 0.0


def sheet():
    bpy.data.batch_remove(list(bpy.data.objects))
    bpy.ops.mesh.primitive_grid_add(x_subdivisions=SIDE, y_subdivisions=SIDE)
    mesh = bpy.context.object.data
    places = np.empty((len(mesh.vertices), 3), np.float32)
    mesh.vertices.foreach_get("co", places.ravel())
    places[:, 2] = 0.1 * np.sin(9 * places[:, 0]) * np.cos(7 * places[:, 1])
    mesh.vertices.foreach_set("co", places.ravel())
    mesh.update()
    return mesh


def view():
    window = bpy.context.window_manager.windows[0]
    area = next(a for a in window.screen.areas if a.type == "VIEW_3D")
    region = next(r for r in area.regions if r.type == "WINDOW")
    return bpy.context.temp_override(window=window, area=area, region=region)


def shown(label, begin, end, marks=(0.0, 1.0, 4.0)):
    """The longest gaps that began after each of these seconds."""
    for mark in marks:
        found = [(d, t - begin) for t, d in gaps if t - d >= begin + mark and t <= end]
        longest = ", ".join(f"{d:.3f} s at {t:.1f}" for d, t in sorted(found, reverse=True)[:4])
        print(f"{label}, from {mark:.0f} s on: {longest or 'none'}", flush=True)


def steps():
    bpy.context.preferences.view.show_splash = False
    preferences = bpy.context.preferences.addons[EXTENSION].preferences
    preferences.separate = SEPARATE
    runs = sys.modules[f"{EXTENSION}.modal"].live_runs
    yield 0.5
    mesh = sheet()
    yield 3.0
    bpy.app.timers.register(beat, first_interval=0.0)
    yield 0.5
    gaps.clear()
    begin = time.perf_counter()
    for _ in range(6):
        mesh.update_tag()
        yield 0.5
    shown("at rest, drawn again", begin, time.perf_counter(), (0.0,))
    gaps.clear()
    begin = time.perf_counter()
    with view():
        assert bpy.ops.uv.flipfree_unwrap("INVOKE_DEFAULT") == {"RUNNING_MODAL"}
    print(f"invoke: {time.perf_counter() - begin:.2f} s for {len(mesh.polygons)} faces", flush=True)
    solving = begin
    while any(run._job is not None for run in runs):
        solving = time.perf_counter()
        yield 0.02
    ended = time.perf_counter()
    shown("while it solves", begin, solving)
    yield 2.0
    print(
        f"solved in {solving - begin:.1f} s; the last tick, which writes: {ended - solving:.2f} s"
    )
    sys.stdout.flush()
    os._exit(0)


def step():
    try:
        return next(running)
    except Exception:
        traceback.print_exc()
        sys.stdout.flush()
        os._exit(1)


running = steps()
bpy.app.timers.register(step, first_interval=1.5)
