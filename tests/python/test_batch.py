"""Batches of models that crash, hang, eat memory; that are killed, and go on."""

import json
import os
import random
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest
from acting_models import records, steady

#: On Windows every signal is an end at once.
KILL = getattr(signal, "SIGKILL", signal.SIGTERM)

DRIVER = Path(__file__).with_name("acting_models.py")


@pytest.fixture
def here(tmp_path, monkeypatch, package_for_children):
    monkeypatch.chdir(tmp_path)
    Path("in").mkdir()
    return tmp_path


def put(**contents):
    for name, text in contents.items():
        Path(f"in/{name}.in").write_text(text)


def start(*arguments):
    return subprocess.Popen(
        [sys.executable, DRIVER, *map(str, arguments)],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )


def batch(*arguments):
    process = start(*arguments)
    out, err = process.communicate(timeout=120)
    return process.returncode, out, err


ALL = ("in", "--out", "out", "--json", "results.jsonl")


def test_every_model_has_a_line_that_says_what_became_of_it(here):
    put(a="write", b="refuse", c="fail", d="bug", e="crash", f="write")
    status, _, said = batch(*ALL)
    assert status == 0
    found = records()
    assert {name: line["status"] for name, line in found.items()} == {
        "a": "certified",
        "b": "refused",
        "c": "failed",
        "d": "failed",
        "e": "failed",
        "f": "certified",
    }
    assert found["b"]["place"] == {"kind": "vertex", "elements": [3]}
    assert "--max-seconds" in found["c"]["message"]
    assert "KeyError" in found["d"]["message"] and "bug" in found["d"]["message"]
    how = "SIGSEGV" if os.name == "posix" else "0xc0000005"
    assert how in found["e"]["message"] and found["e"]["reason"] == "crash"
    for line in found.values():
        assert {"hash", "seconds", "versions", "options", "command", "output"} <= set(line)
    assert {name for name, line in found.items() if line["written"]} == {"a", "f"}
    assert {line["written"] for line in found.values()} == {True, False}
    assert found["a"]["peak_memory"] > 1
    assert sorted(p.name for p in Path("out").iterdir()) == ["a.in", "f.in"]
    assert "2 certified, 1 refused, 3 failed" in said and "[6/6]" in said


def test_a_model_that_hangs_or_eats_memory_is_ended_alone(here):
    put(a="hang", b="eat", c="write", d="write")
    status, _, _ = batch(*ALL, "--timeout", 10, "--memory", 300, "--jobs", 2)
    assert status == 0
    found = records()
    assert (found["a"]["reason"], found["b"]["reason"]) == ("timeout", "memory")
    assert "--timeout" in found["a"]["message"] and "--memory" in found["b"]["message"]
    assert found["b"]["peak_memory"] > 300
    assert found["c"]["status"] == found["d"]["status"] == "certified"


def test_what_one_model_leaves_behind_costs_no_other_one(here):
    put(a="write", b="after", c="write")
    assert batch(*ALL)[0] == 0
    assert {line["status"] for line in records().values()} == {"certified"}


def test_the_first_bad_model_ends_the_run_if_wanted(here):
    put(a="write", b="refuse", c="write")
    status, _, _ = batch(*ALL, "--no-keep-going")
    assert status == 1 and set(records()) == {"a", "b"}


def test_a_finished_run_that_is_resumed_solves_nothing(here):
    put(a="write", b="refuse", c="crash")
    batch(*ALL)
    before = Path("results.jsonl").read_text()
    status, _, said = batch(*ALL, "--resume")
    assert status == 0 and Path("results.jsonl").read_text() == before
    assert "3 of 3 models are done already" in said


def test_results_are_never_overwritten_unasked(here):
    put(a="write")
    batch(*ALL)
    status, _, said = batch(*ALL)
    assert status == 2 and "--resume" in said and len(records()) == 1


def test_changed_inputs_and_options_and_lost_outputs_are_solved_again(here):
    put(a="write", b="write", c="write")
    batch(*ALL)
    put(a="write more")
    Path("out/b.in").unlink()
    _, _, said = batch(*ALL, "--resume")
    assert "1 of 3 models are done already" in said
    assert Path("out/a.in").read_text() == "write more" and Path("out/b.in").exists()
    assert len(Path("results.jsonl").read_text().splitlines()) == 3
    _, _, said = batch(*ALL, "--resume", "--mark", "!")
    assert "done already" not in said and Path("out/c.in").read_text() == "write!"
    assert len(Path("results.jsonl").read_text().splitlines()) == 3


def test_failures_are_tried_again_with_other_limits_or_on_request(here):
    put(a="sleep 8", b="once flag")
    batch(*ALL, "--timeout", 4)
    assert records()["a"]["reason"] == "timeout" and records()["b"]["reason"] == "crash"
    batch(*ALL, "--timeout", 4, "--resume")
    assert records()["b"]["reason"] == "crash"
    batch(*ALL, "--timeout", 4, "--resume", "--retry")
    assert records()["a"]["reason"] == "timeout" and records()["b"]["status"] == "certified"
    batch(*ALL, "--timeout", 60, "--resume")
    assert records()["a"]["status"] == "certified"


def test_a_line_that_was_cut_off_is_solved_again(here):
    put(a="write", b="write")
    batch(*ALL)
    whole = steady()
    text = Path("results.jsonl").read_text()
    Path("results.jsonl").write_text(text[: len(text) - 40])
    assert batch(*ALL, "--resume")[0] == 0
    assert steady() == whole


def test_shards_together_give_what_one_run_gives(here):
    put(**{f"m{i}": "write" if i % 3 else "refuse" for i in range(10)})
    batch(*ALL)
    for i in range(1, 4):
        batch("in", "--out", "out", "--json", f"part{i}.jsonl", "--shard", f"{i}/3")
    lines = sum((steady(f"part{i}.jsonl") for i in range(1, 4)), [])
    assert sorted(lines, key=lambda line: line["input"]) == steady()


def children_of(pid):
    found = []
    for stat in Path("/proc").glob("[0-9]*/stat"):
        try:
            fields = stat.read_text().rpartition(")")[2].split()
        except OSError:
            continue
        if int(fields[1]) == pid:
            found.append(int(stat.parent.name))
    return found


def alive(pid):
    try:
        return Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[0] != "Z"
    except OSError:
        return False


@pytest.mark.skipif(not sys.platform.startswith("linux"), reason="looks into /proc")
def test_children_of_a_killed_run_die_with_it(here):
    put(a="hang", b="hang")
    process = start(*ALL, "--jobs", 2)
    deadline = time.monotonic() + 60
    while len(children := children_of(process.pid)) < 2:
        assert time.monotonic() < deadline
        time.sleep(0.05)
    time.sleep(1.0)  # they have asked the system to be ended with their parent
    process.kill()
    process.communicate()
    while any(map(alive, children)):
        assert time.monotonic() < deadline
        time.sleep(0.05)


@pytest.mark.sample(1)
@pytest.mark.parametrize("seed", range(3))
def test_a_run_that_is_killed_at_any_moment_and_resumed_gives_the_same_results(here, seed):
    kinds = ["write", "refuse", "fail", "sleep 0.1", "sleep 0.3", "bug"]
    put(**{f"m{i:02}": kinds[i % len(kinds)] for i in range(16)} | {"crash": "crash"})
    batch("in", "--out", "whole", "--json", "whole.jsonl", "--jobs", 2)
    chance = random.Random(seed)
    kills = 0
    for _ in range(20):
        process = start(*ALL, "--jobs", 2, "--resume")
        try:
            process.communicate(timeout=chance.uniform(0.2, 1.0))
            break
        except subprocess.TimeoutExpired:
            process.send_signal(KILL)
            process.communicate()
            kills += 1
    assert batch(*ALL, "--jobs", 2, "--resume")[0] == 0
    assert kills > 0
    assert steady() == steady("whole.jsonl", folder="whole")
    written = {p.name: p.read_text() for p in Path("out").glob("*.in")}
    assert written == {p.name: p.read_text() for p in Path("whole").glob("*.in")}


def test_an_unwritable_place_is_found_before_anything_is_solved(here):
    put(a="write")
    Path("file").touch()
    status, _, said = batch("in", "--out", "file/below", "--json", "results.jsonl")
    assert status == 2 and "is a file, not a folder" in said and not Path("results.jsonl").exists()
    status, _, said = batch("in", "--out", "out", "--json", "file/results.jsonl")
    assert status == 2 and "results cannot be written" in said and not Path("out").exists()


@pytest.mark.skipif(sys.platform != "linux", reason="no folder that refuses its owner")
def test_a_folder_in_which_nothing_can_be_made_is_found_before_anything_is_solved(here):
    put(a="write")
    for out in ("/proc/flipfree", "/proc/self"):
        status, _, said = batch("in", "--out", out, "--json", "results.jsonl")
        assert status == 2 and "Give another --out" in said
        assert not Path("results.jsonl").exists()


def test_names_that_are_no_utf_8_are_names_like_others(here):
    put(a="write", z="write")
    name = os.fsdecode(b"caf\xe9.in")
    Path("in", name).write_text("write")
    assert batch(*ALL)[0] == 0
    assert {line["status"] for line in records().values()} == {"certified"}
    found = json.loads(Path("results.jsonl").read_bytes().splitlines()[1])
    assert (found["input"], found["output"]) == (f"in/{name}", f"out/{name}")
    assert Path(found["output"]).read_text() == "write"
    assert "3 of 3 models are done already" in batch(*ALL, "--resume")[2]
    Path("list").write_bytes(b"in/caf\xe9.in\n")
    listed = subprocess.run(
        [sys.executable, DRIVER, "@list", "--out", "out", "--list"], capture_output=True
    )
    assert listed.stdout == b"in/caf\xe9.in -> out/caf\xe9.in\n"
    assert batch("@nowhere", "--out", "out")[0] == 2


@pytest.mark.parametrize("second", ["@list", "@other"])
def test_a_list_that_names_itself_is_refused(here, second):
    put(a="write")
    Path("list").write_text(f"in/a.in\n{second}\n")
    Path("other").write_text("in/a.in\n@./list\n")
    status, _, said = batch("@list", "--out", "out")
    assert status == 2
    assert "the list names itself" in said and "Traceback" not in said


def test_a_list_may_be_named_twice(here):
    put(a="write")
    Path("list").write_text("in/a.in\n")
    Path("both").write_text("@list\n@list\n")
    assert batch("@both", "--out", "out", "--list")[0] == 0


def test_an_output_that_cannot_be_written_is_a_failure_of_the_infrastructure(here):
    put(a="write", b="write")
    Path("out/a.in").mkdir(parents=True)  # a folder where the file should be
    status, _, _ = batch(*ALL)
    assert status == 1
    assert records()["a"]["reason"] == "output cannot be written"
    assert records()["b"]["status"] == "certified"


def test_inputs_that_may_only_be_read_are_enough(here):
    put(a="write")
    Path("in/a.in").chmod(0o444)
    Path("in").chmod(0o555)
    try:
        assert batch(*ALL)[0] == 0
    finally:
        Path("in").chmod(0o755)
    assert [p.name for p in Path("in").iterdir()] == ["a.in"]


def test_an_input_that_vanishes_is_a_failure_of_its_own(here):
    put(a="write", b="write")
    Path("in/c.in").symlink_to("nowhere")
    Path("list").write_text("in/a.in\nin/b.in\n")
    status, _, _ = batch("@list", "--out", "out", "--json", "results.jsonl")
    assert status == 0 and set(records()) == {"a", "b"}
    assert batch("in/c.in", "--out", "out")[0] == 2


def test_list_says_what_would_be_done_and_does_nothing(here):
    put(a="write", b="write")
    batch("in/a.in", "--out", "out", "--json", "results.jsonl")
    status, out, _ = batch(*ALL, "--resume", "--list")
    assert status == 0 and not Path("out/b.in").exists()
    assert out.splitlines() == ["in/a.in -> out/a.in  (done)", "in/b.in -> out/b.in"]


def test_a_file_of_another_type_has_a_line_and_is_named_in_the_sum(here):
    put(a="write", c="write")
    Path("in/b.flat").write_text("write")
    status, _, said = batch(*ALL)
    assert status == 0
    found = records()
    assert [found[name]["status"] for name in "abc"] == ["certified", "refused", "certified"]
    assert found["b"]["reason"] == "file type" and "--suffix" in found["b"]["message"]
    assert "2 certified, 1 refused" in said.splitlines()[-2]
    assert said.splitlines()[-1] == "Not mapped, as files of another type: in/b.flat"
    assert "3 of 3 models are done already" in batch(*ALL, "--resume")[2]
    assert batch(*ALL, "--resume", "--suffix", ".out")[0] == 0
    assert Path("out/b.out").read_text() == "write" and records()["b"]["status"] == "certified"
    _, listed, _ = batch("in", "--out", "new", "--list")
    assert "in/b.flat  (.flat files hold no texture coordinates" in listed
    assert batch("in/b.flat", "--out", "new")[0] == 2


def test_two_runs_do_not_share_a_file_of_results(here):
    put(a="sleep 20")
    process = start(*ALL)
    try:
        deadline = time.monotonic() + 60
        while not Path("results.jsonl").exists():
            assert time.monotonic() < deadline
            time.sleep(0.05)
        status, _, said = batch(*ALL, "--resume")
        assert status == 2 and "another run" in said
    finally:
        process.kill()
        process.communicate()


def test_children_that_cannot_start_are_no_models_failure(here):
    put(a="write")
    code = (
        "import sys; sys.path.insert(0, sys.argv[1]); import acting_models as b\n"
        "from flipfree.batch.child import Engine\n"
        "b.engine_of = lambda s: Engine([sys.executable, '-c', 'print(\"no licence\")'], {}, s)\n"
        "sys.exit(b.main(sys.argv[2:]))"
    )
    process = subprocess.run(
        [sys.executable, "-c", code, DRIVER.parent, *ALL],
        capture_output=True,
        text=True,
        timeout=60,
    )
    assert process.returncode == 1 and "no licence" in process.stderr
    assert Path("results.jsonl").read_text() == ""
