"""Random calls of all public functions, in processes that may crash.

    export PYTHONPATH=build/python:tests:tests/python:benchmarks
    random_calls.py [--calls 1000] [--seed 0] [--jobs 2] [--only NAME,...] [--slack 2.0] [--report FILE.json]
    random_calls.py --repeat SEED

Call number i uses the seed `seed + i` and nothing else, so that --repeat makes it again. A call may return a certified
result or raise one of the package's exceptions that names what exists; it ends within its max_seconds, and after a
cancel at once, but for the slack; and a known call afterwards returns the same bits as ever. Anything else is a finding:
it is printed with its seed, and the exit status is 1.
"""

from __future__ import annotations

import argparse
import collections
import json
import multiprocessing
import sys
import time
import traceback
from collections.abc import Callable
from multiprocessing.connection import Connection
from pathlib import Path
from typing import Any

import numpy as np

import flipfree as ff

from hostile_values import FUNCTIONS
from random_meshes import random_mesh
from random_options import random_arguments
from surfaces import bumpy_grid
from verdict import Finding, check_error, check_result

#: How often a function that takes closed surfaces only gets one.
CLOSED = {"seamless": 0.5}

#: A call without a limit of time is cancelled after so many seconds.
PATIENCE = 2.0

#: A process that says nothing for so many seconds hangs.
SILENCE = 90.0


def known_call() -> bytes:
    return ff.unwrap(*bumpy_grid(4, 4), threads=2, seams="given").uv64.tobytes()


def timed_call(
    name: str, arguments: dict[str, Any], random: np.random.Generator, slack: float
) -> Any:
    """The result of the call, which is cancelled at a random moment or when its time is long over."""
    limit = arguments.get("max_seconds")
    limited = isinstance(limit, float) and limit > 0
    cancel_after = PATIENCE
    if random.random() < 0.3:
        cancel_after = float(10.0 ** random.uniform(-4, -0.5))
    begin = time.monotonic()
    job = getattr(ff.jobs, name)(**arguments)
    while not job.wait(0.002 if cancel_after < 0.1 else 0.05):
        if time.monotonic() - begin > (limit + slack if limited else cancel_after):
            break
        if limited and cancel_after < PATIENCE and time.monotonic() - begin > cancel_after:
            break
    asked = time.monotonic()
    if limited and asked - begin > limit + slack:
        raise Finding(f"late: max_seconds={limit:.3g}, and not back after {asked - begin:.2f} s")
    job.cancel()
    try:
        return job.result()
    finally:
        if time.monotonic() - asked > slack:
            raise Finding(f"late: {time.monotonic() - asked:.2f} s after it was cancelled")


def name_of(seed: int, names: list[str]) -> str:
    return names[np.random.default_rng(seed).integers(len(names))]


def one(seed: int, names: list[str], slack: float, bits: bytes) -> tuple[str, str]:
    """(what happened, details of a finding) for the call of this seed."""
    random = np.random.default_rng(seed)
    name = names[random.integers(len(names))]
    mesh = random_mesh(random, CLOSED.get(name, 0.0))
    arguments = random_arguments(name, mesh, random)
    try:
        try:
            check_result(name, timed_call(name, arguments, random, slack), arguments)
            outcome = "result"
        except ff.FlipfreeError as error:
            check_error(error, mesh, arguments)
            outcome = f"{type(error).__name__}: {error.code}"
        if random.random() < 0.02 and known_call() != bits:
            raise Finding("the known call has other bits than before")
        return f"{name}, {outcome}", ""
    except Finding as finding:
        return f"{name}, finding", f"{finding} [{', '.join(mesh.what)}]"
    except Exception as error:
        where = traceback.extract_tb(error.__traceback__)[-1]
        text = f"{type(error).__name__}: {error} at {where.name}:{where.lineno}"
        return f"{name}, foreign exception", f"{text} [{', '.join(mesh.what)}]"


def work(pipe: Connection, seeds: range, names: list[str], slack: float) -> None:
    bits = known_call()
    for seed in seeds:
        pipe.send((seed, name_of(seed, names), None))
        pipe.send((seed, *one(seed, names, slack, bits)))
    pipe.close()


class Worker:
    """A process that makes the calls of some seeds, and its successors after a crash. `work` is what it runs: a function of
    a pipe, seeds, names and slack, at the top of a module."""

    def __init__(
        self, seeds: range, names: list[str], slack: float, work: Callable[..., None] = work
    ) -> None:
        self.seeds, self.names, self.slack, self.work = seeds, names, slack, work
        self.start()

    def start(self) -> None:
        context = multiprocessing.get_context("spawn")
        self.pipe, other = context.Pipe(duplex=False)
        self.process = context.Process(
            target=self.work, args=(other, self.seeds, self.names, self.slack), daemon=True
        )
        self.process.start()
        other.close()
        self.current, self.name = self.seeds.start, ""
        self.heard = time.monotonic()

    def replace(self, why: str) -> tuple[int, str, str]:
        self.process.kill()
        self.process.join()
        crashed, name, code = self.current, self.name, self.process.exitcode
        self.seeds = range(crashed + 1, self.seeds.stop)
        if self.seeds:
            self.start()
        return crashed, f"{name}, {why}", f"{why}, exit code {code}"

    def poll(self) -> list[tuple[int, str, str]]:
        """What happened since the last call."""
        done = []
        try:
            while self.pipe.poll(0.02):
                seed, outcome, details = self.pipe.recv()
                self.current, self.heard = seed, time.monotonic()
                if details is None:
                    self.name = outcome
                else:
                    done.append((seed, outcome, details))
                    self.seeds = range(seed + 1, self.seeds.stop)
        except (EOFError, ConnectionResetError):
            if self.seeds:
                self.process.join()
                done.append(self.replace("crash"))
        if self.seeds and time.monotonic() - self.heard > SILENCE:
            done.append(self.replace("hang"))
        return done


def run(options: argparse.Namespace, names: list[str], work: Callable[..., None] = work) -> int:
    """Makes options.calls calls from options.seed on, and prints what came of them; 1 if there was a finding."""
    share = -(-options.calls // options.jobs)
    first, last = options.seed, options.seed + options.calls
    workers = [
        Worker(
            range(first + i * share, min(first + (i + 1) * share, last)),
            names,
            options.slack,
            work,
        )
        for i in range(options.jobs)
    ]
    counts: collections.Counter[str] = collections.Counter()
    findings: dict[int, str] = {}
    begin = shown = time.monotonic()
    while any(worker.seeds for worker in workers):
        for worker in workers:
            for seed, outcome, details in worker.poll() if worker.seeds else []:
                counts[outcome] += 1
                if details:
                    findings[seed] = details
                    print(f"seed {seed}: {outcome}: {details}", flush=True)
        if time.monotonic() - shown > 60:
            shown = time.monotonic()
            rate = counts.total() / (shown - begin)
            print(f"{counts.total()} calls, {len(findings)} findings, {rate:.0f}/s", flush=True)
    for outcome, count in sorted(counts.items()):
        print(f"{count:8d}  {outcome}")
    print(f"{counts.total()} calls from seed {first} on, {len(findings)} findings")
    if options.report:
        options.report.write_text(json.dumps({"counts": counts, "findings": findings}, indent=1))
    return 1 if findings else 0


def arguments_for(description: str) -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(description=description)
    parser.add_argument("--calls", type=int, default=1000)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--jobs", type=int, default=2)
    parser.add_argument("--slack", type=float, default=2.0)
    parser.add_argument("--report", type=Path)
    parser.add_argument("--repeat", type=int)
    return parser


def main() -> int:
    parser = arguments_for(__doc__.splitlines()[0])
    parser.add_argument("--only", default=",".join(FUNCTIONS))
    options = parser.parse_args()
    names = options.only.split(",")
    if options.repeat is None:
        return run(options, names)
    outcome, details = one(options.repeat, names, options.slack, known_call())
    print(outcome, details)
    return 1 if details else 0


if __name__ == "__main__":
    sys.exit(main())
