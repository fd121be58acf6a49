"""Checks and conversions of options. Every complaint names the option and what it may be."""

from __future__ import annotations

import os
from collections.abc import Sequence
from operator import index
from typing import Any

import numpy as np

from .errors import InvalidInput

#: Counts are 32-bit integers in the solver.
LARGEST_COUNT = 2**31 - 1

#: More threads than any machine has, fewer than would exhaust it.
MOST_THREADS = 1024

#: Wider or taller textures are refused.
MOST_ASPECT = 16.0

_LONGEST_SHOWN = 80


def shown(value: Any) -> str:
    """``repr(value)`` for a message: short, and for whatever object; some cannot be shown at all."""
    try:
        text = repr(value)
    except Exception:  # such as integers of more than 4300 digits
        text = f"an object of type {type(value).__name__}"
    return text if len(text) <= _LONGEST_SHOWN else text[: _LONGEST_SHOWN - 3] + "..."


def whole_number(value: Any) -> int | None:
    """``value`` as an integer if it is one; truth values and arrays are none."""
    if isinstance(value, (bool, np.bool_, np.ndarray)):
        return None
    try:
        return index(value)
    except Exception:  # whatever the object's own conversion raises
        return None


def real_number(value: Any) -> float | None:
    """``value`` as a float if it is a number; words, truth values and arrays are none."""
    if isinstance(value, (bool, np.bool_, str, bytes, bytearray, np.ndarray, np.timedelta64)):
        return None
    try:
        return float(value)
    except Exception:  # as above; also whole numbers beyond the range of floats
        return None


def as_count(value: Any, name: str, least: int = 0, most: int = LARGEST_COUNT) -> int:
    """``value`` as a whole number from ``least`` to ``most``."""
    count = whole_number(value)
    if count is None:
        raise InvalidInput(f"{name} must be a whole number, not {shown(value)}.", code="bad option")
    if count < least:
        raise InvalidInput(
            f"{name} must be at least {least}, not {shown(count)}.", code="bad option"
        )
    if count > most:
        raise InvalidInput(f"{name} must be at most {most}, not {shown(count)}.", code="bad option")
    return count


def as_threads(value: Any) -> int:
    """``value`` as the number of threads of a call; None and 0 are one for each core that this process may use."""
    count = 0 if value is None else as_count(value, "threads", 0, MOST_THREADS)
    return count or min(_usable_cores(), MOST_THREADS)


def _usable_cores() -> int:
    try:
        return len(os.sched_getaffinity(0))
    except AttributeError:  # not every system says
        return os.cpu_count() or 1


def as_number(value: Any, name: str) -> float:
    """``value`` as a finite float."""
    number = real_number(value)
    if number is None:
        raise InvalidInput(f"{name} must be a number, not {shown(value)}.", code="bad option")
    if not np.isfinite(number):
        raise InvalidInput(
            f"{name} must be a finite number, not {shown(value)}.", code="bad option"
        )
    return number


def as_positive(value: Any, name: str) -> float:
    """``value`` as a finite float above zero."""
    number = as_number(value, name)
    if not number > 0.0:
        raise InvalidInput(f"{name} must be positive, not {shown(value)}.", code="bad option")
    return number


def as_seconds(value: Any, name: str) -> float:
    """``value`` as a limit in seconds; None and 0 are none, which is 0."""
    number = 0.0 if value is None else as_number(value, name)
    if number < 0.0:
        raise InvalidInput(f"{name} must not be negative, not {shown(value)}.", code="bad option")
    return number


def as_effort(value: Any) -> float:
    effort = as_number(value, "effort")
    if not 0.0 <= effort <= 1000.0:
        raise InvalidInput(f"effort must lie in [0, 1000], not {shown(value)}.", code="bad option")
    return effort


def as_aspect(value: Any) -> float:
    """``value`` as the width of a texture over its height."""
    aspect = as_number(value, "aspect")
    if not 1.0 / MOST_ASPECT <= aspect <= MOST_ASPECT:
        raise InvalidInput(
            f"aspect is the texture's width over its height, in [1/{MOST_ASPECT:g}, {MOST_ASPECT:g}], not {shown(value)}.",
            code="bad option",
        )
    return aspect


def as_margin(value: Any) -> float:
    """``value`` as the space between charts, a fraction of the unit square."""
    margin = as_number(value, "margin")
    if not 0.0 <= margin < 0.5:
        raise InvalidInput(f"margin must lie in [0, 0.5), not {shown(value)}.", code="bad option")
    return margin


def as_stretch(value: Any) -> float:
    """``value`` as the factor by which lengths may change."""
    stretch = as_number(value, "stretch")
    if not 1.0 < stretch <= 100.0:
        raise InvalidInput(
            f"stretch must be above 1 and at most 100, not {shown(value)}.", code="bad option"
        )
    return stretch


def as_flag(value: Any, name: str) -> bool:
    """``value`` if it is true or false; words such as "no" are refused instead of taken as true."""
    if isinstance(value, (bool, np.bool_)) or (type(value) is int and value in (0, 1)):
        return bool(value)
    raise InvalidInput(f"{name} must be True or False, not {shown(value)}.", code="bad option")


def as_choice(value: Any, name: str, choices: Sequence[str], otherwise: str = "") -> str:
    """``value`` if it is one of ``choices``; ``otherwise`` says what else the caller takes."""
    if isinstance(value, str):
        word = str.__str__(value)
        if word in choices:
            return word
    raise InvalidInput(
        f"{name} must be one of {', '.join(choices)}{otherwise}, not {shown(value)}.",
        code="bad option",
    )
