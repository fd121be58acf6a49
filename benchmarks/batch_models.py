"""A thousand models through one batch that is killed three times: are the results the same, and how many a second?

    real_models.py fetch                  Debian's packages, below build/corpora
    batch_models.py make [--count 1000]   models real, generated and broken, below build/batch/models
    batch_models.py runs [--jobs 2]       a whole run; one that is killed at random moments and resumed; calls one by one

Exit status 1 where results or maps differ, where a failure has no reason, or where a crash is among them.
"""

from __future__ import annotations

import json
import random
import resource
import shutil
import signal
import subprocess
import sys
import time
from collections import Counter
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
from model_files import NATIVE, SUFFIXES, read_model
from runner import Options, Row, main, table

import flipfree as ff
from flipfree.batch.results import MEASURED

import surfaces
from mesh_files import ROOT

BATCH = ROOT / "build" / "batch"
MODELS = BATCH / "models"
CORPORA = ROOT / "build" / "corpora" / "files"
MOST_FACES = 20_000
ONE_BY_ONE = 60


def make_real(folder: Path, most: int) -> int:
    """Models that no one here made; also those that cannot be read."""
    files = sorted(p for p in CORPORA.rglob("*") if p.suffix.lower() in SUFFIXES)
    random.Random(1).shuffle(files)
    count = 0
    for file in files:
        if count == most:
            break
        name = f"{count:04}_{file.stem}"
        if file.suffix.lower() in NATIVE:
            if file.stat().st_size > 60 * MOST_FACES:
                continue
            shutil.copy(file, folder / f"{name}{file.suffix.lower()}")
        else:
            try:
                vertices, faces = read_model(file)
                if len(faces) > MOST_FACES:
                    continue
                ff.write(folder / f"{name}{NATIVE[count % 4]}", (vertices, faces))
            except Exception:  # what the reader of the benchmarks cannot read is no model here
                continue
        count += 1
    return count


def make_generated(folder: Path, count: int) -> None:
    chance = random.Random(2)
    for i in range(count):
        size = chance.choice([4, 8, 16, 32, 48])
        makers: list[Any] = [
            lambda size=size: surfaces.torus(2 * size, size),
            lambda size=size: surfaces.bumpy_grid(size),
            lambda size=size: surfaces.octahedron_sphere(2 + size // 12),
            lambda size=size: surfaces.cylinder(size, size),
        ]
        mesh = chance.choice(makers)()
        vertices = np.asarray(mesh[0]) * 10.0 ** chance.uniform(-3, 3)
        vertices += np.random.default_rng(i).normal(0, 1e-3, vertices.shape) * np.ptp(vertices)
        ff.write(folder / f"{i:04}{NATIVE[i % 4]}", (vertices, mesh[1]))


def make_broken(folder: Path, count: int, sources: list[Path]) -> None:
    """Files that were cut off, overwritten, emptied, or say nonsense; some of them still hold a mesh."""
    chance = random.Random(3)
    for i in range(count):
        source = chance.choice(sources)
        data = bytearray(source.read_bytes())
        kind = i % 6
        if kind == 0:
            data = data[: chance.randrange(len(data) + 1)]
        elif kind == 1:
            for _ in range(chance.randrange(1, 40)):
                data[chance.randrange(len(data))] = chance.randrange(256)
        elif kind == 2:
            data = bytearray()
        elif kind == 3:
            begin = chance.randrange(len(data))
            data[begin : begin + chance.randrange(200)] = b""
        elif kind == 4:
            data = data.replace(b"0.", b"nan ", 3).replace(b"1.", b"1e400 ", 2)
        else:
            data = bytearray(chance.randbytes(chance.randrange(1, 4000)))
        (folder / f"{i:04}{source.suffix}").write_bytes(data)


@table("models | number")
def make(options: Options) -> Iterator[Row]:
    """Those of formats that ff.read does not know are written as one of its own in turn."""
    shutil.rmtree(MODELS, ignore_errors=True)
    for name in ("real", "generated", "broken"):
        (MODELS / name).mkdir(parents=True)
    real = make_real(MODELS / "real", options.count * 11 // 20)
    broken = options.count * 3 // 20
    make_generated(MODELS / "generated", options.count - real - broken)
    make_broken(MODELS / "broken", broken, sorted((MODELS / "generated").iterdir()))
    yield "real", real
    yield "generated", options.count - real - broken
    yield "broken", broken


def batch(name: str, *more: str) -> list[str]:
    where = ["--out", str(BATCH / name), "--json", str(BATCH / f"{name}.jsonl")]
    limits = ["--suffix", ".obj", "--timeout", "300", "--memory", "4000", "--quiet"]
    return [sys.executable, "-m", "flipfree", "unwrap", str(MODELS), *where, *limits, *more]


def steady(name: str) -> dict[str, dict[str, Any]]:
    lines = [json.loads(line) for line in (BATCH / f"{name}.jsonl").read_text().splitlines()]
    for line in lines:
        line["output"] = line["output"].replace(f"/{name}/", "/")
        for field in MEASURED:
            line.pop(field, None)
    assert len({line["input"] for line in lines}) == len(lines), "an input has two lines"
    return {line["input"]: line for line in lines}


def maps(name: str) -> dict[str, bytes]:
    folder = BATCH / name
    return {str(p.relative_to(folder)): p.read_bytes() for p in folder.rglob("*") if p.is_file()}


def seconds_of(command: list[str]) -> tuple[float, float]:
    """(of the clock, of processors) for a command with all its children."""
    before, begin = resource.getrusage(resource.RUSAGE_CHILDREN), time.perf_counter()
    subprocess.run(command, check=True)
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    used = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
    return time.perf_counter() - begin, used


def killed_run(jobs: str, whole: float) -> int:
    """A run that is killed at three random moments and resumed; how often it was."""
    chance, kills = random.Random(4), 0
    command = batch("killed", "--jobs", jobs, "--resume")
    while kills < 3:
        process = subprocess.Popen(command)
        try:
            process.wait(chance.uniform(0.05, 0.3) * whole)
            break
        except subprocess.TimeoutExpired:
            process.send_signal(signal.SIGKILL)
            process.wait()
            kills += 1
            found = BATCH / "killed.jsonl"
            done = found.read_bytes().count(b"\n") if found.exists() else 0
            print(f"kill -9 after {done} models")
    subprocess.run(command, check=True)
    return kills


def one_by_one(chosen: list[str]) -> float:
    """Processor seconds of a call for each of some models."""
    used = 0.0
    for i, path in enumerate(chosen):
        target = str(BATCH / "single" / f"{i}.obj")
        call = [sys.executable, "-m", "flipfree", "unwrap", path, target, "--quiet"]
        used += seconds_of([*call, "--threads", "1"])[1]
    return used


@table("models | number | certified | warned | refused | failed | processor s")
def runs(options: Options) -> Iterator[Row]:
    for name in ("whole", "killed", "single", "again"):
        shutil.rmtree(BATCH / name, ignore_errors=True)
        (BATCH / f"{name}.jsonl").unlink(missing_ok=True)
    wall, used = seconds_of(batch("whole", "--jobs", str(options.jobs)))
    whole = steady("whole")
    for kind in ("real", "generated", "broken", ""):
        group = [line for path, line in whole.items() if f"/{kind}" in path]
        counts = Counter(line["status"] for line in group)
        figures = [counts[name] for name in ("certified", "warned", "refused", "failed")]
        yield kind or "all", len(group), *figures, "" if kind else f"{used:.0f}"
    kills = killed_run(str(options.jobs), wall)
    if kills < 3 or whole != steady("killed") or maps("whole") != maps("killed"):
        options.fail(f"killed {kills} times: other results or maps")
    for line in whole.values():
        unexplained = line["status"] in ("refused", "failed") and not line["message"]
        if unexplained or line["reason"] in ("crash", "internal error"):
            options.fail(json.dumps(line)[:400])
    good = [path for path, line in sorted(whole.items()) if line["status"] == "certified"]
    some = random.Random(5).sample(good, min(ONE_BY_ONE, len(good)))
    # Outputs of a list lie side by side, so that no two may have one name.
    some = list({Path(path).stem: path for path in some}.values())
    (BATCH / "chosen").write_text("\n".join(some) + "\n")
    yield "of the certified, a call each", len(some), *[""] * 4, f"{one_by_one(some):.1f}"
    again = batch("again", "--jobs", "1", "--threads", "1")
    again[again.index(str(MODELS))] = f"@{BATCH / 'chosen'}"
    yield "the same as a batch, one job", len(some), *[""] * 4, f"{seconds_of(again)[1]:.1f}"


if __name__ == "__main__":
    main(__doc__, count=(1000, "of make"), jobs=(2, ""))
