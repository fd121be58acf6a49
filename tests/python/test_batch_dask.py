"""A batch on a real Dask scheduler with workers as processes, which are killed while they work."""

import json
import os
import random
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest
from acting_models import steady

pytest.importorskip("distributed", reason="pip install distributed: the farm of --dask")

pytestmark = pytest.mark.sample(1)  # of workers that are killed and a scheduler that is silent

DRIVER = Path(__file__).with_name("acting_models.py")
CALM = {"DASK_DISTRIBUTED__DASHBOARD__LINK": "", "DASK_LOGGING__DISTRIBUTED": "error"}


@pytest.fixture
def farm(tmp_path, package_for_children):
    """(address, workers' nannies). The nannies start new workers for those that die."""
    elsewhere = tmp_path / "elsewhere"
    elsewhere.mkdir()
    file = tmp_path / "scheduler.json"
    dask = [sys.executable, "-m", "distributed.cli."]

    def start(program, *arguments):
        return subprocess.Popen(
            [*dask[:2], dask[2] + program, *map(str, arguments)],
            cwd=elsewhere,
            env={**os.environ, **CALM},
            stderr=subprocess.DEVNULL,
            start_new_session=True,
        )

    processes = [
        start("dask_scheduler", "--host", "127.0.0.1", "--port", 0, "--no-dashboard",
              "--scheduler-file", file)
    ]  # fmt: skip
    for _ in range(2):
        processes.append(
            start("dask_worker", "--scheduler-file", file, "--nthreads", 1, "--host", "127.0.0.1",
                  "--no-dashboard", "--death-timeout", 100)
        )  # fmt: skip
    try:
        deadline = time.monotonic() + 100
        while not file.exists() or not file.read_text().strip():
            assert time.monotonic() < deadline
            time.sleep(0.1)
        yield json.loads(file.read_text())["address"], [p.pid for p in processes[1:]]
    finally:
        for process in reversed(processes):
            os.killpg(process.pid, signal.SIGKILL)
            process.wait()


def workers_of(nannies):
    """Processes of workers that live: children of the nannies that are no resource trackers."""
    found = []
    for stat in Path("/proc").glob("[0-9]*/stat"):
        try:
            parent = int(stat.read_text().rpartition(")")[2].split()[1])
            words = stat.with_name("cmdline").read_bytes()
        except OSError:
            continue
        if parent in nannies and b"spawn_main" in words:
            found.append(int(stat.parent.name))
    return found


@pytest.mark.skipif(not sys.platform.startswith("linux"), reason="looks into /proc")
def test_workers_that_are_killed_lose_nothing_and_do_nothing_twice(tmp_path, monkeypatch, farm):
    address, nannies = farm
    monkeypatch.chdir(tmp_path)
    Path("in").mkdir()
    kinds = ["sleep 0.2", "refuse", "sleep 0.5", "fail", "write", "crash"]
    for i in range(24):
        Path(f"in/m{i:02}.in").write_text(kinds[i % len(kinds)])
    whole = [sys.executable, DRIVER, "in", "--out", "whole", "--json", "whole.jsonl"]
    assert subprocess.run([*whole, "--quiet"], timeout=100).returncode == 0
    run = subprocess.Popen(
        [sys.executable, DRIVER, "in", "--out", "out", "--json", "farm.jsonl", "--dask", address],
        env={**os.environ, **CALM},
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )
    chance, kills, deadline = random.Random(7), 0, time.monotonic() + 200
    try:
        while run.poll() is None and kills < 4:
            assert time.monotonic() < deadline
            done = Path("farm.jsonl").read_text().count("\n") if Path("farm.jsonl").exists() else 0
            workers = workers_of(nannies)
            if workers and done > 4 * kills:
                os.kill(chance.choice(workers), signal.SIGKILL)
                kills += 1
            time.sleep(0.1)
        _, said = run.communicate(timeout=200)
    finally:
        run.kill()
    assert run.returncode == 0, said
    assert kills >= 3
    assert steady("farm.jsonl") == steady("whole.jsonl", folder="whole")
    assert sorted(p.name for p in Path("out").iterdir()) == sorted(
        p.name for p in Path("whole").iterdir()
    )


def test_a_scheduler_that_does_not_answer_is_no_models_failure(
    tmp_path, monkeypatch, package_for_children
):
    monkeypatch.chdir(tmp_path)
    Path("a.in").write_text("write")
    code = [sys.executable, DRIVER, "a.in", "--out", "out", "--dask", "tcp://127.0.0.1:9"]
    monkeypatch.setenv("DASK_DISTRIBUTED__COMM__TIMEOUTS__CONNECT", "2s")
    process = subprocess.run(code, capture_output=True, text=True, timeout=100)
    assert process.returncode == 1 and "no scheduler answers" in process.stderr
