"""How long a window's session stands still while an operator works on a million faces.

    xvfb-run -a BLENDER -p 0 0 1280 800 --python benchmarks/blender_tick.py -- [FACES TO A SIDE [never | always [OPERATOR ...]]]

OPERATOR: unwrap, check, pack or improve; all four by default, one after the other on the same mesh. The extension must be
enabled. Two clocks: of each tick of the operator (its own seconds, and CPU seconds of Blender's thread), and of a timer that asks
to be called at once, from one call to the next: drawing, other timers, events and Blender's undo step are part of that. Without a
graphics card drawing is most of it; the same session is measured first with the mesh at rest and drawn again.
"""

import os
import sys
import time
import traceback
from pathlib import Path

import bpy

sys.path.insert(0, str(Path(__file__).resolve().parent))

from blender_sheet import EXTENSION, TASKS, arguments, part, sheet  # noqa: E402

GIVEN = arguments()
SIDE = int(GIVEN[0]) if GIVEN else 1000
SEPARATE = GIVEN[1] if len(GIVEN) > 1 else "always"
NAMES = GIVEN[2:] or list(TASKS)

gaps = []  # (end, seconds) between two calls of the timer
ticks = []  # (begin, seconds, CPU seconds) of the operator's own
last = None


def beat():
    global last
    now = time.perf_counter()
    if last is not None:
        gaps.append((now, now - last))
    last = now
    return 0.0


def time_ticks():
    """Puts a clock around what Blender calls at each tick."""
    driver = part("modal").SolverOperator
    modal = driver.modal

    def timed(self, context, event):
        begin, cpu = time.perf_counter(), time.thread_time()
        status = modal(self, context, event)
        if event.type == "TIMER":
            ticks.append((begin, time.perf_counter() - begin, time.thread_time() - cpu))
        return status

    driver.modal = timed


def view():
    window = bpy.context.window_manager.windows[0]
    area = next(a for a in window.screen.areas if a.type == "VIEW_3D")
    region = next(r for r in area.regions if r.type == "WINDOW")
    return bpy.context.temp_override(window=window, area=area, region=region)


def longest(found):
    return ", ".join(f"{seconds:.3f} at {at:.1f}" for seconds, at in sorted(found)[::-1][:3])


def steps():
    bpy.context.preferences.view.show_splash = False
    bpy.context.preferences.addons[EXTENSION].preferences.separate = SEPARATE
    runs = part("modal").live_runs
    time_ticks()
    yield 0.5
    ob = sheet(SIDE)
    yield 3.0
    bpy.app.timers.register(beat, first_interval=0.0)
    yield 0.5
    gaps.clear()
    begin = time.perf_counter()
    for _ in range(6):
        ob.data.update_tag()
        yield 0.5
    print(
        f"{len(ob.data.polygons)} faces, separate process: {SEPARATE}, Blender {bpy.app.version_string}"
    )
    print(f"at rest, drawn again: {longest([(d, t - begin) for t, d in gaps])}", flush=True)
    for name in NAMES:
        gaps.clear()
        ticks.clear()
        begin = time.perf_counter()
        options = TASKS[name][2]
        with view():
            status = getattr(bpy.ops.uv, f"flipfree_{name}")("INVOKE_DEFAULT", **options)
        invoked = time.perf_counter() - begin
        assert status == {"RUNNING_MODAL"}, status
        while any(
            operator.bl_idname == f"UV_OT_flipfree_{name}" for operator in running_operators()
        ):
            yield 0.05
        ended = time.perf_counter()
        yield 2.0
        assert not any(run.failures for run in runs)
        later = [t for t in ticks if t[0] >= begin + 1.0]
        print(
            f"{name}: invoke {invoked:.2f} s, {ended - begin:.1f} s in all; of {len(later)} ticks after the first second the longest "
            f"take {longest([(d, t - begin) for t, d, _ in later])} s; in CPU s {longest([(c, t - begin) for t, _, c in later])}; "
            f"the session stood still for {longest([(d, t - d - begin) for t, d in gaps if t - d >= begin + 1.0])} s",
            flush=True,
        )
    os._exit(0)


def running_operators():
    return [
        operator
        for window in bpy.context.window_manager.windows
        for operator in window.modal_operators
    ]


def step():
    try:
        return next(running)
    except BaseException:
        traceback.print_exc()
        sys.stdout.flush()
        os._exit(1)


running = steps()
bpy.app.timers.register(step, first_interval=1.5)
