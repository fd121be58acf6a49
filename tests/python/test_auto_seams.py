"""Seams that are found: what they allow, what they respect. The shared models are benchmarks/auto_seams.py's."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from broken_meshes import KINDS, broken_mesh

import flipfree as ff

from judges.charts import charts_of
from surfaces import bumpy_grid, cylinder, edges_of, octahedron_sphere, of_cubes, torus

#: Mean energy that the default stretch of 1.25 allows.
BOUND = 1.025

SURFACES = {
    "annulus": cylinder,
    "sphere": lambda: octahedron_sphere(3),
    "torus": torus,
    "bumps": lambda: bumpy_grid(20, 20),
}


def cube(size: int = 1) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """The unit cube, each side (size x size) squares in two triangles; and the diagonals."""
    vertices, faces = of_cubes([(0, 0, 0)], size)
    return vertices, faces, faces[::2, [0, 2]]


def as_set(edges: np.ndarray) -> set[tuple[int, int]]:
    return {(int(min(e)), int(max(e))) for e in edges}


def length_of(vertices: np.ndarray, edges: np.ndarray) -> float:
    return float(np.linalg.norm(vertices[edges[:, 0]] - vertices[edges[:, 1]], axis=1).sum())


def letter(seed: int, noise: float) -> tuple[np.ndarray, np.ndarray]:
    """A prism over a T with corners on its straight edges; all polygons are fans of their first corner: they fold, and have
    triangles without area, or as thin as the noise."""
    random = np.random.default_rng(seed)
    corners = np.array([(0, 0), (1, 0), (1, 3), (2, 3), (2, 4), (-1, 4), (-1, 3), (0, 3)], float)
    outline = []
    for a, b in zip(corners, np.roll(corners, -1, axis=0), strict=True):
        shares = np.sort(random.integers(1, 8, random.integers(0, 4))) / 8
        outline += [a + share * (b - a) for share in np.unique([0.0, *shares])]
    count = len(outline)
    vertices = np.vstack([np.column_stack([outline, np.full(count, z)]) for z in (0.0, 0.5)])
    vertices += random.uniform(-noise, noise, vertices.shape)
    lower, upper = np.arange(count), count + np.arange(count)
    walls = np.column_stack([lower, np.roll(lower, -1), np.roll(upper, -1), upper]).tolist()
    polygons = [np.roll(lower[::-1], seed).tolist(), np.roll(upper, seed).tolist(), *walls]
    return vertices, np.array(
        [(p[0], *p[i : i + 2]) for p in polygons for i in range(1, len(p) - 1)]
    )


@pytest.mark.parametrize("noise", [0.0, 1e-8, 1e-6])
def test_what_is_thin_or_has_no_area_leaves_the_rest_within_the_bound(noise: float) -> None:
    for seed in range(12):
        vertices, faces = letter(seed, noise)
        result = ff.unwrap(vertices, faces, seams="auto")
        assert result.certificate.ok
        assert result.certificate.energy <= BOUND, (seed, result.certificate.energy)


@pytest.mark.parametrize("name", SURFACES)
def test_seams_keep_the_distortion_within_the_bound(name: str) -> None:
    vertices, faces = SURFACES[name]()
    result = ff.unwrap(vertices, faces, seams="auto")
    assert result.certificate.ok and result.certificate.overlaps == 0
    assert result.certificate.energy <= BOUND
    assert result.stats["charts"] <= (2 if name == "bumps" else 1)


@pytest.mark.parametrize("name", SURFACES)
def test_an_unwrap_along_the_seams_cuts_nothing_more(name: str) -> None:
    vertices, faces = SURFACES[name]()
    seams = ff.auto_seams(vertices, faces)
    result = ff.unwrap(vertices, faces, cuts=seams, seams="given")
    assert result.stats["added_cuts"] == 0
    assert result.certificate.energy <= BOUND
    assert as_set(result.cut_edges) == as_set(seams)


def test_less_stretch_is_bought_with_longer_seams() -> None:
    vertices, faces = octahedron_sphere(4)
    lengths = []
    for stretch in (1.1, 1.25, 1.6):
        seams = ff.auto_seams(vertices, faces, stretch=stretch)
        energy = ff.unwrap(vertices, faces, cuts=seams, seams="given").certificate.energy
        assert energy <= 0.5 * (stretch + 1 / stretch)
        lengths.append(length_of(vertices, seams))
    assert lengths[0] > lengths[1] > lengths[2]


def test_a_flat_sheet_needs_no_seam() -> None:
    vertices, faces = bumpy_grid(10, 10)
    assert len(ff.auto_seams(vertices * [1, 1, 0], faces)) == 0


def test_a_tube_gets_one_seam_along_it() -> None:
    vertices, faces = cylinder(24, 9)
    vertices *= [1.0, 1.0, 2.5]
    seams = ff.auto_seams(vertices, faces)
    assert len(seams) == 9
    assert length_of(vertices, seams) == pytest.approx(5.0)


def bent(tube: np.ndarray, angle: float, radius: float) -> np.ndarray:
    """A tube along an arc of this angle and radius, a quarter as wide."""
    turn, out = tube[:, 2] * angle / 2, radius + 0.25 * tube[:, 0]
    return np.stack([out * np.cos(turn), 0.25 * tube[:, 1], out * np.sin(turn)], 1)


def test_a_bent_pipe_is_no_bundle_of_flat_strips() -> None:
    """Half a ring whose facets around it bend like those of a made thing, and are rolled along it."""
    vertices, faces = cylinder(12, 24)
    polygons = np.arange(len(faces) // 2, dtype=np.int32).repeat(2)
    found = ff.unwrap(bent(vertices, np.pi, 1.0), faces, polygons=polygons)
    assert found.stats["charts"] == 1


def test_a_cube_becomes_one_net() -> None:
    for size in (1, 4):
        vertices, faces, diagonals = cube(size)
        result = ff.unwrap(vertices, faces, seams="auto", uncuttable=diagonals)
        assert result.stats["charts"] == 1
        assert len(result.cut_edges) == 7 * size
        assert result.certificate.energy == pytest.approx(1.0, abs=1e-6)


def staircase() -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """From wall to wall, its sides fans of triangles: vertex k + 8 is the image of k; and the polygons."""
    steps = [(0, 0), (3, 0), (3, 1), (2, 1), (2, 2), (1, 2), (1, 3), (0, 3)]
    vertices = np.array([(x, y, z) for y in (-1, 1) for x, z in steps], float)
    count = len(steps)
    faces, polygons = [], []
    for a in range(count):
        b = (a + 1) % count
        faces += [(a, b, b + count), (a, b + count, a + count)]
        polygons += [a, a]
    for k in range(1, count - 1):
        faces += [(0, k + 1, k), (count, count + k, count + k + 1)]
        polygons += [count, count + 1]
    return vertices, np.array(faces, np.int32)[:, ::-1], np.array(polygons)


@pytest.mark.parametrize("given", [[], [(1, 2)], [(1, 2), (9, 10)]])
def test_nets_of_what_is_symmetric_are_symmetric_unless_given_seams_are_not(
    given: list[tuple[int, int]],
) -> None:
    vertices, faces, polygons = staircase()
    found = ff.unwrap(vertices, faces, polygons=polygons, cuts=given or None)
    seams = as_set(found.cut_edges)
    mirrored = as_set((found.cut_edges + 8) % 16)
    assert (mirrored == seams) == (len(given) != 1) and set(given) <= seams
    assert found.certificate.energy < 1.002 and found.stats["charts"] <= 3
    # What is cut more than a net is to be is told.
    assert found.stats["added_cuts"] == len(seams) - 15


@pytest.mark.parametrize("forbidden", ["nothing", "lines", "all lines"])
def test_bent_tubes_lie_straight_and_open_along_the_cheapest_line(forbidden: str) -> None:
    vertices, faces = cylinder(16, 12)
    along = {"nothing": [], "lines": [5, 6, 7, 8, 9, 10, 11], "all lines": list(range(16))}
    never = np.array(
        [(line + 16 * (line % 12), line + 16 * (line % 12) + 16) for line in along[forbidden]],
        np.int32,
    ).reshape(-1, 2)
    arc = bent(vertices, np.pi / 2, 2.0)
    found = ff.unwrap(arc, faces, polygons=np.arange(len(faces)) // 2, uncuttable=never)
    assert found.stats["charts"] == 1 and not as_set(found.cut_edges) & as_set(never)
    opened = set((found.cut_edges % 16).ravel().tolist())
    if forbidden == "all lines":
        assert len(opened) > 1
        return
    assert opened == {8} if forbidden == "nothing" else opened in ({4}, {12})
    for ring in range(13):
        on_ring = found.uv[faces // 16 == ring]
        assert np.ptp(on_ring, axis=0).min() == 0.0


def test_diagonals_are_no_seams() -> None:
    vertices, faces, diagonals = cube(6)
    seams = ff.auto_seams(vertices, faces, uncuttable=diagonals)
    assert len(seams) > 0
    assert not as_set(seams) & as_set(diagonals)


def test_given_seams_stay() -> None:
    vertices, faces, diagonals = cube(4)
    belt = [
        edge
        for edge in edges_of(faces)
        if np.all(vertices[edge, 2] == 0.5) and np.ptp(vertices[edge], axis=0).max() < 0.3
    ]
    seams = ff.auto_seams(vertices, faces, cuts=belt, uncuttable=diagonals)
    assert as_set(np.array(belt)) < as_set(seams)


def test_sharp_edges_are_seams_if_asked() -> None:
    vertices, faces, diagonals = cube()
    seams = ff.auto_seams(vertices, faces, sharp_angle=1.0, uncuttable=diagonals)
    assert len(seams) == 12
    assert ff.unwrap(vertices, faces, cuts=seams, seams="given").stats["charts"] == 6


def test_weights_lead_seams_and_forbid_them() -> None:
    vertices, faces = octahedron_sphere(4)
    edges = edges_of(faces)
    share = {}
    for factor in (1.0, 20.0, np.inf):
        # Of both halves: a sphere's seams without weights lie anywhere.
        share[factor] = 0.0
        for side in (1.0, -1.0):
            front = side * (vertices[edges] @ [1.0, 0.2, 0.1]).mean(1) > 0
            weights = (edges[front], np.full(front.sum(), factor))
            seams = ff.auto_seams(vertices, faces, weights=weights, stretch=1.3)
            share[factor] += len(as_set(seams) & as_set(edges[front])) / len(seams)
    assert share[1.0] > 1.3 * share[20.0] > share[np.inf] == 0.0


def test_sharp_edges_of_infinite_weight_are_no_seams() -> None:
    vertices, faces, diagonals = cube()
    upper = edges_of(faces)[(vertices[edges_of(faces)][:, :, 2] > vertices[:, 2].mean()).all(1)]
    seams = ff.auto_seams(
        vertices,
        faces,
        sharp_angle=1.0,
        uncuttable=diagonals,
        weights=(upper, np.full(len(upper), np.inf)),
    )
    assert len(seams) == 8 and not as_set(seams) & as_set(upper)


@pytest.mark.parametrize("forbidding", ["weights", "uncuttable"])
def test_forbidden_edges_are_seams_only_where_nothing_else_opens_the_surface(
    forbidding: str,
) -> None:
    def seams(vertices: np.ndarray, faces: np.ndarray, edges: np.ndarray) -> np.ndarray:
        given = (edges, np.full(len(edges), np.inf)) if forbidding == "weights" else edges
        return ff.auto_seams(vertices, faces, stretch=1.05, **{forbidding: given})

    vertices, faces = bumpy_grid(6, 6)
    assert len(seams(vertices, faces, edges_of(faces))) == 0  # a disk is open
    vertices, faces = octahedron_sphere(3)
    edges = edges_of(faces)
    assert 0 < len(seams(vertices, faces, edges)) < len(edges) / 4
    level = np.isclose(*vertices[edges][:, :, 2].T)  # rings around the axis
    assert not as_set(seams(vertices, faces, edges[level])) & as_set(edges[level])


def test_a_handle_that_uncuttable_edges_leave_closed_is_refused() -> None:
    vertices, faces = torus()
    for call in (ff.auto_seams, ff.unwrap):
        with pytest.raises(ff.InvalidInput, match="Leave some of them out"):
            call(vertices, faces, uncuttable=edges_of(faces))
    sphere, its_faces = octahedron_sphere(3)
    edges = edges_of(its_faces)
    with pytest.raises(ff.InvalidInput, match="Leave some of them out"):
        ff.unwrap(sphere, its_faces, uncuttable=edges, seams="given")
    assert ff.unwrap(sphere, its_faces, uncuttable=edges, seams="auto").certificate.ok


@pytest.mark.parametrize("kind", KINDS, ids=lambda kind: kind.__name__)
def test_meshes_that_are_no_clean_surface_get_seams(kind: Callable[..., Any]) -> None:
    vertices, faces = kind(np.random.default_rng(7))
    seams = ff.auto_seams(vertices, faces)
    assert as_set(seams) <= as_set(edges_of(faces))
    assert ff.unwrap(vertices, faces, seams="auto").certificate.ok


def test_without_a_word_about_seams_they_are_found_where_the_bound_asks_and_nowhere_else() -> None:
    ball, its_faces = octahedron_sphere(3)
    found = ff.unwrap(ball, its_faces)
    same = ff.unwrap(ball, its_faces, seams="auto", stretch=1.25)
    assert np.array_equal(found.uv, same.uv) and found.certificate.energy <= 1.025
    assert not found.certificate.poor
    given = ff.unwrap(ball, its_faces, seams="given")
    assert given.certificate.poor and given.certificate.stretched > 0.5
    sheet, its_faces = bumpy_grid(8, 8)
    flat = sheet * [1.0, 1.0, 0.05]
    assert len(ff.unwrap(flat, its_faces).cut_edges) == 0
    whole = ff.unwrap(flat, its_faces, cuts=its_faces[:1, :2])
    assert whole.stats["charts"] == 1 and not whole.certificate.poor


def test_islands_that_given_seams_leave_within_the_bound_stay_and_closed_ones_are_opened() -> None:
    ball, its_faces = octahedron_sphere(3)
    seams = ff.auto_seams(ball, its_faces)
    again = ff.unwrap(ball, its_faces, cuts=seams)
    assert as_set(again.cut_edges) == as_set(seams)
    # A seam within a closed part opens nothing; beside it lies an island that is cut well.
    vertices = np.concatenate([ball, ball + 3.0])
    both = np.concatenate([its_faces, its_faces + len(ball)])
    lone = its_faces[:1, :2] + len(ball)
    mixed = ff.unwrap(vertices, both, cuts=np.concatenate([seams, lone]))
    assert mixed.certificate.ok and not mixed.certificate.poor
    first = {edge for edge in as_set(mixed.cut_edges) if max(edge) < len(ball)}
    assert first == as_set(seams)


def test_with_pins_no_seams_are_looked_for() -> None:
    vertices, faces = octahedron_sphere(2)
    pinned = [
        ff.unwrap(vertices, faces, seams=seams, pins={0: (0.0, 0.0)}) for seams in ("auto", "given")
    ]
    assert np.array_equal(pinned[0].uv, pinned[1].uv)


def test_time_that_is_over_leaves_the_seams_found_so_far() -> None:
    vertices, faces = octahedron_sphere(6)
    found = []
    for seconds in (0.02, 0.05, 0.1, 0.3):
        try:
            found.append(ff.auto_seams(vertices, faces, max_seconds=seconds))
        except ff.NotConverged as error:
            assert error.code == "time limit reached"
    for seams in found:
        assert seams.shape[1] == 2


def test_a_face_that_is_thin_but_for_rounding_is_not_cut_off() -> None:
    """Alone it could not be stored: three points on one line."""
    _, (vertices, faces) = broken_mesh(700722)
    result = ff.unwrap(vertices, faces, seams="auto")
    assert result.certificate.ok
    assert result.certificate.triangles == len(faces)


@pytest.mark.parametrize("seed", [0, 3, 6, 9, 12, 24, 33, 39])
def test_rough_patches_that_lie_on_themselves_are_divided_rather_than_stretched(seed: int) -> None:
    random = np.random.default_rng(seed)
    vertices, faces = bumpy_grid(int(random.integers(3, 8)), int(random.integers(3, 8)))
    rough = vertices * random.uniform(0.2, 3, 3) + 0.1 * random.standard_normal(vertices.shape)
    stretch = float(random.choice([1.05, 1.1, 1.25]))
    bound = 0.5 * (stretch + 1.0 / stretch)
    seams = ff.auto_seams(rough, faces, stretch=stretch)
    for found in (
        ff.unwrap(rough, faces, cuts=seams, seams="given"),
        ff.unwrap(rough, faces, seams="auto", stretch=stretch),
    ):
        assert found.certificate.ok
        assert found.certificate.energy <= bound * (1 + 1e-6)


def rough_with_lines(seed: int) -> tuple[np.ndarray, np.ndarray, float]:
    """A rough sheet; some triangles are divided at the middle of a side, which their neighbours do not know: triangles
    without area lie between. And a stretch."""
    random = np.random.default_rng(seed)
    columns, rows = int(random.integers(2, 6)), int(random.integers(2, 5))
    sheet, faces = bumpy_grid(columns, rows, 0.0)
    heights = random.normal(size=len(sheet)) * random.choice([0.1, 0.3, 0.6])
    vertices = [[x, y, z] for (x, y, _), z in zip(sheet, heights, strict=True)]
    left = int(random.integers(1, 4))
    sides = {(int(t[k]), int(t[(k + 1) % 3])) for t in faces for k in range(3)}
    result: list[list[int]] = []
    for face in faces.tolist():
        k = next((k for k in range(3) if (face[(k + 1) % 3], face[k]) in sides), None)
        if left and k is not None and random.random() < 0.3:
            left -= 1
            a, b, c = face[k], face[(k + 1) % 3], face[(k + 2) % 3]
            middle = len(vertices)
            vertices.append(list(0.5 * (np.array(vertices[a]) + np.array(vertices[b]))))
            result += [[a, middle, c], [middle, b, c], [a, b, middle]]
        else:
            result.append(face)
    return (
        np.array(vertices),
        np.array(result, dtype=np.int32),
        float(random.choice([1.02, 1.1, 1.25])),
    )


@pytest.mark.parametrize("seed", [7, 195, 288])
def test_triangles_without_area_do_not_keep_an_island_above_the_bound(seed: int) -> None:
    vertices, faces, stretch = rough_with_lines(seed)
    result = ff.unwrap(vertices, faces, seams="auto", stretch=stretch)
    uv, points = result.uv32(), vertices[faces]
    sides = np.cross(points[:, 1] - points[:, 0], points[:, 2] - points[:, 0])
    solid = np.linalg.norm(sides, axis=1) >= 1e-9
    chart = np.where(solid, charts_of(faces, uv).face, -1)
    energies = [
        ff.certify(vertices, faces[chart == i], uv[chart == i]).energy
        for i in np.unique(chart[solid])
    ]
    assert max(energies) <= 0.5 * (stretch + 1.0 / stretch) + 1e-5
