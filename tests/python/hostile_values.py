"""Values that no function expects, and the package's functions with arguments that all of them take."""

from __future__ import annotations

import array
import decimal
import fractions
import inspect
import itertools
from collections.abc import Callable, Mapping
from typing import Any

import numpy as np
from integer_maps import box, parametrization

import flipfree as ff

from surfaces import bumpy_grid, octahedron_sphere

#: The package's functions that solve, by name: those that report progress.
FUNCTIONS: dict[str, Callable[..., Any]] = {
    name: getattr(ff, name)
    for name in vars(ff)
    if inspect.isfunction(getattr(ff, name))
    and "progress" in inspect.signature(getattr(ff, name)).parameters
}


class Raises:
    """Every conversion of it fails in a way of its own."""

    def __array__(self, *_args: Any, **_kwargs: Any) -> Any:
        raise RuntimeError("no array")

    def __index__(self) -> int:
        raise ZeroDivisionError("no index")

    def __float__(self) -> float:
        raise KeyError("no float")

    def __iter__(self) -> Any:
        raise NotImplementedError("no items")

    def __bool__(self) -> bool:
        raise AssertionError("neither true nor false")

    def __repr__(self) -> str:
        raise LookupError("cannot be shown")


class BrokenMapping(Mapping[Any, Any]):
    def __getitem__(self, key: Any) -> Any:
        raise RuntimeError("no value")

    def __iter__(self) -> Any:
        return iter([0])

    def __len__(self) -> int:
        return 1


def structured() -> Any:
    return np.zeros(3, dtype=[("x", float), ("y", int)])


def masked() -> Any:
    return np.ma.MaskedArray(np.ones((9, 3)), mask=np.eye(9, 3))


def nested_in_itself() -> Any:
    values: list[Any] = []
    values.append(values)
    return values


def released() -> Any:
    view = memoryview(b"abc")
    view.release()
    return view


#: name -> what makes the value.
VALUES: dict[str, Callable[[], Any]] = {
    **{
        repr(value): (lambda value=value: value)  # type: ignore[misc]
        for value in [
            None, True, False, 0, -1, 1, 3, 2**31 - 1, 2**31, 2**32, 2**63, 2**64, -(2**63) - 1,
            0.5, -0.5, 1e-320, 1e308, float("nan"), float("inf"), -float("inf"), 1j,
            "", "abc", "1", "1.5", "auto", "circle", b"1", (), [], [[]], [[[]]], [None], ["a"],
            [["a", "b", "c"]], [[True, False, True]], [0, 1, 2], [[0, 1, 2]], [[0, 1]], [[0.5, 1]],
            [[1, 2], [3]], [float("nan")] * 9, [[10**30, 0, 0]] * 9, [[0, 1, 2**40]], [2**63] * 9,
            [-(2**70)], [[0, 1, -1]], [1e300] * 9, [[1e300] * 3] * 9, {}, {0: None}, {0: 1.0},
            {0: (0.0, 0.0)}, {0: (0.0, float("nan"))}, {0: (float("inf"), 0.0)}, {0: "ab"},
            {0: (1e39, 0.0)}, {0: (1, 2, 3)}, {0: ((1, 2), (3, 4))}, {"a": 1}, {None: (0.0, 0.0)},
            {(0, 0): (0.0, 0.0)}, {(0, 5): (0.0, 0.0)}, {(0, 1, 2): (0.0, 0.0)}, {-1: (0.0, 0.0)},
            {2**70: (0.0, 0.0)}, {True: (0.0, 0.0)}, {0.5: (0.0, 0.0)}, {0: [2**70]}, {0: [1, 77]},
            {8: (0.0, 0.0), 9: (0.0, 0.0)}, {0, 1}, range(3), range(2**40), object, len, Ellipsis,
            decimal.Decimal("0.5"), fractions.Fraction(1, 3), slice(3),
            ([0, 1], [[0.0, 0.0], [1.0, 0.0]]), [([0, 1], [[0.0, 0.0], [1.0, 0.0]])], [([0], [])],
            ([[0.0] * 3] * 3, [[0, 1, 2]], [0], [0] * 3, [[1.0, 0.0, 0.0]] * 3),
            (None, None, None, None, None), [[]] * 5, (0, 1, 2),
        ]
    },
    "10**400": lambda: 10**400,
    "10**5000": lambda: 10**5000,
    "{10**5000: ...}": lambda: {10**5000: (0.0, 0.0)},
    "[10**400]": lambda: [10**400] * 9,
    "object": object,
    "raises": Raises,
    "[raises]": lambda: [Raises()] * 9,
    "{0: raises}": lambda: {0: Raises()},
    "broken mapping": BrokenMapping,
    "endless": itertools.count,
    "generator": lambda: (i for i in range(3)),
    "nested in itself": nested_in_itself,
    "datetime": lambda: np.datetime64("2020-01-01"),
    "durations": lambda: np.ones(9, "timedelta64[s]"),
    "dates": lambda: np.zeros((9, 3), "datetime64[s]"),
    "complex": lambda: np.ones((9, 3), complex),
    "none as array": lambda: np.array(None),
    "number as array": lambda: np.array(1.5),
    "one number": lambda: np.array([1]),
    "truth values": lambda: np.ones((9, 3), bool),
    "words": lambda: np.array([["1", "2", "3"]] * 9),
    "objects": lambda: np.array([[0, None, 1.0]] * 9, object),
    "beyond int64": lambda: np.full((8, 3), 2**63, np.uint64),
    "nan": lambda: np.full((9, 3), np.nan),
    "infinite": lambda: np.full((9, 3), np.inf),
    "long doubles": lambda: np.full((9, 3), np.finfo(np.longdouble).max),
    "structured": structured,
    "masked": masked,
    "sixty dimensions": lambda: np.zeros((1,) * getattr(np, "MAXDIMS", 60)),
    "no columns": lambda: np.zeros((9, 0)),
    "a billion rows": lambda: np.broadcast_to(np.zeros(1, np.int8), (2**30, 3)),
    "memoryview": lambda: memoryview(b"abc"),
    "released": released,
    "bytearray": lambda: bytearray(b"abc"),
    "array": lambda: array.array("d", [1.0, 2.0]),
    "scalar": lambda: np.float32(0.5),
    "numpy bool": lambda: np.True_,
}  # fmt: skip


def ball(n: int) -> dict[str, Any]:
    return dict(zip(("vertices", "faces"), octahedron_sphere(n), strict=True))


def mapped() -> dict[str, Any]:
    vertices, faces = bumpy_grid(2, 2)
    return {"vertices": vertices, "faces": faces, "uv": vertices[faces][:, :, :2]}


def angled() -> dict[str, Any]:
    vertices, faces = bumpy_grid(2, 2)
    angles = np.full(9, np.pi)
    angles[4] = 2 * np.pi
    angles[[0, 2, 6, 8]] = np.pi / 2
    return {"vertices": vertices, "faces": faces, "target_angles": angles}


def arguments_of(name: str) -> dict[str, Any]:
    """Arguments with which the function works: the required ones."""
    vertices, faces = bumpy_grid(2, 2)
    mesh = {"vertices": vertices, "faces": faces}
    match name:
        case "certify" | "pack" | "repair":
            return mapped()
        case "rectify":
            return {**mesh, "polygons": np.arange(len(faces)) // 2}
        case "improve":
            return {"map_or_arrays": tuple(mapped().values())}
        case "quads":
            return {**ball(1), "target": 50}
        case "quads_from_map":
            return {"parametrization": parametrization(box((1, 2, 3), (2, 2, 2)))}
        case "fit_tiles":
            return {"map_or_arrays": parametrization(box((1, 2, 3), (2, 2, 2))), "tile": 0.5}
        case "field_aligned":
            return ball(1)
        case "seamless":
            return ball(0)
        case "admissible_cut":
            return {**ball(0), "cones": {0: 2, 1: 2, 2: 2, 3: 2}}
        case "conformal" | "conformal_metric":
            return angled()
        case "signature":
            return {**mesh, "field": ff.CrossField(np.tile([0.6, 0.8, 0.0], (8, 1)))}
    return mesh
