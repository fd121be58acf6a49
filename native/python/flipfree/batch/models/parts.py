"""Solvers that want one connected surface, on surfaces of many parts: one after the other, packed together at the end."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import numpy.typing as npt

from ...errors import FlipfreeError
from ...results import Parametrization, Transitions
from ...separated import SeparatedSurface

IntArray = npt.NDArray[np.int32]


def components(faces: IntArray, count: int) -> list[IntArray]:
    """Faces of each connected part, in the order of their first face."""
    label = np.arange(count)
    while True:
        low = label[faces].min(axis=1)
        before = label.copy()
        np.minimum.at(label, faces.ravel(), np.repeat(low, 3))
        label = label[label]
        if np.array_equal(label, before):
            break
    of_face = label[faces[:, 0]]
    _, first = np.unique(of_face, return_index=True)
    return [np.flatnonzero(of_face == of_face[f]).astype(np.int32) for f in np.sort(first)]


#: (vertices, faces, clean vertex of each vertex) -> map
SolvePart = Callable[[npt.NDArray[np.float64], IntArray, IntArray], Parametrization]


def each_part(clean: SeparatedSurface, solve: SolvePart) -> Parametrization:
    """The parts' maps in the numbers of the clean surface, its vertices first. Places overlap; certificate and ``stats`` are
    the first part's that is not ok, or the first one's: judge the whole again."""
    pieces = []
    for own in components(clean.faces, len(clean.vertices)):
        used, numbers = np.unique(clean.faces[own], return_inverse=True)
        faces = numbers.reshape(-1, 3).astype(np.int32)
        try:
            found = solve(clean.vertices[used], faces, used.astype(np.int32))
        except FlipfreeError as error:
            error.kind, error.elements = _on_input(clean, used, own, error)
            raise
        pieces.append((own, used, found))
    return pieces[0][2] if len(pieces) == 1 else _combined(clean, pieces)


def _on_input(
    clean: SeparatedSurface, used: npt.NDArray[Any], own: IntArray, error: FlipfreeError
) -> tuple[str, list[int]]:
    ids = np.array(error.elements, np.int64)
    if error.kind in ("vertex", "edge") and (ids < len(used)).all():
        return error.kind, clean.vertex_origin[used[ids]].tolist()
    if error.kind == "face" and (ids < len(own)).all():
        return error.kind, clean.face_origin[own[ids]].tolist()
    return "none", []


def _combined(
    clean: SeparatedSurface, pieces: list[tuple[IntArray, npt.NDArray[Any], Parametrization]]
) -> Parametrization:
    count = len(clean.vertices)
    vertices, faces, uv, uv64, uv32 = [clean.vertices], [], [], [], []
    parent_face, cuts, turns, shifts = [], [], [], []
    new_parents, new_weights = [], []
    first_parent, first_weights = np.zeros(count, np.int32), np.zeros((count, 3))
    for own, used, found in pieces:
        old = len(used)
        number = np.concatenate([used, count + np.arange(len(found.vertices) - old)]).astype(
            np.int32
        )
        count += len(found.vertices) - old
        vertices.append(found.vertices[old:])
        faces.append(number[found.faces])
        uv.append(found.uv)
        uv64.append(found.uv64)
        uv32.append(found.uv32())
        parent_face.append(own[found.parent_face])
        cuts.append(number[found.cut_edges].reshape(-1, 2))
        turns.append(found.transitions.quarter_turns)
        shifts.append(found.transitions.translation.reshape(-1, 2))
        first_parent[used] = own[found.vertex_parent[:old]]
        first_weights[used] = found.vertex_barycentric[:old]
        new_parents.append(own[found.vertex_parent[old:]])
        new_weights.append(found.vertex_barycentric[old:])
    results = [found for _, _, found in pieces]
    worst = next((r for r in results if not r.certificate.ok), results[0])
    return replace(
        worst,
        vertices=np.concatenate(vertices),
        faces=np.concatenate(faces),
        uv=np.concatenate(uv),
        uv64=np.concatenate(uv64),
        _uv32=np.concatenate(uv32),
        parent_face=np.concatenate(parent_face).astype(np.int32),
        vertex_parent=np.concatenate([first_parent, *new_parents]).astype(np.int32),
        vertex_barycentric=np.concatenate([first_weights, *new_weights]),
        cut_edges=np.concatenate(cuts).astype(np.int32),
        transitions=Transitions(np.concatenate(turns), np.concatenate(shifts)),
    )
