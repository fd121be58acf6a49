"""From what the compiled module returns to the package's results."""

from __future__ import annotations

from typing import Any

import numpy as np

from .arrays import Positions
from .maps.distortion import BOUND_ENERGY, energies, stretched_islands, stretched_share
from .results import Certificate, ConformalMetric, Mend, Parametrization, Transitions, frozen


def certificate_from(
    data: dict[str, Any],
    *,
    vertices: Any = None,
    faces: Any = None,
    uv32: Any = None,
    exponent: int = 0,
    aspect: float = 1.0,
) -> Certificate:
    """The dataclass from what the compiled module returns for this map, as stored, of vertices in units of 2 to the exponent.
    Errors have one without its map, and so without ``stretched`` and what goes with it."""
    data = dict(data) | {"stretched": -1.0, "area": -1.0, "poor": False}
    data["poor_islands"] = np.zeros(0, np.int32)
    if data["energy"] != -1.0:  # a metric that is not the surface's has none
        data["poor"] = not data["energy"] <= BOUND_ENERGY
    if data["energy"] != -1.0 and uv32 is not None:
        energy, area = energies(vertices, faces, uv32, aspect)
        with np.errstate(over="ignore", under="ignore"):
            data["area"] = float(np.ldexp(area.sum(), 2 * exponent))
        data["stretched"] = stretched_share(energy, area)
        if data["stretched"] > 0.0:
            data["poor_islands"] = stretched_islands(faces, uv32, energy, area)
    for name in ("failed_faces", "seam_vertices", "quarter_cones", "poor_islands"):
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


def parametrization_from(
    data: dict[str, Any], positions: Positions, aspect: float = 1.0
) -> Parametrization:
    """The dataclass from what the compiled module returns for the scaled vertices of ``positions``. aspect: of the texture on
    which distortion is measured."""
    data = dict(data)
    scaled = data["vertices"]
    data["vertices"] = positions.restored(data["vertices"])
    data["_uv32"] = data.pop("uv32")
    for value in data.values():
        if isinstance(value, np.ndarray):
            frozen(value)
    transitions = transitions_from(data)
    certificate = certificate_from(
        data.pop("certificate"),
        vertices=scaled,
        faces=data["faces"],
        uv32=data["_uv32"],
        exponent=positions.exponent,
        aspect=aspect,
    )
    return Parametrization(transitions=transitions, certificate=certificate, **data)


def metric_from(data: dict[str, Any], exponent: int = 0) -> ConformalMetric:
    """The dataclass from what the compiled module returns for lengths in units of 2 to the exponent."""
    metric = ConformalMetric(**{**data, "flip_counts": tuple(data["flip_counts"])})
    if exponent:
        metric.log_lengths[...] += exponent * np.log(2.0)
    return metric
