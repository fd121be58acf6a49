"""Checks and conversions of arguments. Every complaint names the argument and what it may be."""

from __future__ import annotations

import os
from collections.abc import Callable, Mapping, Sequence
from functools import partial
from itertools import islice
from operator import index
from typing import Any, TypeVar

import numpy as np
import numpy.ma
import numpy.typing as npt

from .errors import InvalidInput, bad_option, bad_shape, out_of_range
from .results import FloatArray, IntArray, Mesh, in_unit

Number = TypeVar("Number", int, float)

#: Binary exponents of coordinates beyond which products of four lengths leave the range of doubles.
ORDINARY_EXPONENT = 128

#: The largest coordinate that a stored UV can have.
LARGEST_UV = float(np.finfo(np.float32).max)

#: Counts are 32-bit integers in the solver.
LARGEST_COUNT = 2**31 - 1

#: Corner ids are 32-bit integers, so there can be no more faces (or vertices) than this.
MOST_ROWS = LARGEST_COUNT // 3

#: What a list of constraints may have, so that an endless iterator ends.
MOST_LISTED = 2**20

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
        must = f"a whole number, not {shown(value)}"
    elif count < least:
        must = f"at least {least}, not {shown(count)}"
    elif count > most:
        must = f"at most {most}, not {shown(count)}"
    else:
        return count
    raise bad_option(f"{name} must be {must}.")


def as_threads(value: Any) -> int:
    """``value`` as the number of threads of a call; None and 0 are one for each core that this process may use."""
    count = 0 if value is None else as_count(value, "threads", 0, MOST_THREADS)
    return count or min(usable_cores(), MOST_THREADS)


def usable_cores() -> int:
    try:
        return len(os.sched_getaffinity(0))
    except AttributeError:  # not every system says
        return os.cpu_count() or 1


def as_number(
    value: Any, name: str, must: str = "", fits: Callable[[float], bool] = np.isfinite
) -> float:
    """``value`` as a finite float that ``fits``; ``must`` says in the complaint what that is."""
    number = real_number(value)
    if number is None:
        must = "must be a number"
    elif not np.isfinite(number):
        must = "must be a finite number"
    elif fits(number):
        return number
    raise bad_option(f"{name} {must}, not {shown(value)}.")


as_positive = partial(as_number, must="must be positive", fits=lambda x: x > 0.0)


def as_seconds(value: Any, name: str) -> float:
    """``value`` as a limit in seconds; None and 0 are none, which is 0."""
    return as_number(
        0.0 if value is None else value, name, "must not be negative", lambda x: x >= 0.0
    )


def as_flag(value: Any, name: str) -> bool:
    """``value`` if it is true or false; words such as "no" are refused instead of taken as true."""
    if isinstance(value, (bool, np.bool_)) or (type(value) is int and value in (0, 1)):
        return bool(value)
    raise bad_option(f"{name} must be True or False, not {shown(value)}.")


def as_choice(value: Any, name: str, choices: Sequence[str], otherwise: str = "") -> str:
    """``value`` if it is one of ``choices``; ``otherwise`` says what else the caller takes."""
    if isinstance(value, str):
        word = str.__str__(value)
        if word in choices:
            return word
    raise bad_option(f"{name} must be one of {', '.join(choices)}{otherwise}, not {shown(value)}.")


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
        raise bad_shape(
            f"{name} has {array.shape[0]} rows, more than 32-bit indices can count. Split the mesh."
        )
    return array


def _not_an_array(name: str, of: str, reason: str) -> InvalidInput:
    return bad_shape(f"{name} is not an array of {of}: {reason}.")


def _shaped(array: npt.NDArray[Any], name: str, columns: int | None) -> npt.NDArray[Any]:
    if array.size == 0 and (array.ndim == 1 or array.shape[0] == 0):
        array = array.reshape((0,) if columns is None else (0, columns))
    wanted = "(n,)" if columns is None else f"(n, {columns})"
    fits = array.ndim == 1 if columns is None else array.ndim == 2 and array.shape[1] == columns
    if not fits:
        raise bad_shape(f"{name} must have shape {wanted}, not {array.shape}.")
    return array


def _to_floats(array: npt.NDArray[Any], name: str) -> FloatArray:
    if array.size == 0:
        return np.zeros(array.shape)
    if array.dtype.kind == "O":
        return np.array(_each(array, name, "numbers", real_number)).reshape(array.shape)
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
    whole = _each(array, name, "whole numbers", whole_number)
    beyond = 2**62  # either way, of 32 bits
    return np.array([max(min(n, beyond), -beyond) for n in whole], np.int64).reshape(array.shape)


def _each(
    array: npt.NDArray[Any], name: str, of: str, convert: Callable[[Any], Number | None]
) -> list[Number]:
    """The objects of an array as numbers."""
    numbers = []
    for value in array.flat:
        number = convert(value)
        if number is None:
            raise _not_an_array(name, of, f"it has {shown(value)}")
        numbers.append(number)
    return numbers


def as_indices(values: Any, name: str, columns: int | None = None) -> IntArray:
    """``values`` as a C-contiguous int32 array; fractions and values out of range are refused."""
    array = _shaped(_as_array(values, name, "whole numbers"), name, columns)
    if array.size == 0:
        return np.zeros(array.shape, np.int32)
    array = _to_whole_numbers(array, name)
    limits = np.iinfo(np.int32)
    if array.min() < limits.min or array.max() > limits.max:
        raise out_of_range(f"{name} has an index beyond 32 bits.")
    return np.ascontiguousarray(array, dtype=np.int32)


def as_optional_indices(values: Any, name: str, columns: int | None = None) -> IntArray:
    """The same, and None as none."""
    return as_indices([] if values is None else values, name, columns)


def as_face_numbers(values: Any, name: str, face_count: int) -> IntArray:
    """One whole number for each face, or none at all for None."""
    array = as_optional_indices(values, name)
    if values is not None and len(array) != face_count:
        raise bad_shape(
            f"{name} must have as many numbers as there are faces, {face_count}, not {len(array)}."
        )
    return array


def as_corner_uv(values: Any, name: str, face_count: int | None = None) -> FloatArray:
    """``values`` of shape (faces, 3, 2) as (3 faces, 2); of any number of triangles, None is none."""
    free = face_count is None
    array = _as_array([] if free and values is None else values, name, "numbers")
    if free and array.size == 0:
        return np.zeros((0, 2))
    if array.ndim != 3 or array.shape[1:] != (3, 2) or face_count not in (None, len(array)):
        wanted = "(n, 3, 2)" if free else f"({face_count}, 3, 2), one UV per face corner"
        raise bad_shape(f"{name} must have shape {wanted}, not {array.shape}.")
    return _to_floats(array, name).reshape(-1, 2)


def as_mesh(vertices: Any, faces: Any, of: str = "", exponent: int | None = None) -> Mesh:
    """of: begins the arguments' names. Vertices are in their own unit, unless ``exponent`` tells one."""
    triangles = as_indices(faces, f"{of}faces", 3)
    given = as_floats(vertices, f"{of}vertices", 3)
    used = np.zeros(len(given), bool)
    in_range = not triangles.size or (triangles.min() >= 0 and triangles.max() < len(given))
    used[triangles if in_range else triangles[(triangles >= 0) & (triangles < len(given))]] = True
    all_used = bool(used.all())
    exponent = _unit_of(given if all_used else given[used]) if exponent is None else exponent
    scaled = in_unit(given, exponent)
    if not all_used:
        loose = ~used & np.isfinite(given).all(axis=1)  # others are refused by name
        scaled = scaled.copy()
        scaled[loose] = 0.0
    return Mesh(given, scaled, triangles, exponent)


def as_lengths(values: Any) -> tuple[FloatArray, int]:
    """The edge lengths of faces, and the exponent of their unit as in :class:`Mesh`."""
    array = as_floats(values, "lengths", 3)
    exponent = _unit_of(array)
    return in_unit(array, exponent), exponent


def _unit_of(array: FloatArray) -> int:
    size = np.abs(array).max(initial=0.0)
    exponent = int(np.frexp(size)[1]) if np.isfinite(size) else 0
    return exponent if abs(exponent) > ORDINARY_EXPONENT else 0


def as_places(values: Any, name: str) -> FloatArray:
    """``values`` as (n, 2) places of the map, refused where no stored UV could be so large."""
    array = as_floats(values, name, 2)
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


def as_items(
    values: Any, name: str, meaning: str, code: str = "array of the wrong shape"
) -> list[tuple[Any, Any]]:
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
            raise bad_shape(
                f"{name} has the key {shown(key)}, which is no vertex. Give {{vertex: {meaning}}}."
            )
        result[vertex] = value
    return result


def as_angles(values: Any) -> list[tuple[int, float]]:
    """Cones {vertex: angle} as pairs."""
    cones = as_vertex_map(values, "cones", "angle")
    as_indices(list(cones), "cones")
    return [(v, as_number(angle, f"cones[{v}]")) for v, angle in cones.items()]


def as_list(values: Any, name: str, of: str) -> list[Any]:
    """``values`` as a list of at most MOST_LISTED, None as an empty one; ``of`` says in the complaint what it should be."""
    try:
        result = list(islice(iter(() if values is None else values), MOST_LISTED + 1))
    except Exception:  # it cannot be iterated over, or its iteration fails
        raise bad_shape(f"{name} must be {of}, not {shown(values)}.") from None
    if len(result) > MOST_LISTED:
        raise bad_shape(f"{name} has more than {MOST_LISTED} elements. Give fewer.")
    return result


_FLAGS = (
    "bijective cut_extremities disjoint exact keep_bijective may_add_cuts optimise repair require_convergence "
    "reroute scale_true seamless share_tile simplify stack_mirrored stack_similar tiled together"
).split()

#: Options that mean the same wherever a call has them: how they are checked.
OPTIONS: dict[str, Callable[[Any, str], Any]] = {
    **dict.fromkeys(_FLAGS, as_flag),
    **dict.fromkeys(("cuts", "features", "uncuttable"), partial(as_optional_indices, columns=2)),
    **dict.fromkeys(("corners", "groups", "layouts", "movable", "unmoved"), as_optional_indices),
    "aspect": partial(
        as_number,
        must=f"is the texture's width over its height, in [1/{MOST_ASPECT:g}, {MOST_ASPECT:g}]",
        fits=lambda x: 1.0 / MOST_ASPECT <= x <= MOST_ASPECT,
    ),
    "effort": partial(as_number, must="must lie in [0, 1000]", fits=lambda x: 0.0 <= x <= 1000.0),
    "iterations": as_count,
    "margin": partial(as_number, must="must lie in [0, 0.5)", fits=lambda x: 0.0 <= x < 0.5),
    "max_cones": partial(as_count, least=1),
    "max_iterations": partial(as_count, least=1),
    "max_seconds": as_seconds,
    "stretch": partial(
        as_number, must="must be above 1 and at most 100", fits=lambda x: 1.0 < x <= 100.0
    ),
    "tolerance": as_positive,
}


def checked(given: Mapping[str, Any], names: str) -> dict[str, Any]:
    """The options with these names, which blanks part, of a call's arguments."""
    return {name: OPTIONS[name](given[name], name) for name in names.split()}
