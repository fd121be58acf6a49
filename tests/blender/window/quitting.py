# SPDX-License-Identifier: GPL-3.0-or-later
"""Quits Blender, "rest": at rest, or "run": while a solver runs; "stay": solves and waits to be killed. Started by robust.py."""

import importlib
import sys
from pathlib import Path

import bpy

sys.path.insert(0, str(Path(__file__).parents[1]))
sys.dont_write_bytecode = True

import shapes  # noqa: E402


def context():
    window = bpy.context.window_manager.windows[0]
    area = next(a for a in window.screen.areas if a.type == "VIEW_3D")
    region = next(r for r in area.regions if r.type == "WINDOW")
    return bpy.context.temp_override(window=window, area=area, region=region)


def start():
    if sys.argv[-1] in ("run", "stay"):
        shapes.slow()
        with context():
            assert bpy.ops.uv.flipfree_unwrap("INVOKE_DEFAULT") == {"RUNNING_MODAL"}
        modal = importlib.import_module("bl_ext.user_default.flipfree_uv.modal")
        bpy.app.timers.register(lambda: wait_for_solver(modal))
        return
    bpy.app.timers.register(stop, first_interval=1.0)


def wait_for_solver(modal):
    """It starts once the mesh is read."""
    found = [run for run in modal.live_runs if run.process_id is not None]
    if not found:
        return 0.1
    print("RUNNING\nSOLVER", found[0].process_id, "", flush=True)
    if sys.argv[-1] != "stay":
        bpy.app.timers.register(stop, first_interval=1.0)
    return None


def stop():
    print("QUITTING", flush=True)
    with context():
        bpy.ops.wm.quit_blender()


bpy.app.timers.register(start, first_interval=1.5)
