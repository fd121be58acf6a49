# SPDX-License-Identifier: GPL-3.0-or-later
"""Tests that need a window, run by a timer of a real Blender:

    blender --enable-event-simulate --python session.py -- REPORT [SHOTS]

Each test is a generator: it yields the seconds that Blender shall go on (drawing, timers, events) before its next line. REPORT is
a JUnit file. With SHOTS, a folder, pictures of the screen are put there (needs ImageMagick's `import`).
"""

import os
import subprocess
import sys
import time
import traceback
import xml.etree.ElementTree as ET
from pathlib import Path

import bpy
import numpy as np

sys.path.insert(0, str(Path(__file__).parents[1]))
sys.dont_write_bytecode = True

import importlib  # noqa: E402

import shapes  # noqa: E402

modal = importlib.import_module("bl_ext.user_default.flipfree_uv.modal")
arguments = sys.argv[sys.argv.index("--") + 1 :]
REPORT = arguments[0]
SHOTS = Path(arguments[1]) if len(arguments) > 1 else None


def area_of(kind):
    window = bpy.context.window_manager.windows[0]
    for area in window.screen.areas:
        if area.type == kind:
            region = next(r for r in area.regions if r.type == "WINDOW")
            return {"window": window, "area": area, "region": region}
    raise LookupError(kind)


def show(workspace):
    """Switches to one of Blender's own workspaces; the change takes a moment."""
    bpy.context.window_manager.windows[0].workspace = bpy.data.workspaces[workspace]


def shot(name):
    if SHOTS is not None:
        bpy.ops.wm.redraw_timer(type="DRAW_WIN_SWAP", iterations=1)
        subprocess.run(["import", "-window", "root", str(SHOTS / f"{name}.png")], check=True)


def reset():
    if bpy.context.mode != "OBJECT":
        bpy.ops.object.mode_set(mode="OBJECT")
    bpy.data.batch_remove(list(bpy.data.objects))
    bpy.context.view_layer.update()


def invoke(**options):
    with bpy.context.temp_override(**area_of("VIEW_3D")):
        return bpy.ops.uv.flipfree_unwrap("INVOKE_DEFAULT", True, **options)


def simulate(kind, value="PRESS"):
    window = bpy.context.window_manager.windows[0]
    window.event_simulate(type=kind, value=value, x=window.width // 2, y=window.height // 2)


def click(x, y):
    window = bpy.context.window_manager.windows[0]
    window.event_simulate(type="MOUSEMOVE", value="NOTHING", x=x, y=y)
    window.event_simulate(type="LEFTMOUSE", value="PRESS", x=x, y=y)
    window.event_simulate(type="LEFTMOUSE", value="RELEASE", x=x, y=y)


def running():
    return any(run._job is not None for run in modal._live_runs)


def wait_for_end(seconds=120.0):
    deadline = time.monotonic() + seconds
    while running():
        assert time.monotonic() < deadline, "the operator does not end"
        yield 0.1
    yield 0.4


def test_escape_cancels_and_leaves_everything():
    ob = shapes.slow()
    before = shapes.everything(ob)
    assert invoke() == {"RUNNING_MODAL"}
    yield 0.6
    assert running(), "too small a mesh for this test"
    shot("progress")
    simulate("ESC")
    simulate("ESC", "RELEASE")
    yield from wait_for_end(10.0)
    assert shapes.everything(ob) == before
    assert not running()


def test_a_run_from_the_menu_writes_a_map_and_is_one_undo_step():
    ob = shapes.grid(60, uv=True)
    name = ob.name
    shapes.set_uv(ob, np.zeros((len(ob.data.loops), 2)))
    bpy.ops.ed.undo_push(message="Before")
    before = shapes.uv_of(ob).tobytes()
    assert invoke() <= {"RUNNING_MODAL", "FINISHED"}
    yield from wait_for_end()
    assert shapes.exact_flips(ob) == 0
    with bpy.context.temp_override(**area_of("VIEW_3D")):
        bpy.ops.ed.undo()
    yield 0.2
    ob = bpy.data.objects[name]
    assert shapes.uv_of(ob).tobytes() == before
    with bpy.context.temp_override(**area_of("VIEW_3D")):
        bpy.ops.ed.redo()
    yield 0.2
    assert shapes.exact_flips(bpy.data.objects[name]) == 0


def test_undo_in_edit_mode_is_one_step_too():
    ob = shapes.grid(40, uv=True)
    bpy.ops.object.mode_set(mode="EDIT")
    bpy.ops.mesh.select_all(action="SELECT")
    bpy.ops.ed.undo_push(message="Before")
    yield 0.2
    before = shapes.uv_of(ob).tobytes()
    assert invoke() <= {"RUNNING_MODAL", "FINISHED"}
    yield from wait_for_end()
    assert shapes.uv_of(ob).tobytes() != before
    with bpy.context.temp_override(**area_of("VIEW_3D")):
        bpy.ops.ed.undo()
    yield 0.2
    assert bpy.context.mode == "EDIT_MESH"
    assert shapes.uv_of(bpy.context.object).tobytes() == before


def test_keys_do_not_reach_the_mesh_while_solving():
    ob = shapes.slow()
    assert invoke() == {"RUNNING_MODAL"}
    yield 0.3
    assert running()
    window = bpy.context.window_manager.windows[0]
    region = area_of("VIEW_3D")["region"]
    x, y = region.x + region.width // 2, region.y + region.height // 2
    window.event_simulate(type="MOUSEMOVE", value="NOTHING", x=x, y=y)
    yield 0.2
    for key in ("X", "TAB"):
        window.event_simulate(type=key, value="PRESS", x=x, y=y)
        window.event_simulate(type=key, value="RELEASE", x=x, y=y)
    yield 0.5
    assert bpy.context.mode == "OBJECT" and ob.name in bpy.data.objects
    simulate("ESC")
    simulate("ESC", "RELEASE")
    yield from wait_for_end(10.0)


def test_the_menus_draw_the_entry():
    show("UV Editing")
    yield 0.5
    shapes.monkey(2)
    bpy.ops.object.mode_set(mode="EDIT")
    bpy.ops.mesh.select_all(action="SELECT")
    invoke(pack=True)
    yield from wait_for_end()
    with bpy.context.temp_override(**area_of("IMAGE_EDITOR")):
        bpy.ops.image.view_all(fit_view=True)
    with bpy.context.temp_override(**area_of("VIEW_3D")):
        bpy.ops.view3d.view_selected()
    yield 0.4
    hud = next(r for r in area_of("VIEW_3D")["area"].regions if r.type == "HUD")
    assert hud.width > 1, "no redo panel"
    click(hud.x + 20, hud.y + hud.height // 2)
    yield 0.5
    shot("result")
    for kind, menu in (("VIEW_3D", "VIEW3D_MT_uv_map"), ("IMAGE_EDITOR", "IMAGE_MT_uvs_unwrap")):
        region = area_of(kind)["region"]
        window = bpy.context.window_manager.windows[0]
        x, y = region.x + region.width // 3, region.y + region.height * 2 // 3
        window.event_simulate(type="MOUSEMOVE", value="NOTHING", x=x, y=y)
        yield 0.2
        with bpy.context.temp_override(**area_of(kind)):
            bpy.ops.wm.call_menu(name=menu)
        yield 0.6
        shot(f"menu_{kind.lower()}")
        simulate("ESC")
        simulate("ESC", "RELEASE")
        yield 0.3


TESTS = [function for name, function in list(globals().items()) if name.startswith("test_")]


def run_all():
    suite = ET.Element("testsuite", name="window")
    bpy.context.preferences.view.show_splash = False
    yield 0.5
    for test in TESTS:
        case = ET.SubElement(suite, "testcase", name=test.__name__, classname="window")
        try:
            reset()
            yield from test()
        except Exception:
            ET.SubElement(case, "failure", message="see text").text = traceback.format_exc()
            print(test.__name__, traceback.format_exc())
            for run in list(modal._live_runs):
                run.close()
            yield 0.5
    ET.ElementTree(suite).write(REPORT)
    sys.stdout.flush()
    os._exit(0)


steps = run_all()
bpy.app.timers.register(lambda: next(steps), first_interval=1.5)
