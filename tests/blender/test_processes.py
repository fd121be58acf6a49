# SPDX-License-Identifier: GPL-3.0-or-later
"""Solving in a process of its own: the same maps, and what a session sees when that process dies."""

import os
import signal
import sys
import time

import bpy
import numpy as np
import pytest
import shapes

#: On Windows every signal is an end at once.
KILL = getattr(signal, "SIGKILL", signal.SIGTERM)
ENDED_BY = "signal" if os.name == "posix" else "status"

pytestmark = pytest.mark.sample(6)  # a Blender of its own each


@pytest.fixture
def wanted(part):
    """wanted("always"): sets the preference; it is taken back."""
    preferences = bpy.context.preferences.addons[part("preferences").__package__].preferences

    def choose(separate, triangles=100_000):
        preferences.separate, preferences.separate_from = separate, triangles

    yield choose
    choose("above")


@pytest.fixture
def processes_started(part, monkeypatch):
    """Ids of the processes that runs have used."""
    found = set()
    client = part("runs.processes").client.SolverProcess
    start = client.start

    def noting(process, *arguments, **options):
        job = start(process, *arguments, **options)
        found.add(process.pid)
        return job

    monkeypatch.setattr(client, "start", noting)
    return found


def pinned_grid():
    """Its corners pinned where they are, one of them moved."""
    ob = shapes.grid(8, uv=True)
    assert bpy.ops.uv.flipfree_unwrap() == {"FINISHED"}
    corner = shapes.corners(ob)
    uv = shapes.uv_of(ob)
    uv[corner == 80] += np.float32([0.01, 0.02])
    shapes.set_uv(ob, uv)
    shapes.set_pins(ob, np.isin(corner, [0, 8, 72, 80]))
    return ob


def torus():
    return shapes.primitive("torus", major_segments=16, minor_segments=8, minor_radius=0.4)


RUNS = {
    "auto_seams": shapes.cube,
    "unwrap": lambda: shapes.monkey(1),
    "match": pinned_grid,
    "improve": pinned_grid,
    "repair": shapes.two_sheets,
    "pack": shapes.two_sheets,
    "check": shapes.two_sheets,
    "suggest_cones": torus,
    "conformal": lambda: shapes.grid(6, bump=0.8),
    "seamless": torus,
    "field_aligned": torus,
}


@pytest.mark.parametrize("name", RUNS)
def test_every_operator_gives_the_same_bits_in_a_process(name, wanted, processes_started):
    found = []
    for choice in ("never", "always"):
        bpy.data.batch_remove(list(bpy.data.objects))
        bpy.context.view_layer.update()
        wanted(choice)
        ob = RUNS[name]()
        operator = getattr(bpy.ops.uv, f"flipfree_{name}")
        processes_started.clear()
        assert operator() == {"FINISHED"}
        assert bool(processes_started) == (choice == "always")
        groups = [[(g.group, g.weight) for g in v.groups] for v in ob.data.vertices]
        found.append((shapes.everything(ob), shapes.selection(ob), groups))
    assert found[0] == found[1]


def test_it_takes_meshes_from_a_size_on(part, wanted, unwrapping):
    ob = shapes.grid(8, uv=True)
    tasks = unwrapping(ob)._waiting
    for choice, size, expected in (
        ("never", 1, False),
        ("above", 129, False),
        ("above", 128, True),
        ("always", 10_000, True),
    ):
        wanted(choice, size)
        assert (part("runs.processes").of(tasks) is not None) == expected


def begun(run):
    """A run whose process has begun to solve."""
    deadline = time.monotonic() + 60.0
    while not run.advance(0.02) and run.progress()[1] == 0.0:
        assert time.monotonic() < deadline
    assert run.process_id not in (None, os.getpid()), "too small a mesh for this test"
    return run


@pytest.mark.parametrize("number", [KILL, signal.SIGSEGV])
def test_a_killed_solver_leaves_blender_the_mesh_and_the_selection(number, unwrapping):
    ob = shapes.slow()
    before, chosen = shapes.everything(ob), shapes.selection(ob)
    run = begun(unwrapping(ob))
    os.kill(run.process_id, number)
    assert run.advance(30.0)
    run.finish()
    (failure,) = run.failures
    text = str(failure)
    assert "Grid: the surface was not finished, because its solver's process ended" in text
    assert "Close other programs" in text and f"{ENDED_BY} {int(number)}" in text
    assert not run.done and not failure.has_place
    assert shapes.everything(ob) == before and shapes.selection(ob) == chosen


def test_the_other_objects_of_a_run_get_their_maps(part, wanted, monkeypatch):
    wanted("always")
    large, small = shapes.slow("Large"), shapes.grid(8, "Small", uv=True)
    large.select_set(True)
    before, small_before = shapes.everything(large), shapes.everything(small)
    advance = part("modal").Run.advance
    killed = []

    def killing(run, seconds):
        ended = advance(run, 0.02)
        if run._task is not None and run._task.snapshot.object_name == "Large":
            if run.progress()[1] > 0.0 and not killed:
                killed.append(run.process_id)
                os.kill(run.process_id, KILL)
        return ended

    monkeypatch.setattr(part("modal").Run, "advance", killing)
    assert bpy.ops.uv.flipfree_unwrap() == {"FINISHED"}
    assert killed and shapes.everything(large) == before
    assert shapes.everything(small) != small_before and shapes.exact_flips(small) == 0


def test_the_process_ends_with_its_run_and_with_the_extension(part, wanted, unwrapping):
    wanted("always")
    ob = shapes.grid(8, uv=True)
    run = unwrapping(ob)
    while not run.advance(0.02):
        process = run._process._process
    assert process.wait(10.0) is not None and run.process_id is None
    run = begun(unwrapping(shapes.slow()))
    process = run._process._process
    part("modal").close_all()
    assert process.wait(10.0) is not None


def test_without_a_process_it_is_solved_in_blender_or_refused(part, wanted, monkeypatch, solved):
    monkeypatch.setattr(part("runs.processes"), "command", lambda: ["/nowhere/python"])
    ob = shapes.grid(8, uv=True)
    before = shapes.everything(ob)
    wanted("always")
    with pytest.raises(RuntimeError, match="Separate Process to Never"):
        bpy.ops.uv.flipfree_unwrap()
    assert shapes.everything(ob) == before
    wanted("above", 1)
    said = []
    operator = part("operators.unwrap").UV_OT_flipfree_unwrap
    monkeypatch.setattr(
        part("certificates"), "remember", lambda tasks, verb: said.append(verb) or ()
    )
    assert bpy.ops.uv.flipfree_unwrap() == {"FINISHED"}
    assert shapes.exact_flips(ob) == 0 and shapes.everything(ob) != before
    assert said == [operator.bl_label]
    run = solved(ob)
    assert "/nowhere/python" in run.solved_here


def test_it_is_this_blenders_python(part):
    import subprocess

    code = "import sys; print(sys.version_info[:2])"
    found = subprocess.run(
        [*part("runs.processes").command(), "-c", code], capture_output=True, text=True, check=True
    )
    assert found.stdout.strip() == str(sys.version_info[:2])
