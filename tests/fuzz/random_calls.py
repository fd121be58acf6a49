"""Random calls of all public functions.

    random_calls.py [--only NAME,...] and what driver.py says

A call may return a certified result or raise one of the package's exceptions that names what exists; it ends within its
max_seconds, and after a cancel at once, but for the slack. One of ten meshes is a degenerate one of up to 12 faces and has no
limit of time: a call on it ends by itself.
"""

from __future__ import annotations

import sys

import numpy as np
from degenerate_meshes import degenerate_mesh
from driver import main, timed_call

import flipfree as ff

from hostile_values import FUNCTIONS
from random_meshes import Mesh, random_mesh
from random_options import random_arguments
from verdict import check_error, check_result

#: How often a function that takes closed surfaces only gets one.
CLOSED = {"seamless": 0.5}


def small_degenerate_mesh(random: np.random.Generator) -> Mesh:
    while True:
        vertices, faces = degenerate_mesh(random)
        if len(faces) <= 12:
            return Mesh(vertices, faces, ["small and degenerate"])


def case(seed: int, slack: float, said: list[str], only: str) -> str:
    random = np.random.default_rng(seed)
    names = only.split(",")
    name = names[random.integers(len(names))]
    mesh = random_mesh(random, CLOSED.get(name, 0.0))
    unlimited = bool(random.random() < 0.1) and name != "quads_from_map"  # cells of any number
    if unlimited:
        mesh = small_degenerate_mesh(random)
    said += [name, *mesh.what]
    arguments = random_arguments(name, mesh, random, hostile=0.0 if unlimited else 1 / 12)
    if unlimited:
        arguments.pop("max_seconds", None)
    try:
        result = timed_call(name, arguments, random, slack, unlimited=unlimited)
        check_result(name, result, arguments)
        return f"{name}, result"
    except ff.FlipfreeError as error:
        check_error(error, mesh, arguments)
        return f"{name}, {type(error).__name__}: {error.code}"


if __name__ == "__main__":
    sys.exit(main(__doc__, case, only=",".join(FUNCTIONS)))
