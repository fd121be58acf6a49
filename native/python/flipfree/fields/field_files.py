"""Files of cross fields: .rawfield (Directional), .ffield (Myles, Pietroni, Zorin 2014), and rotation forms."""

from __future__ import annotations

import gzip
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from ..calls.mesh_files import MALFORMED, NO_ACCESS, _as_path
from ..errors import InvalidInput
from ..results import FloatArray, IntArray
from ..texts import counted

#: What .ffield files have for a period jump that is not known.
UNSET = 999999


@dataclass(frozen=True)
class FieldFile:
    """Directions (m, 3), rotation (3 m,), quarters (3 m,) as the solver takes them; empty where the file has none."""

    directions: FloatArray = field(default_factory=lambda: np.zeros((0, 3)))
    rotation: FloatArray = field(default_factory=lambda: np.zeros(0))
    quarters: IntArray = field(default_factory=lambda: np.zeros(0, np.int32))


def _malformed(path: Any, what: str) -> InvalidInput:
    return InvalidInput(f"{path}: {what}", code=MALFORMED)


def read_field_file(path: Any, vertices: FloatArray, faces: IntArray) -> FieldFile:
    """The field that the file holds for this mesh."""
    place = _as_path(path)
    try:
        raw = gzip.open(place, "rb").read() if place.suffix == ".gz" else place.read_bytes()
    except (OSError, EOFError) as error:
        reason = getattr(error, "strerror", None) or error
        raise InvalidInput(
            f"{place} cannot be read: {reason}. Check the path and its permissions.", code=NO_ACCESS
        ) from None
    text = raw.decode("latin-1")
    kind = place.suffix.lower()
    if kind == ".rawfield":
        return _read_rawfield(place, text, faces)
    if kind == ".ffield":
        return _read_ffield(place, text, vertices, faces)
    numbers = _numbers(place, text.split())
    if len(numbers) != faces.size:
        raise _malformed(
            place,
            f"{counted(len(numbers), 'number')} instead of {faces.size}, one for each half-edge.",
        )
    return FieldFile(rotation=numbers)


def _numbers(path: Any, words: list[str]) -> FloatArray:
    try:
        numbers = np.array(words, np.float64)
    except ValueError as error:
        raise _malformed(path, f"not a number: {error}.") from None
    if not np.isfinite(numbers).all():
        raise _malformed(path, "it has numbers that are not finite.")
    return numbers


def _read_rawfield(path: Any, text: str, faces: IntArray) -> FieldFile:
    numbers = _numbers(path, text.split())
    if len(numbers) < 2 or numbers[0] != 4:
        raise _malformed(path, "it does not begin with 4, the number of vectors of a cross.")
    if numbers[1] != len(faces) or len(numbers) != 2 + 12 * len(faces):
        raise _malformed(
            path,
            f"it has {counted(len(numbers) - 2, 'number')} for a count of faces of {numbers[1]:g}; "
            f"the mesh has {len(faces)}, which take 12 each.",
        )
    return FieldFile(directions=numbers[2:].reshape(-1, 4, 3)[:, 0].copy())


def _read_ffield(path: Any, text: str, vertices: FloatArray, faces: IntArray) -> FieldFile:
    lines = [line.split() for line in text.splitlines() if line.strip()]
    names = {line[0]: i for i, line in reversed(list(enumerate(lines)))}
    if "crossfield_angles" not in names:
        raise _malformed(path, "it has no crossfield_angles.")
    row = names["crossfield_angles"] + 1
    angles = _numbers(path, lines[row] if row < len(lines) else [])
    if len(angles) != len(faces):
        raise _malformed(
            path, f"{counted(len(angles), 'angle')} for {counted(len(faces), 'face')}."
        )
    directions = _turned(vertices, faces, angles)
    for name, sign in (("MI_matchings", 1), ("matchings", -1)):
        for found in (name, name + "_and_sharp"):
            if found in names:
                jumps = _period_jumps(path, lines[names[found] + 1 :], faces)
                if (jumps == UNSET).any():
                    return FieldFile(directions=directions)
                return FieldFile(directions=directions, quarters=_quarters(sign * jumps))
    return FieldFile(directions=directions)


def _quarters(jumps: IntArray) -> IntArray:
    # A period jump p makes the rotation (angle here) + (frames) - (angle there) + p pi / 2.
    return np.asarray(-jumps % 4, np.int32).ravel()


def _period_jumps(path: Any, lines: list[list[str]], faces: IntArray) -> IntArray:
    if len(lines) < len(faces):
        raise _malformed(
            path, f"{counted(len(lines), 'line')} of matchings for {counted(len(faces), 'face')}."
        )
    rows = [line[:6] for line in lines[: len(faces)]]
    if any(len(line) < 6 for line in rows):
        raise _malformed(path, "a line of matchings has fewer than 6 numbers.")
    table = _numbers(path, [word for line in rows for word in line]).reshape(-1, 6)
    jumps = np.full(faces.shape, UNSET, np.int32)
    for k in range(3):
        # The half-edge that ends at the vertex with this id.
        ends = np.roll(faces, -1, axis=1) == table[:, k, None]
        if not (ends.sum(axis=1) == 1).all():
            place = int(np.flatnonzero(ends.sum(axis=1) != 1)[0])
            raise _malformed(path, f"the matchings of face {place} are of other vertices.")
        jumps[ends] = table[:, 3 + k]
    return jumps


def _frames(vertices: FloatArray, faces: IntArray) -> tuple[FloatArray, FloatArray]:
    """Of each face the unit vector from its last to its first corner, and that to the left of it."""
    a, b, c = (vertices[faces[:, k]] for k in range(3))
    along = a - c
    along = along / np.linalg.norm(along, axis=1, keepdims=True)
    left = np.cross(np.cross(b - a, c - a), along)
    return along, left / np.linalg.norm(left, axis=1, keepdims=True)


def _turned(vertices: FloatArray, faces: IntArray, angles: FloatArray) -> FloatArray:
    if faces.min(initial=0) < 0 or faces.max(initial=-1) >= len(vertices):
        return np.zeros((len(faces), 3))  # the mesh is refused by name where the field is read
    with np.errstate(all="ignore"):
        along, left = _frames(vertices, faces)
        turned: FloatArray = np.cos(angles)[:, None] * along + np.sin(angles)[:, None] * left
    return turned


def write_field_file(
    path: Any,
    vertices: FloatArray,
    faces: IntArray,
    directions: FloatArray,
    rotation: FloatArray,
    quarters: IntArray,
) -> None:
    """The field to a file of the kind that its name says."""
    place = _as_path(path)
    kind = place.suffix.lower()
    if kind == ".rawfield":
        text = _rawfield(vertices, faces, directions)
    elif kind == ".ffield":
        text = _ffield(vertices, faces, directions, quarters)
    else:
        text = "".join(f"{value!r}\n" for value in rotation.tolist())
    data = text.encode()
    try:
        place.write_bytes(gzip.compress(data) if kind == ".gz" else data)
    except OSError as error:
        raise InvalidInput(
            f"{place} cannot be written: {error.strerror or error}. Check the path and its permissions.",
            code=NO_ACCESS,
        ) from None


def _rawfield(vertices: FloatArray, faces: IntArray, directions: FloatArray) -> str:
    a, b, c = (vertices[faces[:, k]] for k in range(3))
    normal = np.cross(b - a, c - a)
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    left = np.cross(normal, directions)
    rows = np.concatenate([directions, left, -directions, -left], axis=1).tolist()
    lines = (" ".join(map(repr, row)) for row in rows)
    return "\n".join([f"4 {len(faces)}", *lines, ""])


def _ffield(
    vertices: FloatArray, faces: IntArray, directions: FloatArray, quarters: IntArray
) -> str:
    along, left = _frames(vertices, faces)
    angles = np.arctan2((directions * left).sum(axis=1), (directions * along).sum(axis=1))
    jumps = (-quarters % 4).reshape(-1, 3)
    lines = ["# 1", "target_frame", str(len(faces)), "k1 k2 k1v_x k1v_y k1v_z k2v_x k2v_y k2v_z"]
    second = np.cross(np.cross(along, left), directions)
    for one, two in zip(directions.tolist(), second.tolist(), strict=True):
        lines.append(" ".join(map(repr, [1.0, 1.0, *one, *two])))
    lines += ["crossfield_angles", " ".join(map(repr, angles.tolist())), "fixed 0", "MI_matchings"]
    ends = np.roll(faces, -1, axis=1)
    lines += [" ".join(map(str, row)) for row in np.concatenate([ends, jumps], axis=1).tolist()]
    return "\n".join([*lines, ""])
