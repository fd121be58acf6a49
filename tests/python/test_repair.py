"""Properties of ff.repair, judged by other code."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
import pytest
from broken_meshes import broken_mesh
from map_damage import DAMAGES, map_of
from random_repairs import Task, repaired

import flipfree as ff

from judges.any_triangles import judge_any
from judges.coverage import coverage
from surfaces import bumpy_grid, cylinder, octahedron_sphere, torus

Floats = npt.NDArray[np.float64]

MESHES = {
    "grid": bumpy_grid(14, 11),
    "cylinder": cylinder(),
    "sphere": octahedron_sphere(3),
    "torus": torus(),
}


def planar_map(vertices: Floats, faces: npt.NDArray[np.int32]) -> Floats:
    return vertices[faces][:, :, :2].copy()


def sound(result: ff.Parametrization) -> bool:
    """In 64 and in 32 bits: no flip, one turn around every vertex, no chart on itself."""
    for uv in (result.uv64, result.uv, result.uv32()):
        judged = coverage(result.faces, uv)
        if len(judged.flipped) or len(judged.overwound) or len(judged.within):
            return False
    return True


@pytest.mark.parametrize("damage", DAMAGES)
@pytest.mark.parametrize("mesh", MESHES)
def test_whatever_happened_to_a_map_it_is_mended(mesh: str, damage: str) -> None:
    vertices, faces = MESHES[mesh]
    base = ff.unwrap(vertices, faces, seams="given")
    for seed in range(3):
        given = map_of(faces, base.uv32().astype(np.float64))
        DAMAGES[damage](given, np.random.default_rng(seed))
        result = ff.repair(vertices, faces, given.uv, cuts=base.cut_edges if seed else None)
        assert result.certificate.ok
        assert sound(result)
        assert result.stats["corners_kept"] == (result.uv == given.uv).all(axis=2).sum()


@pytest.mark.parametrize("seed", range(40))
def test_maps_of_broken_meshes_are_mended(seed: int) -> None:
    _, (vertices, faces) = broken_mesh(seed)
    base = ff.unwrap(vertices, faces, seams="given")
    random = np.random.default_rng(seed)
    given = map_of(faces, base.uv32().astype(np.float64))
    list(DAMAGES.values())[seed % len(DAMAGES)](given, random)
    result = ff.repair(vertices, faces, given.uv, disjoint=True)
    assert result.certificate.ok
    assert bool(result.certificate.mends) == bool(base.certificate.mends)
    for uv in (result.uv64, result.uv32()):
        assert judge_any(faces, uv) == []


@pytest.mark.parametrize("seed", [8365, 8415, 8515])
def test_faces_of_contradictory_windings_that_come_to_share_an_edge_do_not_fold(seed: int) -> None:
    outcome = repaired(Task(seed, "broken", "zero_corners"))
    assert outcome is not None and outcome.said == ""


def with_faces_that_use_a_vertex_twice() -> tuple[Floats, npt.NDArray[np.int64], Floats]:
    """A sheet in two islands; three such faces, one of them at no place of the others."""
    vertices, faces = bumpy_grid(8, 8)
    uv = planar_map(vertices, faces)
    uv[vertices[faces][:, :, 0].mean(axis=1) > 0.5, :, 0] += 1.0
    thin = np.array([[3, 3, 4], [51, 52, 52], [7, 7, 8]])
    own = vertices[thin][:, :, :2].copy()
    own[1, :, 0] += 1.0
    own[2] = 0.25
    return vertices, np.vstack([faces, thin]), np.concatenate([uv, own])


def test_faces_that_use_a_vertex_twice_go_with_their_neighbours() -> None:
    vertices, faces, uv = with_faces_that_use_a_vertex_twice()
    sound = ff.repair(vertices, faces, uv)
    assert np.array_equal(sound.uv, uv) and np.array_equal(sound.uv32(), uv.astype(np.float32))
    assert sound.stats["corners_kept"] == uv.shape[0] * 3
    thrown = uv.copy()
    thrown[faces == 51] = (5.0, 5.0)
    result = ff.repair(vertices, faces, thrown)
    assert result.stats["corners_kept"] == (result.uv == thrown).all(axis=2).sum()
    moved = result.uv[:-3][faces[:-3] == 51]
    assert (moved != 5.0).all() and np.array_equal(result.uv[-2, 0], moved[0])
    assert np.array_equal(result.uv[-1], uv[-1])


def test_pins_hold_at_faces_that_use_a_vertex_twice() -> None:
    vertices, faces, uv = with_faces_that_use_a_vertex_twice()
    uv[faces == 20] = (5.0, 5.0)
    pins = {3: tuple(uv[faces == 3][0].tolist()), (len(faces) - 1, 0): (0.75, 0.5)}
    result = ff.repair(vertices, faces, uv, pins=pins)
    assert result.certificate.ok and result.certificate.pin_failures == 0
    assert (result.uv[faces == 3] == pins[3]).all()
    assert tuple(result.uv[-1, 0].tolist()) == (0.75, 0.5)


def test_islands_wrong_side_up_and_out_of_shape_cost_no_more_than_what_was_open(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setenv("FLIPFREE_DATA", "")  # generated meshes only
    outcome = repaired(Task(20152))
    assert outcome is not None and outcome.said == ""
    assert outcome.energy < 1.1


def test_where_mended_charts_cannot_be_stored_all_are_made_anew() -> None:
    outcome = repaired(Task(8111, "broken"))
    assert outcome is not None and outcome.said == ""
    assert outcome.stats["charts_anew"] == outcome.stats["charts"]
    assert outcome.stats["corners_kept"] == 0 and outcome.stats["flips_before"] > 0


@pytest.mark.parametrize("mesh", MESHES)
def test_a_sound_map_comes_back_bit_for_bit(mesh: str) -> None:
    vertices, faces = MESHES[mesh]
    base = ff.unwrap(vertices, faces, seams="given")
    result = ff.repair(vertices, faces, base.uv32().astype(np.float64), disjoint=True)
    assert np.array_equal(result.uv32(), base.uv32())
    assert np.array_equal(result.uv, base.uv32())


def test_what_was_done_is_counted() -> None:
    vertices, faces = bumpy_grid()
    uv = planar_map(vertices, faces)
    uv[faces == 100] = (5.0, 5.0)
    uv[faces == 200] = np.nan
    result = ff.repair(vertices, faces, uv)
    assert result.stats["flips_before"] > 3
    assert result.stats["corners_without_place"] == 6
    assert result.stats["energy_before"] == np.inf
    assert result.stats["charts_unfolded"] == result.stats["charts"] == 1
    assert result.stats["corners_kept"] >= 3 * len(faces) - 12
    assert result.stats["energy"] == result.certificate.energy < 1.5


def test_other_corners_stay_as_they_were() -> None:
    vertices, faces = bumpy_grid()
    uv = planar_map(vertices, faces)
    thrown = uv.copy()
    thrown[faces == 100] = (5.0, 5.0)
    result = ff.repair(vertices, faces, thrown)
    assert np.array_equal(result.uv[faces != 100], uv[faces != 100])


def test_an_island_made_anew_stays_where_and_as_large_as_it_was() -> None:
    vertices, faces = bumpy_grid(30, 10)
    uv = planar_map(vertices, faces)
    random = np.random.default_rng(1)
    left = vertices[faces][:, :, 0].mean(axis=1) < 0.5
    uv[~left, :, 0] += 0.5
    turned = uv @ np.array([[0.8, 0.6], [-0.6, 0.8]])
    given = map_of(faces, turned)
    places = given.places()
    folded = np.unique(given.point[left])
    folded = folded[random.random(len(folded)) < 0.4]
    places[folded] += 0.1 * random.normal(size=(len(folded), 2))
    given.put(places)
    result = ff.repair(vertices, faces, given.uv)
    assert np.array_equal(result.uv[~left], turned[~left])
    assert np.abs(result.uv[left] - turned[left]).max() < 0.2


def test_pins_are_met_bit_for_bit() -> None:
    vertices, faces = bumpy_grid()
    uv = planar_map(vertices, faces)
    uv[faces == 130] = (0.9, 0.1)
    pins = {30: (1 / 3, 0.1), 200: tuple(uv[faces == 200][0].tolist())}
    result = ff.repair(vertices, faces, uv, pins=pins)
    assert result.certificate.ok and result.certificate.pin_failures == 0
    for vertex, target in pins.items():
        assert np.all(result.uv[faces == vertex] == target)


def test_pins_that_fold_the_map_are_an_error_that_names_them() -> None:
    vertices, faces = bumpy_grid(6, 6)
    uv = planar_map(vertices, faces)
    left, right = uv[faces == 23][0], uv[faces == 25][0]
    uv[faces == 23], uv[faces == 25] = right, left
    pins = {int(v): tuple(uv[faces == v][0].tolist()) for v in np.unique(faces)}
    with pytest.raises(ff.NotConverged, match="pins cannot be reached"):
        ff.repair(vertices, faces, uv, pins=pins)


def stretched_half() -> tuple[Floats, npt.NDArray[np.int32], Floats, npt.NDArray[np.bool_]]:
    """Two islands, of which that on the right is drawn out."""
    vertices, faces = bumpy_grid(16, 16)
    vertices[:, 2] *= 0.2
    uv = planar_map(vertices, faces)
    right = vertices[faces][:, :, 0].mean(axis=1) > 0.5
    uv[right, :, 0] += 1.0
    uv[right, :, 1] *= 2.5
    return vertices, faces, uv, right


def test_a_stretched_island_stays_and_is_counted_unless_it_is_to_be_improved() -> None:
    vertices, faces, uv, right = stretched_half()
    kept = ff.repair(vertices, faces, uv)
    assert np.array_equal(kept.uv, uv)
    assert kept.stats["stretched_charts"] == 1
    better = ff.repair(vertices, faces, uv, stretched="improve")
    assert np.array_equal(better.uv[~right], uv[~right])
    assert better.stats["charts_improved"] == 1 and better.stats["stretched_charts"] == 0
    assert sound(better)
    anew = ff.unwrap(vertices, faces, cuts=kept.cut_edges, seams="given")
    own = ff.certify(vertices, faces[right], better.uv[right]).energy
    assert own < 1.1 * ff.certify(vertices, faces[right], anew.uv[right]).energy
    middles = better.uv[right].mean((0, 1)), uv[right].mean((0, 1))
    assert np.linalg.norm(middles[0] - middles[1]) < 0.05
    # One scale with the other island, which has half of the surface.
    size = np.ptp(better.uv[right].reshape(-1, 2), axis=0)
    assert np.prod(size) == pytest.approx(0.5, rel=0.1)


def test_islands_of_many_sizes_keep_theirs_when_they_are_improved() -> None:
    vertices, faces, uv, right = stretched_half()
    part = (vertices[faces][:, :, 1].mean(axis=1) * 3).astype(int)
    for i, scale in enumerate((1.0, 2.0, 3.0)):  # of what is not stretched
        uv[~right & (part == i)] *= scale
    uv[right, :, 0] += 5.0
    better = ff.repair(vertices, faces, uv, stretched="improve")
    assert better.stats["charts_improved"] == 1 and np.array_equal(better.uv[~right], uv[~right])
    size = np.ptp(better.uv[right].reshape(-1, 2), axis=0)
    assert np.prod(size) == pytest.approx(0.5 * 2.5, rel=0.2)


def test_pins_hold_while_a_stretched_island_is_improved() -> None:
    vertices, faces, uv, right = stretched_half()
    own = np.unique(faces[right][vertices[faces[right]][:, :, 0].min(axis=1) > 0.6])[[3, 40]]
    pins = {int(v): tuple(uv[faces == v][0].tolist()) for v in own}
    better = ff.repair(vertices, faces, uv, stretched="improve", pins=pins)
    assert better.certificate.ok and better.certificate.pin_failures == 0
    for vertex, target in pins.items():
        assert np.all(better.uv[faces == vertex] == target)
    assert better.stats["charts_improved"] + better.stats["charts_stretched_anew"] == 1


@pytest.mark.parametrize("seed", range(20))
def test_no_island_is_stretched_after_it_was_improved(
    seed: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("FLIPFREE_DATA", "")  # generated meshes only
    outcome = repaired(Task(seed))
    assert outcome is not None and outcome.said == ""
    better = outcome.improved
    assert better is not None or outcome.missed
    if better is not None and not better.pinned:
        assert better.islands_above == 0 and better.forced == 0


@pytest.mark.parametrize("seed", range(8))
def test_stretched_islands_of_broken_meshes_are_improved(seed: int) -> None:
    outcome = repaired(Task(seed, "broken", "nudge_points"))
    assert outcome is not None and outcome.said == ""


def test_a_stacked_island_moves_only_on_demand() -> None:
    vertices, faces = bumpy_grid()
    uv = planar_map(vertices, faces)
    uv[vertices[faces][:, :, 0].mean(axis=1) > 0.7, :, 0] -= 0.5
    assert np.array_equal(ff.repair(vertices, faces, uv).uv, uv)
    result = ff.repair(vertices, faces, uv, disjoint=True)
    assert result.certificate.island_overlaps == 0
    assert result.stats["charts_moved"] == 1
    assert (result.uv == uv).all(axis=(1, 2)).mean() > 0.6
