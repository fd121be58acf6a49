"""How far a map is from the surface: shares of the surface by energy, angle and area."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import numpy.typing as npt

from ...results import Certificate

#: Percentiles by area.
_SHARES = (5, 50, 95, 99)

_COUNTS = (
    *("triangles", "flips64", "flips32", "turned", "overlaps", "island_overlaps"),
    *("winding_failures", "pin_failures", "seam_failures", "cone_failures"),
    *("seam_edges", "seams_exact32"),
)


def of_certificate(certificate: Certificate) -> dict[str, Any]:
    """Counts of -1: not measured; figures that were not: null, as JSON has no NaN."""
    found: dict[str, Any] = {"ok": certificate.ok}
    found |= {name: int(getattr(certificate, name)) for name in _COUNTS}
    for name in ("energy", "energy_p99", "max_energy"):
        value = float(getattr(certificate, name))
        found[name] = value if math.isfinite(value) and value >= 0 else None
    found["stretched"] = certificate.stretched if certificate.stretched >= 0 else None
    found["poor"] = certificate.poor
    found["poor_islands"] = certificate.poor_islands.tolist()
    found["mends"] = {mend.what: mend.count for mend in certificate.mends}
    found["failures"] = list(certificate.failures)
    return found


def percentiles(
    vertices: npt.NDArray[np.float64], faces: npt.NDArray[np.int32], uv: npt.NDArray[np.float64]
) -> dict[str, dict[str, float]] | None:
    """{"energy" | "angle" | "area": {"p5": ..., ...}} over the surface by area, at the scale that keeps the whole area.

    energy: (|J|^2 + |J^-1|^2) / 4; angle: larger by smaller stretch; area: UV area by surface area. 1 is isometric. None for a
    surface without area.
    """
    corner = vertices[faces]
    x, y = corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0]
    length = np.linalg.norm(x, axis=1)
    twice = np.linalg.norm(np.cross(x, y), axis=1)
    u, v = uv[:, 1] - uv[:, 0], uv[:, 2] - uv[:, 0]
    mapped = u[:, 0] * v[:, 1] - u[:, 1] * v[:, 0]
    good = (twice > 0) & (mapped > 0) & (length > 0)
    if not good.any():
        return None
    x, y, length, twice, u, v, mapped = (a[good] for a in (x, y, length, twice, u, v, mapped))
    with np.errstate(all="ignore"):
        along, height = np.einsum("ij,ij->i", x, y) / length, twice / length
        first = u / length[:, None]  # the map's derivatives along the first side and across
        second = (v - first * along[:, None]) / height[:, None]
        scale = twice.sum() / mapped.sum()
        squares = ((first**2).sum(1) + (second**2).sum(1)) * scale
        area = mapped / twice * scale
        root = np.sqrt(np.maximum(squares**2 - 4 * area**2, 0.0))
        values = {
            "energy": (squares + squares / area**2) / 4,
            "angle": (squares + root) / (2 * area),
            "area": area,
        }
        return {name: _shares(value, twice) for name, value in values.items()}


def _shares(values: npt.NDArray[np.float64], weights: npt.NDArray[np.float64]) -> dict[str, float]:
    order = np.argsort(values, kind="stable")
    total = np.cumsum(weights[order])
    found = {}
    for share in _SHARES:
        at = min(int(np.searchsorted(total, total[-1] * share / 100)), len(order) - 1)
        value = float(values[order[at]])
        found[f"p{share}"] = value if math.isfinite(value) else -1.0
    return found
