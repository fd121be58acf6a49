"""Solver calls that run on a C++ thread while Python goes on: poll, cancel, accept, collect.

``start_*`` functions return a :class:`Job` at once; the blocking functions of the package are ``run(start_*(...))``.
The solver thread touches neither Python nor the caller's arrays (they are copied at the start).
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, Generic, TypeVar

from .errors import Cancelled, FlipfreeError, InvalidInput, NotConverged

Result = TypeVar("Result")
Progress = Callable[[str, float], bool | None]

#: Seconds between two calls of a progress function.
POLL_SECONDS = 0.05


class Job(Generic[Result]):
    """A running solver call."""

    def __init__(self, native: Any, convert: Callable[[Any], Result]) -> None:
        self._native = native
        self._convert = convert

    def wait(self, seconds: float) -> bool:
        """Waits up to ``seconds``, without the GIL; True when the call has ended, well or badly."""
        ended: bool = self._native.wait(seconds)
        return ended

    def progress(self) -> tuple[str, float]:
        """(stage, fraction) as last reported; the fraction never falls."""
        stage, fraction = self._native.progress()
        return stage, fraction

    def cancel(self) -> None:
        """Asks the solver to stop; it does within 0.2 s. Then ``result`` raises Cancelled."""
        self._native.cancel()

    def accept(self) -> None:
        """Takes the map as it is: as if ``max_seconds`` were over now, or as soon as there is a map. ``result`` then has
        ``stats["time_limit_reached"]`` 1. Calls that have no map before their end (conformal, certify, pack) just go on.
        """
        self._native.accept()

    def result(self) -> Result:
        """Waits for the end; the result, or the solver's exception. Call it once."""
        try:
            return self._convert(self._native.result())
        except FlipfreeError:
            raise
        except MemoryError:
            raise NotConverged(
                "Not enough memory for this mesh. Split it, or close other programs.",
                code="out of memory",
            ) from None
        except Exception as error:
            raise NotConverged(
                f"The solver met an error of its own: {error}. Please report this mesh.",
                code="internal error",
            ) from error


def run(job: Job[Result], progress: Progress | None = None) -> Result:
    """Waits for ``job``, calling ``progress(stage, fraction)`` about 20 times per second.

    Raises Cancelled when it returns something false other than None; an exception that it raises cancels too and goes through.
    """

    def stops(stage: str, fraction: float) -> bool:
        answer = None if progress is None else progress(stage, fraction)
        return answer is not None and not answer

    if progress is not None and not callable(progress):
        job.cancel()
        raise InvalidInput(
            f"progress must be a function of (stage, fraction), not {progress!r}.",
            code="bad option",
        )
    try:
        while not job.wait(POLL_SECONDS):
            if stops(*job.progress()):
                job.cancel()
                break
    except BaseException:
        job.cancel()
        raise
    result = job.result()
    if stops("done", 1.0):
        raise Cancelled("Cancelled by the caller.", code="cancelled")
    return result
