"""Options of the command lines: what no model can be solved with is refused before any is."""

from __future__ import annotations

import argparse
import contextlib
import math
from collections.abc import Callable
from pathlib import Path
from typing import Any, TypeVar

from .. import checks
from ..calls.conformal import LEAST_BITS, MOST_BITS
from ..checks import LARGEST_COUNT, MOST_ASPECT, Within
from ..quads import MOST_QUADS
from .plan import PlanError

Number = TypeVar("Number", int, float)


def real(
    least: float = -math.inf, most: float = math.inf, **bounds: float
) -> Callable[[str], float]:
    """For argparse: a number as of checks.real."""
    return _of_text(checks.real("a number", least=least, most=most, **bounds), float)


def whole(least: int, most: int = LARGEST_COUNT) -> Callable[[str], int]:
    """For argparse: a whole number within the bounds."""
    return _of_text(checks.whole(least, most), int)


def _of_text(within: Within[Number], kind: Callable[[str], Number]) -> Callable[[str], Number]:
    def number(text: str) -> Number:
        with contextlib.suppress(ValueError):
            value = within.number(kind(text))
            if value is not None:
                return value
        raise argparse.ArgumentTypeError(f"must be {within.words}, not {text!r}")

    return number


def precision(text: str) -> int:
    """For argparse: mantissa bits, 0 for as many as it takes."""
    return 0 if text in ("auto", "0") else whole(LEAST_BITS, MOST_BITS)(text)


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


#: Types of the options that have a value and are no word.
KINDS: dict[str, Callable[[str], Any]] = {
    "adaptive": real(0.0, 100.0),
    "aspect": aspect,
    "bound": real(above=1.0),
    "curvature": real(0.0, 1.0),
    "edge_weight": real(0.01, 1.0),
    "effort": real(0.0, 1000.0),
    "iterations": whole(0),
    "out": Path,
    "precision": precision,
    "sharp_from": real(0.0, 180.0),
    "stretch": real(above=1.0, most=100.0),
    "target": whole(1, MOST_QUADS),
    "tile": whole(1001, 1100),
    "tiles": whole(1, 100),
    **dict.fromkeys(("edge_length", "margin_pixels", "tile_size"), real(0.0)),
    **dict.fromkeys(("jobs", "texture_size", "threads", "tile_count"), whole(1)),
    **dict.fromkeys(("max_seconds", "memory", "timeout"), real(above=0.0)),
}


def add_options(parser: argparse.ArgumentParser, usage: str) -> None:
    """Those of a text, one a line, what it is after two blanks; indented lines go on.

    --quiet      a flag
    --field a|b  a choice, the first one by default
    --bound=4    a value of the type that it has above, or a word; nothing after the sign: none by default, '': no letters
    """
    for line in filter(None, usage.replace("\n    ", " ").splitlines()):
        form, _, text = line.partition("  ")
        word, _, choices = form.partition(" ")
        word, given, default = word.partition("=")
        if given:
            kind = KINDS.get(word[2:].replace("-", "_"), str)
            value = kind(default.strip("'")) if default else None
            parser.add_argument(word, type=kind, default=value, help=text)
        elif choices:
            words = choices.split("|")
            parser.add_argument(word, choices=words, default=words[0], help=text)
        else:
            parser.add_argument(word, action="store_true", help=text)


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
