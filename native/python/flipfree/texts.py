"""Numbers of things in words."""

import re

from .distortion import STRETCH_BOUND

_ONE = {"edges": "edge", "faces": "face", "vertices": "vertex", "use": "uses", "their": "its"}


def counted(count: int, one: str, many: str = "") -> str:
    """Such as "1 face" and "2 faces". many: where it is not ``one`` with an s."""
    return f"{count} {one if count == 1 else many or one + 's'}"


def mended(count: int, what: str) -> str:
    """Such as "1 edge with more than two faces", of the name that such mends have: "edges with more than two faces"."""
    if count == 1:
        noun = re.search(r"\b(edges|faces|vertices)\b", what)
        end = noun.end() if noun else 0
        first = re.sub(r"\w+$", lambda found: _ONE[found[0]], what[:end])
        what = first + re.sub(r"\b(use|their)\b", lambda found: _ONE[found[0]], what[end:])
    return f"{count} {what}"


def above_bound(share: float) -> str:
    """Of a map, how much of the surface is stretched beyond the bound (distortion.py)."""
    percent = "less than 1" if share < 0.01 else f"{int(100.0 * share)}"
    return f"{percent} % of the surface is stretched beyond {STRETCH_BOUND:g}"


def turned_over(count: int) -> str:
    """Of a map, what it means that so many faces are mapped against their own winding."""
    are, their = ("is", "its") if count == 1 else ("are", "their")
    return f"{counted(count, 'face')} {are} wound against the others: {their} texture is mirrored, seen from the front"


def needles_named(count: int) -> str:
    """What to do about triangles without width, which spoil the figure of the worst face; "" if there are none."""
    return f"{counted(count, 'needle')}: Merge by Distance or Limited Dissolve" if count else ""


def mirrored(islands: int) -> str:
    """Of a map."""
    return counted(islands, "island is mirrored", "islands are mirrored")
