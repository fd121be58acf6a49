# SPDX-License-Identifier: GPL-3.0-or-later
"""Random calls in one window, for as long as asked: operators, undo, redo, modes, selections, views, objects.

    scripts/soak.sh BLENDER NAME [SEED [CALLS]]
    PYTHON tests/blender/window/soak.py -- LOG SEED CALLS      with the package bpy: no window, so nothing is invoked or drawn

The log has the seed, a line per call, written before it is made, and memory every 25 calls. The last line is OK, or what
failed: an exception that is no refusal, a solver that goes on after its operator, flips in a map that Unwrap wrote, memory
that grows.
"""

import os
import random
import re
import sys
import time
import traceback
from pathlib import Path

import bpy  # isort: skip - it makes addon_utils importable
import addon_utils
import numpy as np

addon_utils.enable("bl_ext.user_default.flipfree_uv", default_set=True)
sys.path[:0] = [str(Path(__file__).parent), str(Path(__file__).parents[1])]
sys.dont_write_bytecode = True

import shapes  # noqa: E402
from stage import area_of, arguments, part, running, simulate  # noqa: E402

LOG = Path(arguments[0])
SEED, CALLS = int(arguments[1]), int(arguments[2])
MOST_OBJECTS = 4
# Of resident memory, from a quarter of the calls on: undo steps and caches are full by then.
MOST_GROWTH = 200  # MB
SECONDS = 120.0  # for one call

tools, state, controls = part("ui.tools"), part("views.state"), part("views.controls")
choose = random.Random(SEED)


def log(text):
    with LOG.open("a") as file:
        file.write(text + "\n")


def megabytes():
    if sys.platform == "win32":
        from flipfree.process import windows

        return windows.memory()[0]
    status = Path("/proc/self/status").read_text()
    return int(re.search(r"VmRSS:\s*(\d+)", status)[1]) / 2**10


def add_object():
    if len(bpy.data.objects) >= MOST_OBJECTS:
        return
    to_object_mode()
    make = choose.choice(
        (
            lambda: shapes.monkey(choose.randrange(2)),
            shapes.cube,
            lambda: shapes.grid(choose.randint(2, 20), uv=choose.random() < 0.5),
            bpy.ops.mesh.primitive_torus_add,
            bpy.ops.mesh.primitive_uv_sphere_add,
        )
    )
    make()
    bpy.context.object.location.x = choose.uniform(-5, 5)


def remove_object():
    to_object_mode()
    if bpy.data.objects:
        bpy.data.objects.remove(choose.choice(list(bpy.data.objects)))


def to_object_mode():
    if bpy.context.mode != "OBJECT":
        bpy.ops.object.mode_set(mode="OBJECT")


def change_mode():
    # Undo may go back to the scene that Blender starts with, where a camera can be the active one.
    if bpy.context.object is not None and bpy.context.object.type == "MESH":
        bpy.ops.object.mode_set(mode="EDIT" if bpy.context.mode == "OBJECT" else "OBJECT")


def select():
    if bpy.context.mode == "EDIT_MESH":
        bpy.ops.mesh.select_random(ratio=choose.choice((0.1, 0.5, 0.9)), seed=choose.randrange(99))
        if choose.random() < 0.3:
            bpy.ops.mesh.select_all(action="SELECT")
        return
    for ob in bpy.context.view_layer.objects:
        ob.select_set(choose.random() < 0.7)
        if choose.random() < 0.5:
            bpy.context.view_layer.objects.active = ob


def mark():
    if bpy.context.mode == "EDIT_MESH":
        call = choose.choice(
            (bpy.ops.mesh.mark_seam, bpy.ops.mesh.hide, bpy.ops.mesh.reveal, bpy.ops.uv.pin)
        )
        call()


def pin_some():
    ob = bpy.context.object
    if bpy.context.mode == "OBJECT" and ob is not None and ob.data.uv_layers.active is not None:
        shapes.set_pins(
            ob, np.random.default_rng(choose.randrange(99)).random(len(ob.data.loops)) < 0.02
        )


def undo():
    bpy.ops.ed.undo()


def redo():
    bpy.ops.ed.redo()


def show_something():
    controls.switch(choose.choice(state.ALL), choose.random() < 0.7)


def call_operator():
    """One of the table, from a menu or as scripts call it; its own options at random."""
    tool = choose.choice(tools.all_tools())
    space, name = tool.operator.split(".")
    operator = getattr(getattr(bpy.ops, space), name)
    options = random_options(operator)
    how = choose.choice(("INVOKE_DEFAULT", "EXEC_DEFAULT")[bpy.app.background :])
    log(f"  {tool.operator} {how} {options}")
    before = bpy.context.object
    result = operator(how, True, **options)
    if result == {"RUNNING_MODAL"}:
        yield from wait(choose.choice(("", "", "ESC", "RET")))
    if result == {"FINISHED"} and name == "flipfree_unwrap" and bpy.context.mode == "OBJECT":
        hidden = any(p.hide for p in before.data.polygons)
        if before.select_get() and not hidden:
            assert shapes.exact_flips(before) == 0, "Unwrap wrote a flip"


def random_options(operator):
    found = {}
    for prop in operator.get_rna_type().properties:
        if prop.identifier == "rna_type" or choose.random() < 0.6:
            continue
        if prop.type == "BOOLEAN":
            found[prop.identifier] = choose.random() < 0.5
        elif prop.type == "ENUM" and prop.enum_items:
            found[prop.identifier] = choose.choice([item.identifier for item in prop.enum_items])
    return found


def wait(key):
    deadline = time.monotonic() + SECONDS
    yield 0.2
    if key:
        simulate(key)
        simulate(key, "RELEASE")
    while running():
        if time.monotonic() > deadline:
            simulate("ESC")
            simulate("ESC", "RELEASE")
        assert time.monotonic() < deadline + 30.0, "a solver goes on"
        yield 0.1
    yield 0.1


ACTIONS = (
    *([call_operator] * 10),
    *([undo] * 3),
    *([change_mode] * 3),
    *([select] * 3),
    redo,
    add_object,
    add_object,
    remove_object,
    mark,
    pin_some,
    show_something,
)


def soak():
    LOG.write_text(f"seed {SEED}, {CALLS} calls, Blender {bpy.app.version_string}\n")
    bpy.context.preferences.edit.undo_steps = 16
    bpy.context.preferences.view.show_splash = False
    yield 0.5
    bpy.data.batch_remove(list(bpy.data.objects))
    add_object()
    bpy.ops.ed.undo_push(message="Start")
    refused, early = 0, 0.0
    for i in range(CALLS):
        action = choose.choice(ACTIONS)
        log(f"{i} {action.__name__} {bpy.context.mode}")
        steps = None
        try:
            with bpy.context.temp_override(**some_area()):
                steps = action()
                if steps is not None:
                    steps = list_until_modal(steps)
            if steps is not None:
                yield from steps
        except RuntimeError as error:
            refused += 1
            log(f"  refused: {str(error).strip().splitlines()[0][:150]}")
        if action not in (undo, redo, call_operator, show_something):
            bpy.ops.ed.undo_push(message=action.__name__)
        yield 0.05
        if i % 25 == 0:
            log(f"  memory {megabytes():.0f} MB, {len(bpy.data.meshes)} meshes")
        if i == CALLS // 4:
            early = megabytes()
    growth = megabytes() - early
    log(f"{refused} calls refused; memory {early:.0f} MB after a quarter, {growth:+.0f} MB since")
    assert growth < MOST_GROWTH, f"memory grew by {growth:.0f} MB"


def some_area():
    if bpy.app.background:
        return {}
    try:
        return area_of(choose.choice(("VIEW_3D", "VIEW_3D", "IMAGE_EDITOR")))
    except LookupError:
        return area_of("VIEW_3D")


def list_until_modal(steps):
    """Runs the call itself inside the override; what waits comes after it."""
    first = next(steps, None)
    return None if first is None else chain(first, steps)


def chain(first, steps):
    yield first
    yield from steps


def guarded():
    try:
        yield from soak()
        log("OK")
        status = 0
    except BaseException:
        log(traceback.format_exc())
        status = 1
    os._exit(status)


steps = guarded()
if bpy.app.background:
    for _ in steps:
        pass
bpy.app.timers.register(lambda: next(steps), first_interval=1.5, persistent=True)
