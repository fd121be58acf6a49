"""Every argument of every function, replaced by values that it does not expect: a result, or one of our own exceptions."""

from __future__ import annotations

import inspect
import pickle
import time
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

import flipfree as ff

from hostile_values import FUNCTIONS, VALUES, Raises, arguments_of

#: Of the clock, for a call on 8 faces on a busy machine.
DEADLINE = 20.0

PLACES = [
    (name, parameter)
    for name, function in FUNCTIONS.items()
    for parameter in inspect.signature(function).parameters
]


def stopper() -> Callable[[str, float], bool]:
    end = time.monotonic() + DEADLINE
    return lambda _stage, _fraction: time.monotonic() < end


def check_result(result: Any) -> None:
    if isinstance(result, ff.Parametrization):
        assert result.certificate.ok
        assert ff.certify(result.vertices, result.faces, result.uv).ok
    if isinstance(result, (ff.Certificate, ff.Parametrization)):
        certificate = getattr(result, "certificate", result)
        numbers = [certificate.energy, certificate.max_energy]
        assert not certificate.ok or np.isfinite(numbers).all()


@pytest.mark.sample(48)
@pytest.mark.parametrize(("name", "parameter"), PLACES)
def test_unexpected_arguments_are_taken_or_refused(name: str, parameter: str) -> None:
    refused = 0
    for described, make in VALUES.items():
        value = make()
        if parameter == "progress" and callable(value):
            continue  # what it raises is the caller's own
        arguments = {"progress": stopper(), **arguments_of(name), parameter: value}
        try:
            check_result(FUNCTIONS[name](**arguments))
        except ff.Cancelled:
            assert parameter == "progress", f"{described} took longer than {DEADLINE} s"
        except ff.FlipfreeError as error:
            refused += 1
            assert error.code not in ("", "internal error", "out of memory"), (described, error)
            assert len(str(error)) > 20, (described, error)
            pickle.loads(pickle.dumps(error))
    assert refused > 20


@pytest.mark.parametrize("parameter", ["faces", "cuts", "uv"])
@pytest.mark.parametrize("call", [ff.split_fans, ff.islands])
def test_plain_functions_take_or_refuse_unexpected_arguments(
    call: Callable[..., Any], parameter: str
) -> None:
    if parameter not in inspect.signature(call).parameters:
        return
    for described, make in VALUES.items():
        try:
            call(**{"faces": [[0, 1, 2]], parameter: make()})
        except ff.InvalidInput as error:
            assert len(str(error)) > 20, (described, error)


@pytest.mark.parametrize("name", FUNCTIONS)
def test_arrays_of_any_layout_give_the_same_result(name: str) -> None:
    def read_only(a: np.ndarray) -> np.ndarray:
        a = a.copy()
        a.flags.writeable = False
        return a

    layouts: list[Callable[[np.ndarray], Any]] = [
        lambda a: a.byteswap().view(a.dtype.newbyteorder()),
        lambda a: np.repeat(a, 2, axis=0)[::2],
        lambda a: np.asfortranarray(a),
        lambda a: np.ma.MaskedArray(a),
        lambda a: memoryview(np.ascontiguousarray(a)),
        lambda a: a.astype(object),
        lambda a: a.tolist(),
        read_only,
    ]

    def relaid(value: Any, layout: Callable[[np.ndarray], Any]) -> Any:
        if isinstance(value, tuple):
            return tuple(relaid(part, layout) for part in value)
        return layout(value) if isinstance(value, np.ndarray) else value

    def bits(result: Any) -> bytes:
        for attribute in ("uv64", "scale_factors", "directions"):
            result = getattr(result, attribute, result)
        return result.tobytes() if isinstance(result, np.ndarray) else repr(result).encode()

    arguments = arguments_of(name)
    usual = bits(FUNCTIONS[name](**arguments))
    for layout in layouts:
        other = {key: relaid(value, layout) for key, value in arguments.items()}
        assert bits(FUNCTIONS[name](**other)) == usual


def test_an_exception_of_progress_goes_through() -> None:
    def fails(_stage: str, _fraction: float) -> bool:
        raise LookupError("the caller's own")

    with pytest.raises(LookupError, match="the caller's own"):
        ff.unwrap(**arguments_of("unwrap"), progress=fails)


def test_jobs_take_any_number_of_seconds_and_are_collected_once() -> None:
    job = ff.jobs.unwrap(**arguments_of("unwrap"))
    for seconds in (-1, 0, 1e-300, np.float32(0.1)):
        job.wait(seconds)
    for seconds in (1e300, float("inf")):
        assert job.wait(seconds)
    for nonsense in (None, "1", float("nan"), Raises()):
        with pytest.raises(ff.InvalidInput, match="seconds"):
            job.wait(nonsense)  # type: ignore[arg-type]
    assert job.result().certificate.ok
    with pytest.raises(ff.InvalidInput, match="already collected"):
        job.result()


def test_a_failed_job_fails_again() -> None:
    job = ff.jobs.embed(np.zeros((3, 3)), [[0, 1, 2]])
    for _ in range(2):
        with pytest.raises(ff.InvalidInput, match="Edge 0-1"):
            job.result()


def test_the_complaint_names_the_argument() -> None:
    vertices, faces = arguments_of("unwrap").values()
    for values in (None, "abc", object(), [[1j] * 3], np.ones((9, 3), bool), [[10**400] * 3]):
        with pytest.raises(ff.InvalidInput, match="^vertices is not an array of numbers"):
            ff.unwrap(values, faces)
        with pytest.raises(ff.InvalidInput, match="^faces "):
            ff.unwrap(vertices, values)
    for name in ("iterations", "threads", "tolerance", "margin", "max_seconds"):
        for value in ("1", True, 10**400, 2**31 + 0j, np.ones(1)):
            with pytest.raises(ff.InvalidInput, match=f"^{name} must be"):
                ff.unwrap(vertices, faces, **{name: value})
    with pytest.raises(
        ff.InvalidInput, match="^iterations must be a whole number from 0 to 2147483647"
    ):
        ff.unwrap(vertices, faces, iterations=2**31)
