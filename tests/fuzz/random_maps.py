"""What the random cases of a single operator share: outcomes of a judged call, the processes that make them, the command line."""

from __future__ import annotations

import traceback
from collections.abc import Callable
from multiprocessing.connection import Connection

import numpy as np
from random_calls import arguments_for, known_call, run

from verdict import Finding

# The case of a seed, with a slack in seconds and the bits of known_call(): (what happened, details of a finding).
One = Callable[[int, float, bytes], tuple[str, str]]


def outcome_of(
    attempt: Callable[[], str], random: np.random.Generator, bits: bytes, note: str
) -> tuple[str, str]:
    """What attempt() says that happened; or why it is a finding, with the note."""
    try:
        happened = attempt()
        if random.random() < 0.02 and known_call() != bits:
            raise Finding("the known call has other bits than before")
        return happened, ""
    except Finding as finding:
        return "finding", f"{finding} {note}"
    except Exception as error:
        where = traceback.extract_tb(error.__traceback__)[-1]
        text = f"{type(error).__name__}: {error} at {where.name}:{where.lineno}"
        return "foreign exception", f"{text} {note}"


def work_through(pipe: Connection, seeds: range, name: str, one: One, slack: float) -> None:
    """In a process that may crash."""
    bits = known_call()
    for seed in seeds:
        pipe.send((seed, name, None))
        pipe.send((seed, *one(seed, slack, bits)))
    pipe.close()


def main_of(description: str, name: str, one: One, work: Callable[..., None]) -> int:
    options = arguments_for(description).parse_args()
    if options.repeat is None:
        return run(options, [name], work)
    outcome, details = one(options.repeat, options.slack, known_call())
    print(outcome, details)
    return 1 if details else 0
