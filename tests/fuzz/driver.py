"""Random cases in processes that may crash: what every program of random cases here shares.

    export PYTHONPATH=build/python:tests:tests/python:benchmarks
    PROGRAM.py [--calls 1000] [--seed 0] [--jobs 2] [--slack 2.0] [--report FILE.json]
    PROGRAM.py --repeat SEED

Case number i uses the seed `seed + i` and nothing else, so that --repeat makes it again. A program's case(seed, slack, said)
says what happened, or raises a Finding; notes for the report go to the list `said`. A finding, an exception that is not the
package's, a crash, a hang, and a known call that returns other bits afterwards are printed with their seed; the exit status is 1.
"""

from __future__ import annotations

import argparse
import collections
import json
import multiprocessing
import time
import traceback
from collections.abc import Callable
from functools import partial
from multiprocessing.connection import Connection
from pathlib import Path
from typing import Any

import numpy as np

import flipfree as ff

from surfaces import bumpy_grid
from verdict import Finding

#: A call without a limit of time is cancelled after so many seconds.
PATIENCE = 2.0

#: A process that says nothing for so many seconds hangs.
SILENCE = 90.0

Random = np.random.Generator
Case = Callable[[int, float, list[str]], str]


def known_call() -> bytes:
    return ff.unwrap(*bumpy_grid(4, 4), threads=2, seams="given").uv64.tobytes()


def timed_call(
    name: str, arguments: dict[str, Any], random: Random, slack: float, *, unlimited: bool = False
) -> Any:
    """The result of the call, which is cancelled at a random moment or when its time is long over; unlimited: it has to end."""
    if unlimited:
        job = getattr(ff.jobs, name)(**arguments)
        if not job.wait(SILENCE / 2):
            job.cancel()
            raise Finding("a call without a limit of time does not end")
        return job.result()
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


def outcome(case: Case, seed: int, slack: float = 2.0) -> tuple[str, str]:
    """(what happened, details of a finding) for the case of this seed."""
    said: list[str] = []
    try:
        return case(seed, slack, said), ""
    except Finding as finding:
        return "finding", f"{finding} [{', '.join(said)}]"
    except Exception as error:
        where = traceback.extract_tb(error.__traceback__)[-1]
        text = f"{type(error).__name__}: {error} at {where.name}:{where.lineno}"
        return "foreign exception", f"{text} [{', '.join(said)}]"


def work(pipe: Connection, seeds: range, case: Case, slack: float) -> None:
    """In a process of its own."""
    bits = known_call()
    for seed in seeds:
        pipe.send((seed, "", None))
        happened, details = outcome(case, seed, slack)
        if seed % 50 == 0 and known_call() != bits:
            happened, details = "finding", "the known call has other bits than before"
        pipe.send((seed, happened, details))
    pipe.close()


class Worker:
    """A process that makes the cases of some seeds, and its successors after a crash."""

    def __init__(self, seeds: range, case: Case, slack: float) -> None:
        self.seeds, self.case, self.slack = seeds, case, slack
        self.start()

    def start(self) -> None:
        context = multiprocessing.get_context("spawn")
        self.pipe, other = context.Pipe(duplex=False)
        self.process = context.Process(
            target=work, args=(other, self.seeds, self.case, self.slack), daemon=True
        )
        self.process.start()
        other.close()
        self.current, self.heard = self.seeds.start, time.monotonic()

    def replace(self, why: str) -> tuple[int, str, str]:
        self.process.kill()
        self.process.join()
        crashed, code = self.current, self.process.exitcode
        self.seeds = range(crashed + 1, self.seeds.stop)
        if self.seeds:
            self.start()
        return crashed, why, f"{why}, exit code {code}"

    def poll(self) -> list[tuple[int, str, str]]:
        """What happened since the last call."""
        done = []
        try:
            while self.pipe.poll(0.02):
                self.current, happened, details = self.pipe.recv()
                self.heard = time.monotonic()
                if details is not None:
                    done.append((self.current, happened, details))
                    self.seeds = range(self.current + 1, self.seeds.stop)
        except (EOFError, ConnectionResetError):
            if self.seeds:
                self.process.join()
                done.append(self.replace("crash"))
        if self.seeds and time.monotonic() - self.heard > SILENCE:
            done.append(self.replace("hang"))
        return done


def run(options: argparse.Namespace, case: Case) -> int:
    """Makes options.calls cases from options.seed on, and prints what came of them; 1 if there was a finding."""
    share = -(-options.calls // options.jobs)
    first, last = options.seed, options.seed + options.calls
    starts = range(first, last, share)
    workers = [Worker(range(s, min(s + share, last)), case, options.slack) for s in starts]
    counts: collections.Counter[str] = collections.Counter()
    findings: dict[int, str] = {}
    begin = shown = time.monotonic()
    while any(worker.seeds for worker in workers):
        for worker in workers:
            for seed, happened, details in worker.poll() if worker.seeds else []:
                counts[happened] += 1
                if details:
                    findings[seed] = details
                    print(f"seed {seed}: {happened}: {details}", flush=True)
        if time.monotonic() - shown > 60:
            shown = time.monotonic()
            rate = counts.total() / (shown - begin)
            print(f"{counts.total()} calls, {len(findings)} findings, {rate:.0f}/s", flush=True)
    for happened, count in sorted(counts.items()):
        print(f"{count:8d}  {happened}")
    print(f"{counts.total()} calls from seed {first} on, {len(findings)} findings")
    if options.report:
        options.report.write_text(json.dumps({"counts": counts, "findings": findings}, indent=1))
    return 1 if findings else 0


def main(doc: str | None, case: Callable[..., str], **texts: str) -> int:
    """A program's command line; an option of text for each of its own, which case() takes by name."""
    parser = argparse.ArgumentParser(description=(doc or "").splitlines()[0])
    parser.add_argument("--calls", type=int, default=1000)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--jobs", type=int, default=2)
    parser.add_argument("--slack", type=float, default=2.0)
    parser.add_argument("--report", type=Path)
    parser.add_argument("--repeat", type=int)
    for name, default in texts.items():
        parser.add_argument(f"--{name}", default=default)
    options = parser.parse_args()
    own: Case = partial(case, **{name: getattr(options, name) for name in texts})
    if options.repeat is None:
        return run(options, own)
    happened, details = outcome(own, options.repeat, options.slack)
    print(happened, details)
    return 1 if details else 0
