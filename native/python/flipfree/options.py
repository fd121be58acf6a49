"""Checks and conversions of options. Every complaint names the option and what it may be."""

from __future__ import annotations

from collections.abc import Sequence
from operator import index
from typing import Any

import numpy as np

from .errors import InvalidInput


def as_count(value: Any, name: str, least: int = 0) -> int:
    """``value`` as a whole number that is not below ``least``."""
    try:
        count = index(value)
    except TypeError:
        raise InvalidInput(
            f"{name} must be a whole number, not {value!r}.", code="bad option"
        ) from None
    if count < least:
        raise InvalidInput(f"{name} must be at least {least}, not {count}.", code="bad option")
    return count


def as_number(value: Any, name: str) -> float:
    """``value`` as a finite float."""
    try:
        number = float(value)
    except (TypeError, ValueError):
        raise InvalidInput(f"{name} must be a number, not {value!r}.", code="bad option") from None
    if not np.isfinite(number):
        raise InvalidInput(f"{name} must be a finite number, not {value!r}.", code="bad option")
    return number


def as_positive(value: Any, name: str) -> float:
    """``value`` as a finite float above zero."""
    number = as_number(value, name)
    if not number > 0.0:
        raise InvalidInput(f"{name} must be positive, not {value!r}.", code="bad option")
    return number


def as_seconds(value: Any, name: str) -> float:
    """``value`` as a limit in seconds; None and 0 are none, which is 0."""
    number = 0.0 if value is None else as_number(value, name)
    if number < 0.0:
        raise InvalidInput(f"{name} must not be negative, not {value!r}.", code="bad option")
    return number


def as_margin(value: Any) -> float:
    """``value`` as the space between charts, a fraction of the unit square."""
    margin = as_number(value, "margin")
    if not 0.0 <= margin < 0.5:
        raise InvalidInput(f"margin must lie in [0, 0.5), not {value}.", code="bad option")
    return margin


def as_flag(value: Any, name: str) -> bool:
    """``value`` if it is true or false; words such as "no" are refused instead of taken as true."""
    if isinstance(value, (bool, np.bool_)) or (isinstance(value, int) and value in (0, 1)):
        return bool(value)
    raise InvalidInput(f"{name} must be True or False, not {value!r}.", code="bad option")


def as_choice(value: Any, name: str, choices: Sequence[str], otherwise: str = "") -> str:
    """``value`` if it is one of ``choices``; ``otherwise`` says what else the caller takes."""
    if isinstance(value, str) and value in choices:
        return value
    raise InvalidInput(
        f"{name} must be one of {', '.join(choices)}{otherwise}, not {value!r}.", code="bad option"
    )
