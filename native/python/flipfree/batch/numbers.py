"""Types of the options that are numbers: what no model can be solved with is refused before any is."""

from __future__ import annotations

import argparse
import contextlib
import math
from collections.abc import Callable, Mapping
from typing import Any, TypeVar

from ..calls.conformal import LEAST_BITS, MOST_BITS
from ..checks import LARGEST_COUNT, MOST_ASPECT
from .plan import PlanError

Number = TypeVar("Number", int, float)


def real(
    least: float = -math.inf,
    most: float = math.inf,
    *,
    above: float = -math.inf,
    below: float = math.inf,
) -> Callable[[str], float]:
    """For argparse: a finite number within the bounds, of which ``above`` and ``below`` are excluded themselves."""
    return _number(
        float,
        lambda value: least <= value <= most and above < value < below,
        "a number",
        {"from": least, "above": above, "to": most, "below": below},
    )


def whole(least: int, most: int = LARGEST_COUNT) -> Callable[[str], int]:
    """For argparse: a whole number within the bounds."""
    bounds = {"from": least, "to": math.inf if most == LARGEST_COUNT else most}
    return _number(int, lambda value: least <= value <= most, "a whole number", bounds)


def _number(
    kind: Callable[[str], Number],
    fits: Callable[[Number], bool],
    words: str,
    bounds: dict[str, float],
) -> Callable[[str], Number]:
    for word, bound in bounds.items():
        words += f" {word} {bound:g}" if math.isfinite(bound) else ""

    def number(text: str) -> Number:
        with contextlib.suppress(ValueError):
            value = kind(text)
            if fits(value):
                return value
        raise argparse.ArgumentTypeError(f"must be {words}, not {text!r}")

    return number


stretch = real(above=1.0, most=100.0)
#: Of the scale, for suggested cones.
bound = real(above=1.0)


def precision(text: str) -> int:
    """For argparse: mantissa bits, 0 for as many as it takes."""
    return 0 if text in ("auto", "0") else whole(LEAST_BITS, MOST_BITS)(text)


#: Options that several commands have: their type and default.
OPTIONS: dict[str, tuple[Callable[[str], float], float]] = {
    "bound": (bound, 4.0),
    "effort": (real(0.0, 1000.0), 1.0),
    "iterations": (whole(0), 200),
    "precision": (precision, 0),
    "margin_pixels": (real(0.0), 4.0),
    "texture_size": (whole(1), 1024),
    "tile": (whole(1001, 1100), 1001),
    "tiles": (whole(1, 100), 1),
}

#: Options of a command by their words: "--name" is a flag, "--name a|b" a choice, the first of them by default, and what has a
#: type and a default beside its text is a number or a word.
Options = Mapping[str, str | tuple[Callable[[str], Any], Any, str]]


def add_options(parser: argparse.ArgumentParser, options: Options) -> None:
    for key, told in options.items():
        word, _, choices = key.partition(" ")
        if isinstance(told, tuple):
            kind, default, text = told
            parser.add_argument(word, type=kind, default=default, help=text)
        elif choices:
            words = choices.split("|")
            parser.add_argument(word, choices=words, default=words[0], help=told)
        else:
            parser.add_argument(word, action="store_true", help=told)


def of_several(**texts: str) -> Options:
    """Such as several commands have, with what they are of this one."""
    return {f"--{name.replace('_', '-')}": (*OPTIONS[name], text) for name, text in texts.items()}


def margin(options: dict[str, Any]) -> float:
    """In widths of the texture."""
    return float(options["margin_pixels"] / options["texture_size"])


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
