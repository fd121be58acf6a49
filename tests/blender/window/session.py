# SPDX-License-Identifier: GPL-3.0-or-later
"""Tests that need a window, run by a timer of a real Blender:

    blender --enable-event-simulate --python session.py -- REPORT [SHOTS [WORD ...]]

Each test is a generator: it yields the seconds that Blender shall go on (drawing, timers, events) before its next line. REPORT is
a JUnit file. With SHOTS, a folder, pictures of the screen are put there (needs ImageMagick's `import`); some are those of
docs/images. With WORDs, only tests run whose names have one of them. Without, each test runs in one of two Blenders
(tests/sampling.py), or with FLIPFREE_LONG=1 in both.
"""

import os
import sys
import time
import traceback
import xml.etree.ElementTree as ET
from pathlib import Path

import bpy

HERE = Path(__file__).parent
sys.path[:0] = [str(HERE), str(HERE.parent), str(HERE.parent.parent)]
sys.dont_write_bytecode = True

import menus  # noqa: E402
import pins  # noqa: E402
import robust  # noqa: E402
import solving  # noqa: E402
import stage  # noqa: E402
import views  # noqa: E402

import sampling  # noqa: E402

TESTS = [
    function
    for module in (solving, menus, views, pins, robust)
    for name, function in vars(module).items()
    if name.startswith("test_") and (not stage.WORDS or any(word in name for word in stage.WORDS))
]
if not stage.WORDS:
    TESTS = sampling.halved(TESTS, "windows")


def run_all():
    suite = ET.Element("testsuite", name="window")
    bpy.context.preferences.view.show_splash = False
    # Software would smooth what nobody looks at in a quarter of the time of all tests.
    if stage.SHOTS is None:
        system = bpy.context.preferences.system
        system.viewport_aa = "OFF"
        system.use_overlay_smooth_wire = system.use_edit_mode_smooth_wire = False
    yield 0.5
    for test in TESTS:
        case = ET.SubElement(suite, "testcase", name=test.__name__, classname="window")
        start = time.monotonic()
        try:
            stage.reset()
            yield from test()
        except Exception:
            ET.SubElement(case, "failure", message="see text").text = traceback.format_exc()
            print(test.__name__, traceback.format_exc())
            for run in list(stage.modal.live_runs):
                run.close()
            yield 0.5
        case.set("time", f"{time.monotonic() - start:.3f}")
    ET.ElementTree(suite).write(stage.REPORT)
    sys.stdout.flush()
    os._exit(0)


steps = run_all()
bpy.app.timers.register(lambda: next(steps), first_interval=1.5, persistent=True)
