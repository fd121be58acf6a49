"""Signs of determinants of floating-point numbers: doubles with a rigorous bound, then integers."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

Floats = npt.NDArray[np.float64]
Signs = npt.NDArray[np.int8]

# Shewchuk 1997, section 4.1: (3 + 16 e) e with e = 2^-53, rounded up.
_BOUND = 3.3306690738754731e-16
#: Sign of a determinant that doubles do not decide.
UNKNOWN = 2


def filtered_turns(a: Floats, b: Floats, c: Floats) -> Signs:
    """Which way a, b, c (..., 2) turn: 1 left, -1 right, 0 straight, UNKNOWN. What is not UNKNOWN is exact."""
    left = (a[..., 0] - c[..., 0]) * (b[..., 1] - c[..., 1])
    right = (a[..., 1] - c[..., 1]) * (b[..., 0] - c[..., 0])
    turn = left - right
    # Products that leave the normal range lose more than the relative bound says.
    bound = _BOUND * (np.abs(left) + np.abs(right)) + 1e-290
    straight = _zero_factor(a, b, c, 0, 1) & _zero_factor(a, b, c, 1, 0)
    sign = np.where(np.abs(turn) > bound, np.sign(turn), UNKNOWN)
    return np.where(straight, 0, sign).astype(np.int8)


def _zero_factor(a: Floats, b: Floats, c: Floats, i: int, j: int) -> npt.NDArray[np.bool_]:
    return (a[..., i] == c[..., i]) | (b[..., j] == c[..., j])


def exact_turns(a: Floats, b: Floats, c: Floats) -> Signs:
    """As filtered_turns, in integers: never UNKNOWN, and slow."""
    stacked = integers(np.stack(np.broadcast_arrays(a, b, c)))
    a, b, c = stacked
    turn = (a[..., 0] - c[..., 0]) * (b[..., 1] - c[..., 1]) - (a[..., 1] - c[..., 1]) * (
        b[..., 0] - c[..., 0]
    )
    return np.asarray((turn > 0).astype(np.int8) - (turn < 0).astype(np.int8))


def turns(a: Floats, b: Floats, c: Floats) -> Signs:
    """Which way a, b, c (n, 2) turn, exactly."""
    sign = filtered_turns(a, b, c)
    open_ = sign == UNKNOWN
    if open_.any():
        sign[open_] = exact_turns(a[open_], b[open_], c[open_])
    return sign


def integers(values: Floats) -> npt.NDArray[np.object_]:
    """The values times one power of two that makes all of them integers, as Python's."""
    mantissa, exponent = np.frexp(values)
    if not np.isfinite(values).all():
        raise ValueError("A coordinate is not finite.")
    whole = (mantissa * 2.0**53).astype(np.int64)
    least = int(exponent[whole != 0].min(initial=0))
    shift = np.where(whole != 0, exponent - least, 0)
    flat = [m << s for m, s in zip(whole.ravel().tolist(), shift.ravel().tolist(), strict=True)]
    result = np.empty(len(flat), object)
    result[:] = flat
    return result.reshape(values.shape)
