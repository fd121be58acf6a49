# SPDX-License-Identifier: GPL-3.0-or-later
"""What may happen to a session while a solver runs: saving, undo, mode changes, deleting, loading, quitting."""

import itertools
import os
import subprocess
from pathlib import Path

import bpy
import numpy as np
import shapes
from stage import invoke, modal, part, press, running, show, undo, until, wait_for_end

controls, refresh = part("views.controls"), part("views.refresh")


class held:
    """Runs go through the timer and do not end before `release`, however fast the machine is."""

    def __enter__(self):
        self._advance = modal.Run.advance
        modal.Run.advance = lambda run, seconds: False
        # So that a job is there for whoever looks.
        make = modal.Run.__init__

        def with_job(run, *arguments, **options):
            make(run, *arguments, **options)
            while run._job is None or isinstance(run._job, modal.Pause):
                if self._advance(run, 0.0):
                    break

        self._make, modal.Run.__init__ = make, with_job
        return self

    def release(self):
        modal.Run.advance, modal.Run.__init__ = self._advance, self._make

    def __exit__(self, *_):
        self.release()


_started = itertools.count()


def started():
    """In `held`: a run that has begun, and its object."""
    yield from show("Layout")
    ob = shapes.grid(30, uv=True)
    # Undo brings other tests' objects back: none has this name.
    ob.name = f"Started {next(_started)}"
    bpy.ops.ed.undo_push(message="Created")
    bpy.ops.ed.undo_push(message="Before")
    assert invoke() == {"RUNNING_MODAL"}
    yield 0.3
    assert running()
    return ob


def with_process():
    """The run that is solved in a process of its own; it starts once the mesh is read."""
    yield from until(
        lambda: any(run.process_id is not None for run in modal.live_runs), "no process is started"
    )
    (run,) = [run for run in modal.live_runs if run.process_id is not None]
    return run


def test_saving_during_a_run_stores_the_old_map_and_the_run_goes_on():
    with held():
        ob = yield from started()
        before = shapes.uv_of(ob)
        path = Path(bpy.app.tempdir) / "saved.blend"
        bpy.ops.wm.save_as_mainfile(filepath=str(path), copy=True)
        assert running()
    yield from wait_for_end()
    assert shapes.exact_flips(ob) == 0 and not np.array_equal(shapes.uv_of(ob), before)
    with bpy.data.libraries.load(str(path)) as (found, into):
        into.meshes = list(found.meshes)
    (stored,) = into.meshes
    assert np.array_equal(shapes._uv(stored, None), before)
    bpy.data.meshes.remove(stored)


def test_undo_during_a_run_neither_crashes_nor_corrupts():
    with held():
        ob = yield from started()
        name, before = ob.name, shapes.uv_of(ob)
        undo()
        yield 0.3
    yield from wait_for_end()
    found = bpy.data.objects[name]
    assert not running()
    assert np.array_equal(shapes.uv_of(found), before) or shapes.exact_flips(found) == 0


def test_a_mode_change_during_a_run_is_no_obstacle():
    with held():
        ob = yield from started()
        before = shapes.uv_of(ob)
        bpy.ops.object.mode_set(mode="EDIT")
    yield from wait_for_end()
    bpy.ops.object.mode_set(mode="OBJECT")
    assert shapes.exact_flips(ob) == 0 and not np.array_equal(shapes.uv_of(ob), before)


def test_a_mesh_that_changes_during_a_run_is_left_alone():
    with held():
        ob = yield from started()
        shapes.enter("EDIT")
        bpy.ops.mesh.quads_convert_to_tris()
        bpy.ops.object.mode_set(mode="OBJECT")
        before = shapes.everything(ob)
    yield from wait_for_end()
    assert shapes.everything(ob) == before


def test_another_file_during_a_run_ends_the_solver():
    with held():
        yield from started()
        (job,) = [run._job for run in modal.live_runs if run._job is not None]
        controls.switch("distortion", True)
        refresh.look(at_once=True)
        assert refresh.entries
        bpy.ops.wm.read_homefile(app_template="")
        assert job.wait(0.0), "the solver outlives its file"
    assert not running()

    def only_what_there_is():
        return {entry.name for entry in refresh.entries.values()} <= set(bpy.data.objects.keys())

    yield from until(only_what_there_is, "objects of the other file are still drawn")
    controls.switch_off()
    bpy.context.preferences.view.show_splash = False


def test_escape_ends_the_process_that_solves():
    yield from show("Layout")
    shapes.slow()
    assert invoke() == {"RUNNING_MODAL"}
    run = yield from with_process()
    process = run._process._process
    yield 0.4
    press("ESC")
    yield from wait_for_end(10.0)
    yield from until(lambda: process.poll() is not None, "the process outlives Esc", 10.0)


def test_a_killed_blender_takes_its_solver_along():
    blender, script = os.environ["FLIPFREE_BLENDER"], Path(__file__).with_name("quitting.py")
    command = [blender, "-p", "0", "0", "400", "300", "--python", str(script), "--", "stay"]
    log = Path(bpy.app.tempdir) / "killed.log"
    with log.open("w") as file:
        process = subprocess.Popen(command, stdout=file, stderr=subprocess.STDOUT)
    yield from until(lambda: "SOLVER" in log.read_text(), log.read_text, 120.0)
    solver = Path("/proc", log.read_text().split("SOLVER ")[1].split()[0])
    assert "flipfree.process" in (solver / "cmdline").read_text()
    process.kill()
    process.wait()
    yield from until(lambda: not solver.exists(), "the solver outlives Blender", 20.0)


def test_blender_quits_during_a_run():
    """In a Blender of its own; it has to end by itself, with the status of one that quits at rest."""
    blender, script = os.environ["FLIPFREE_BLENDER"], Path(__file__).with_name("quitting.py")

    def status(*arguments):
        command = [blender, "-p", "0", "0", "400", "300", "--python", str(script), "--", *arguments]
        log = Path(bpy.app.tempdir) / f"quit-{'-'.join(arguments)}.log"
        with log.open("w") as file:
            process = subprocess.Popen(command, stdout=file, stderr=subprocess.STDOUT)
        yield from until(lambda: process.poll() is not None, log.read_text, 120.0)
        return process.returncode, log.read_text()

    at_rest, text = yield from status("rest")
    assert "QUITTING" in text, text
    during, text = yield from status("run")
    assert "QUITTING" in text and "RUNNING" in text, text
    assert during == at_rest, text
