"""From what the compiled module returns to the package's results."""

from __future__ import annotations

from typing import Any

import numpy as np

from .arrays import Positions
from .results import Certificate, ConformalMetric, Mend, Parametrization, Transitions, frozen


def certificate_from(data: dict[str, Any]) -> Certificate:
    data = dict(data)
    for name in ("failed_faces", "seam_vertices", "quarter_cones"):
        frozen(data[name])
    data["mends"] = tuple(
        Mend(what, kind, count, frozen(elements)) for what, kind, count, elements in data["mends"]
    )
    return Certificate(seam_transitions=transitions_from(data), **data)


def transitions_from(data: dict[str, Any]) -> Transitions:
    """Taken out of what the compiled module returns."""
    return Transitions(
        frozen(data.pop("transition_turns")), frozen(data.pop("transition_translations"))
    )


def parametrization_from(data: dict[str, Any], positions: Positions) -> Parametrization:
    """The dataclass from what the compiled module returns for the scaled vertices of ``positions``."""
    data = dict(data)
    data["vertices"] = positions.restored(data["vertices"])
    data["_uv32"] = data.pop("uv32")
    for value in data.values():
        if isinstance(value, np.ndarray):
            frozen(value)
    transitions = transitions_from(data)
    certificate = certificate_from(data.pop("certificate"))
    return Parametrization(transitions=transitions, certificate=certificate, **data)


def metric_from(data: dict[str, Any], exponent: int = 0) -> ConformalMetric:
    """The dataclass from what the compiled module returns for lengths in units of 2 to the exponent."""
    metric = ConformalMetric(**{**data, "flip_counts": tuple(data["flip_counts"])})
    if exponent:
        metric.log_lengths[...] += exponent * np.log(2.0)
    return metric
