# SPDX-License-Identifier: GPL-3.0-or-later
"""What the tests in a window have in common: areas, events, pictures, waiting."""

import importlib
import subprocess
import sys
import time
from pathlib import Path

import bpy


def part(name):
    """The installed extension's module of that name."""
    return importlib.import_module(f"bl_ext.user_default.flipfree_uv.{name}")


modal, watch = part("modal"), part("watch")
arguments = sys.argv[sys.argv.index("--") + 1 :]
REPORT = arguments[0]
SHOTS = Path(arguments[1]) if len(arguments) > 1 else None
WORDS = arguments[2:]


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
    yield 0.5


def shot(name):
    if SHOTS is not None:
        bpy.ops.wm.redraw_timer(type="DRAW_WIN_SWAP", iterations=1)
        subprocess.run(["import", "-window", "root", str(SHOTS / f"{name}.png")], check=True)


def reset():
    part("live.live_pins").close()
    if bpy.context.mode != "OBJECT":
        bpy.ops.object.mode_set(mode="OBJECT")
    bpy.data.batch_remove(list(bpy.data.objects))
    bpy.context.tool_settings.use_uv_select_sync = True
    bpy.context.view_layer.update()


def invoke(name="unwrap", **options):
    with bpy.context.temp_override(**area_of("VIEW_3D")):
        operator = getattr(bpy.ops.uv, f"flipfree_{name}")
        return operator("INVOKE_DEFAULT", True, **options)


class modal_from_the_start:
    """Runs go through the timer however short they are: the window shows reports of those only, not of calls that scripts
    make."""

    def __enter__(self):
        self._advance = advance = modal.Run.advance
        modal.Run.advance = lambda run, seconds: seconds == 0.0 and advance(run, seconds)

    def __exit__(self, *_):
        modal.Run.advance = self._advance


def simulate(kind, value="PRESS"):
    window = bpy.context.window_manager.windows[0]
    window.event_simulate(type=kind, value=value, x=window.width // 2, y=window.height // 2)


def press(key):
    simulate(key)
    simulate(key, "RELEASE")


def undo(kind="VIEW_3D"):
    with bpy.context.temp_override(**area_of(kind)):
        return bpy.ops.ed.undo()


def pointer(kind, x=0.5, y=0.5):
    """Moves it to this share of an area; returns the place."""
    region = area_of(kind)["region"]
    x, y = region.x + int(region.width * x), region.y + int(region.height * y)
    window = bpy.context.window_manager.windows[0]
    window.event_simulate(type="MOUSEMOVE", value="NOTHING", x=x, y=y)
    return x, y


def click(x, y):
    window = bpy.context.window_manager.windows[0]
    window.event_simulate(type="MOUSEMOVE", value="NOTHING", x=x, y=y)
    window.event_simulate(type="LEFTMOUSE", value="PRESS", x=x, y=y)
    window.event_simulate(type="LEFTMOUSE", value="RELEASE", x=x, y=y)


def running():
    """Whether an operator of ours is at work; Live Pins goes on beside all others."""
    working = [
        operator.bl_idname
        for window in bpy.context.window_manager.windows
        for operator in window.modal_operators
        if operator is not None
    ]
    ours = any(name.startswith("UV_OT_flipfree") and name != watch.LIVE for name in working)
    return ours or any(run._job is not None for run in modal.live_runs)


def wait_for_end(seconds=120.0):
    deadline = time.monotonic() + seconds
    while running():
        assert time.monotonic() < deadline, "the operator does not end"
        yield 0.1
    yield 0.4


def ended(name="unwrap", **options):
    """A run from the menu, however short it is, until it has ended."""
    assert invoke(name, **options) <= {"RUNNING_MODAL", "FINISHED"}
    yield from wait_for_end()


def timed(name="unwrap", **options):
    """The same through the timer."""
    with modal_from_the_start():
        assert invoke(name, **options) == {"RUNNING_MODAL"}
        yield 0.5
    yield from wait_for_end()


def escaped(name, after, picture=""):
    """A run that Esc ends so many seconds after its beginning."""
    assert invoke(name) == {"RUNNING_MODAL"}
    yield after
    assert running(), "too small a mesh for this test"
    if picture:
        shot(picture)
    press("ESC")
    yield from wait_for_end(10.0)
    assert not running()


def picture(name, wait=0.5):
    """Of the whole map and the whole model."""
    frame_all()
    yield wait
    shot(name)


def picture_of_options(name):
    open_redo_panel()
    yield 0.5
    shot(name)


def frame_all():
    with bpy.context.temp_override(**area_of("IMAGE_EDITOR")):
        bpy.ops.image.view_all(fit_view=True)
    with bpy.context.temp_override(**area_of("VIEW_3D")):
        bpy.ops.view3d.view_selected()


def frame_view():
    with bpy.context.temp_override(**area_of("VIEW_3D")):
        bpy.ops.view3d.view_selected()


def open_redo_panel():
    hud = next(r for r in area_of("VIEW_3D")["area"].regions if r.type == "HUD")
    assert hud.width > 1, "no redo panel"
    click(hud.x + 20, hud.y + hud.height // 2)


def ring(levels=2):
    """A torus: closed, genus 1."""
    bpy.ops.mesh.primitive_torus_add(major_segments=24, minor_segments=12, minor_radius=0.4)
    ob = bpy.context.object
    if not levels:
        return ob
    modifier = ob.modifiers.new("Subdivision", "SUBSURF")
    modifier.levels = levels
    bpy.ops.object.modifier_apply(modifier=modifier.name)
    return ob


def until(condition, what, seconds=30.0):
    """Waits for it, however busy the machine is."""
    deadline = time.monotonic() + seconds
    while not condition():
        assert time.monotonic() < deadline, what() if callable(what) else what
        yield 0.1
