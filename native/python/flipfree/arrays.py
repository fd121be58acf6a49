"""Checks and conversions of array arguments. Every complaint names the argument."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

from .errors import InvalidInput


def as_floats(values: Any, name: str, columns: int | None = None) -> npt.NDArray[np.float64]:
    """``values`` as a C-contiguous float64 array of shape (n, columns), or (n,) without columns."""
    try:
        array = np.ascontiguousarray(values, dtype=np.float64)
    except (TypeError, ValueError) as error:
        raise InvalidInput(
            f"{name} is not an array of numbers: {error}.", code="array of the wrong shape"
        ) from None
    return _shaped(array, name, columns)


def as_indices(values: Any, name: str, columns: int | None = None) -> npt.NDArray[np.int32]:
    """``values`` as a C-contiguous int32 array; fractions and values out of range are refused."""
    try:
        array = np.asarray(values)
        if array.size == 0:
            array = array.astype(np.int64)
        if not np.issubdtype(array.dtype, np.integer):
            whole = array.astype(np.int64)
            if not np.array_equal(whole, array):
                raise ValueError("it has fractions")
            array = whole
    except (TypeError, ValueError) as error:
        raise InvalidInput(
            f"{name} is not an array of whole numbers: {error}.", code="array of the wrong shape"
        ) from None
    limits = np.iinfo(np.int32)
    if array.size and (array.min() < limits.min or array.max() > limits.max):
        raise InvalidInput(f"{name} has an index beyond 32 bits.", code="index out of range")
    return _shaped(np.ascontiguousarray(array, dtype=np.int32), name, columns)


def _shaped(array: npt.NDArray[Any], name: str, columns: int | None) -> npt.NDArray[Any]:
    if array.size == 0:
        array = array.reshape((0,) if columns is None else (0, columns))
    wanted = "(n,)" if columns is None else f"(n, {columns})"
    fits = array.ndim == 1 if columns is None else array.ndim == 2 and array.shape[1] == columns
    if not fits:
        raise InvalidInput(
            f"{name} must have shape {wanted}, not {array.shape}.", code="array of the wrong shape"
        )
    return array


def as_corner_uv(values: Any, name: str, face_count: int) -> npt.NDArray[np.float64]:
    """``values`` of shape (faces, 3, 2) as (3 faces, 2)."""
    try:
        array = np.ascontiguousarray(values, dtype=np.float64)
    except (TypeError, ValueError) as error:
        raise InvalidInput(
            f"{name} is not an array of numbers: {error}.", code="array of the wrong shape"
        ) from None
    if array.shape != (face_count, 3, 2):
        raise InvalidInput(
            f"{name} must have shape ({face_count}, 3, 2), one UV per face corner, not {array.shape}.",
            code="array of the wrong shape",
        )
    return array.reshape(-1, 2)
