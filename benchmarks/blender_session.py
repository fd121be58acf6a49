"""Runs inside a Blender that has the extension enabled: what it takes of Blender's own thread, and many objects.

    BLENDER_USER_RESOURCES=build/profile-blender-5.2 BLENDER -b --python-exit-code 1 --python benchmarks/blender_session.py -- VERB ...
    xvfb-run -a BLENDER -p 0 0 1280 800 --python benchmarks/blender_session.py -- tick ...

    tick [FACES TO A SIDE [never | always [OPERATOR ...]]]      how long a window's session stands still on a large mesh
    enable                importing the extension's modules, and registering; CPU seconds
    live [QUADS TO A SIDE]      one tick of Live Pins and one update of its solver
    scene [OBJECTS ...]         a scene of many small objects in one call; CPU seconds
    objects                     everything that Blender makes, unwrapped by Blender and by us

scripts/blender-tests.sh makes such a profile. OPERATOR: unwrap, check, pack or improve; all by default, one after the other on the same
mesh. tick asks two clocks: of each tick of the operator, and of a timer that asks to be called at once, from one call to the next, so that
drawing, other timers and Blender's undo step are part of that. scene: boxes of 12 triangles, bumpy sheets of 500. objects: triangles
with an area in the map / edges with two triangles of one island on the same side / pairs of triangles that overlap, by tests/judges;
seams: none, as a beginner would do it.
"""

import importlib
import os
import re
import sys
import time
import traceback
from pathlib import Path

import bpy
import numpy as np

EXTENSION = "bl_ext.user_default.flipfree_uv"
METHODS = ("ANGLE_BASED", "CONFORMAL", "MINIMUM_STRETCH")
OPERATORS = {"unwrap": {}, "check": {}, "pack": {}, "improve": {"iterations": 3}}
TESTS = Path(__file__).resolve().parent.parent / "tests"
sys.dont_write_bytecode = True
sys.path += [str(TESTS), str(TESTS / "python"), str(TESTS / "blender")]


def part(name):
    """A module of the extension."""
    return importlib.import_module(f"{EXTENSION}.{name}")


def say(text):
    print(text, flush=True)


def large_sheet(side):
    """The only object: side * side quads, a wavy sheet whose UVs are its plane's."""
    bpy.data.batch_remove(list(bpy.data.objects))
    bpy.ops.mesh.primitive_grid_add(x_subdivisions=side, y_subdivisions=side)
    mesh = bpy.context.object.data
    places = np.empty((len(mesh.vertices), 3), np.float32)
    mesh.vertices.foreach_get("co", places.ravel())
    places[:, 2] = 0.1 * np.sin(9 * places[:, 0]) * np.cos(7 * places[:, 1])
    mesh.vertices.foreach_set("co", places.ravel())
    mesh.update()
    return bpy.context.object


def begun(side, separate):
    bpy.context.preferences.addons[EXTENSION].preferences.separate = separate
    ob = large_sheet(int(side))
    say(f"{len(ob.data.polygons)} faces, separate process: {separate}, {bpy.app.version_string}")
    return ob


def longest(found):
    return ", ".join(f"{seconds:.3f}" for seconds in sorted(found, reverse=True)[:3])


def of_thread(call):
    """(what it returns, CPU seconds of this thread)."""
    begin = time.thread_time()
    found = call()
    return found, time.thread_time() - begin


def tick_steps(side="1000", separate="always", *names):
    """Yields how long to wait until it goes on."""
    gaps, ticks, last = [], [], [None]  # (begin, seconds, of the thread's CPU)

    def beat():
        now = time.perf_counter()
        if last[0] is not None:
            gaps.append((last[0], now - last[0], 0.0))
        last[0] = now
        return 0.0

    driver = part("modal").SolverOperator
    modal = driver.modal

    def timed(self, context, event):
        begin = time.perf_counter()
        status, cpu = of_thread(lambda: modal(self, context, event))
        if event.type == "TIMER":
            ticks.append((begin, time.perf_counter() - begin, cpu))
        return status

    driver.modal = timed
    bpy.context.preferences.view.show_splash = False
    yield 0.5
    ob = begun(side, separate)
    yield 3.0
    bpy.app.timers.register(beat, first_interval=0.0)
    yield 0.5
    gaps.clear()
    for _ in range(6):
        ob.data.update_tag()
        yield 0.5
    say(f"at rest, drawn again: {longest(d for _, d, _ in gaps)}")
    say(
        "| operator | when it is called, s | longest ticks after the first second, s | CPU s | ticks | session stood still, s |"
    )
    for name in names or OPERATORS:
        gaps.clear()
        ticks.clear()
        begin = time.perf_counter()
        window = bpy.context.window_manager.windows[0]
        area = next(a for a in window.screen.areas if a.type == "VIEW_3D")
        region = next(r for r in area.regions if r.type == "WINDOW")
        with bpy.context.temp_override(window=window, area=area, region=region):
            operator = getattr(bpy.ops.uv, f"flipfree_{name}")
            assert operator("INVOKE_DEFAULT", **OPERATORS[name]) == {"RUNNING_MODAL"}
        called = time.perf_counter() - begin
        while any(o.bl_idname == f"UV_OT_flipfree_{name}" for o in window.modal_operators):
            yield 0.05
        yield 2.0
        assert not any(run.failures for run in part("modal").live_runs)
        later, still = ([t for t in found if t[0] >= begin + 1.0] for found in (ticks, gaps))
        cells = f"{called:.2f}", longest(d for _, d, _ in later), longest(c for _, _, c in later)
        figures = *cells, len(later), longest(d for _, d, _ in still)
        say(f"| {name} | {' | '.join(map(str, figures))} |")


def tick(*arguments):
    steps = tick_steps(*arguments)

    def step():
        try:
            return next(steps)
        except BaseException as error:
            if not isinstance(error, StopIteration):
                traceback.print_exc()
            sys.stdout.flush()
            os._exit(not isinstance(error, StopIteration))

    bpy.app.timers.register(step, first_interval=1.5)


def enable():
    """With the byte code that Python keeps beside the modules; what Blender does once, unpacking the solver, is not part of it."""
    sys.modules[EXTENSION].unregister()
    for name in list(sys.modules):
        if name.startswith(EXTENSION) or name.partition(".")[0] == "flipfree":
            del sys.modules[name]
    extension, imported = of_thread(lambda: importlib.import_module(EXTENSION))
    _, registered = of_thread(extension.register)
    say(f"imported {imported:.3f}, registered {registered:.3f} CPU s")


def live(side="99"):
    """Four pins, one of which is moved by a hundredth of the map, twenty times."""
    import pinned
    import shapes

    ob, at = pinned.pinned_grid(int(side))
    place = shapes.uv_of(ob)[at[3][0]]
    session = part("live.live_pins").Session([ob])
    ticks, updates = [], []
    for i in range(20):
        pinned.move(ob, at[3], np.float32(place - 0.01 * (i + 1)))
        begin, quiet = time.process_time(), 0
        while quiet < 3:
            ticks.append(of_thread(lambda i=i: session.tick(i % 2 == 0))[1])
            quiet = quiet + 1 if session.followed[0].idle else 0
            time.sleep(0.01)
        updates.append(time.process_time() - begin)
    assert session.updates == 20 and not session.problem
    say(
        f"{2 * int(side) ** 2} triangles: longest tick {max(ticks):.3f} CPU s, update {np.median(updates):.3f} CPU s"
    )


def small_sheet(random):
    """500 triangles."""
    from surfaces import bumpy_grid

    vertices, faces = bumpy_grid(25, 10)
    x, y = vertices[:, 0], vertices[:, 1] * 0.4
    z = 0.1 * np.sin(random.uniform(2, 6) * x + random.uniform(0, 6)) * np.cos(5 * y)
    return np.stack([x, y, z], -1), faces


def box(random):
    """Of sides at random: 12 triangles."""
    corners = np.indices((2, 2, 2)).reshape(3, -1).T * random.uniform(0.2, 2.0, 3)
    sides = [[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]]
    return corners, np.array(sides)


KINDS = {"boxes": box, "sheets": small_sheet}


def selected_objects(kind, count):
    """In a scene that holds nothing else."""
    bpy.data.batch_remove(list(bpy.data.meshes))
    for seed in range(count):
        mesh = bpy.data.meshes.new(f"{kind} {seed}")
        vertices, faces = KINDS[kind](np.random.default_rng(seed))
        mesh.from_pydata(vertices.tolist(), [], faces.tolist())
        ob = bpy.data.objects.new(mesh.name, mesh)
        bpy.context.scene.collection.objects.link(ob)
        ob.select_set(True)
    bpy.context.view_layer.objects.active = ob


def cpu_of(call):
    """Seconds of all threads, and of processes that have ended."""
    begin = sum(os.times()[:4])
    call()
    return sum(os.times()[:4]) - begin


def scene(*counts):
    calls = {
        "Blender, Angle Based": lambda: by_blender("ANGLE_BASED"),
        "Auto Unwrap": bpy.ops.uv.flipfree_unwrap,
        "Pack": bpy.ops.uv.flipfree_pack,
        "Check": bpy.ops.uv.flipfree_check,
    }
    for kind in KINDS:
        selected_objects(kind, 2)
        bpy.ops.uv.flipfree_unwrap()  # a first call takes longer
    say(f"| objects | {' | '.join(calls)} |")
    for count in map(int, counts or ("200", "5000")):
        for kind in KINDS:
            selected_objects(kind, count)
            cells = [f"{cpu_of(call):.2f}" for call in calls.values()]
            say(f"| {count} {kind} | {' | '.join(cells)} |")


def judged(ob):
    """Triangles, those mapped, folded edges, pairs that overlap."""
    import shapes

    from judges.any_triangles import judge_any
    from judges.coverage import overlapping_triangles
    from judges.exact import turns

    triangles, uv = shapes.triangles_of(ob)
    points = uv.astype(np.float64)
    side = turns(points[:, 0], points[:, 1], points[:, 2])
    folded = re.search(r"(\d+) edges with", " ".join(judge_any(triangles, uv, disjoint=False)))
    pairs = overlapping_triangles(points, side.astype(np.int8))
    return len(triangles), int((side != 0).sum()), int(folded[1]) if folded else 0, len(pairs)


def by_blender(method):
    bpy.ops.object.mode_set(mode="EDIT")
    bpy.ops.mesh.reveal()
    bpy.ops.mesh.select_all(action="SELECT")
    bpy.ops.uv.unwrap(method=method, margin=0.005)
    bpy.ops.object.mode_set(mode="OBJECT")


def objects():
    from all_objects import OBJECTS

    makers = {f"Blender {method}": lambda m=method: by_blender(m) for method in METHODS}
    makers["Flipfree UV"] = bpy.ops.uv.flipfree_unwrap
    say(f"| object | triangles | {' | '.join(makers)} |")
    total = {name: [0, 0, 0] for name in makers}
    for name, make in OBJECTS.items():
        cells, count = [], 0
        for maker, unwrap in makers.items():
            for collection in (bpy.data.objects, bpy.data.meshes):
                bpy.data.batch_remove(list(collection))
            make()
            ob = bpy.context.object
            if ob.data.uv_layers.active is None:
                ob.data.uv_layers.new()
            unwrap()
            count, *figures = judged(ob)
            total[maker] = [a + b for a, b in zip(total[maker], figures, strict=True)]
            cells.append("{} / {} / {}".format(*figures))
        say(f"| {name} | {count} | {' | '.join(cells)} |")
    say(f"| all | | {' | '.join('{} / {} / {}'.format(*figures) for figures in total.values())} |")


verb, *rest = sys.argv[sys.argv.index("--") + 1 :]
VERBS = {"tick": tick, "enable": enable, "live": live, "scene": scene, "objects": objects}
VERBS[verb](*rest)
if verb != "tick":
    sys.stdout.flush()
    os._exit(0)
