"""Every kind of bad input has its own clear message; docs/errors.md lists them and is compared here."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import flipfree as ff

from surfaces import bumpy_grid, octahedron_sphere

DOCS = Path(__file__).resolve().parent.parent.parent / "docs" / "errors.md"


def quad() -> tuple[np.ndarray, np.ndarray]:
    vertices = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [0.5, 0.5, 1.0], [2, 2, 2.0]])
    return vertices, np.array([[0, 1, 2], [0, 2, 3]])


def with_faces(faces: list[list[int]]) -> tuple[Any, Any]:
    return quad()[0], np.array(faces)


def with_vertex(index: int, value: list[float]) -> tuple[Any, Any]:
    vertices, faces = quad()
    vertices[index] = value
    return vertices, faces


def two_disks() -> tuple[Any, Any]:
    vertices, faces = bumpy_grid(3, 3)
    return np.vstack([vertices, vertices + 3]), np.vstack([faces, faces + len(vertices)])


#: name in docs/errors.md -> (call, exception, code, words that the message must contain)
CASES: dict[str, tuple[Callable[[], Any], type[ff.FlipfreeError], str, list[str]]] = {
    "no faces": (
        lambda: ff.unwrap(np.zeros((0, 3)), np.zeros((0, 3), int)),
        ff.InvalidInput, "empty mesh", ["no faces"],
    ),
    "vertices of the wrong shape": (
        lambda: ff.unwrap(np.zeros((4, 2)), [[0, 1, 2]]),
        ff.InvalidInput, "array of the wrong shape", ["vertices", "(n, 3)"],
    ),
    "polygons instead of triangles": (
        lambda: ff.unwrap(quad()[0], [[0, 1, 2, 3]]),
        ff.InvalidInput, "array of the wrong shape", ["faces", "(n, 3)"],
    ),
    "faces that are not whole numbers": (
        lambda: ff.unwrap(quad()[0], [[0, 1, 2.5]]),
        ff.InvalidInput, "array of the wrong shape", ["faces", "whole"],
    ),
    "vertices that are no numbers": (
        lambda: ff.unwrap([["a", "b", "c"]] * 3, [[0, 1, 2]]),
        ff.InvalidInput, "array of the wrong shape", ["vertices", "numbers"],
    ),
    "index out of range": (
        lambda: ff.unwrap(*with_faces([[0, 1, 2], [0, 2, 77]])),
        ff.InvalidInput, "index out of range", ["Face 1", "does not exist"],
    ),
    "NaN": (
        lambda: ff.unwrap(*with_vertex(2, [np.nan, 0, 0])),
        ff.InvalidInput, "coordinate is not finite", ["Vertex 2", "NaN"],
    ),
    "infinity": (
        lambda: ff.unwrap(*with_vertex(3, [0, np.inf, 0])),
        ff.InvalidInput, "coordinate is not finite", ["Vertex 3"],
    ),
    "face that uses a vertex twice": (
        lambda: ff.unwrap(*with_faces([[0, 1, 2], [3, 3, 4]])),
        ff.InvalidInput, "face uses a vertex twice", ["Face 1"],
    ),
    "duplicate face": (
        lambda: ff.unwrap(*with_faces([[0, 1, 2], [2, 0, 1]])),
        ff.InvalidInput, "duplicate face", ["Face 1", "Delete"],
    ),
    "edge with more than two faces": (
        lambda: ff.unwrap(*with_faces([[0, 1, 2], [1, 0, 3], [0, 1, 4]])),
        ff.InvalidInput, "non-manifold edge", ["Edge 0-1", "more than two"],
    ),
    "faces oriented against each other": (
        lambda: ff.unwrap(*with_faces([[0, 1, 2], [0, 1, 4]])),
        ff.InvalidInput, "inconsistent orientation", ["Edge 0-1", "normals"],
    ),
    "vertex that joins two fans": (
        lambda: ff.unwrap(*with_faces([[0, 1, 2], [0, 4, 5]])),
        ff.InvalidInput, "non-manifold vertex", ["Vertex 0", "Split"],
    ),
    "zero-length edge": (
        lambda: ff.unwrap(*with_vertex(1, [1, 1, 0])),
        ff.InvalidInput, "zero-length edge", ["Edge 1-2", "Merge"],
    ),
    "zero-area face": (
        lambda: ff.unwrap(*with_vertex(1, [0.5, 0.5, 0])),
        ff.InvalidInput, "zero-area face", ["Face 0", "one line"],
    ),
    "cut that is no edge": (
        lambda: ff.unwrap(*quad(), cuts=[[1, 3]]),
        ff.InvalidInput, "not an edge of the mesh", ["vertices 1 and 3"],
    ),
    "pin at a vertex without faces": (
        lambda: ff.unwrap(*quad(), pins={5: (0.0, 0.0)}),
        ff.InvalidInput, "bad pins", ["vertex 5"],
    ),
    "pin that is not finite": (
        lambda: ff.unwrap(*quad(), pins={0: (0.0, np.nan)}),
        ff.InvalidInput, "bad pins", ["finite"],
    ),
    "one vertex pinned to two places": (
        lambda: ff.unwrap(*quad(), pins={(0, 0): (0.0, 0.0), (1, 0): (0.5, 0.0)}),
        ff.InvalidInput, "bad pins", ["Vertex 0", "two different places"],
    ),
    "two vertices pinned to one place": (
        lambda: ff.unwrap(*quad(), pins={0: (0.5, 0.5), 2: (0.5, 0.5)}),
        ff.Infeasible, "contradictory pins", ["same point"],
    ),
    "option out of range": (
        lambda: ff.unwrap(*quad(), margin=2.0),
        ff.InvalidInput, "bad option", ["margin"],
    ),
    "UVs of the wrong shape": (
        lambda: ff.certify(*quad(), np.zeros((2, 2, 2))),
        ff.InvalidInput, "array of the wrong shape", ["uv", "(2, 3, 2)"],
    ),
}  # fmt: skip


@pytest.mark.parametrize("name", CASES)
def test_bad_input_is_refused_by_name(name: str) -> None:
    call, kind, code, words = CASES[name]
    with pytest.raises(kind) as caught:
        call()
    assert caught.value.code == code
    for word in words:
        assert word in str(caught.value), str(caught.value)


@pytest.mark.parametrize("name", CASES)
def test_the_table_of_errors_lists_the_case_with_its_code(name: str) -> None:
    rows = [row for row in DOCS.read_text().splitlines() if row.startswith(f"| {name} |")]
    assert len(rows) == 1, f"docs/errors.md has {len(rows)} rows for {name!r}"
    assert f"| {CASES[name][2]} |" in rows[0]


def test_inputs_are_never_changed() -> None:
    vertices, faces = octahedron_sphere(2)
    before = vertices.copy(), faces.copy()
    ff.unwrap(vertices, faces)
    assert np.array_equal(vertices, before[0]) and np.array_equal(faces, before[1])


@pytest.mark.parametrize("scale", [1e-300, 1e-30, 1e30, 1e150])
def test_absurd_scales_are_unwrapped_like_any_other(scale: float) -> None:
    vertices, faces = bumpy_grid(8, 8)
    assert ff.unwrap(vertices * scale, faces).certificate.ok


def test_several_components_are_no_error_for_unwrap() -> None:
    assert ff.unwrap(*two_disks()).certificate.ok


def test_element_ids_come_with_the_error() -> None:
    with pytest.raises(ff.InvalidInput) as caught:
        CASES["edge with more than two faces"][0]()
    assert caught.value.kind == "edge"
    assert caught.value.elements == [0, 1]
