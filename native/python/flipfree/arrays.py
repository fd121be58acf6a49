"""Checks and conversions of array arguments. Every complaint names the argument."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from itertools import islice
from typing import Any

import numpy as np
import numpy.ma
import numpy.typing as npt

from .errors import InvalidInput
from .options import real_number, shown, whole_number

#: Binary exponents of coordinates beyond which products of four lengths leave the range of doubles.
ORDINARY_EXPONENT = 128

#: The largest coordinate that a stored UV can have.
LARGEST_UV = float(np.finfo(np.float32).max)

#: Corner ids are 32-bit integers, so there can be no more faces (or vertices) than this.
MOST_ROWS = (2**31 - 1) // 3

#: What a list of constraints may have, so that an endless iterator ends.
MOST_LISTED = 2**20

BAD_SHAPE = "array of the wrong shape"

FloatArray = npt.NDArray[np.float64]
IntArray = npt.NDArray[np.int32]


def _as_array(values: Any, name: str, of: str) -> npt.NDArray[Any]:
    """``values`` as an array whose elements are integers, floats or objects; ``of`` says what they should be."""
    try:
        array = np.asarray(values)
    except Exception as error:  # whatever the object's own conversion raises
        raise _not_an_array(name, of, str(error)) from None
    if isinstance(values, np.ma.MaskedArray) and np.ma.is_masked(values):
        raise _not_an_array(name, of, "it has masked values")
    if array.ndim == 0:
        raise _not_an_array(name, of, f"it is {shown(values)}")
    if array.size and array.dtype.kind not in "iufO":
        what = "complex numbers" if array.dtype.kind == "c" else f"the type {array.dtype}"
        raise _not_an_array(name, of, f"it has {what}")
    if array.shape[0] > MOST_ROWS:
        raise InvalidInput(
            f"{name} has {array.shape[0]} rows, more than 32-bit indices can count. Split the mesh.",
            code=BAD_SHAPE,
        )
    return array


def _not_an_array(name: str, of: str, reason: str) -> InvalidInput:
    return InvalidInput(f"{name} is not an array of {of}: {reason}.", code=BAD_SHAPE)


def _shaped(array: npt.NDArray[Any], name: str, columns: int | None) -> npt.NDArray[Any]:
    if array.size == 0 and (array.ndim == 1 or array.shape[0] == 0):
        array = array.reshape((0,) if columns is None else (0, columns))
    wanted = "(n,)" if columns is None else f"(n, {columns})"
    fits = array.ndim == 1 if columns is None else array.ndim == 2 and array.shape[1] == columns
    if not fits:
        raise InvalidInput(f"{name} must have shape {wanted}, not {array.shape}.", code=BAD_SHAPE)
    return array


def _to_floats(array: npt.NDArray[Any], name: str) -> FloatArray:
    if array.size == 0:
        return np.zeros(array.shape)
    if array.dtype.kind == "O":
        numbers = np.empty(array.shape)
        for i, value in enumerate(array.flat):
            number = real_number(value)
            if number is None:
                raise _not_an_array(name, "numbers", f"it has {shown(value)}")
            numbers.flat[i] = number
        return numbers
    with np.errstate(
        all="ignore"
    ):  # longer floats may become infinite: refused where they are used
        return np.ascontiguousarray(array, dtype=np.float64)


def as_floats(values: Any, name: str, columns: int | None = None) -> FloatArray:
    """``values`` as a C-contiguous float64 array of shape (n, columns), or (n,) without columns."""
    return _to_floats(_shaped(_as_array(values, name, "numbers"), name, columns), name)


def _to_whole_numbers(array: npt.NDArray[Any], name: str) -> npt.NDArray[Any]:
    if array.dtype.kind == "f":
        if not np.isfinite(array).all():
            raise _not_an_array(name, "whole numbers", "it has NaN or infinite numbers")
        if (array != np.trunc(array)).any():
            raise _not_an_array(name, "whole numbers", "it has fractions")
    if array.dtype.kind != "O":
        return array
    whole = []
    for value in array.flat:
        number = whole_number(value)
        if number is None:
            raise _not_an_array(name, "whole numbers", f"it has {shown(value)}")
        whole.append(max(min(number, 2**62), -(2**62)))  # beyond either way
    return np.array(whole, np.int64).reshape(array.shape)


def as_indices(values: Any, name: str, columns: int | None = None) -> IntArray:
    """``values`` as a C-contiguous int32 array; fractions and values out of range are refused."""
    array = _shaped(_as_array(values, name, "whole numbers"), name, columns)
    if array.size == 0:
        return np.zeros(array.shape, np.int32)
    array = _to_whole_numbers(array, name)
    limits = np.iinfo(np.int32)
    if array.min() < limits.min or array.max() > limits.max:
        raise InvalidInput(f"{name} has an index beyond 32 bits.", code="index out of range")
    return np.ascontiguousarray(array, dtype=np.int32)


def as_face_numbers(values: Any, name: str, face_count: int) -> IntArray:
    """One whole number for each face, or none at all for None."""
    array = as_indices([] if values is None else values, name)
    if values is not None and len(array) != face_count:
        raise InvalidInput(
            f"{name} must have as many numbers as there are faces, {face_count}, not {len(array)}.",
            code=BAD_SHAPE,
        )
    return array


def as_corner_uv(values: Any, name: str, face_count: int) -> FloatArray:
    """``values`` of shape (faces, 3, 2) as (3 faces, 2)."""
    array = _as_array(values, name, "numbers")
    if array.shape != (face_count, 3, 2):
        raise InvalidInput(
            f"{name} must have shape ({face_count}, 3, 2), one UV per face corner, not {array.shape}.",
            code=BAD_SHAPE,
        )
    return _to_floats(array, name).reshape(-1, 2)


def as_triangles(values: Any, name: str) -> FloatArray:
    """``values`` of shape (n, 3, 2) as (3 n, 2)."""
    array = _as_array(values, name, "numbers")
    if array.size == 0:
        return np.zeros((0, 2))
    if array.ndim != 3 or array.shape[1:] != (3, 2):
        raise InvalidInput(f"{name} must have shape (n, 3, 2), not {array.shape}.", code=BAD_SHAPE)
    return _to_floats(array, name).reshape(-1, 2)


@dataclass(frozen=True, eq=False)
class Positions:
    """Vertices of a mesh: as given, and as the solvers take them.

    Attributes:
        given: (n, 3), in the caller's unit.
        scaled: (n, 3), divided by 2 to the exponent, which is exact: squares of areas neither overflow nor vanish.
            Vertices that no face uses are at the origin there, so that they decide nothing.
        exponent: 0 for ordinary coordinates.
    """

    given: FloatArray
    scaled: FloatArray
    exponent: int

    def restored(self, vertices: FloatArray) -> FloatArray:
        """The vertices of a result, which begin with those that were given, in the caller's unit."""
        result = in_unit(vertices, -self.exponent)
        result[: len(self.given)] = self.given
        return result


def as_vertices(
    values: Any, faces: IntArray, name: str = "vertices", exponent: int | None = None
) -> Positions:
    """``values`` as the vertices of ``faces``; their own unit, unless ``exponent`` tells one."""
    given = as_floats(values, name, 3)
    used = np.zeros(len(given), bool)
    in_range = not faces.size or (faces.min() >= 0 and faces.max() < len(given))
    used[faces if in_range else faces[(faces >= 0) & (faces < len(given))]] = True
    all_used = bool(used.all())
    exponent = _unit_of(given if all_used else given[used]) if exponent is None else exponent
    scaled = in_unit(given, exponent)
    if not all_used:
        loose = ~used & np.isfinite(given).all(axis=1)  # others are refused by name
        scaled = scaled.copy()
        scaled[loose] = 0.0
    return Positions(given, scaled, exponent)


def as_lengths(values: Any) -> tuple[FloatArray, int]:
    """The edge lengths of faces, and the exponent of their unit as in :class:`Positions`."""
    array = as_floats(values, "lengths", 3)
    exponent = _unit_of(array)
    return in_unit(array, exponent), exponent


def in_unit(array: FloatArray, exponent: int) -> FloatArray:
    """``array`` divided by 2 to the exponent."""
    with np.errstate(over="ignore"):
        return np.ldexp(array, -exponent) if exponent else array


def _unit_of(array: FloatArray) -> int:
    size = np.abs(array).max(initial=0.0)
    exponent = int(np.frexp(size)[1]) if np.isfinite(size) else 0
    return exponent if abs(exponent) > ORDINARY_EXPONENT else 0


def as_places(values: Any, name: str) -> FloatArray:
    """``values`` as (n, 2) places of the map, refused where no stored UV could be so large."""
    array = as_floats(values, name, 2)
    refuse_beyond_storage(array, name)
    return array


def as_place(values: Any, name: str) -> FloatArray:
    """``values`` as one place (u, v) of the map, refused where no stored UV could be so large."""
    array = as_floats(values, name)
    if array.shape != (2,):
        raise InvalidInput(f"{name} must be two numbers (u, v).", code=BAD_SHAPE)
    refuse_beyond_storage(array, name)
    return array


def refuse_beyond_storage(array: FloatArray, name: str) -> None:
    """Infinite and undefined coordinates pass: the solvers name their vertices."""
    if not array.size or (array.min() >= -LARGEST_UV and array.max() <= LARGEST_UV):
        return  # of a million faces what follows would be felt
    beyond = np.isfinite(array) & (np.abs(array) > LARGEST_UV)
    if beyond.any():
        raise InvalidInput(
            f"{name} has the coordinate {array[beyond][0]:g}, more than UVs can store (3.4e38). Scale it down.",
            code="coordinate is not finite",
        )


def as_items(values: Any, name: str, meaning: str, code: str = BAD_SHAPE) -> list[tuple[Any, Any]]:
    """The items of a dict, none for None; ``meaning`` says in the complaint what it should be."""
    if values is None:
        return []
    if not isinstance(values, Mapping):
        raise InvalidInput(
            f"{name} must be a dict {meaning}, not {type(values).__name__}.", code=code
        )
    try:
        return [(key, value) for key, value in values.items()]
    except Exception as error:  # a mapping of the caller's own
        raise InvalidInput(
            f"{name} must be a dict {meaning}; its items cannot be read: {error}.", code=code
        ) from None


def as_vertex_map(values: Any, name: str, meaning: str) -> dict[int, Any]:
    """``values`` as {vertex: value}; ``meaning`` says in the complaint what a value is."""
    result: dict[int, Any] = {}
    for key, value in as_items(values, name, f"{{vertex: {meaning}}}"):
        vertex = whole_number(key)
        if vertex is None:
            raise InvalidInput(
                f"{name} has the key {shown(key)}, which is no vertex. Give {{vertex: {meaning}}}.",
                code=BAD_SHAPE,
            )
        result[vertex] = value
    return result


def as_list(values: Any, name: str, of: str) -> list[Any]:
    """``values`` as a list of at most MOST_LISTED; ``of`` says in the complaint what it should be."""
    try:
        result = list(islice(iter(values), MOST_LISTED + 1))
    except Exception:  # it cannot be iterated over, or its iteration fails
        raise InvalidInput(f"{name} must be {of}, not {shown(values)}.", code=BAD_SHAPE) from None
    if len(result) > MOST_LISTED:
        raise InvalidInput(
            f"{name} has more than {MOST_LISTED} elements. Give fewer.", code=BAD_SHAPE
        )
    return result
