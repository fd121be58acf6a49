"""Properties of ff.repair, judged by other code."""

from __future__ import annotations

import time
from collections.abc import Callable

import numpy as np
import numpy.typing as npt
import pytest
from broken_meshes import broken_mesh
from map_damage import DAMAGES, map_of
from random_repairs import Task, repaired

import flipfree as ff

from judges.any_triangles import judge_any
from judges.coverage import coverage
from judges.gaps import area
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


@pytest.mark.parametrize(
    ("share", "change", "off"), [(0.4, "charts_unfolded", 0.05), (0.9, "charts_anew", 0.2)]
)
def test_an_island_that_is_mended_stays_where_and_as_large_as_it_was(
    share: float, change: str, off: float
) -> None:
    vertices, faces = bumpy_grid(30, 10)
    uv = planar_map(vertices, faces)
    random = np.random.default_rng(1)
    left = vertices[faces][:, :, 0].mean(axis=1) < 0.5
    uv[~left, :, 0] += 0.5
    turned = 0.25 * uv @ np.array([[0.8, 0.6], [-0.6, 0.8]]) + [4.0, 2.0]
    given = map_of(faces, turned)
    places = given.places()
    folded = np.unique(given.point[left])
    folded = folded[random.random(len(folded)) < share]
    places[folded] += 0.025 * random.normal(size=(len(folded), 2))
    given.put(places)
    result = ff.repair(vertices, faces, given.uv)
    assert result.stats[change] == 1
    assert np.array_equal(result.uv[~left], turned[~left])
    assert np.abs(result.uv[left] - turned[left]).max() < off


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


def test_stretch_that_pins_force_is_not_counted() -> None:
    vertices, faces = bumpy_grid(8, 8, 0.1)
    x, y = vertices[:, 0], vertices[:, 1]
    places = np.column_stack([np.where(x < 0.5, 0.1 * x, 0.05 + 1.9 * (x - 0.5)), y])
    pins = {v: tuple(place) for v, place in enumerate(places.tolist())}
    held = ff.repair(vertices, faces, places[faces], pins=pins, stretched="improve")
    assert np.array_equal(held.uv, places[faces])
    assert held.stats["stretched_charts"] == held.stats["charts_stretched_anew"] == 0
    two = dict(list(pins.items())[:2])
    better = ff.repair(vertices, faces, places[faces], pins=two, stretched="improve")
    assert better.stats["charts_improved"] + better.stats["charts_stretched_anew"] == 1
    assert better.certificate.energy < 1.3 and better.certificate.pin_failures == 0


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


def flat_sheet(n: int = 6) -> tuple[Floats, npt.NDArray[np.int32], Floats]:
    vertices, faces = bumpy_grid(n, n, 0.0)
    return vertices, faces, planar_map(vertices, faces)


@pytest.mark.parametrize("beside", [0, 1, 2])
def test_a_lost_corner_takes_the_place_of_its_neighbours(beside: int) -> None:
    """From either side, wherever the ring around the vertex begins: the edge on one side has lost its other end too."""
    vertices, faces, uv = flat_sheet()
    for face, corner in np.argwhere(faces == 24):
        lost = uv.copy()
        lost[face, [corner, (corner + beside) % 3]] = np.nan
        result = ff.repair(vertices, faces, lost)
        assert np.array_equal(result.uv, uv) and result.stats["corners_rejoined"] == 0


def test_nothing_says_that_a_map_goes_on_where_both_ends_are_lost() -> None:
    vertices, faces, uv = flat_sheet()
    apart = uv + 5.0 * np.arange(len(faces))[:, None, None] * [1.0, 0.0]
    lost = apart.copy()
    lost[30, :2] = np.nan
    result = ff.repair(vertices, faces, lost)
    assert result.stats["charts"] == len(faces)
    assert np.array_equal(np.delete(result.uv, 30, 0), np.delete(apart, 30, 0))


def test_a_lost_vertex_on_a_cut_has_a_place_on_either_side() -> None:
    vertices, faces, uv = flat_sheet()
    uv[uv.mean(axis=1)[:, 0] > 0.5, :, 0] += 5.0
    lost = uv.copy()
    lost[faces == 24] = np.nan
    result = ff.repair(vertices, faces, lost)
    assert result.stats["charts"] == 2
    assert np.array_equal(result.uv[faces != 24], uv[faces != 24])
    assert np.abs(result.uv[faces == 24] - uv[faces == 24]).max() < 0.2


def torn(name: str, faces: npt.NDArray[np.int32], uv: Floats) -> None:
    """Faces and corners that are drawn away from where they belong."""
    if name == "face":
        uv[30] *= -4.0
    elif name == "corner":
        uv[50, 1] = 7.0
    else:
        uv[40:42][faces[40:42] == faces[40, 0]] = (-2.0, 1.0)


@pytest.mark.parametrize("name", ["face", "corner", "corner of two"])
def test_what_was_torn_off_comes_back_unless_a_seam_or_a_pin_parts_it(name: str) -> None:
    vertices, faces, uv = flat_sheet()
    sound = uv.copy()
    torn(name, faces, uv)
    result = ff.repair(vertices, faces, uv)
    assert np.array_equal(result.uv, sound) and result.stats["corners_rejoined"] > 0
    if name != "face":
        return
    sides = np.stack([faces[30], np.roll(faces[30], -1)], -1)
    assert ff.repair(vertices, faces, uv, cuts=sides).stats["corners_rejoined"] == 0
    pins = {(30, k): tuple(uv[30, k].tolist()) for k in range(3)}
    assert ff.repair(vertices, faces, uv, pins=pins).stats["corners_rejoined"] == 0


def test_an_island_that_lies_elsewhere_or_would_not_fit_is_not_torn() -> None:
    vertices, faces, uv = flat_sheet()
    uv[:24, :, 0] += 3.0
    result = ff.repair(vertices, faces, uv)
    assert np.array_equal(result.uv, uv) and result.stats["corners_rejoined"] == 0
    vertices, faces, uv = flat_sheet()
    uv[24:48], uv[48:, :, 1] = 9.0, uv[48:, :, 1] + 4.0  # two rows at one point
    result = ff.repair(vertices, faces, uv)
    assert result.stats["corners_rejoined"] == 0 and result.stats["charts_anew"] == 1
    assert np.array_equal(np.delete(result.uv, range(24, 48), 0), np.delete(uv, range(24, 48), 0))


def islands_at(*places: tuple[float, float, float]) -> tuple[Floats, npt.NDArray[np.int32], Floats]:
    """Square islands (u, v, side), each flat and as large on the surface; nowhere if it is NaN."""
    vertices, faces, uv = flat_sheet(2)
    points = [side * vertices + [3.0 * i, 0.0, 0.0] for i, (_, _, side) in enumerate(places)]
    ids = [faces + len(vertices) * i for i in range(len(places))]
    maps = [side * uv + [u, v] for u, v, side in places]
    return np.concatenate(points), np.concatenate(ids).astype(np.int32), np.concatenate(maps)


@pytest.mark.parametrize(("stretch", "kept"), [(3.0, True), (15.0, False)])
def test_an_island_wrong_side_up_keeps_its_shape_unless_that_is_poor(
    stretch: float, kept: bool
) -> None:
    vertices, faces = bumpy_grid(8, 8, 0.1)
    uv = planar_map(vertices, faces) * [-stretch, 1.0]
    result = ff.repair(vertices, faces, uv)
    assert (result.stats["charts_mirrored"], result.stats["charts_anew"]) == (kept, not kept)
    assert not kept or result.certificate.energy > 1.5


NOWHERE = float("nan")


@pytest.mark.parametrize(
    ("places", "inside"),
    [
        ([(0.0, 0.0, 0.5), (NOWHERE, NOWHERE, 0.25)], True),
        ([(0.0, 0.0, 1.0), (NOWHERE, NOWHERE, 0.25), (NOWHERE, NOWHERE, 1.5)], False),
    ],
)
def test_islands_without_a_place_get_one_at_their_size_beside_the_others(
    places: list[tuple[float, float, float]], inside: bool
) -> None:
    vertices, faces, uv = islands_at(*places)
    result = ff.repair(vertices, faces, uv)
    assert result.certificate.island_overlaps == 0
    assert np.array_equal(result.uv[:8], uv[:8])
    for i, (_, _, side) in enumerate(places[1:], 1):
        own = result.uv[8 * i : 8 * i + 8]
        assert area(own) == pytest.approx(side**2)
        assert (own.max() <= 1.0) == inside and (inside or own[:, :, 0].min() >= 1.0)


def test_pinned_islands_are_not_moved_apart() -> None:
    vertices, faces, uv = islands_at((0.0, 0.0, 0.3), (0.1, 0.1, 0.3), (0.15, 0.15, 0.3))
    pins = {(8, 0): tuple(uv[8, 0].tolist())}
    result = ff.repair(vertices, faces, uv, pins=pins, disjoint=True)
    assert result.certificate.island_overlaps == 0 and result.stats["charts_moved"] == 2
    assert np.array_equal(result.uv[8:16], uv[8:16])


def test_islands_on_each_other_may_stay_so_when_they_are_improved() -> None:
    vertices, faces, uv, right = stretched_half()
    uv[right, :, 0] -= 1.5
    result = ff.repair(vertices, faces, uv, stretched="improve")
    assert result.stats["charts_improved"] == 1 and result.stats["charts_moved"] == 0
    assert result.certificate.island_overlaps > 0
    apart = ff.repair(vertices, faces, uv, stretched="improve", disjoint=True)
    assert apart.certificate.island_overlaps == 0


def fan(count: int) -> tuple[Floats, npt.NDArray[np.int64], Floats]:
    """Faces around one vertex, all of them wrong side up."""
    angle = np.linspace(0.0, 2.0 * np.pi, count, endpoint=False)
    points = np.vstack([[0.0, 0.0], np.column_stack([np.cos(angle), np.sin(angle)])])
    rim = np.arange(count)
    faces = np.column_stack([0 * rim, rim + 1, (rim + 1) % count + 1])
    return np.column_stack([points, 0 * points[:, 0]]), faces, points[faces] * (1.0, -1.0)


def squares(count: int) -> tuple[Floats, npt.NDArray[np.int64], Floats]:
    """So many islands in each row and column, and one that lies on the first of them."""
    low = 2.0 * np.stack(np.meshgrid(np.arange(count), np.arange(count)), -1).reshape(-1, 2)
    low = np.vstack([low, [[0.5, 0.5]]])
    points = (low[:, None] + [[0, 0], [1, 0], [1, 1], [0, 1]]).reshape(-1, 2)
    faces = (4 * np.arange(len(low))[:, None] + [0, 1, 2, 0, 2, 3]).reshape(-1, 3)
    height = np.arange(len(points)) // 4 == count**2
    return np.column_stack([points, height]), faces, points[faces] / (2 * count)


def turned_row(count: int) -> tuple[Floats, npt.NDArray[np.int64], Floats]:
    """A row between two others, turned over, of which none can join them: what goes back spoils the next."""
    x, y = (part.ravel() for part in np.meshgrid(np.arange(count + 1.0), np.arange(4.0)))
    low = np.concatenate([row * (count + 1) + np.arange(count) for row in range(3)])[:, None]
    faces = (low + [0, 1, count + 2, 0, count + 2, count + 1]).reshape(-1, 3)
    points = np.column_stack([x, y])
    across, up = points[faces].mean(axis=1).T
    middle = (up > 1.0) & (up < 2.0)
    faces, middle = faces[middle | (across > 1.0)], middle[middle | (across > 1.0)]
    uv = points[faces]
    uv[middle, :, 0] = -10.0 - uv[middle, :, 0]
    return np.column_stack([points, 0 * x]), faces, uv


@pytest.mark.parametrize(
    ("make", "count", "changed"),
    [
        (fan, 100_000, {"charts_mirrored": 1}),
        (squares, 200, {"charts_moved": 1}),
        (turned_row, 20_000, {"corners_rejoined": 0, "charts_mirrored": 1}),
    ],
)
def test_time_grows_with_the_number_of_faces(
    make: Callable[[int], tuple[Floats, npt.NDArray[np.int64], Floats]],
    count: int,
    changed: dict[str, int],
) -> None:
    mesh = make(count)
    begin = time.process_time()
    result = ff.repair(*mesh, disjoint=True)
    assert time.process_time() - begin < 30.0  # of two seconds; their square would be hours
    assert {key: result.stats[key] for key in changed} == changed
