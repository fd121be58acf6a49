"""What the ticks of a run take of Blender's own thread on a large mesh: CPU seconds, on a machine however busy.

    blender -b --python benchmarks/blender_tick_cpu.py -- [FACES TO A SIDE [never | always [OPERATOR ...]]]

OPERATOR: unwrap, check, pack or improve; all four by default, one after the other on the same mesh, so that each has the map of
the one before. The extension must be enabled. Beside it blender_tick.py, which asks a window's clock and so counts drawing and
Blender's own undo step as well.
"""

import os
import sys
import time
from pathlib import Path

import bpy

sys.path.insert(0, str(Path(__file__).resolve().parent))

from blender_sheet import EXTENSION, TASKS, arguments, part, sheet  # noqa: E402

GIVEN = arguments()
SIDE = int(GIVEN[0]) if GIVEN else 1000
SEPARATE = GIVEN[1] if len(GIVEN) > 1 else "never"
NAMES = GIVEN[2:] or list(TASKS)


def of_thread(call):
    """(what it returns, CPU seconds of this thread)."""
    begin = time.thread_time()
    found = call()
    return found, time.thread_time() - begin


def ticks_of(name, ob):
    """CPU seconds of each step that reads, of each tick that solves, of each that writes and reports."""
    module, task_name, options = TASKS[name]
    modal, module = part("modal"), part(module)

    class Quiet(modal.SolverOperator):
        verb = name

        def report(self, _, text):
            print(f"  {text}", flush=True)

        def summary(self, tasks):
            return module.summary(tasks)

    def start():
        snapshot = yield from part("meshes.mesh_io").reading(ob, only_selected=False)
        yield
        layout = part("operators.layout").joint_of(bpy.context, [snapshot])
        task = getattr(module, task_name)(snapshot, **options)
        return modal.Run([task], [], layout=None if name == "check" else layout)

    operator = Quiet()
    operator._beginning = start()
    reading, solving, writing = [], [], []
    while operator._run is None:
        (_, operator._run), seconds = of_thread(lambda: modal._moment(operator._beginning, 0.0))
        reading.append(seconds)
    run, ended = operator._run, False
    while not ended:
        ended, seconds = of_thread(lambda: run.advance(0.0))
        solving.append(seconds)
        time.sleep(0.02)
    operator._conclusion = operator._conclude(run)
    status = None
    while status is None:
        status, seconds = of_thread(operator._go_on)
        writing.append(seconds)
    assert status == {"FINISHED"}, status
    return reading, solving, writing


def longest(ticks):
    return ", ".join(f"{seconds:.3f}" for seconds in sorted(ticks, reverse=True)[:4])


bpy.context.preferences.addons[EXTENSION].preferences.separate = SEPARATE
ob = sheet(SIDE)
print(
    f"{len(ob.data.polygons)} faces, separate process: {SEPARATE}, Blender {bpy.app.version_string}"
)
for name in NAMES:
    reading, solving, writing = ticks_of(name, ob)
    print(
        f"{name}: longest of {len(reading)} ticks that read: {longest(reading)} CPU s; of {len(solving)} that solve: {longest(solving)}; "
        f"of {len(writing)} that write and report: {longest(writing)}",
        flush=True,
    )
os._exit(0)
