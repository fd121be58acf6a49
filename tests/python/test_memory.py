"""Address space that is really exhausted: out of memory or a result, soon, and the next call as if nothing had been."""

from __future__ import annotations

import os
import subprocess
import sys
import time

import numpy as np
import pytest
from small_calls import CALLS

import flipfree as ff

#: Megabytes beyond what the process has; the linear algebra alone takes 128 for each thread.
ROOM = (0, 1, 4, 16, 64, 150, 300, 600)
#: For the first call of a process the heap's own room is filled, but for less than one of these bytes in a piece: what a
#: call loads or sets up only then finds none. (With 2000 bytes NumPy itself loses its error: SystemError.)
PIECES = (16_000, 20_000, 32_000, 64_000)
#: Seconds for a process that makes one call with each; on a busy machine.
DEADLINE = 120


def main(name: str, piece: int) -> None:
    import resource

    results = []
    for room in ROOM:
        with open("/proc/self/statm") as statm:
            used = int(statm.read().split()[0]) * resource.getpagesize()
        resource.setrlimit(resource.RLIMIT_AS, (used + room * 2**20, resource.RLIM_INFINITY))
        filling = []
        size = 2**22 if not room else 0
        while size >= piece:
            try:
                filling.append(bytearray(size))
            except MemoryError:
                size //= 2
        begin = time.monotonic()
        try:
            results.append(CALLS[name]())
            outcome = "result"
        except ff.NotConverged as error:
            outcome = error.code
        except MemoryError:  # of numpy's, on the way in or out
            outcome = "out of memory"
        resource.setrlimit(resource.RLIMIT_AS, (resource.RLIM_INFINITY, resource.RLIM_INFINITY))
        del filling
        print(room, f"{time.monotonic() - begin:.2f}", outcome, sep="\t", flush=True)
    expected = CALLS[name]()
    print("same", all(np.array_equal(result, expected) for result in results), sep="\t")


@pytest.mark.skipif(sys.platform != "linux", reason="reads /proc")
@pytest.mark.sample(7)
@pytest.mark.parametrize("name", CALLS)
def test_memory_that_is_exhausted_ends_in_out_of_memory(name: str) -> None:
    piece = PIECES[list(CALLS).index(name) % len(PIECES)]
    run = subprocess.run(
        [sys.executable, __file__, name, str(piece)],
        capture_output=True,
        text=True,
        timeout=DEADLINE,
        env={**os.environ, "PYTHONPATH": os.pathsep.join(sys.path)},
        check=False,
    )
    assert run.returncode == 0, run.stdout + run.stderr
    *lines, last = [line.split("\t") for line in run.stdout.splitlines()]
    outcomes = [outcome for _room, _seconds, outcome in lines]
    assert len(outcomes) == len(ROOM)
    assert outcomes[0] == "out of memory" and outcomes[-1] == "result", outcomes
    assert set(outcomes) == {"out of memory", "result"}
    assert last == ["same", "True"]


if __name__ == "__main__":
    main(sys.argv[1], int(sys.argv[2]))
