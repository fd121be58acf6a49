"""Calls in a process of their own: the same results, and what becomes of the caller when that process dies."""

import copy
import dataclasses
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest

import flipfree as ff
from flipfree.process import client

from surfaces import bumpy_grid

#: On Windows every signal is an end at once.
KILL = getattr(signal, "SIGKILL", signal.SIGTERM)

posix_only = pytest.mark.skipif(os.name != "posix", reason="signals")


def sheet(n, bump=0.3):
    return bumpy_grid(n, n, bump)


@pytest.fixture
def process():
    process = client.SolverProcess()
    yield process
    process.close()


@pytest.fixture
def slow(process):
    """A call that takes seconds, in the middle of it."""
    job = process.start("unwrap", *sheet(300, 6.0), seams="given")
    until(lambda: job.wait(0.0) or job.progress()[1] > 0.0)
    assert not job.ended, "too small a mesh for this test"
    return job


def until(condition, seconds=60.0):
    deadline = time.monotonic() + seconds
    while not condition():
        assert time.monotonic() < deadline
        time.sleep(0.02)


def is_there(pid):
    try:
        state = Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[0]
    except OSError:
        return False
    return state != "Z"


def same(one, other):
    """Bit for bit, but for what clocks say."""
    if dataclasses.is_dataclass(one):
        assert type(one) is type(other)
        for field in dataclasses.fields(one):
            same(getattr(one, field.name), getattr(other, field.name))
    elif isinstance(one, np.ndarray):
        assert one.dtype == other.dtype and one.shape == other.shape
        assert one.tobytes() == other.tobytes()
        assert one.flags.writeable == other.flags.writeable
        assert type(one) is type(other)
        same(getattr(one, "__dict__", {}), getattr(other, "__dict__", {}))
    elif isinstance(one, dict):
        assert one.keys() == other.keys()
        for key in one:
            if "second" not in str(key):
                same(one[key], other[key])
    elif isinstance(one, (list, tuple)):
        assert len(one) == len(other)
        for a, b in zip(one, other, strict=True):
            same(a, b)
    else:
        assert one == other or (one != one and other != other)


def test_results_are_the_same_bit_for_bit(process):
    vertices, faces = sheet(12)
    here = ff.unwrap(vertices, faces, pins={0: (0.1, 0.2), 100: (0.8, 0.9)})
    there = process.start("unwrap", vertices, faces, pins={0: (0.1, 0.2), 100: (0.8, 0.9)}).result()
    same(here, there)
    first = process.pid
    field = process.start("cross_field", vertices, faces).result()
    same(ff.cross_field(vertices, faces), field)
    same(
        ff.field_aligned(vertices, faces, field=field),
        process.start("field_aligned", vertices, faces, field=field).result(),
    )
    same(ff.auto_seams(vertices, faces), process.start("auto_seams", vertices, faces).result())
    suggested = process.start("suggest_cones", *sheet(12, 2.0), bound=1.2).result()
    assert len(suggested.cones)
    same(ff.suggest_cones(*sheet(12, 2.0), bound=1.2), suggested)
    same(copy.deepcopy(suggested), suggested)
    assert process.pid == first and first != os.getpid()


def test_exceptions_come_with_their_places(process):
    vertices, faces = sheet(4)
    vertices[7, 0] = np.nan
    with pytest.raises(ff.InvalidInput) as here:
        ff.unwrap(vertices, faces)
    with pytest.raises(ff.InvalidInput) as there:
        process.start("unwrap", vertices, faces).result()
    assert str(there.value) == str(here.value)
    assert (there.value.code, there.value.kind, there.value.elements) == (
        here.value.code,
        "vertex",
        [7],
    )
    target = {12: (0.5, 0.5), 13: (0.5, 0.5)}
    with pytest.raises(ff.Infeasible) as there:
        process.start("unwrap", *sheet(4), pins=target).result()
    with pytest.raises(ff.Infeasible) as here:
        ff.unwrap(*sheet(4), pins=target)
    assert here.value.witness and there.value.witness == here.value.witness


def test_what_is_no_error_of_the_solver_is_one_of_the_packages(process):
    with pytest.raises(ff.NotConverged, match="unexpected keyword") as caught:
        process.start("unwrap", *sheet(2), no_such_option=1).result()
    assert caught.value.code == "internal error"
    assert process.start("unwrap", *sheet(2)).result().certificate.ok


def test_progress_is_heard_of_and_never_falls(process):
    job = process.start("unwrap", *sheet(80, 3.0), seams="given")
    seen = [job.progress()[1]]
    while not job.wait(0.02):
        seen.append(job.progress()[1])
    assert seen == sorted(seen) and len(set(seen)) > 3
    assert job.result().certificate.ok


def test_a_result_is_handed_out_once(process):
    job = process.start("unwrap", *sheet(2))
    job.result()
    with pytest.raises(ff.InvalidInput, match="already collected"):
        job.result()


@posix_only
def test_writing_to_a_dead_process_is_no_signal():
    """Inside Blender, where nothing ignores SIGPIPE, it would end the session."""
    script = (
        "import os, signal, subprocess, sys\nfrom flipfree.process import client\n"
        "signal.signal(signal.SIGPIPE, signal.SIG_DFL)\n"
        "child = subprocess.Popen([sys.executable, '-c', ''], bufsize=0, stdin=subprocess.PIPE)\n"
        "child.wait()\nassert not client.send(child.stdin, b'hello')\n"
        "assert signal.SIGPIPE not in signal.pthread_sigmask(signal.SIG_BLOCK, [])\n"
        "child.stdin.close()\nassert not client.send(child.stdin, b'hello')\nprint('alive')\n"
    )
    search = str(Path(ff.__file__).parents[1])
    found = subprocess.run(
        [sys.executable, "-c", script],
        env={**os.environ, "PYTHONPATH": search},
        capture_output=True,
        text=True,
    )
    assert found.stdout == "alive\n" and found.returncode == 0, found.stderr


@posix_only
@pytest.mark.parametrize("number", [KILL, signal.SIGSEGV])
def test_a_killed_process_is_an_error_and_the_next_call_has_a_new_one(process, slow, number):
    killed = process.pid
    os.kill(killed, number)
    assert slow.wait(30.0)
    with pytest.raises(
        ff.NotConverged, match=f"signal {int(number)} .*solve the mesh in parts"
    ) as e:
        slow.result()
    assert e.value.code == client.ENDED
    assert ("memory ran out" in str(e.value)) == (number == KILL)
    assert process.start("unwrap", *sheet(2)).result().certificate.ok
    assert process.pid != killed and not is_there(killed)


def test_cancelling_ends_the_process_at_once(process, slow):
    pid = process.pid
    slow.cancel()
    assert slow.wait(0.0)
    with pytest.raises(ff.Cancelled):
        slow.result()
    until(lambda: not is_there(pid), 10.0)
    assert process.start("unwrap", *sheet(2)).result().certificate.ok


def test_accepting_takes_the_map_as_it_is(slow):
    slow.accept()
    result = slow.result()
    assert result.stats["time_limit_reached"] == 1 and result.certificate.ok


def test_a_limit_of_time_holds_there(process):
    with pytest.raises(ff.NotConverged) as error:
        process.start("unwrap", *sheet(300, 6.0), max_seconds=0.01).result()
    assert error.value.code == "time limit reached"


def test_a_call_that_was_let_go_of_does_not_delay_the_next(process, slow):
    pid = process.pid
    assert process.start("unwrap", *sheet(2)).result().certificate.ok
    assert process.pid != pid


@pytest.mark.skipif(sys.platform != "linux", reason="looks into /proc")
@pytest.mark.parametrize("since", [0.0, -1.0])
def test_it_ends_and_tidies_up_when_its_parent_is_killed(since):
    """In the middle of a call, and while it starts."""
    script = (
        "from test_process import sheet\nfrom flipfree.process import client\n"
        "process = client.SolverProcess()\njob = process.start('unwrap', *sheet(300, 6.0))\n"
        f"while not job.progress()[1] > {since}: assert not job.wait(0.01)\n"
        "print(process.pid, process._process.folder, flush=True)\njob.wait(600)\n"
    )
    search = os.pathsep.join([str(Path(ff.__file__).parents[1]), *sys.path])
    parent = subprocess.Popen(
        [sys.executable, "-c", script],
        stdout=subprocess.PIPE,
        text=True,
        env={**os.environ, "PYTHONPATH": search},
    )
    pid, folder = parent.stdout.readline().split()
    assert is_there(pid)
    parent.kill()
    parent.wait()
    parent.stdout.close()
    until(lambda: not is_there(pid) and not Path(folder).exists(), 10.0)


def test_closing_stdin_ends_it_and_removes_its_files(process, slow):
    """What it sees where the system cannot end it together with its parent."""
    pid, folder = process.pid, process._process.folder
    process._process.stdin.close()
    until(lambda: not is_there(pid) and not folder.exists(), 10.0)


@pytest.mark.parametrize(
    "command", [("/nowhere/python",), (sys.executable, "-c", "raise SystemExit(3)")]
)
def test_without_a_process_calls_are_refused_or_solved_here(command):
    vertices, faces = sheet(4)
    with pytest.raises(ff.NotConverged, match="No process could be started") as error:
        client.SolverProcess(command).start("unwrap", vertices, faces).result()
    assert error.value.code == client.NOT_STARTED
    process = client.SolverProcess(command, or_here=True)
    for _ in range(2):
        found = process.start("unwrap", vertices, faces)
        same(found.result(), ff.unwrap(vertices, faces))
    assert process.solved_here
    if not Path(command[0]).exists():  # the system's own words name no command
        assert str(error.value).count(command[0]) and process.solved_here.startswith(command[0])
    with pytest.raises(ff.InvalidInput):
        process.start("unwrap", vertices, faces + 100).result()


def test_what_python_says_at_its_end_is_part_of_the_error():
    command = (sys.executable, "-c", "import sys; sys.exit('no such module')")
    with pytest.raises(ff.NotConverged, match="no such module"):
        client.SolverProcess(command).start("unwrap", *sheet(2)).result()


def test_the_files_are_gone_afterwards():
    process = client.SolverProcess()
    result = process.start("unwrap", *sheet(4)).result()
    folder = process._process.folder
    assert folder.exists() and not list(folder.glob("*-1"))
    process.close()
    assert not folder.exists()
    assert result.uv.sum() > 0.0  # and the result stays
