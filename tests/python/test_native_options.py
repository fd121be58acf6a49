"""Options on their way into the compiled module: what it does not know is refused, what is left out keeps its default."""

from __future__ import annotations

import numpy as np
import pytest

import flipfree as ff
from flipfree import _native

from surfaces import bumpy_grid

VERTICES, FACES = bumpy_grid(6, 6)


def unwrap(options: dict[str, object]) -> np.ndarray:
    map = _native.unwrap(VERTICES, FACES.astype(np.int32), options, None, 1).result()
    return np.asarray(map["uv32"])


def test_an_option_that_is_left_out_is_the_solvers_own() -> None:
    assert np.array_equal(unwrap({}), unwrap({"bijective": True, "margin": 0.005}))
    assert not np.array_equal(unwrap({}), unwrap({"margin": 0.2}))


@pytest.mark.parametrize("options", [{"marge": 0.1}, {"margin": 0.1, "effort ": 1.0}])
def test_an_option_that_a_call_does_not_have_is_named(options: dict[str, object]) -> None:
    with pytest.raises(ff.InvalidInput, match=list(options)[-1]):
        unwrap(options)


def test_a_choice_that_there_is_not_is_named() -> None:
    corners = np.zeros((3 * len(FACES), 2))
    with pytest.raises(ff.InvalidInput, match='overlaps cannot be "glue"'):
        _native.repair(VERTICES, FACES.astype(np.int32), corners, {"overlaps": "glue"}, 1)
