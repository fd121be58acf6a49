"""Types of the options that are numbers: what no model can be solved with is refused before any is."""

from __future__ import annotations

import argparse
from collections.abc import Callable
from typing import Any

from ..options import LARGEST_COUNT, MOST_ASPECT
from .plan import PlanError


def real(
    least: float | None = None,
    most: float | None = None,
    *,
    above: float | None = None,
    below: float | None = None,
) -> Callable[[str], float]:
    """For argparse: a finite number within the bounds, of which ``above`` and ``below`` are excluded themselves."""
    words = _words("a number", least, most, above, below)

    def number(text: str) -> float:
        try:
            value = float(text)
        except ValueError:
            value = float("nan")
        if (
            not float("-inf") < value < float("inf")
            or (least is not None and value < least)
            or (most is not None and value > most)
            or (above is not None and not value > above)
            or (below is not None and not value < below)
        ):
            raise argparse.ArgumentTypeError(f"must be {words}, not {text!r}")
        return value

    return number


def whole(least: int, most: int = LARGEST_COUNT) -> Callable[[str], int]:
    """For argparse: a whole number within the bounds."""
    words = _words("a whole number", least, None if most == LARGEST_COUNT else most, None, None)

    def number(text: str) -> int:
        try:
            value = int(text)
        except ValueError:
            value = least - 1
        if not least <= value <= most:
            raise argparse.ArgumentTypeError(f"must be {words}, not {text!r}")
        return value

    return number


def _words(
    kind: str, least: float | None, most: float | None, above: float | None, below: float | None
) -> str:
    named = (("from", least), ("above", above), ("to", most), ("below", below))
    return " ".join([kind, *(f"{word} {bound:g}" for word, bound in named if bound is not None)])


#: Space between islands, in widths of the unit square.
margin = real(0.0, below=0.5)
stretch = real(above=1.0, most=100.0)
#: Of the scale, for suggested cones.
bound = real(above=1.0)
effort = real(0.0, 1000.0)
pixels = real(0.0)
texture_size = whole(1)
tile = whole(1001, 1100)
tiles = whole(1, 100)
iterations = whole(0)


def aspect(text: str) -> float:
    """For argparse: the shape of a texture, as one number or as two."""
    width, _, height = text.replace("x", ":").partition(":")
    try:
        value = float(width) / float(height or 1.0)
    except (ValueError, ZeroDivisionError):
        value = float("nan")
    if not 1.0 / MOST_ASPECT <= value <= MOST_ASPECT:
        raise argparse.ArgumentTypeError(
            f"must be a texture's width over its height, such as 2, 16:9 or 2048x1024, within {MOST_ASPECT:g} either way, "
            f"not {text!r}"
        )
    return value


def refuse_together(options: dict[str, Any]) -> None:
    """What only several numbers are at fault for. Raises PlanError."""
    if "margin_pixels" in options and not options["margin_pixels"] < options["texture_size"] / 2:
        raise PlanError(
            f"--margin-pixels {options['margin_pixels']:g}: it must be below half of the {options['texture_size']} pixels "
            "of --texture-size. Give fewer pixels, or a larger texture."
        )
    if options.get("tiles", 1) > 1 and options.get("aspect", 1.0) != 1.0:
        raise PlanError(
            "--aspect: islands are spread over several --tiles only where these are squares. Leave one of them out."
        )
