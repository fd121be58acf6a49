# SPDX-License-Identifier: GPL-3.0-or-later
"""What corners of new vertices carry: the mean of what their face has at the corners between which they lie.

Blender's own interpolation weighs all corners of a polygon, so that the two sides of an edge differ in their last bits, and a
polygon that is not flat gets other values than the triangles that it is drawn with. Here each value is made of those at two or
three corners, in one order and with one set of weights for all faces around the vertex.
"""

# Layers of BMesh whose values are sums, and those whose values are names for something: a mean of two would name another thing.
_SUMS = ("uv", "float", "float_vector", "float_color", "color")
_NAMES = ("int", "bool", "string")


class Corners:
    """between: {new vertex: [(weight, old vertex)]}, the old ones in one order."""

    def __init__(self, bm, between: dict):
        self._between = between
        layers = bm.loops.layers
        self._sums = [(kind, layer) for kind in _SUMS for layer in _of(layers, kind)]
        self._names = [layer for kind in _NAMES for layer in _of(layers, kind)]

    def fill(self, loop, old_loops: dict) -> None:
        """old_loops: {vertex: loop} of the face in which the new one lies."""
        shares = [(weight, old_loops.get(vertex)) for weight, vertex in self._between[loop.vert]]
        if any(old is None for _, old in shares):
            return
        for kind, layer in self._sums:
            if kind == "uv":
                loop[layer].uv = _mean([(weight, old[layer].uv) for weight, old in shares])
            elif kind == "color":  # bytes, which hold light as screens want it
                light = _mean([(weight, _light(old[layer])) for weight, old in shares])
                loop[layer] = [*map(_encoded, light[:3]), light[3]]
            elif kind == "float":
                loop[layer] = sum(weight * old[layer] for weight, old in shares)
            else:
                loop[layer] = _mean([(weight, old[layer]) for weight, old in shares])
        _, largest = max(shares, key=lambda share: share[0])
        for layer in self._names:
            loop[layer] = largest[layer]


def _light(color) -> list[float]:
    """Of the bytes of a colour, what is added up where light is mixed (IEC 61966-2-1); the fourth is opacity."""
    red, green, blue, opacity = color
    return [
        *(x / 12.92 if x <= 0.04045 else ((x + 0.055) / 1.055) ** 2.4 for x in (red, green, blue)),
        opacity,
    ]


def _encoded(light: float) -> float:
    return 12.92 * light if light <= 0.0031308 else 1.055 * light ** (1 / 2.4) - 0.055


def keep_whole(layers, new, old) -> None:
    """Names that the element `new` carries are those of `old`, not means of several."""
    for kind in _NAMES:
        for layer in _of(layers, kind):
            new[layer] = old[layer]


def _of(layers, kind: str) -> list:
    """[] for kinds that this Blender does not know."""
    return list(getattr(layers, kind, None).values()) if hasattr(layers, kind) else []


def _mean(shares) -> list[float]:
    return [
        sum(parts) for parts in zip(*([w * x for x in value] for w, value in shares), strict=True)
    ]
