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
    """(reading and starting, CPU seconds of each tick that solves, of each that writes and reports)."""
    module, task_name, options = TASKS[name]
    modal, module = part("modal"), part(module)

    class Quiet(modal.SolverOperator):
        verb = name

        def report(self, _, text):
            print(f"  {text}", flush=True)

        def summary(self, tasks):
            return module.summary(tasks)

    def start():
        snapshot = part("meshes.mesh_io").read(ob, only_selected=False)
        layout = part("operators.layout").joint_of(bpy.context, [snapshot])
        task = getattr(module, task_name)(snapshot, **options)
        run = modal.Run([task], [], layout=None if name == "check" else layout)
        return run, run.advance(0.0)

    (run, ended), starting = of_thread(start)
    operator = Quiet()
    operator._run = run
    solving, writing = [], []
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
    return starting, solving, writing


def longest(ticks):
    return ", ".join(f"{seconds:.3f}" for seconds in sorted(ticks, reverse=True)[:4])


bpy.context.preferences.addons[EXTENSION].preferences.separate = SEPARATE
ob = sheet(SIDE)
print(
    f"{len(ob.data.polygons)} faces, separate process: {SEPARATE}, Blender {bpy.app.version_string}"
)
for name in NAMES:
    starting, solving, writing = ticks_of(name, ob)
    print(
        f"{name}: reading and starting {starting:.2f} CPU s; longest of {len(solving)} ticks that solve: {longest(solving)}; of "
        f"{len(writing)} that write and report: {longest(writing)}",
        flush=True,
    )
os._exit(0)
