"""Every kind of bad input has its own clear message; docs/errors.md lists their codes and is compared here."""

from __future__ import annotations

import inspect
import pickle
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import flipfree as ff

from hostile_values import FUNCTIONS, arguments_of
from surfaces import bumpy_grid, cylinder, octahedron_sphere, torus

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


#: name -> (call, exception, code, words that the message must contain)
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
        lambda: ff.embed(*with_faces([[0, 1, 2], [3, 3, 4]])),
        ff.InvalidInput, "face uses a vertex twice", ["Face 1"],
    ),
    "duplicate face": (
        lambda: ff.embed(*with_faces([[0, 1, 2], [2, 0, 1]])),
        ff.InvalidInput, "duplicate face", ["Face 1", "Delete"],
    ),
    "edge with more than two faces": (
        lambda: ff.embed(*with_faces([[0, 1, 2], [1, 0, 3], [0, 1, 4]])),
        ff.InvalidInput, "non-manifold edge", ["Edge 0-1", "more than two"],
    ),
    "faces oriented against each other": (
        lambda: ff.embed(*with_faces([[0, 1, 2], [0, 1, 4]])),
        ff.InvalidInput, "inconsistent orientation", ["Edge 0-1", "normals"],
    ),
    "vertex that joins two fans": (
        lambda: ff.embed(*with_faces([[0, 1, 2], [0, 4, 5]])),
        ff.InvalidInput, "non-manifold vertex", ["Vertex 0", "Split"],
    ),
    "zero-length edge": (
        lambda: ff.embed(*with_vertex(1, [1, 1, 0])),
        ff.InvalidInput, "zero-length edge", ["Edge 1-2", "Merge"],
    ),
    "zero-area face": (
        lambda: ff.embed(*with_vertex(1, [0.5, 0.5, 0])),
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
    "option of the wrong type": (
        lambda: ff.unwrap(*quad(), iterations="many"),
        ff.InvalidInput, "bad option", ["iterations", "whole number", "'many'"],
    ),
    "word where True or False is wanted": (
        lambda: ff.unwrap(*quad(), bijective="no"),
        ff.InvalidInput, "bad option", ["bijective", "True or False"],
    ),
    "progress that is no function": (
        lambda: ff.unwrap(*quad(), progress="yes"),
        ff.InvalidInput, "bad option", ["progress", "function"],
    ),
    "complex numbers": (
        lambda: ff.unwrap(quad()[0] * 1j, quad()[1]),
        ff.InvalidInput, "array of the wrong shape", ["vertices", "complex"],
    ),
    "constraints that are no dict": (
        lambda: ff.match(*bumpy_grid(3, 3), points=np.zeros((4, 2))),
        ff.InvalidInput, "array of the wrong shape", ["points", "dict {vertex: (u, v)}"],
    ),
    "constraint at what is no vertex": (
        lambda: ff.match(*bumpy_grid(3, 3), points={(0, 0): (0.0, 0.0)}),
        ff.InvalidInput, "array of the wrong shape", ["(0, 0)", "no vertex"],
    ),
    "line that is no pair": (
        lambda: ff.match(*bumpy_grid(3, 3), lines=[[0, 1, 2]]),
        ff.InvalidInput, "array of the wrong shape", ["lines[0]", "pair (vertices, polyline)"],
    ),
    "place beyond 32-bit floats": (
        lambda: ff.match(*bumpy_grid(3, 3), points={5: (1e39, 0.0)}),
        ff.InvalidInput, "coordinate is not finite", ["points", "1e+39"],
    ),
    "map with flips": (
        lambda: ff.improve(
            (*quad(), [[(0, 0), (1, 0), (1, 1)], [(0, 0), (0, 1), (1, 1)]]), repair=False
        ),
        ff.InvalidInput, "map has flips", ["the first is face 1", "Repair"],
    ),
    "UVs of the wrong shape": (
        lambda: ff.certify(*quad(), np.zeros((2, 2, 2))),
        ff.InvalidInput, "array of the wrong shape", ["uv", "(2, 3, 2)"],
    ),
    "cones that do not sum up": (
        lambda: ff.seamless(*octahedron_sphere(0), {0: 1}),
        ff.Infeasible, "angles violate Gauss-Bonnet", ["needs 8", "Take 5 from"],
    ),
    "cones that no torus has": (
        lambda: ff.seamless(*torus(8, 6), {3: 3, 20: 5}),
        ff.Infeasible, "bad angles", ["3 and 5", "third one"],
    ),
    "cone of no quarter turn": (
        lambda: ff.seamless(*octahedron_sphere(0), {0: 0}),
        ff.InvalidInput, "bad angles", ["cones[0]", "1 or more", "not 0"],
    ),
    "cone that is no whole number": (
        lambda: ff.seamless(*octahedron_sphere(0), {0: 3.5}),
        ff.InvalidInput, "bad angles", ["cones[0]", "whole number", "3.5"],
    ),
    "cone at no vertex": (
        lambda: ff.seamless(*octahedron_sphere(0), {77: 3}),
        ff.InvalidInput, "index out of range", ["vertex 77", "has 6"],
    ),
    "corner at a free boundary": (
        lambda: ff.seamless(octahedron_sphere(0)[0], octahedron_sphere(0)[1][1:], {0: 1}, boundary="free"),
        ff.InvalidInput, "bad angles", ["Vertex 0", "Leave it out"],
    ),
    "boundary that is no word for one": (
        lambda: ff.seamless(*octahedron_sphere(0), boundary="straight"),
        ff.InvalidInput, "bad option", ["boundary", "aligned, aligned_or_free, free"],
    ),
}  # fmt: skip


@pytest.mark.parametrize("name", CASES)
def test_bad_input_is_refused_by_name_and_its_code_has_one_row_in_the_table_of_errors(
    name: str,
) -> None:
    call, kind, code, words = CASES[name]
    with pytest.raises(kind) as caught:
        call()
    assert caught.value.code == code
    for word in words:
        assert word in str(caught.value), str(caught.value)
    rows = [row for row in DOCS.read_text().splitlines() if row.startswith(f"| {code} |")]
    assert len(rows) == 1, f"docs/errors.md has {len(rows)} rows for {code!r}"


def test_inputs_are_never_changed() -> None:
    vertices, faces = octahedron_sphere(2)
    before = vertices.copy(), faces.copy()
    ff.unwrap(vertices, faces)
    assert np.array_equal(vertices, before[0]) and np.array_equal(faces, before[1])


@pytest.mark.parametrize("scale", [2.0**-400, 2.0**400])
def test_metrics_are_in_the_unit_of_the_input(scale: float) -> None:
    vertices, faces = octahedron_sphere(2)
    target = np.full(len(vertices), 2 * np.pi)
    target[:8] = 1.5 * np.pi
    usual = ff.conformal_metric(vertices, faces, target)
    scaled = ff.conformal_metric(vertices * scale, faces, target)
    assert np.allclose(scaled.scale_factors, usual.scale_factors, atol=1e-9)
    assert np.allclose(scaled.log_lengths, usual.log_lengths + np.log(scale), atol=1e-9)
    edges = vertices[faces] - vertices[np.roll(faces, -1, axis=1)]
    given = ff.conformal_metric(
        vertices, faces, target, lengths=np.linalg.norm(edges, axis=2) * scale
    )
    assert np.allclose(given.log_lengths, scaled.log_lengths, atol=1e-9)


@pytest.mark.parametrize("scale", [2.0**-400, 2.0**400])
def test_certificates_measure_in_any_unit(scale: float) -> None:
    vertices, faces = bumpy_grid(4, 4)
    refined = ff.embed(vertices, faces, boundary="triangle")
    parent = (
        vertices * scale,
        faces,
        refined.parent_face,
        refined.vertex_parent,
        refined.vertex_barycentric,
    )
    certificate = ff.certify(refined.vertices * scale, refined.faces, refined.uv, parent=parent)
    assert certificate.ok, str(certificate)
    assert certificate.energy == pytest.approx(refined.certificate.energy)
    moved = refined.vertices * scale
    moved[-1] += 0.1 * scale
    assert not ff.certify(moved, refined.faces, refined.uv, parent=parent).ok


def test_results_can_be_kept_copied_and_shown() -> None:
    result = ff.unwrap(*bumpy_grid(3, 3))
    again = pickle.loads(pickle.dumps(result))
    assert again != result and result == result
    assert np.array_equal(again.uv32(), result.uv32())
    assert again.certificate.ok and again.stats == result.stats
    assert repr(result).startswith("<Parametrization: 16 vertices, 18 faces, 0 cut edges; ")
    assert "overlaps 0" in str(result.certificate)
    flipped = ff.certify(result.vertices, result.faces, result.uv * [-1, 1])
    assert flipped.overlaps == -1
    uncounted = "overlaps of islands with themselves not counted where a map has flips"
    assert uncounted in str(flipped)


def test_errors_can_be_sent_between_processes() -> None:
    with pytest.raises(ff.InvalidInput) as caught:
        CASES["edge with more than two faces"][0]()
    again = pickle.loads(pickle.dumps(caught.value))
    assert (str(again), again.code, again.elements) == (
        str(caught.value),
        "non-manifold edge",
        [0, 1],
    )


OCTAGON = np.stack([np.cos(np.arange(8) * np.pi / 4), np.sin(np.arange(8) * np.pi / 4)], 1)
LOOP = {"boundary_loop": [0, 1, 2, 5, 8, 7, 6, 3]}
DENT = OCTAGON * np.where(np.arange(8) == 3, 0.2, 1.0)[:, None]

#: (call, arguments beside those of hostile_values.arguments_of, words of the message)
BAD_OPTIONS: list[tuple[str, dict[str, Any], str]] = [
    *(("unwrap", {"tolerance": value}, "tolerance") for value in (0.0, np.nan)),
    *(("unwrap", {"margin": value}, "margin") for value in (-1.0, np.nan)),
    ("unwrap", {"iterations": -1}, "iterations"),
    ("unwrap", {"cuts": [[0.5, 1]]}, "cuts"),
    ("unwrap", {"cuts": [0, 1]}, "cuts"),
    ("unwrap", {"pins": {"abc": (0, 0)}}, "pin"),
    ("unwrap", {"pins": {0: (1, 2, 3)}}, "pin"),
    ("unwrap", {"pins": {(0, 5): (1, 2)}}, "pin"),
    ("unwrap", {"pins": [1, 2]}, "pins"),
    ("unwrap", {"place_like": np.zeros((1, 3, 2))}, "place_like"),
    ("auto_seams", {"stretch": 1.0}, "stretch"),
    ("auto_seams", {"sharp_angle": 4.0}, "sharp_angle"),
    ("auto_seams", {"weights": 3}, "weights"),
    ("auto_seams", {"weights": ([[0, 1]], [-1.0])}, "negative"),
    ("auto_seams", {"weights": ([[0, 1]], [1.0, 2.0])}, "one factor for each edge"),
    ("auto_seams", {"weights": ([[0, 0]], [1.0])}, "edge"),
    ("embed", {"boundary": "pentagon"}, "circle, square, triangle"),
    ("embed", {"method": "magic"}, "ladder"),
    ("embed", {"start": "random"}, "tutte"),
    ("embed", {"boundary": np.zeros((3, 3))}, "boundary must have shape"),
    ("embed", {"boundary": np.zeros((3, 2))}, "one position per vertex"),
    ("embed", {**LOOP, "boundary": DENT}, "not convex at point 3"),
    ("embed", {"initial_uv": np.zeros((3, 2))}, "one finite position per vertex"),
    ("embed", {"boundary_loop": [0, 1, 99]}, "vertex 99"),
    ("embed", {"boundary_loop": [0, 1, 2]}, "boundary loop"),
    *(
        ("embed", {"boundary": OCTAGON, "boundary_loop": [0, 1, 2, 5, *loop]}, words)
        for loop, words in (
            ((8, 7, 1, 3), "passes vertex 1 twice"),
            ((7, 8, 6, 3), "edge from vertex . to . is not in the boundary loop"),
        )
    ),
    *(
        ("embed", {"vertices": mesh[0], "faces": mesh[1]}, f"{said}. Cut it open")
        for mesh, said in (
            ((torus(6, 5)[0], torus(6, 5)[1][:-1]), "1 boundary loops and genus 1"),
            (cylinder(6, 2), "2 boundary loops and genus 0"),
        )
    ),
    ("embed", {"tolerance": -1.0}, "tolerance"),
    ("embed", dict(zip(("vertices", "faces"), octahedron_sphere(0), strict=True)), "boundary"),
    ("conformal", {"tolerance": 0.0}, "tolerance"),
    *(("conformal", {"precision": value}, "precision") for value in (12, "high")),
    ("conformal", {"original_triangles": "maybe"}, "original_triangles"),
    ("conformal", {"intrinsic_refinement": "sometimes"}, "intrinsic_refinement"),
    ("conformal", {"cuts": [[0, 8]]}, "vertices 0 and 8"),
    *(("conformal_metric", {"precision": value}, "precision") for value in (20, "high")),
    ("conformal_metric", {"lengths": np.ones((2, 3))}, "lengths"),
    ("conformal_metric", {"target_angles": np.ones(5)}, "target_angles"),
    ("boundary_angles", {"boundary": "wavy"}, "boundary"),
    ("boundary_angles", {"boundary": "straight", "corners": [4]}, "[Cc]orner"),
    ("boundary_angles", {"boundary": "free", "cones": {0: 1.0}}, "cone"),
    ("boundary_angles", {"boundary": "free", "cones": {4: -1.0}}, "cone"),
    *(
        (call, {"sizing": v}, f"sizing {said}")
        for call in ("cross_field", "field_aligned")
        for v, said in ((np.zeros(9), ""), (np.full(9, np.nan), ""), ([1.0], "must have shape"))
    ),
    ("cross_field", {"sizing": []}, "sizing must have shape"),
    ("match", {"points": {9999: (0, 0)}}, "9999"),
    ("match", {"points": {3: (np.nan, 0)}}, "vertex 3 is not finite"),
    ("match", {"boundary_uv": np.zeros((3, 2))}, "boundary"),
    ("match", {"boundary_loop": [0, 1, 2]}, "boundary"),
    ("match", {"lines": [([0, 8], [(0, 0), (1, 1)])]}, "line"),
    ("match", {"engine": "magic"}, "engine"),
    (
        "match",
        {**LOOP, "boundary_uv": OCTAGON, "points": {4: (0.0, 0.0)}, "paths": {4: [4, 6]}},
        "[Pp]ath",
    ),
    ("pack", {"obstacles": 3.0}, "obstacles"),
    ("pack", {"obstacles": [[0.0, 1.0]]}, "obstacles"),
    ("pack", {"obstacles": [[[0.0, 0.0], [1.0, np.nan], [0.0, 1.0]]]}, "obstacle"),
    (
        "pack",
        {"obstacles": [[[-50.0, -50.0], [900.0, -50.0], [-50.0, 900.0]]]},
        "no room for the islands",
    ),
    *(("pack", {"density": value}, "density") for value in (0.0, "high")),
    ("pack", {"place_like": np.zeros((1, 3, 2))}, "place_like"),
    ("pack", {"place_like": np.zeros((8, 3, 2)), "together": True}, "together"),
    ("pack", {"rotation": "some"}, "^rotation "),
    ("pack", {"tile": 1000}, "^tile "),
    ("pack", {"tiles": 0}, "^tiles "),
    ("pack", {"tile": 1098, "tiles": 4}, "from 1098 on there are 3, not 4"),
    ("pack", {"aspect": 2.0, "tiles": 2}, "one tile"),
    ("pack", {"effort": -1.0}, "^effort "),
    ("pack", {"groups": [1, 2]}, "one number per face"),
    ("pack", {"texture_size": 0, "margin_pixels": 1}, "^texture_size "),
    *(("pack", {"margin_pixels": value}, "^margin_pixels ") for value in (512, -1)),
    ("pack", {"margin": 0.5}, "^margin "),
]


@pytest.mark.parametrize(("name", "options", "words"), BAD_OPTIONS)
def test_options_without_meaning_are_refused_by_name(
    name: str, options: dict[str, Any], words: str
) -> None:
    with pytest.raises(ff.InvalidInput, match=words):
        getattr(ff, name)(**{**arguments_of(name), **options})


@pytest.mark.parametrize("name", FUNCTIONS)
def test_options_that_many_calls_have_are_refused_by_all_of_them(name: str) -> None:
    for option, values in {
        "aspect": (0.0, -1.0, 17.0, float("nan"), "2"),
        "max_seconds": (-1.0, float("nan"), "soon"),
        "threads": (-1,),
    }.items():
        for value in values if option in inspect.signature(FUNCTIONS[name]).parameters else ():
            with pytest.raises(ff.InvalidInput, match=option):
                FUNCTIONS[name](**{**arguments_of(name), option: value})
