"""The job type for Flamenco: compiled by its documented interface, its tasks run by workers that are killed."""

import json
import random
import shutil
import subprocess
import sys
import threading
from pathlib import Path

import pytest
from acting_models import steady

NODE = shutil.which("node") or shutil.which("nodejs")
HERE = Path(__file__).resolve().parent
JOB_TYPE = HERE.parent.parent / "scripts" / "farm" / "flipfree_uv.js"
PROGRAM = f"{sys.executable} {HERE / 'acting_models.py'}"

pytestmark = pytest.mark.skipif(NODE is None, reason="no node: it runs the job type's JavaScript")


def compiled(**settings):
    done = subprocess.run(
        [NODE, HERE / "flamenco.js", JOB_TYPE, json.dumps(settings)],
        capture_output=True,
        text=True,
        timeout=60,
    )
    if done.returncode:
        raise ValueError(done.stderr)
    return json.loads(done.stdout)


def test_a_task_for_each_share_and_one_that_joins_them():
    tasks = compiled(
        inputs='models "more models"', out="/uv", results="/r", shares=3, options="--suffix .obj"
    )
    assert [task["name"] for task in tasks[:3]] == [f"share {i} of 3" for i in (1, 2, 3)]
    (command,) = tasks[1]["commands"]
    assert command["name"] == "exec" and command["parameters"]["exe"] == "{blender}"
    arguments = command["parameters"]["args"]
    assert arguments[:3] == ["-b", "-c", "flipfree"]
    assert arguments[3:6] == ["unwrap", "models", "more models"]
    assert arguments[arguments.index("--shard") + 1] == "2/3"
    assert "--resume" in arguments and "--memory" not in arguments
    assert arguments[-2:] == ["--suffix", ".obj"]
    assert tasks[3]["dependencies"] == [0, 1, 2]


def test_check_has_no_outputs():
    arguments = compiled(inputs="m", out="/uv", results="/r", command="check")[0]["commands"][0]
    assert "--out" not in arguments["parameters"]["args"]


@pytest.mark.parametrize("wrong", [{"inputs": " "}, {"shares": 0}, {"command": "fold"}])
def test_settings_that_make_no_sense_are_refused(wrong):
    with pytest.raises(ValueError):
        compiled(**{"inputs": "m", "out": "/uv", "results": "/r"} | wrong)


def test_workers_that_are_killed_lose_nothing(tmp_path, monkeypatch, package_for_children):
    monkeypatch.chdir(tmp_path)
    for name in ("in", "r"):
        Path(name).mkdir()
    kinds = ["sleep 0.2", "refuse", "sleep 0.4", "fail", "write"]
    for i in range(20):
        Path(f"in/m{i:02}.in").write_text(kinds[i % len(kinds)])
    whole = [*PROGRAM.split(), "in", "--out", "whole", "--json", "whole.jsonl", "--timeout", "600"]
    assert subprocess.run([*whole, "--quiet"], timeout=100).returncode == 0
    tasks = compiled(inputs="in", out="out", results="r", shares=3, program=PROGRAM)
    chance, kills = random.Random(11), []

    def work(task):
        """A worker whose machine may die; the manager then queues the task again."""
        parameters = task["commands"][0]["parameters"]
        # The models of this test have one command only, which needs no name.
        words = [parameters["exe"], *(a for a in parameters["args"] if a != "unwrap")]
        for patience in (chance.uniform(0.5, 1.0), chance.uniform(0.5, 1.0), 100.0):
            process = subprocess.Popen(words, stderr=subprocess.DEVNULL)
            try:
                assert process.wait(patience) == 0
                return
            except subprocess.TimeoutExpired:
                process.kill()
                process.wait()
                kills.append(task["name"])

    threads = [threading.Thread(target=work, args=(task,)) for task in tasks[:3]]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert len(kills) >= 2
    join = tasks[3]["commands"][0]["parameters"]
    subprocess.run([join["exe"], *join["args"]], check=True)
    found = steady("r/results.jsonl", ignored=["command"])
    assert found == steady("whole.jsonl", ignored=["command"], folder="whole")
