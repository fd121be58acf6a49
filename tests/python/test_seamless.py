"""Properties of seamless maps over generated surfaces, by judges that know the UVs only, in rationals."""

from __future__ import annotations

import time

import numpy as np
import pytest

import flipfree as ff

from judges import holonomy
from judges.seams import seam_count
from judges.unfoldings import SHAPES, unfolding
from surfaces import (
    areas_of,
    bumpy_grid,
    compact,
    edges_of,
    joined,
    octahedron_sphere,
    of_cubes,
    plate,
    prism,
    shuffled,
    signed_areas,
    torus,
)


def random_cones(faces: np.ndarray, genus: int, count: int, seed: int) -> dict[int, int]:
    """Cones of 3 and 5 quarter turns whose sum fits a closed surface of this genus."""
    places = np.random.default_rng(seed).permutation(faces.max() + 1)[:count]
    sharp = (count + 8 - 8 * genus) // 2
    return {int(v): 3 if i < sharp else 5 for i, v in enumerate(places)}


@pytest.mark.parametrize("seed", range(4))
@pytest.mark.parametrize("genus", [0, 1, 2, 3])
def test_turns_by_quarters_on_loops_that_the_solver_has_not_seen(genus: int, seed: int) -> None:
    closed = [octahedron_sphere(3), torus(), *(of_cubes(plate(holes), 3) for holes in (2, 3))]
    vertices, faces = closed[genus]
    cones = random_cones(faces, genus, 16 + 4 * genus, seed)
    map = ff.seamless(vertices, faces, cones, engine="penner", optimise=False, exact=False)
    assert map.certificate.ok
    basis = holonomy.random_homology_basis(map.faces, seed)
    assert len(basis) == 2 * genus
    judged = holonomy.judge(map.faces, map.uv64, cones, basis)
    assert judged.vertex_error < 1e-9
    assert judged.loop_error < 1e-9


@pytest.mark.parametrize("stored", [False, True])
def test_transitions_join_the_sides_of_every_cut_edge_exactly(stored: bool) -> None:
    vertices, faces = torus()
    map = ff.seamless(vertices, faces, random_cones(faces, 1, 12, 3))
    certificate = map.certificate
    assert certificate.seam_edges == certificate.seams_exact64 == certificate.seams_exact32 > 0
    uv = map.uv32().astype(np.float64) if stored else map.uv64
    corner = {
        (int(f[k]), int(f[(k + 1) % 3])): (uv[i, k], uv[i, (k + 1) % 3])
        for i, f in enumerate(map.faces)
        for k in range(3)
    }
    assert len(map.cut_edges) == len(map.transitions.quarter_turns) > 0
    again = ff.certify(map.vertices, map.faces, uv, seamless=True)
    for edges, transitions in (
        (map.cut_edges, map.transitions),
        (again.seam_vertices, again.seam_transitions),
    ):
        for (a, b), quarters, shift in zip(
            edges.tolist(), transitions.quarter_turns, transitions.translation, strict=True
        ):
            turned = np.linalg.matrix_power(np.array([[0, -1], [1, 0]]), int(quarters))
            first, second = corner[a, b], corner[b, a]
            assert (turned @ first[0] + shift == second[1]).all()
            assert (turned @ first[1] + shift == second[0]).all()


def test_optimising_lowers_the_energy() -> None:
    vertices, faces = octahedron_sphere(4)
    cones = random_cones(faces, 0, 24, 7)
    plain = ff.seamless(vertices, faces, cones, optimise=False)
    assert ff.seamless(vertices, faces, cones).certificate.energy < plain.certificate.energy


def two_parts() -> tuple[np.ndarray, np.ndarray]:
    """A torus inside a sphere of ten times its size."""
    ball, faces = octahedron_sphere(3)
    return joined(torus(), (10.0 * ball, faces))


def test_without_cones_some_are_suggested_for_every_part() -> None:
    vertices, faces = two_parts()
    map = ff.seamless(vertices, faces)
    judged = seam_count(map.faces, map.uv32())
    assert judged.flipped == judged.torn == 0
    assert judged.edges == judged.exact > 0
    assert judged.cones == dict(map.certificate.quarter_cones.tolist())
    on_ball = [v for v in judged.cones if v >= len(torus()[0])]
    assert sum(4 - judged.cones[v] for v in on_ball) == 8
    assert sum(4 - k for k in judged.cones.values()) == 8


def test_parts_lie_beside_each_other_at_the_scale_of_the_surface() -> None:
    vertices, faces = two_parts()
    map = ff.seamless(vertices, faces)
    first = map.parent_face < len(torus()[1])
    a, b = map.uv[first].reshape(-1, 2), map.uv[~first].reshape(-1, 2)
    assert (a.max(0) < b.min(0)).any() or (b.max(0) < a.min(0)).any()
    for part in (first, ~first):
        own = areas_of(map.vertices, map.faces[part]).sum()
        assert signed_areas(map.uv[part]).sum() == pytest.approx(own, rel=0.1)


def test_suggested_cones_can_be_given() -> None:
    vertices, faces = prism(12)
    angles = ff.suggest_cones(vertices, faces, bound=2.0, quarter_turns=True)
    cones = angles.quarter_turns
    assert sum(4 - k for k in cones.values()) == 8
    map = ff.seamless(vertices, faces, cones)
    assert dict(map.certificate.quarter_cones.tolist()) == cones
    assert np.array_equal(map.uv, ff.seamless(vertices, faces).uv)


def test_a_torus_needs_no_cones() -> None:
    map = ff.seamless(*torus(), {})
    assert map.certificate.ok and len(map.certificate.quarter_cones) == 0
    assert not map.transitions.quarter_turns.any()


def test_a_map_fits_the_first_quadrant_in_32_bits() -> None:
    """Moved there by its own grid, as what places it does, it stays exact."""
    vertices, faces = octahedron_sphere(4)
    map = ff.seamless(vertices, faces)
    uv = map.uv64 - map.uv64.min((0, 1))
    assert (uv.astype(np.float32) == uv).all()
    assert ff.certify(map.vertices, map.faces, uv, seamless=True).ok


def test_edges_that_are_not_to_be_cut_are_not_cut_in_any_part() -> None:
    vertices, faces = two_parts()
    diagonals = np.concatenate([faces[: len(torus()[1]) : 2, [0, 2]], faces[-200:, [0, 1]]])
    map = ff.seamless(vertices, faces, uncuttable=diagonals)
    cut = {frozenset(edge) for edge in map.cut_edges.tolist()}
    assert cut.isdisjoint(frozenset(edge) for edge in diagonals.tolist())
    with pytest.raises(ff.InvalidInput, match="not an edge"):
        ff.seamless(vertices, faces, uncuttable=[[0, len(vertices) - 1]])


def test_without_exactness_seams_match_up_to_rounding() -> None:
    vertices, faces = octahedron_sphere(3)
    map = ff.seamless(vertices, faces, exact=False)
    assert map.certificate.ok and map.certificate.seam_edges == -1
    measured = ff.certify(map.vertices, map.faces, map.uv64, seamless=True)
    assert not measured.ok and measured.seam_edges == len(map.cut_edges)
    assert 0 < measured.seam_deviation < 1e-12
    assert "off by up to" in str(measured)
    assert np.array_equal(map.uv.astype(np.float32), map.uv32())


def test_a_foreign_map_is_told_how_far_it_is_from_seamless() -> None:
    vertices, faces = octahedron_sphere(3)
    map = ff.seamless(vertices, faces)
    moved = map.uv64.copy()
    edge = map.cut_edges[0]
    f, k = next(
        (f, k) for f, t in enumerate(map.faces.tolist()) for k in range(3) if t[k] == edge[0]
    )
    moved[f, k] += 2.0**-12
    certificate = ff.certify(map.vertices, map.faces, moved, seamless=True)
    assert not certificate.ok and certificate.seam_failures > 0
    assert 2.0**-12 <= certificate.seam_deviation < 2.0**-10
    assert certificate.seam_edges > certificate.seams_exact64
    unwrapped = ff.unwrap(vertices, faces, seams="given")
    foreign = ff.certify(vertices, unwrapped.faces, unwrapped.uv, seamless=True)
    assert not foreign.ok and foreign.seam_deviation > 1e-3


def test_the_order_of_vertices_and_faces_does_not_decide() -> None:
    mesh = octahedron_sphere(3)
    cones = {v: 3 for v in range(8)}
    order = np.random.default_rng(5).permutation(len(mesh[0]))  # as shuffled() draws it
    vertices, faces = shuffled(mesh, 5)
    place = np.empty_like(order)
    place[order] = np.arange(len(order))
    other = ff.seamless(vertices, faces, {int(place[v]): k for v, k in cones.items()})
    usual = ff.seamless(*mesh, cones)
    assert other.certificate.energy == pytest.approx(usual.certificate.energy, rel=0.05)


def test_few_iterations_are_refused_or_taken_as_they_are() -> None:
    vertices, faces = octahedron_sphere(3)
    cones = random_cones(faces, 0, 16, 2)
    best = ff.seamless(vertices, faces, cones).certificate.energy
    for most in (1, 2, 4, 8):
        try:
            assert ff.seamless(vertices, faces, cones, max_iterations=most).certificate.energy >= best * (1 - 1e-9)  # fmt: skip
        except ff.NotConverged as error:
            assert error.code == "iteration limit reached"


def test_the_map_lies_along_the_edges_of_the_mesh() -> None:
    frame = unfolding(plate(1), 3, 4)
    sides = frame.vertices[np.roll(frame.faces, -1, 1)] - frame.vertices[frame.faces]
    slanted = (np.abs(sides) > 1e-9).sum(-1) > 1
    ends = np.stack([frame.faces, np.roll(frame.faces, -1, 1)], -1)
    map = ff.seamless(frame.vertices, frame.faces, uncuttable=ends[slanted])
    assert map.certificate.max_energy < 1 + 1e-6
    along = np.roll(map.uv, -1, 1) - map.uv
    assert np.abs(along[~slanted]).min(-1).max() < 1e-5


def test_padding_avoids_the_edges_that_it_has_not_split_and_takes_all_others() -> None:
    vertices, faces = torus(9, 7)
    edges = edges_of(faces)
    cones = random_cones(faces, 1, 8, 5)
    result = ff.seamless(vertices, faces, cones, engine="padding", uncuttable=edges[::3])
    assert result.certificate.ok
    assert result.stats["engine"] == "padding"
    count = seam_count(result.faces, result.uv)
    assert count.exact == count.edges > 0
    assert count.cones == cones


def test_parts_without_room_for_corners_are_free_wherever_they_stand_among_the_others() -> None:
    # Single triangles have three corners, and a boundary turns by four quarters; a square and a sheet have room.
    square = np.array([(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0)], float)
    parts = [(square[[0, 1, 3]] + [2.0 + 2 * k, 0, 0], [(0, 1, 2)]) for k in range(30)]
    mesh = joined((square, [(0, 1, 2), (0, 2, 3)]), *parts)
    result = ff.seamless(*mesh, boundary="aligned_or_free")
    assert result.certificate.ok
    assert result.stats["freed_boundaries"] == len(parts)
    with pytest.raises(ff.Infeasible):
        ff.seamless(*mesh, boundary="aligned")


@pytest.mark.parametrize("cells", [12, 20, 33])
def test_ragged_borders_are_aligned_with_moderate_distortion(cells: int) -> None:
    """Of the triangles near the middle of a grid: the border has steps, and some stick out."""
    vertices, faces = bumpy_grid(cells, cells, 0.05)
    near = np.linalg.norm(vertices[faces].mean(axis=1)[:, :2] - 0.5, axis=1) < 0.45
    result = ff.seamless(*compact(vertices, faces[near]))
    assert result.certificate.ok and seam_count(result.faces, result.uv32()).slanted == 0
    assert result.certificate.energy < 1.5


def test_corners_that_are_given_are_never_freed() -> None:
    vertices, faces = np.eye(3), np.array([[0, 1, 2]])
    assert ff.seamless(vertices, faces, boundary="aligned_or_free").stats["freed_boundaries"] == 1
    with pytest.raises(ff.Infeasible):
        ff.seamless(vertices, faces, dict.fromkeys(range(3), 1), boundary="aligned_or_free")


def test_a_sliver_that_cannot_be_optimised_leaves_the_map_as_it_was() -> None:
    vertices, faces = bumpy_grid(3, 3, 0.0)
    vertices *= 3.0
    vertices[0] = vertices[1] - (1e-10, 0, 0)
    result = ff.seamless(vertices, faces)
    assert result.certificate.ok and result.certificate.energy < 1.1
    assert result.stats["distortion.stop"] == "not factorized"


def test_needles_that_padding_cannot_cut_are_not_blamed_on_edges_that_it_made() -> None:
    # A torus of nine vertices, flattened to 1e-50 of its width, with a cone of two full turns.
    x = [1.4, -0.6999999999999996, -0.7000000000000006, -0.39999999999999986, -0.39999999999999986]
    x += [-0.40000000000000036, 0.7999999999999998, -0.39999999999999974, -0.40000000000000024]
    y = [0.0, 1.2124355652982142e-50, -1.2124355652982138e-50, 6.928203230275512e-51]
    y += [6.92820323027551e-51, -6.928203230275507e-51, 0.0, 6.928203230275508e-51]
    y += [-6.928203230275506e-51]
    z = [0.0] * 3 + [0.34641016151377546, 0.3464101615137755, 0.3464101615137755]
    z += [-0.34641016151377535] * 3
    faces = [(0, 1, 4), (0, 4, 3), (1, 2, 5), (1, 5, 4), (2, 0, 3), (2, 3, 5), (3, 4, 7), (3, 7, 6)]
    faces += [(4, 5, 8), (4, 8, 7), (5, 3, 6), (5, 6, 8), (6, 7, 1), (6, 1, 0), (7, 8, 2)]
    faces += [(7, 2, 1), (8, 6, 0), (8, 0, 2)]
    with pytest.raises(ff.NotConverged, match="too thin"):
        ff.seamless(
            np.array([x, y, z]).T,
            np.array(faces),
            {2: 3, 0: 3, 5: 2, 4: 8},
            engine="padding",
            max_seconds=60,
        )


def test_a_torus_pressed_flat_to_nothing_is_given_up_by_padding_without_a_limit() -> None:
    # Six of its nine vertices coincide in pairs but for 1e-50 of its width: thousands of bits, one
    # attempt after the other, made minutes of it.
    vertices, faces = torus(3, 3, 0.5)
    vertices[:, 2] *= 1e-50
    before = time.process_time()
    with pytest.raises(ff.NotConverged, match="Merge vertices") as failed:
        ff.seamless(vertices, faces, {5: 3, 0: 3, 6: 2, 3: 8}, engine="padding", max_seconds=200)
    assert failed.value.code != "time limit reached"
    assert time.process_time() - before < 20


@pytest.mark.parametrize("engine", ["penner", "padding"])
@pytest.mark.parametrize("genus, cones", [(0, {0: 1, 3: 1, 40: 2}), (1, {0: 1, 130: 7})])
def test_cones_of_one_quarter_turn_are_met_by_both_engines(
    engine: str, genus: int, cones: dict[int, int]
) -> None:
    # Theorem 5.1 of the thesis leaves them out.
    mesh = torus() if genus else octahedron_sphere(3)
    found = ff.seamless(*mesh, cones, engine=engine)
    assert found.stats["engine"] == engine and found.certificate.ok
    assert found.certificate.seams_exact32 == found.certificate.seam_edges
    assert {v: k for v, k in found.certificate.quarter_cones.tolist() if k != 4} == cones


def test_certificate_and_judge_agree_on_maps_that_are_not_exact() -> None:
    wrong = 0
    for seed in range(30):
        given = unfolding(SHAPES["bar"], 2, seed)
        certificate = ff.certify(given.vertices, given.faces, given.uv, seamless=True)
        judged = seam_count(given.faces, given.uv)
        assert (judged.edges, judged.exact) == (certificate.seam_edges, certificate.seams_exact64)
        stored = seam_count(given.faces, given.uv.astype(np.float32))
        assert stored.edges - stored.exact == certificate.seam_edges - certificate.seams_exact32
        assert not certificate.ok
        assert 0 < certificate.seam_deviation < 1e-12 * np.abs(given.uv).max()
        wrong += judged.edges - judged.exact
    assert wrong > 0


def test_cones_are_judged_exactly_where_the_map_is_seamless() -> None:
    vertices, faces = octahedron_sphere(2)
    map = ff.seamless(vertices, faces)
    cones = dict(map.certificate.quarter_cones.tolist())
    assert cones == seam_count(faces, map.uv64).cones
    angles = {v: k * np.pi / 2 for v, k in cones.items()}
    assert ff.certify(vertices, faces, map.uv64, seamless=True, cones=angles).ok
    angles.pop(next(iter(angles)))
    missing = ff.certify(vertices, faces, map.uv64, seamless=True, cones=angles)
    assert missing.cone_failures == 1
