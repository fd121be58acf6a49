"""Closed curves that bound two immersed disks each, mirror images of each other in the vertical axis."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

#: x is a sum of sines, y one of cosines of the frequencies 1 to 5. The second is a doodle after Milnor's.
CURVES = {
    "lobes": ((0.827, 0.036, 1.328, -0.240, -2.113), (0.402, -0.234, -2.061, 0.048, 0.469)),
    "doodle": ((0.328, -0.398, 2.009, -0.521, 0.591), (-0.153, -0.810, -1.184, -0.280, -1.236)),
}
#: A point of the axis in each, to which a pin may be drawn on either disk.
PINS = {"lobes": (0.0, 0.9), "doodle": (0.0, -1.0)}


def curve(name: str, spokes: int) -> npt.NDArray[np.float64]:
    """(spokes, 2) points in order, none of them on the axis."""
    sines, cosines = (np.array(row) for row in CURVES[name])
    angle = 2 * np.pi * (np.arange(spokes) + 0.5) / spokes
    frequency = np.arange(1, 6)[:, None]
    return np.stack([sines @ np.sin(frequency * angle), cosines @ np.cos(frequency * angle)], 1)
