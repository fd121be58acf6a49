"""Exceptions of the public functions. No other exception leaves them."""

from collections.abc import Callable, Mapping, Sequence
from typing import Any

from .results import Certificate, ConformalMetric, Parametrization


class FlipfreeError(Exception):
    """Base of all errors.

    Attributes:
        code: short name of what failed, e.g. ``"non-manifold edge"``.
        kind: ``"vertex"``, ``"edge"``, ``"face"``, ``"corner"`` or ``"none"``: what ``elements`` counts.
        elements: ids of the elements at fault (edges as consecutive vertex pairs), at most 1000.
        certificate: the best certificate that was reached, where there is one.
        witness: of Infeasible: ``{"rule": name, ...}``, the numbers that prove it, see docs/errors.md; else empty.
    """

    def __init__(
        self,
        message: str,
        *,
        code: str = "",
        kind: str = "none",
        elements: Sequence[int] = (),
        certificate: Certificate | None = None,
        witness: Mapping[str, Any] | None = None,
    ) -> None:
        super().__init__(message)
        self.code = code
        self.kind = kind
        self.elements = [int(element) for element in elements]
        self.certificate = certificate
        self.witness = dict(witness or {})


class InvalidInput(FlipfreeError, ValueError):
    """The input is malformed; the message names the place and the cure."""


def _invalid(code: str) -> Callable[..., InvalidInput]:
    """What makes errors with this code."""

    def made(message: str, kind: str = "none", elements: Any = ()) -> InvalidInput:
        return InvalidInput(message, code=code, kind=kind, elements=elements)

    return made


bad_angles = _invalid("bad angles")
bad_boundary = _invalid("bad boundary")
bad_file = _invalid("malformed file")
bad_option = _invalid("bad option")
bad_pins = _invalid("bad pins")
bad_shape = _invalid("array of the wrong shape")
no_access = _invalid("file not accessible")
not_finite = _invalid("coordinate is not finite")
out_of_range = _invalid("index out of range")


class Infeasible(FlipfreeError):
    """The target provably cannot be met; the message says why."""


class NotConverged(FlipfreeError):
    """The solver gave up, or its result did not pass the certificate.

    Attributes:
        parametrization: the best map that was reached, where there is one.
        metric: the metric of a conformal map that could not be stored.
    """

    parametrization: Parametrization | None = None
    metric: ConformalMetric | None = None


def require(certificate: Any, what: str, cure: str = "") -> None:
    """Raises NotConverged, which says what did not pass and what then to do, if a certificate is not ok."""
    if not certificate.ok:
        raise NotConverged(
            f"{what}: {'; '.join(certificate.failures)}. {cure}".rstrip(),
            code="certificate failed",
            certificate=certificate if isinstance(certificate, Certificate) else None,
        )


class Cancelled(FlipfreeError):
    """The caller's progress function returned False, or the job was cancelled."""
