"""Checks and conversions of array arguments. Every complaint names the argument."""

from __future__ import annotations

from collections.abc import Mapping
from operator import index
from typing import Any

import numpy as np
import numpy.typing as npt

from .errors import InvalidInput

#: Binary exponents of coordinates beyond which products of four lengths leave the range of doubles.
ORDINARY_EXPONENT = 128

#: The largest coordinate that a stored UV can have.
LARGEST_UV = float(np.finfo(np.float32).max)


def _as_numbers(values: Any, name: str) -> npt.NDArray[np.float64]:
    try:
        array = np.asarray(values)
        if np.iscomplexobj(array):
            raise TypeError("it has complex numbers")
        return np.ascontiguousarray(array, dtype=np.float64)
    except (TypeError, ValueError) as error:
        raise InvalidInput(
            f"{name} is not an array of numbers: {error}.", code="array of the wrong shape"
        ) from None


def as_floats(values: Any, name: str, columns: int | None = None) -> npt.NDArray[np.float64]:
    """``values`` as a C-contiguous float64 array of shape (n, columns), or (n,) without columns."""
    return _shaped(_as_numbers(values, name), name, columns)


def as_indices(values: Any, name: str, columns: int | None = None) -> npt.NDArray[np.int32]:
    """``values`` as a C-contiguous int32 array; fractions and values out of range are refused."""
    try:
        array = np.asarray(values)
        if array.size == 0:
            array = array.astype(np.int64)
        if not np.issubdtype(array.dtype, np.integer):
            if array.dtype == np.bool_ or np.iscomplexobj(array):
                raise TypeError(f"it has the type {array.dtype}")
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
    array = _as_numbers(values, name)
    if array.shape != (face_count, 3, 2):
        raise InvalidInput(
            f"{name} must have shape ({face_count}, 3, 2), one UV per face corner, not {array.shape}.",
            code="array of the wrong shape",
        )
    return array.reshape(-1, 2)


def as_vertices(values: Any) -> tuple[npt.NDArray[np.float64], int]:
    """(vertices, exponent): positions in a unit in which squares of areas neither overflow nor vanish.

    The unit is 2 to the exponent, so that going there and back is exact; ordinary coordinates stay as they are.
    """
    array = as_floats(values, "vertices", 3)
    exponent = _unit_of(array)
    return in_unit(array, exponent), exponent


def as_lengths(values: Any) -> tuple[npt.NDArray[np.float64], int]:
    """As :func:`as_vertices`, for the edge lengths of faces."""
    array = as_floats(values, "lengths", 3)
    exponent = _unit_of(array)
    return in_unit(array, exponent), exponent


def in_unit(array: npt.NDArray[np.float64], exponent: int) -> npt.NDArray[np.float64]:
    """``array`` divided by 2 to the exponent."""
    return np.ldexp(array, -exponent) if exponent else array


def _unit_of(array: npt.NDArray[np.float64]) -> int:
    size = np.abs(array).max(initial=0.0)
    exponent = int(np.frexp(size)[1]) if np.isfinite(size) else 0
    return exponent if abs(exponent) > ORDINARY_EXPONENT else 0


def as_places(values: Any, name: str) -> npt.NDArray[np.float64]:
    """``values`` as (n, 2) places of the map, refused where no stored UV could be so large."""
    array = as_floats(values, name, 2)
    refuse_beyond_storage(array, name)
    return array


def refuse_beyond_storage(array: npt.NDArray[np.float64], name: str) -> None:
    """Infinite and undefined coordinates pass: the solvers name their vertices."""
    beyond = np.isfinite(array) & (np.abs(array) > LARGEST_UV)
    if beyond.any():
        raise InvalidInput(
            f"{name} has the coordinate {array[beyond][0]:g}, more than UVs can store (3.4e38). Scale it down.",
            code="coordinate is not finite",
        )


def as_vertex_map(values: Any, name: str, meaning: str) -> dict[int, Any]:
    """``values`` as {vertex: value}; ``meaning`` says in the complaint what a value is."""
    if values is None:
        return {}
    if not isinstance(values, Mapping):
        raise InvalidInput(
            f"{name} must be a dict {{vertex: {meaning}}}, not {type(values).__name__}.",
            code="array of the wrong shape",
        )
    result: dict[int, Any] = {}
    for key, value in values.items():
        try:
            result[index(key)] = value
        except TypeError:
            raise InvalidInput(
                f"{name} has the key {key!r}, which is no vertex. Give {{vertex: {meaning}}}.",
                code="array of the wrong shape",
            ) from None
    return result
