"""Checks and conversions of arguments. Every complaint names the argument and what it may be."""

import operator
import os
from collections.abc import Callable, Mapping, Sequence
from functools import partial
from itertools import islice
from typing import Any, Generic, TypeVar

import numpy as np
import numpy.ma

from .errors import InvalidInput, bad_option, bad_pins, bad_shape, not_finite, out_of_range
from .results import Array, FloatArray, IntArray, Mesh, Parametrization, in_unit

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
        return operator.index(value)
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


class Within(Generic[Number]):
    """Checks that something is a number within bounds; words: what that is, for a complaint."""

    def __init__(
        self, kind: Callable[[Any], Number | None], noun: str, bounds: Mapping[str, float]
    ) -> None:
        """bounds: "least", "most", "above", "below", of which the last two are excluded themselves."""
        told = (f" {_FITS[name][0]} {at:.10g}" for name, at in bounds.items() if np.isfinite(at))
        self.words = noun + "".join(told)
        self._kind: Callable[[Any], Number | None] = kind
        self._bounds = bounds

    def number(self, value: Any) -> Number | None:
        """None where it is none of these."""
        number = self._kind(value)
        fits = number is not None and all(
            _FITS[name][1](number, bound) for name, bound in self._bounds.items()
        )
        return number if fits else None

    def __call__(self, value: Any, name: str) -> Number:
        number = self.number(value)
        if number is None:
            raise bad_option(f"{name} must be {self.words}, not {shown(value)}.")
        return number


_FITS: dict[str, tuple[str, Callable[[float, float], bool]]] = {
    **dict(least=("from", operator.ge), most=("to", operator.le)),
    **dict(above=("above", operator.gt), below=("below", operator.lt)),
}


def real(noun: str = "a finite number", **bounds: float) -> Within[float]:
    return Within(real_number, noun, {"above": -np.inf, "below": np.inf} | bounds)


def whole(least: int = 0, most: int = LARGEST_COUNT, noun: str = "a whole number") -> Within[int]:
    return Within(whole_number, noun, {"least": least, "most": most})


as_positive = real(above=0.0)


def as_threads(value: Any) -> int:
    """``value`` as the number of threads of a call; None and 0 are one for each core that this process may use."""
    count = 0 if value is None else whole(0, MOST_THREADS)(value, "threads")
    return count or min(usable_cores(), MOST_THREADS)


def usable_cores() -> int:
    try:
        return len(os.sched_getaffinity(0))
    except AttributeError:  # not every system says
        return os.cpu_count() or 1


def as_seconds(value: Any, name: str) -> float:
    """``value`` as a limit in seconds; None and 0 are none, which is 0."""
    return real(least=0.0)(0.0 if value is None else value, name)


def as_flag(value: Any, name: str, otherwise: str = "") -> bool:
    """``value`` if it is true or false; words such as "no" are refused instead of taken as true. otherwise: as of as_choice."""
    if isinstance(value, (bool, np.bool_)) or (type(value) is int and value in (0, 1)):
        return bool(value)
    raise bad_option(f"{name} must be True or False{otherwise}, not {shown(value)}.")


def as_choice(value: Any, name: str, choices: Sequence[str], otherwise: str = "") -> str:
    """``value`` if it is one of ``choices``; ``otherwise`` says what else the caller takes."""
    if isinstance(value, str):
        word = str.__str__(value)
        if word in choices:
            return word
    raise bad_option(f"{name} must be one of {', '.join(choices)}{otherwise}, not {shown(value)}.")


def _as_array(values: Any, name: str, of: str, convert: Callable[[Any], Any]) -> Array:
    """``values`` as an array of integers or floats; ``of`` says what its elements should be, convert makes one of an object."""
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
    if array.dtype.kind != "O":
        return array
    found = [convert(value) for value in array.flat]
    if None in found:
        odd = next(value for value in array.flat if convert(value) is None)
        raise _not_an_array(name, of, f"it has {shown(odd)}")
    beyond = 2**62  # of 32 bits, either way
    fit = [max(min(n, beyond), -beyond) if isinstance(n, int) else n for n in found]
    return np.array(fit).reshape(array.shape)


def _not_an_array(name: str, of: str, reason: str) -> InvalidInput:
    return bad_shape(f"{name} is not an array of {of}: {reason}.")


def _shaped(array: Array, name: str, columns: int | None) -> Array:
    if array.size == 0 and (array.ndim == 1 or array.shape[0] == 0):
        array = array.reshape((0,) if columns is None else (0, columns))
    wanted = "(n,)" if columns is None else f"(n, {columns})"
    if array.ndim != 1 + (columns is not None) or array.shape[1:] not in ((), (columns,)):
        raise bad_shape(f"{name} must have shape {wanted}, not {array.shape}.")
    return array


def _to_floats(array: Array) -> FloatArray:
    with np.errstate(all="ignore"):  # longer floats may become infinite: refused where used
        return np.ascontiguousarray(array, dtype=np.float64)


def as_floats(values: Any, name: str, columns: int | None = None) -> FloatArray:
    """``values`` as a C-contiguous float64 array of shape (n, columns), or (n,) without columns."""
    return _to_floats(_shaped(_as_array(values, name, "numbers", real_number), name, columns))


def as_indices(values: Any, name: str, columns: int | None = None) -> IntArray:
    """``values`` as a C-contiguous int32 array; fractions and values out of range are refused."""
    of = "whole numbers"
    array = _shaped(_as_array(values, name, of, whole_number), name, columns)
    if array.size == 0:
        return np.zeros(array.shape, np.int32)
    if array.dtype.kind == "f" and not np.isfinite(array).all():
        raise _not_an_array(name, of, "it has NaN or infinite numbers")
    if array.dtype.kind == "f" and (array != np.trunc(array)).any():
        raise _not_an_array(name, of, "it has fractions")
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
    """``values`` of shape (faces, 3, 2) as (3 faces, 2); of any number of triangles without ``face_count``."""
    array = _as_array(values, name, "numbers", real_number)
    if face_count is None and array.size == 0:
        return np.zeros((0, 2))
    if array.ndim != 3 or array.shape[1:] != (3, 2) or face_count not in (None, len(array)):
        wanted = (
            f"({face_count}, 3, 2), one UV per face corner"
            if face_count is not None
            else "(n, 3, 2)"
        )
        raise bad_shape(f"{name} must have shape {wanted}, not {array.shape}.")
    return _to_floats(array).reshape(-1, 2)


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


def as_map(given: Any, name: str) -> tuple[Any, Any, Any]:
    """Vertices, faces and UVs of a map. name: of what takes it."""
    if isinstance(given, Parametrization):
        return given.vertices, given.faces, given.uv
    try:
        vertices, faces, uv = given
    except Exception:  # it has another number of parts, or none
        raise bad_shape(f"{name} takes a Parametrization or (vertices, faces, uv).") from None
    return vertices, faces, uv


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
        raise not_finite(
            f"{name} has the coordinate {array[beyond][0]:g}, more than UVs can store (3.4e38). Scale it down."
        )


def as_items(
    values: Any, name: str, meaning: str, bad: Callable[[str], InvalidInput] = bad_shape
) -> list[tuple[Any, Any]]:
    """The items of a dict, none for None; ``meaning`` says in the complaint what it should be."""
    if values is None:
        return []
    if not isinstance(values, Mapping):
        raise bad(f"{name} must be a dict {meaning}, not {type(values).__name__}.")
    try:
        return [(key, value) for key, value in values.items()]
    except Exception as error:  # a mapping of the caller's own
        raise bad(f"{name} must be a dict {meaning}; its items cannot be read: {error}.") from None


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


def as_vertex_places(values: Any, name: str) -> dict[int, FloatArray]:
    """{vertex: (u, v)}, (2,) each."""
    found = {}
    for vertex, value in as_vertex_map(values, name, "(u, v)").items():
        own = f"{name}[{shown(vertex)}]"
        found[vertex] = as_floats(value, own)
        if found[vertex].shape != (2,):
            raise bad_shape(f"{own} must be two numbers (u, v).")
        refuse_beyond_storage(found[vertex], own)
    return found


def as_angles(values: Any) -> list[tuple[int, float]]:
    """Cones {vertex: angle} as pairs."""
    cones = as_vertex_map(values, "cones", "angle")
    as_indices(list(cones), "cones")
    return [(v, real()(angle, f"cones[{v}]")) for v, angle in cones.items()]


def as_list(values: Any, name: str, of: str) -> list[Any]:
    """``values`` as a list of at most MOST_LISTED, None as an empty one; ``of`` says in the complaint what it should be."""
    try:
        result = list(islice(iter(() if values is None else values), MOST_LISTED + 1))
    except Exception:  # it cannot be iterated over, or its iteration fails
        raise bad_shape(f"{name} must be {of}, not {shown(values)}.") from None
    if len(result) > MOST_LISTED:
        raise bad_shape(f"{name} has more than {MOST_LISTED} elements. Give fewer.")
    return result


Pins = Mapping[Any, tuple[float, float]]


def pins_to_corners(pins: Pins | None, faces: IntArray) -> tuple[IntArray, FloatArray]:
    """{vertex or (face, corner): (u, v)} as corner ids 3 f + k and their targets; a vertex pins all its corners."""
    targets: list[tuple[int, FloatArray]] = []
    by_vertex: dict[int, FloatArray] = {}
    for key, value in as_items(pins, "pins", "{vertex or (face, corner): (u, v)}", bad_pins):
        name = f"pins[{shown(key)}]"
        place = as_floats(value, name)
        if place.shape != (2,) or not np.isfinite(place).all():
            raise bad_pins(f"{name} must be two finite numbers (u, v).")
        refuse_beyond_storage(place, name)
        is_pair = isinstance(key, tuple) and len(key) == 2
        face, corner = map(whole_number, key if is_pair else (0, key))
        if face is None or corner is None:
            raise bad_pins(
                f"pins has the key {shown(key)}, which is neither a vertex nor a pair (face, corner)."
            )
        if not is_pair:
            by_vertex[corner] = place
        elif 0 <= face < len(faces) and 0 <= corner < 3:
            targets.append((3 * face + corner, place))
        else:
            raise bad_pins(
                f"pins names corner {shown(corner)} of face {shown(face)}, which does not exist."
            )
    flat = faces.reshape(-1)
    missing = by_vertex.keys() - set(np.unique(flat).tolist() if by_vertex else ())
    if missing:
        largest = int(flat.max(initial=-1))  # beyond it, nobody here knows whether they exist
        lost = [v for v in sorted(missing) if 0 <= v <= largest][:1000]
        text = f"pins names vertex {shown(min(missing))}, which belongs to no face."
        raise bad_pins(text, "vertex", lost)
    pinned = np.flatnonzero(np.isin(flat, list(by_vertex))).tolist() if by_vertex else ()
    targets += [(corner, by_vertex[int(flat[corner])]) for corner in pinned]
    corners, places = [corner for corner, _ in targets], [place for _, place in targets]
    return as_indices(corners, "pins"), as_floats(places, "pins", 2)


def as_sizing(value: Any, count: int) -> FloatArray:
    """One number per vertex."""
    sizes = as_floats(value, "sizing")
    if len(sizes) == 0 or len(sizes) != count:
        raise bad_shape(f"sizing must have shape ({count},), one number per vertex.")
    return sizes


#: Options that mean the same wherever a call has them: how they are checked. Words that are choices go on as they are: the
#: compiled module knows them.
OPTIONS: dict[str, Callable[[Any, str], Any]] = {
    name: check
    for check, names in (
        (as_flag, "bijective cut_extremities disjoint exact keep_bijective may_add_cuts optimise"),
        (as_flag, "prefer_translations repair require_convergence reroute scale_true seamless"),
        (as_flag, "share_tile simplify stack_mirrored stack_similar tiled together with_map"),
        (partial(as_indices, columns=2), "cuts features uncuttable"),
        (as_indices, "corners groups layouts movable unmoved"),
        (lambda word, _name: word, "boundary engine method overlaps rotation stretched"),
        (
            lambda word, name: as_choice(word, name, ("auto", "on", "off")) == "on",
            "intrinsic_refinement",
        ),
        (
            real("the texture's width over its height", least=1.0 / MOST_ASPECT, most=MOST_ASPECT),
            "aspect",
        ),
        (real(), "alignment edge_weight"),
        (real(above=1.0), "bound"),
        (real(least=0.0, most=1000.0), "effort"),
        (real(above=0.0, below=2.0 * np.pi), "least_angle"),
        (real(least=0.0, below=0.5), "margin"),
        (real(above=0.0, most=np.pi), "sharp_angle"),
        (real(above=1.0, most=100.0), "stretch"),
        (as_positive, "tolerance"),
        (whole(), "iterations"),
        (whole(1), "max_cones max_iterations"),
        (whole(1, 100), "tiles"),
        (as_corner_uv, "obstacles"),
    )
    for name in names.split()
}

#: The same of those that belong to a mesh.
OF_MESH: dict[str, Callable[[Any, str, Mesh], Any]] = {
    **dict.fromkeys(
        ("materials", "mirrored", "polygons"),
        lambda value, name, mesh: as_face_numbers(value, name, len(mesh.faces)),
    ),
    **dict.fromkeys(
        ("place_like", "uv"), lambda value, name, mesh: as_corner_uv(value, name, len(mesh.faces))
    ),
    "pins": lambda value, _name, mesh: pins_to_corners(value, mesh.faces),
    "sizing": lambda value, _name, mesh: as_sizing(value, len(mesh.given)),
}

#: Those that may be None, which the compiled module knows as none at all.
_OPTIONAL = set(
    "corners cuts features groups layouts materials mirrored movable obstacles place_like polygons sharp_angle sizing uncuttable "
    "unmoved".split()
)

#: Those that the solver calls otherwise.
_SOLVERS = {
    **dict(iterations="max_iterations", materials="material", polygons="polygon"),
    **dict(sharp_angle="seams.sharp_angle", stack_similar="stack", stretch="seams.stretch"),
}


def checked(given: Mapping[str, Any], names: str = "") -> tuple[Mesh, dict[str, Any]]:
    """A call's mesh, and its options by the solver's names, of its local variables: those with these names, which blanks part, or
    all that are known here."""
    mesh, found = as_mesh(given["vertices"], given["faces"]), {}
    for name in names.split() or [name for name in (*OF_MESH, *OPTIONS) if name in given]:
        value = given[name]
        if value is None and name in _OPTIONAL:
            continue
        of_mesh = OF_MESH.get(name)
        option = of_mesh(value, name, mesh) if of_mesh else OPTIONS[name](value, name)
        found[_SOLVERS.get(name, name)] = option
    return mesh, found
