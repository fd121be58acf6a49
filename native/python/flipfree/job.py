"""Solver calls that run on a C++ thread while Python goes on: poll, cancel, accept, collect.

Every function of the package is declared once, as one that starts a :class:`Job`; :func:`solver_call` makes the blocking
function of it, :func:`job_of` finds the one that returns the job. The solver thread touches neither Python nor the caller's
arrays (they are copied at the start).
"""

from __future__ import annotations

import errno
import inspect
import time
from collections.abc import Callable, Generator
from functools import partial, wraps
from typing import Any, Generic, NoReturn, ParamSpec, TypedDict, TypeVar, cast

from .checks import as_seconds, as_threads, real_number, shown
from .errors import Cancelled, FlipfreeError, NotConverged, bad_option
from .results import Mesh, Parametrization, parametrization_from

Result = TypeVar("Result")
Arguments = ParamSpec("Arguments")
Progress = Callable[[str, float], bool | None]


class Limits(TypedDict, total=False):
    """What every call of a solver has: seconds of the clock, None or 0 being no limit; how many threads, None being all cores;
    what is told where it stands, which the function that starts a job does not have."""

    max_seconds: float | None
    threads: int | None
    progress: Progress | None


#: By the name of each call of a solver what starts its job.
JOBS: dict[str, Callable[..., Job[Any]]] = {}

#: Seconds between two calls of a progress function.
POLL_SECONDS = 0.05


#: The longest time that Job.wait waits at once.
LONGEST_WAIT = 1e6


def _raise_ours(error: Exception) -> NoReturn:
    """Raises what is no error of the caller's as one of the package's exceptions."""
    if isinstance(error, FlipfreeError):
        raise error
    out_of_memory = isinstance(error, OSError) and error.errno == errno.ENOMEM
    if out_of_memory or isinstance(error, MemoryError):
        raise NotConverged(
            "Not enough memory for this mesh. Split it, or close other programs.",
            code="out of memory",
        ) from None
    raise NotConverged(
        f"The solver met an error of its own: {error}. Please report this mesh.",
        code="internal error",
    ) from error


def ours_only(
    start: Callable[Arguments, Result], signature: inspect.Signature | None = None
) -> Callable[Arguments, Result]:
    """``start``, from which no other exceptions come than the package's, and Python's own for arguments that it lacks, or that
    the signature does."""
    known = signature or inspect.signature(start)

    @wraps(start)
    def guarded(*args: Arguments.args, **kwargs: Arguments.kwargs) -> Result:
        known.bind(*args, **kwargs)
        try:
            return start(*args, **kwargs)
        except Exception as error:
            _raise_ours(error)

    return guarded


class Job(Generic[Result]):
    """A running solver call."""

    _collected = False

    def __init__(self, native: Any, convert: Callable[[Any], Result]) -> None:
        self._native = native
        self._convert = convert

    def wait(self, seconds: float) -> bool:
        """Waits up to ``seconds``, without the GIL; True when the call has ended, well or badly."""
        number = real_number(seconds)
        if number is None or number != number:
            raise bad_option(f"seconds must be a number, not {shown(seconds)}.")
        return bool(self._native.wait(min(max(number, 0.0), LONGEST_WAIT)))

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
        """Waits for the end; the result, once, or the solver's exception."""
        if self._collected:
            raise bad_option(
                "The result of this job was already collected. Keep it, it is not held here."
            )
        try:
            while not self.wait(LONGEST_WAIT):
                pass
            result = self._result()
        except Exception as error:
            _raise_ours(error)
        self._collected = True
        return result

    def _result(self) -> Result:
        return self._convert(self._native.result())


def start_job(
    call: Callable[..., Any],
    mesh: Mesh,
    options: dict[str, Any],
    limits: Limits,
    convert: Callable[[Any, Mesh], Result],
) -> Job[Result]:
    """The job of a call of the compiled module, whose result ``convert`` makes of what it returns and the mesh."""
    options = options | {"max_seconds": as_seconds(limits.get("max_seconds"), "max_seconds")}
    native = call(mesh.scaled, mesh.faces, options, as_threads(limits.get("threads")))
    return Job(native, lambda data: convert(data, mesh))


def start_map(
    call: Callable[..., Any],
    mesh: Mesh,
    options: dict[str, Any],
    limits: Limits,
    aspect: float = 1.0,
) -> Job[Parametrization]:
    """The same of a call that returns a map. aspect: of the texture on which its distortion is measured."""
    return start_job(call, mesh, options, limits, partial(parametrization_from, aspect=aspect))


#: What a StagedJob is made of: yields (job, share of the progress at its end), and returns the result.
Stages = Generator[tuple[Job[Any], float], Any, Result]


class StagedJob(Job[Result]):
    """A row of jobs, written down as one generator: ``found = yield job, share``. What a job raises is raised there."""

    def __init__(self, stages: Stages[Result]) -> None:
        self._stages = stages
        self._cancelled = self._accepted = False
        self._ended: Callable[[], Result] | None = None
        self._begin, self._current, self._end = 0.0, *next(stages)

    def wait(self, seconds: float) -> bool:
        begin = time.monotonic()
        while self._ended is None:
            if not self._current.wait(max(seconds - (time.monotonic() - begin), 0.0)):
                return False
            self._go_on()
        return True

    def _go_on(self) -> None:
        begin = self._end
        try:
            try:
                found = self._current.result()
            except FlipfreeError as error:
                following = self._stages.throw(error)
            else:
                following = self._stages.send(found)
            self._begin, self._current, self._end = begin, *following
        except StopIteration as end:
            self._ended = lambda value=end.value: value
        except Exception as error:
            self._ended = partial(_raise_ours, error)
        if self._cancelled:
            self._current.cancel()
        if self._accepted:
            self._current.accept()

    def progress(self) -> tuple[str, float]:
        if self._ended is not None:
            return "done", 1.0
        stage, fraction = self._current.progress()
        return stage, self._begin + (self._end - self._begin) * fraction

    def cancel(self) -> None:
        self._cancelled = True
        self._current.cancel()

    def accept(self) -> None:
        self._accepted = True
        self._current.accept()

    def _result(self) -> Result:
        assert self._ended is not None
        return self._ended()


def run(job: Job[Result], progress: Progress | None = None) -> Result:
    """Waits for ``job``, calling ``progress(stage, fraction)`` about 20 times per second.

    Raises Cancelled when it returns something false other than None; an exception that it raises cancels too and goes through.
    """

    def stops(stage: str, fraction: float) -> bool:
        answer = None if progress is None else progress(stage, fraction)
        try:
            return answer is not None and not answer
        except Exception:  # such as an array's, whose truth is ambiguous
            raise bad_option(
                f"progress must return None, True or False, not {shown(answer)}."
            ) from None

    stopped = False
    try:
        if progress is not None and not callable(progress):
            raise bad_option(
                f"progress must be a function of (stage, fraction), not {shown(progress)}."
            )
        while not stopped and not job.wait(POLL_SECONDS):
            stopped = stops(*job.progress())
    except BaseException:
        job.cancel()
        raise
    if stopped:
        job.cancel()
    result = job.result()
    # The solver may have been done before it saw that it was to stop: nobody is asked again then.
    if stopped or stops("done", 1.0):
        raise Cancelled("Cancelled by the caller.", code="cancelled")
    return result


def solver_call(declared: Callable[Arguments, Job[Result]]) -> Callable[Arguments, Result]:
    """The blocking function of a declaration that starts a job: same arguments, the job's result.

    ``declared`` takes ``**limits``, which both functions have one by one. Arguments that are missing or unknown are Python's own
    TypeError; nothing else leaves but the package's exceptions.
    """
    signature = inspect.signature(declared)
    own = [p for p in signature.parameters.values() if p.kind is not p.VAR_KEYWORD]
    *limits, progress = (
        inspect.Parameter(
            name, inspect.Parameter.KEYWORD_ONLY, default=None, annotation=kind.__forward_arg__
        )
        for name, kind in Limits.__annotations__.items()
    )
    job_signature = signature.replace(parameters=[*own, *limits])
    result = str(signature.return_annotation).removeprefix("Job[").removesuffix("]")
    start = ours_only(cast("Callable[..., Job[Result]]", declared), job_signature)

    @wraps(declared)
    def blocking(*args: Any, progress: Progress | None = None, **kwargs: Any) -> Result:
        return run(start(*args, **kwargs), progress)

    start.__doc__ = f"As :func:`flipfree.{declared.__name__}`, at once, on a thread."
    start.__dict__["__signature__"] = job_signature
    blocking.__dict__["__signature__"] = signature.replace(
        parameters=[*own, *limits, progress], return_annotation=result
    )
    blocking.__dict__["_start_job"] = JOBS[declared.__name__] = start
    return cast("Callable[Arguments, Result]", blocking)


def job_of(blocking: Callable[Arguments, Result]) -> Callable[Arguments, Job[Result]]:
    """The function that starts the job of what :func:`solver_call` has made; it takes no ``progress``."""
    return cast("Callable[Arguments, Job[Result]]", blocking.__dict__["_start_job"])
