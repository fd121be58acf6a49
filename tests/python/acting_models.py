"""A batch whose models do what their files say: python acting_models.py COMMAND LINE (or --worker, as its own child).

A file holds words: "write", "crash", "hang", "eat" (memory), "refuse", "fail", "bug", "sleep SECONDS", "once FILE" (crashes
if FILE is not there, and makes it), "after" (crashes unless its process is fresh).
"""

import argparse
import faulthandler
import json
import os
import signal
import sys
import time
from pathlib import Path

import flipfree as ff
from flipfree.batch import arguments, child
from flipfree.batch.child import Engine
from flipfree.batch.plan import Formats, PlanError
from flipfree.batch.run import NOT_WRITTEN

FORMATS = Formats(reads=(".in", ".flat"), writes=(".in", ".out"))


def records(path="results.jsonl"):
    """{name of the input without its ending: its line}"""
    lines = [json.loads(line) for line in Path(path).read_text().splitlines()]
    return {Path(line["input"]).stem: line for line in lines}


def steady(path="results.jsonl", *, ignored=(), folder="out"):
    """Lines without what is measured, in order of the inputs; `folder`: where the outputs lie, named as if it were out."""
    lines = [json.loads(line) for line in Path(path).read_text().splitlines()]
    for line in lines:
        for name in ("seconds", "peak_memory", *ignored):
            line.pop(name, None)
        line["output"] = line["output"] and line["output"].replace(f"{folder}/", "out/")
    return sorted(lines, key=lambda line: line["input"])


def unit_of(settings):
    solved = []

    def solve(source, target):
        words = source.read_text().split()
        solved.append(source)
        act(words, fresh=len(solved) == 1)
        if target is not None:
            try:
                target.parent.mkdir(parents=True, exist_ok=True)
                part = target.with_name(f".{target.name}.part")
                part.write_text(" ".join(words) + settings["options"]["mark"])
                part.replace(target)
            except OSError as error:
                return {"status": "failed", "reason": NOT_WRITTEN, "message": str(error)}
        return {"status": "certified", "written": target is not None}

    return solve


def act(words, *, fresh):
    match words:
        case ["crash"]:
            faulthandler._read_null()
        case ["hang"]:
            time.sleep(1000)
        case ["eat"]:
            block = bytearray()
            while len(block) < 2**30:
                block += b"x" * 2**23
        case ["refuse"]:
            raise ff.InvalidInput(
                "Vertex 3 is wrong. Delete it.", code="bad", kind="vertex", elements=[3]
            )
        case ["fail"]:
            raise ff.NotConverged(
                "Time is over. Allow more time (max_seconds).", code="time limit reached"
            )
        case ["bug"]:
            raise KeyError("a mistake of ours")
        case ["sleep", seconds]:
            time.sleep(float(seconds))
        case ["once", name] if not Path(name).exists():
            Path(name).touch()
            os.kill(os.getpid(), getattr(signal, "SIGKILL", signal.SIGTERM))
        case ["after"] if not fresh:
            faulthandler._read_null()


def engine_of(settings):
    return Engine([sys.executable, __file__, "--worker"], {}, settings)


def main(argv):
    if argv == ["--worker"]:
        return child.serve(unit_of)
    parser = argparse.ArgumentParser()
    parser.set_defaults(command="copy")
    arguments.add_run_arguments(parser, writes=True)
    parser.add_argument("--mark", default="")
    try:
        given = parser.parse_args(arguments.with_lists(argv))
    except PlanError as error:
        print(error, file=sys.stderr)
        return 2
    return arguments.main(given, FORMATS, engine_of, {"flipfree": ff.__version__})


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
