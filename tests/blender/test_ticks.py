# SPDX-License-Identifier: GPL-3.0-or-later
"""What a run does on Blender's own thread comes in ticks: between jobs, and while it writes."""

from types import SimpleNamespace

import bmesh
import bpy
import numpy as np
import pytest
import shapes


class Done:
    """A job that has ended."""

    def __init__(self, result):
        self._result = result

    def wait(self, seconds):
        return True

    def result(self):
        return self._result

    def cancel(self):
        pass


@pytest.fixture
def in_steps(part, monkeypatch):
    """No tick does more than one step, and no slice of an edited mesh has more than three faces."""
    monkeypatch.setattr(part("runs.run"), "MOMENT", 0.0)
    monkeypatch.setattr(part("modal"), "MOMENT", 1e-9)
    monkeypatch.setattr(part("meshes.writing.edit_mode"), "_SLICE", 3)


def staged(part, ob, log, stages=4):
    class Staged(part("modal").StagedTask):
        def stages(self):
            for k in range(stages):
                log.append((yield Done(k)))

        def write(self, ob):
            log.append("written")

    return Staged(part("meshes.mesh_io").read(ob, only_selected=False))


def test_a_tick_takes_one_step_between_jobs(part, in_steps):
    log = []
    run = part("modal").Run([staged(part, shapes.grid(2, uv=True), log)])
    ticks = 0
    while not run.advance(0.0):
        ticks += 1
        assert len(log) <= ticks
    assert log == [0, 1, 2, 3] and ticks >= 8
    assert len(run.done) == 1


def test_cancelling_between_two_jobs_leaves_what_they_found(part, in_steps):
    log = []
    run = part("modal").Run([staged(part, shapes.grid(2, uv=True), log)])
    while not log:
        assert not run.advance(0.0)
    run.cancel()
    while not run.advance(0.0):
        pass
    run.finish()
    assert run.cancelled and not run.done and log[0] == 0 and "written" not in log


def test_cancelling_between_two_jobs_starts_none_any_more(part, in_steps, monkeypatch, unwrapping):
    started = []
    monkeypatch.setattr(part("solver"), "unwrap", lambda *_, **__: started.append(1))
    run = unwrapping(shapes.grid(4, uv=True), seams="auto")
    while not isinstance(run._job, part("modal").Pause):
        assert not run.advance(0.0)
    run.cancel()
    assert run.advance(0.0) and run.cancelled and not run.done and not started


def begun(part, *arguments):
    """Writing UVs, some slices of them done."""
    writing = part("meshes.mesh_io").writing_uv(*arguments)
    for _ in range(9):
        next(writing)
    return writing


def edited(uv=True):
    ob = shapes.grid(6, uv=uv)
    shapes.enter("EDIT")
    return ob


def new_values(part, ob):
    """(snapshot, loops, other UVs for all of them)."""
    snapshot = part("meshes.mesh_io").read(ob, only_selected=False)
    loops = np.arange(len(snapshot.uv))
    return snapshot, loops, (snapshot.uv + np.float32(0.25)).astype(np.float32)


def _edited_uv(ob):
    bm = bmesh.from_edit_mesh(ob.data)
    layer = bm.loops.layers.uv.active
    return np.array([loop[layer].uv for face in bm.faces for loop in face.loops], np.float32)


def test_an_edited_mesh_is_written_slice_by_slice_and_all_of_it_in_the_end(part, in_steps):
    ob = edited()
    snapshot, loops, values = new_values(part, ob)
    steps = 0
    for _ in part("meshes.mesh_io").writing_uv(ob, snapshot, loops, values):
        steps += 1
    assert steps > len(ob.data.polygons) // 3
    assert np.array_equal(_edited_uv(ob), values)
    bpy.ops.object.mode_set(mode="OBJECT")
    assert np.array_equal(shapes.uv_of(ob), values)


@pytest.mark.parametrize("uv", [True, False])
def test_writing_that_is_given_up_leaves_no_mesh_half_written(part, in_steps, uv):
    ob = edited(uv)
    snapshot, loops, values = new_values(part, ob)
    before = snapshot.uv.copy()
    writing = begun(part, ob, snapshot, loops, values)
    assert not np.array_equal(_edited_uv(ob), before), "nothing was written yet"
    writing.close()
    bpy.ops.object.mode_set(mode="OBJECT")
    assert bool(ob.data.uv_layers) == uv
    if uv:
        assert np.array_equal(shapes.uv_of(ob), before)


def test_a_mesh_that_leaves_edit_mode_meanwhile_gets_its_map_back(part, in_steps):
    ob = edited()
    snapshot, loops, values = new_values(part, ob)
    before = snapshot.uv.copy()
    writing = begun(part, ob, snapshot, loops, values)
    bpy.ops.object.mode_set(mode="OBJECT")
    with pytest.raises(part("meshes.mesh_io").MeshProblem, match="changed while"):
        list(writing)
    assert np.array_equal(shapes.uv_of(ob), before)


def test_a_mesh_that_changes_meanwhile_is_said_and_not_written_further(part, in_steps):
    ob = edited()
    snapshot, loops, values = new_values(part, ob)
    writing = begun(part, ob, snapshot, loops, values)
    bm = bmesh.from_edit_mesh(ob.data)
    bm.faces.ensure_lookup_table()
    bmesh.ops.delete(bm, geom=[bm.faces[0]], context="FACES")
    bmesh.update_edit_mesh(ob.data)
    with pytest.raises(part("meshes.mesh_io").MeshProblem, match="changed while"):
        list(writing)
    bpy.ops.object.mode_set(mode="OBJECT")


def test_an_object_that_is_removed_while_others_are_written_is_a_failure_not_a_crash(
    in_steps, solved
):
    first, second = shapes.grid(3, "First", uv=True), shapes.grid(3, "Second", uv=True)
    run = solved(first, second)
    writing = run.writing()
    next(writing)
    bpy.data.objects.remove(second)
    list(writing)
    assert len(run.done) == 1 and "deleted" in str(run.failures[0])


class Operator:
    """What Blender calls at each tick, with a window's parts that only count."""

    def __init__(self, part, run):
        self.said = []
        driver = part("modal").SolverOperator()
        driver._run, driver._timer = run, "timer"
        driver.bl_label, driver.summary = "Unwrap", lambda tasks: "all is well"
        driver.between = driver.advice = driver.hint = lambda tasks: ""
        driver.report = lambda kind, text: self.said.append((kind, text))
        self.driver = driver
        self.context = SimpleNamespace(
            window_manager=SimpleNamespace(event_timer_remove=lambda timer: None),
            workspace=SimpleNamespace(status_text_set=lambda text: self.said.append(text)),
        )

    def event(self, kind="TIMER", value="NOTHING"):
        return self.driver.modal(self.context, SimpleNamespace(type=kind, value=value))


def test_writing_goes_on_tick_by_tick_and_escape_is_too_late_then(part, in_steps, unwrapping):
    ob = edited()
    run = unwrapping(ob, seams="auto")
    operator = Operator(part, run)
    ticks = 0
    while (status := operator.event()) == {"RUNNING_MODAL"}:
        if operator.driver._conclusion is not None:
            ticks += 1
            operator.event("ESC", "PRESS")
    assert status == {"FINISHED"} and ticks > 10
    assert any(isinstance(text, str) and "writing" in text for text in operator.said)
    assert any("all is well" in text[1] for text in operator.said if isinstance(text, tuple))
    bpy.ops.object.mode_set(mode="OBJECT")
    assert not run.cancelled and shapes.exact_flips(ob) == 0


def test_a_file_that_is_closed_while_it_is_written_keeps_its_map(part, in_steps, unwrapping):
    ob = edited()
    before = _edited_uv(ob)
    run = unwrapping(ob, seams="auto")
    operator = Operator(part, run)
    for _ in range(10_000):
        operator.event()
        if not np.array_equal(_edited_uv(ob), before):
            break
    assert operator.driver._conclusion is not None
    operator.driver.cancel(operator.context)
    assert np.array_equal(_edited_uv(ob), before)
    bpy.ops.object.mode_set(mode="OBJECT")


@pytest.mark.parametrize("mode", ["OBJECT", "EDIT"])
def test_a_uv_map_that_was_renamed_meanwhile_is_said_and_nothing_is_written(part, in_steps, mode):
    ob = edited() if mode == "EDIT" else shapes.grid(6, uv=True)
    snapshot, loops, values = new_values(part, ob)
    ob.data.uv_layers[0].name = "Another"
    before = shapes.uv_of(ob, "Another")
    with pytest.raises(part("meshes.mesh_io").MeshProblem, match="changed while"):
        part("meshes.mesh_io").write_uv(ob, snapshot, loops, values)
    assert np.array_equal(shapes.uv_of(ob, "Another"), before)


def test_other_uv_maps_may_come_and_go_while_one_is_written(part, in_steps):
    ob = edited()
    ob.data.uv_layers.new(name="Second")
    ob.data.uv_layers.active_index = 1
    snapshot, loops, values = new_values(part, ob)
    writing = begun(part, ob, snapshot, loops, values)
    ob.data.uv_layers.remove(ob.data.uv_layers[0])
    list(writing)
    assert np.array_equal(shapes.uv_of(ob, "Second"), values)


def test_an_object_that_is_removed_while_it_is_written_is_a_failure(in_steps, solved):
    for ob in (shapes.grid(6, uv=True), edited()):
        run = solved(ob)
        writing = run.writing()
        next(writing)
        bpy.data.objects.remove(ob)
        list(writing)
        assert not run.done and "deleted" in str(run.failures[0])


class Reading(Operator):
    """Begins with what an operator of ours reads."""

    def __init__(self, part):
        super().__init__(part, None)
        values = SimpleNamespace(
            needs_uv=False,
            joint_layout=True,
            values=lambda context: {},
            make_task=lambda snapshot: part("operators.unwrap").UnwrapTask(snapshot),
        )
        read = part("operators.options").MapOperator.make_run
        self.driver.make_run = lambda context: read(values, context)
        self.driver._beginning = self.driver._start(bpy.context)


def test_reading_comes_in_ticks(part, in_steps):
    objects = [shapes.grid(6, name, uv=True) for name in ("First", "Second")]
    before = [shapes.uv_of(ob) for ob in objects]
    for ob in objects:
        ob.select_set(True)
    operator = Reading(part)
    ticks = 0
    while operator.driver._run is None:
        assert operator.event() == {"RUNNING_MODAL"}
        ticks += 1
    assert ticks > 5 and any("reading" in text for text in operator.said)
    while operator.event() == {"RUNNING_MODAL"}:
        pass
    for ob, uv in zip(objects, before, strict=True):
        assert not np.array_equal(shapes.uv_of(ob), uv) and shapes.exact_flips(ob) == 0


def test_escape_while_it_is_read_leaves_everything_as_it_was(part, in_steps):
    ob = edited()
    before, meshes = _edited_uv(ob), len(bpy.data.meshes)
    operator = Reading(part)
    for _ in range(2):
        operator.event()
    assert operator.event("ESC", "PRESS") == {"CANCELLED"}
    assert operator.said[-1][1].startswith("Cancelled") and operator.said[-2] is None
    assert np.array_equal(_edited_uv(ob), before) and len(bpy.data.meshes) == meshes


def test_what_is_removed_before_it_is_read_is_passed_over(part, in_steps):
    for name in ("First", "Second"):
        shapes.grid(3, name, uv=True).select_set(True)
    bpy.data.objects["First"].select_set(True)
    operator = Reading(part)
    operator.event()
    gone = next(ob for ob in bpy.context.selected_objects if ob.name == "Second")
    bpy.data.objects.remove(gone)
    while (status := operator.event()) == {"RUNNING_MODAL"}:
        pass
    assert status == {"FINISHED"}


def test_nothing_to_read_is_said_once_and_ends_it(part, in_steps):
    ob = edited()
    bpy.ops.mesh.select_all(action="DESELECT")
    operator = Reading(part)
    while (status := operator.event()) == {"RUNNING_MODAL"}:
        pass
    assert status == {"CANCELLED"} and "selected" in operator.said[-2][1]
    assert ob.mode == "EDIT"


def test_the_certificate_is_kept_for_the_object_that_was_renamed_not_for_another(part, solved):
    certificates = part("certificates")
    certificates.forget()
    first, second = shapes.grid(3, "First", uv=True), shapes.grid(3, "Second", uv=True)
    run = solved(first)
    first.name, second.name = "Third", "First"
    run.finish()
    for _ in certificates.remember(run.done, "Unwrap"):
        pass
    assert certificates.of(first) is not None and certificates.of(second) is None


def test_islands_are_moved_one_after_another_in_ticks(part, in_steps):
    ob = shapes.grid(40, uv=True)  # every face an island of its own
    shapes.set_uv(ob, np.random.default_rng(1).random((len(ob.data.loops), 2), np.float32))
    task = part("operators.arrange.density").DensityTask(
        part("meshes.mesh_io").read(ob, only_selected=False), density=10.0
    )
    pauses = sum(1 for _ in task._placed(task.snapshot.corner_uv.astype(np.float64)))
    assert pauses > 1000 and task.moved > 1000
