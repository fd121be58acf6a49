# SPDX-License-Identifier: GPL-3.0-or-later
"""The driver that runs solver jobs: cancelling, failing, ending. What needs a window is in window/."""

import time
from types import SimpleNamespace

import pytest
import shapes

pytestmark = pytest.mark.halved


@pytest.fixture
def big_run(unwrapping):
    """A run that takes seconds, just started, and its object."""
    ob = shapes.slow()
    run = unwrapping(ob)
    assert run.advance(0.05) is False, "too small a mesh for this test"
    yield ob, run
    run.close()


def test_cancelling_stops_soon_and_changes_nothing(big_run):
    ob, run = big_run
    before = shapes.everything(ob)
    run.cancel()
    deadline = time.monotonic() + 10.0
    while not run.advance(0.05):
        assert time.monotonic() < deadline
    assert run.cancelled and not run.done and not run.failures
    assert shapes.everything(ob) == before


def test_progress_never_falls_and_names_object_and_stage(big_run):
    ob, run = big_run
    seen = []
    while not run.advance(0.02):
        seen.append(run.progress())
    fractions = [fraction for _, fraction in seen]
    assert len(set(fractions)) > 3 and fractions == sorted(fractions)
    assert all(text.startswith("Grid: ") for text, _ in seen if text)
    assert 0.0 <= fractions[0] and fractions[-1] <= 1.0


def test_accepting_takes_the_map_as_it_is(big_run):
    ob, run = big_run
    before = shapes.everything(ob)
    run.accept()
    while not run.advance(0.05):
        pass
    assert run.accepted and run.ended_early and len(run.done) == 1 and not run.failures
    run.finish()
    assert shapes.everything(ob) != before and shapes.exact_flips(ob) == 0
    assert run.done[0].certificate.ok


def test_accepting_counts_for_all_objects_that_are_left(unwrapping):
    objects = [shapes.grid(30, f"Grid{i}", bump=3.0, uv=True) for i in range(3)]
    run = unwrapping(*objects)
    run.accept()
    while not run.advance(0.05):
        pass
    assert len(run.done) == 3 and run.ended_early
    assert all(task.result.stats["time_limit_reached"] for task in run.done)


def test_return_accepts_and_escape_still_cancels(part):
    pressed = []
    operator = part("modal").SolverOperator()
    operator._run = SimpleNamespace(
        accept=lambda: pressed.append("accept"), cancel=lambda: pressed.append("cancel")
    )
    for key in ("RET", "NUMPAD_ENTER", "ESC", "A"):
        event = SimpleNamespace(type=key, value="PRESS")
        assert operator.modal(None, event) == {"RUNNING_MODAL"}
    operator.modal(None, SimpleNamespace(type="RET", value="RELEASE"))
    assert pressed == ["accept", "accept", "cancel"]


def test_closing_ends_the_solvers_thread(big_run, part):
    _, run = big_run
    job = run._job
    part("modal").close_all()
    assert job.wait(0.0)


def test_an_object_that_was_renamed_meanwhile_gets_its_map(solved):
    ob = shapes.grid(4, uv=True)
    before = shapes.uv_of(ob)
    run = solved(ob)
    ob.name = "Renamed"
    run.finish()
    assert len(run.done) == 1 and (shapes.uv_of(ob) != before).any()


def test_another_object_of_the_same_name_is_left_alone(solved):
    import bpy

    ob = shapes.grid(4, uv=True)
    run = solved(ob)
    bpy.data.objects.remove(ob)
    bpy.context.view_layer.update()
    other = shapes.grid(4, uv=True)
    assert other.name == "Grid"
    before = shapes.everything(other)
    run.finish()
    assert not run.done and "deleted" in str(run.failures[0])
    assert shapes.everything(other) == before


def test_an_unexpected_error_ends_the_timer_and_the_solver(part):
    ended = []

    class Broken:
        def advance(self, seconds):
            raise ZeroDivisionError

        def close(self):
            ended.append("solver")

    operator = part("modal").SolverOperator()
    operator._run, operator._timer = Broken(), "timer"
    context = SimpleNamespace(
        window_manager=SimpleNamespace(event_timer_remove=ended.append),
        workspace=SimpleNamespace(status_text_set=ended.append),
    )
    with pytest.raises(ZeroDivisionError):
        operator.modal(context, SimpleNamespace(type="TIMER", value="NOTHING"))
    assert ended == ["solver", "timer", None]
