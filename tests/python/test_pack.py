"""ff.pack: charts into the unit square by similarities, nested; layouts of ff.pack and ff.unwrap on random islands: nothing on
top of anything, gaps on stored values by the slow judge, and every option kept."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt
import pytest
from packing_layouts import Layout, drawn, flat
from random_layouts import case

import flipfree as ff

from judges import gaps
from judges.gaps import area
from surfaces import areas_of, bumpy_grid, joined


def two_sheets(second: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Two components and a map of each that is its x, y; the second's is scaled."""
    vertices, faces = bumpy_grid(8, 6)
    both, faces = joined((vertices, faces), (vertices + [5, 0, 0], faces))
    uv = both[faces][:, :, :2].copy()
    uv[len(faces) // 2 :] *= second
    return both, faces, uv


def test_components_that_stay_together_lie_side_by_side_in_the_unit_square() -> None:
    vertices, faces, uv = two_sheets(3.0)
    packed = ff.pack(vertices, faces, uv, together=True, margin=0.01)
    assert packed.certificate.ok and packed.uv.min() > 0.0 and packed.uv.max() < 1.0
    parts = [part.reshape(-1, 2) for part in np.split(packed.uv, 2)]
    low, high = [part.min(0) for part in parts], [part.max(0) for part in parts]
    assert max((low[1] - high[0]).max(), (low[0] - high[1]).max()) > 0.007


@pytest.mark.parametrize(("scale_true", "ratio"), [(True, 1.0), (False, 9.0)])
def test_scales_keep_their_ratio_or_follow_the_surface(scale_true: bool, ratio: float) -> None:
    vertices, faces, uv = two_sheets(3.0)
    packed = ff.pack(vertices, faces, uv, scale_true=scale_true)
    m = len(faces) // 2
    assert area(packed.uv[m:]) / area(packed.uv[:m]) == pytest.approx(ratio, rel=1e-6)


def test_charts_of_one_component_keep_their_rotations_only_together() -> None:
    vertices, faces = bumpy_grid(8, 6)
    uv = vertices[faces][:, :, :2].copy()
    left = uv[:, :, 0].mean(1) < np.median(uv[:, :, 0])
    # The second half is turned by a quarter and lies elsewhere: its own chart.
    uv[~left] = np.stack([-uv[~left][:, :, 1], uv[~left][:, :, 0]], -1) * 1.0 + [7.0, 3.0]
    packed = ff.pack(vertices, faces, uv, together=True).uv

    def turn(part: np.ndarray) -> complex:
        before = uv[part][:, 1] - uv[part][:, 0]
        after = packed[part][:, 1] - packed[part][:, 0]
        z = (after[:, 0] + 1j * after[:, 1]) / (before[:, 0] + 1j * before[:, 1])
        assert np.abs(z - z[0]).max() < 1e-9
        return complex(z[0])

    assert turn(left) == pytest.approx(turn(~left), abs=1e-9)


Array = npt.NDArray[np.float64]


class Scene:
    """Flat sheets of random shape as one mesh, each an island, somewhere in the plane."""

    def __init__(self, seed: int, count: int):
        random = np.random.default_rng(seed)
        parts: list[Any] = []
        uv: list[Array] = []
        self.island: list[slice] = []
        triangles = 0
        for _ in range(count):
            points, grid = bumpy_grid(
                int(random.integers(1, 4)), int(random.integers(1, 4)), height=0.0
            )
            points = points * [*random.uniform(0.2, 2.0, 2), 1.0]
            angle, centre = random.uniform(0, 7), random.uniform(-3, 3, 2)
            turn = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
            parts.append((points, grid))
            uv.append((points[:, :2] @ turn.T * random.uniform(0.5, 2.0) + centre)[grid])
            self.island.append(slice(triangles, triangles + len(grid)))
            triangles += len(grid)
        self.vertices, self.faces = joined(*parts)
        self.uv = np.concatenate(uv)

    def stored(self, result: ff.Parametrization) -> list[Array]:
        uv = result.uv32().astype(np.float64)
        return [uv[own] for own in self.island]

    def density(self, result: ff.Parametrization, i: int) -> float:
        own = self.island[i]
        surface = areas_of(self.vertices, self.faces[own]).sum()
        return float(np.sqrt(area(result.uv[own]) / surface))


def assert_apart(islands: list[Array], obstacles: Array | None = None) -> None:
    assert gaps.narrowest(islands, 1e-3).distance > 0.0
    for still in [] if obstacles is None else obstacles:
        assert all(gaps.between(island, still[None], 1e-3) > 0.0 for island in islands)


@pytest.mark.sample(10)
@pytest.mark.parametrize("margin", [0.0, 0.005, 0.05])
@pytest.mark.parametrize("seed", range(8))
def test_random_islands_are_packed_apart_at_one_scale(seed: int, margin: float) -> None:
    scene = Scene(seed, 1 + 4 * seed)
    packed = ff.pack(scene.vertices, scene.faces, scene.uv, margin=margin, scale_true=True)
    found = scene.stored(packed)
    assert_apart(found)
    assert all(uv.min() >= 0.0 and uv.max() <= 1.0 for uv in found)
    scales = [scene.density(packed, i) for i in range(len(scene.island))]
    assert max(scales) / min(scales) < 1.0 + 1e-9
    assert packed.stats["density"] == pytest.approx(scales[0])
    assert packed.stats["tile"] == packed.stats["kept_places"] == 0


@pytest.mark.parametrize("seed", range(12))
def test_random_obstacles_and_unmoved_islands_are_kept_clear_of(seed: int) -> None:
    scene = Scene(seed, 3 + seed)
    random = np.random.default_rng(seed)
    obstacles = random.uniform(-0.3, 1.3, (1 + seed % 9, 1, 2))
    obstacles = obstacles + random.uniform(-0.2, 0.2, (len(obstacles), 3, 2))
    own = scene.island[1]
    size = np.ptp(scene.uv[own].reshape(-1, 2), axis=0).max()
    scene.uv[own] = scene.uv[own] * 0.3 / size  # stays, in the square
    scene.uv[own] += 0.4 - scene.uv[own].min((0, 1))
    scene.uv[own] = scene.uv[own].astype(np.float32)
    corner = 3 * own.start
    packed = ff.pack(
        scene.vertices,
        scene.faces,
        scene.uv,
        scale_true=True,
        obstacles=obstacles,
        unmoved=[corner],
        effort=0.1,
    )
    assert np.array_equal(packed.uv[own], scene.uv[own])
    assert np.array_equal(packed.uv32()[own], scene.uv[own].astype(np.float32))
    found = scene.stored(packed)
    moved = [uv for i, uv in enumerate(found) if i != 1]
    assert_apart(moved, np.concatenate([obstacles, found[1]]))
    tile = np.array([packed.stats["tile"] % 10, packed.stats["tile"] // 10])
    assert all((uv - tile).min() >= 0.0 and (uv - tile).max() <= 1.0 for uv in moved)
    # As dense as the one that stays, or as dense as there is room for.
    assert packed.stats["density"] <= scene.density(packed, 1) * (1.0 + 1e-9)


def test_moved_islands_take_the_density_of_unmoved_ones_if_there_is_room() -> None:
    scene = Scene(1, 6)
    scene.uv = ff.pack(scene.vertices, scene.faces, scene.uv, scale_true=True).uv * 0.4
    packed = ff.pack(scene.vertices, scene.faces, scene.uv, scale_true=True, unmoved=[0])
    scales = [scene.density(packed, i) for i in range(6)]
    assert max(scales) / min(scales) < 1.0 + 1e-6


def test_a_density_is_met_if_there_is_room_and_never_exceeded() -> None:
    scene = Scene(2, 9)
    mesh = scene.vertices, scene.faces, scene.uv
    largest = ff.pack(*mesh, scale_true=True).stats["density"]
    low = ff.pack(*mesh, scale_true=True, density=0.25 * largest)
    assert low.stats["density"] == pytest.approx(0.25 * largest)
    assert scene.density(low, 3) == pytest.approx(0.25 * largest)
    high = ff.pack(*mesh, scale_true=True, density=4.0 * largest)
    assert high.stats["density"] == pytest.approx(largest)


def test_a_density_is_in_the_users_unit() -> None:
    scene = Scene(2, 4)
    scale = 2.0**300
    packed = ff.pack(scene.vertices * scale, scene.faces, scene.uv, density=0.1 / scale)
    assert packed.stats["density"] == pytest.approx(0.1 / scale)


def test_islands_keep_usable_places_at_one_scale() -> None:
    scene = Scene(5, 7)
    mesh = scene.vertices, scene.faces
    before = ff.pack(*mesh, scene.uv, scale_true=True).uv
    before = 0.9 - 0.8 * before  # turned by half a turn
    kept = ff.pack(*mesh, scene.uv, scale_true=True, place_like=before)
    assert kept.stats["kept_places"] == 1
    assert np.abs(kept.uv - before).max() < 1e-6
    uneven = before.copy()
    own = scene.island[2]
    uneven[own] = 0.5 * (uneven[own] - uneven[own].mean((0, 1))) + uneven[own].mean((0, 1))
    kept = ff.pack(*mesh, scene.uv, scale_true=True, place_like=uneven)
    scales = [scene.density(kept, i) for i in range(7)]
    assert kept.stats["kept_places"] == 1 and max(scales) / min(scales) < 1.0 + 1e-6


@pytest.mark.parametrize("fault", ["overlap", "inside", "outside", "torn", "obstacle", "nan"])
def test_places_that_are_not_usable_are_given_up_for_all(fault: str) -> None:
    scene = Scene(5, 7)
    mesh = scene.vertices, scene.faces
    before = ff.pack(*mesh, scene.uv, scale_true=True, margin=0.01).uv.copy()
    first, second = scene.island[0], scene.island[1]
    obstacles = None
    if fault == "overlap":
        before[first] += before[second].mean((0, 1)) - before[first].mean((0, 1))
    elif fault == "inside":  # a small one in the middle of a large one: no boundary meets
        wide, small = (
            max(scene.island, key=lambda own: area(before[own])),
            min(scene.island, key=lambda own: area(before[own])),
        )
        before = (before - before[wide].mean((0, 1))) * 0.3 + 0.5
        before[small] += before[wide].mean((0, 1)) - before[small].mean((0, 1))
    elif fault == "outside":
        before += 0.1
    elif fault == "torn":
        before[first.start] += 0.001
    elif fault == "obstacle":
        obstacles = before[first].mean((0, 1)) + [[[0, 0], [1e-4, 0], [0, 1e-4]]]
    else:
        before[first.start, 0, 0] = np.nan
    packed = ff.pack(*mesh, scene.uv, scale_true=True, place_like=before, obstacles=obstacles)
    assert packed.stats["kept_places"] == 0
    found = scene.stored(packed)
    assert_apart(found, obstacles)
    assert all(uv.min() >= 0.0 and uv.max() <= 1.0 for uv in found)


def sheets(count: int) -> tuple[Array, npt.NDArray[np.int32]]:
    """Bumpy sheets side by side, each its own component and of another size."""
    vertices, faces = bumpy_grid(6, 5)
    n = len(vertices)
    return (
        np.concatenate([vertices * (1.0 + 0.3 * i) + [9.0 * i, 0, 0] for i in range(count)]),
        np.concatenate([faces + n * i for i in range(count)]).astype(np.int32),
    )


def test_unwrapped_charts_have_one_density_and_keep_clear_of_pinned_ones() -> None:
    vertices, faces = sheets(5)
    m = len(faces) // 5
    free = ff.unwrap(vertices, faces, seams="given")
    pins = {0: (0.5, 0.5)}
    pinned = ff.unwrap(vertices, faces, pins=pins)
    for result, moved in ((free, range(5)), (pinned, range(1, 5))):
        uv = result.uv32().astype(np.float64)
        islands = [uv[m * i : m * (i + 1)] for i in range(5)]
        assert_apart(islands)
        scales = [np.sqrt(area(islands[i])) / (1.0 + 0.3 * i) for i in moved]
        assert max(scales) / min(scales) < 1.0 + 1e-5
    assert pinned.certificate.pin_failures == 0


def test_former_places_of_an_unwrap_are_all_kept_or_none() -> None:
    vertices, faces = sheets(3)
    m = len(faces) // 3
    before = 0.5 * ff.unwrap(vertices, faces, seams="given").uv + 0.3
    kept = ff.unwrap(vertices, faces, place_like=before, seams="given")
    assert kept.stats["kept_places"] == 1 and np.abs(kept.uv - before).max() < 1e-3
    before[:m] += before[m : 2 * m].mean((0, 1)) - before[:m].mean((0, 1))
    packed = ff.unwrap(vertices, faces, place_like=before, seams="given")
    assert packed.stats["kept_places"] == 0
    assert_apart(list(packed.uv32().astype(np.float64).reshape(3, m, 3, 2)))
    assert packed.uv.max() > 0.9


SQUARE = np.array([[[0.0, 0], [1, 0], [1, 1]], [[0, 0], [1, 1], [0, 1]]])


def islands(layout: Layout, packed: ff.Parametrization) -> list[Array]:
    uv = packed.uv32().astype(np.float64)
    return [uv[layout.island == i] for i in range(layout.islands)]


def pack(layout: Layout, **options: Any) -> ff.Parametrization:
    options.setdefault("effort", 0.1)
    return ff.pack(layout.vertices, layout.faces, layout.uv, **options)


def turns(layout: Layout, packed: ff.Parametrization) -> Array:
    """The angle by which each face's first side was turned."""
    sides = []
    for uv in (layout.uv, packed.uv):
        side = uv[:, 1] - uv[:, 0]
        sides.append(side[:, 0] + 1j * side[:, 1])
    return np.asarray(np.angle(sides[1] / sides[0]))


@pytest.mark.sample(24)
@pytest.mark.parametrize("kind", ["blobs", "letters", "rings", "sizes", "mixed"])
@pytest.mark.parametrize("count", [1, 2, 7, 40])
@pytest.mark.parametrize("pixels", [0.0, 2.0, 16.0])
def test_gaps_are_at_least_the_margin_as_stored(kind: str, count: int, pixels: float) -> None:
    layout = drawn(kind, count, seed=count)
    packed = pack(layout, margin_pixels=pixels, texture_size=1024)
    assert packed.certificate.ok and packed.certificate.island_overlaps == 0
    assert packed.certificate.flips32 == 0
    margin = pixels / 1024
    found = islands(layout, packed)
    gap = gaps.narrowest(found, max(margin, 1e-6))
    assert gap.distance >= margin and gap.distance > 0.0, gap
    low, high = min(uv.min() for uv in found), max(uv.max() for uv in found)
    assert low >= margin / 2 and 1.0 - high >= margin / 2
    assert packed.stats["fill"] == pytest.approx(sum(gaps.area(uv) for uv in found), rel=1e-4)


def test_nested_islands_are_larger_than_boxes_side_by_side() -> None:
    layout = drawn("mixed", 60, seed=5)
    boxes = pack(layout, effort=0.0).stats["fill"]
    assert pack(layout, effort=0.5).stats["fill"] > 1.2 * boxes


def test_small_islands_go_into_holes() -> None:
    layout = drawn("rings", 1, seed=3)
    angle = np.linspace(0.0, 2.0 * np.pi, 33)[:-1]
    ring = np.column_stack([np.cos(angle), np.sin(angle)])
    own = np.arange(32)
    after = np.roll(own, -1)
    faces = [
        np.column_stack([own, 32 + own, 32 + after]),
        np.column_stack([own, 32 + after, after]),
    ]
    points = np.vstack([0.8 * ring, ring, 0.7 * ring + 5.0, [[5.0, 5.0]]])
    faces.append(np.column_stack([np.full(32, 96), 64 + own, 64 + after]))
    layout = flat(points[np.concatenate(faces)])
    assert layout.islands == 2
    uv = pack(layout, margin=0.005).uv
    centres = [uv[layout.island == i].reshape(-1, 2) for i in range(2)]
    middle = [0.5 * (c.min(0) + c.max(0)) for c in centres]
    assert np.linalg.norm(middle[0] - middle[1]) < 0.1


@pytest.mark.parametrize("rotation", ["free", "none"])
def test_islands_grow_until_the_gap_is_no_wider_than_asked_for(rotation: str) -> None:
    layout = drawn("blobs", 7, seed=1)
    packed = pack(layout, margin=2 / 1024, effort=1.0, rotation=rotation)
    assert 2 <= 1024 * gaps.narrowest(islands(layout, packed), 5 / 1024).distance < 2.3
    if rotation == "free":  # 0.768 by cells alone, 2.7 of these pixels wide, in eight directions
        assert packed.stats["fill"] > 0.78


@pytest.mark.parametrize("rotation", ["quarters", "none"])
def test_rotations_are_restricted(rotation: str) -> None:
    layout = drawn("mixed", 30, seed=8)
    found = turns(layout, pack(layout, rotation=rotation)) / (np.pi / 2)
    assert np.abs(found - np.round(found)).max() < 1e-9
    assert (np.abs(found).max() < 1e-9) == (rotation == "none")


def test_groups_keep_their_places_relative_to_each_other() -> None:
    layout = drawn("blobs", 12, seed=2)
    groups = np.where(layout.island < 4, 7, -1)
    packed = pack(layout, groups=groups)
    own = layout.island < 4
    z, w = (uv[own][:, :, 0] + 1j * uv[own][:, :, 1] for uv in (layout.uv, packed.uv))
    ratio = (w - w[0, 0])[1:, 1:] / (z - z[0, 0])[1:, 1:]
    assert np.abs(ratio - ratio[0, 0]).max() < 1e-6 * abs(ratio[0, 0])
    others = [u for i, u in enumerate(islands(layout, packed)) if i >= 4]
    as_one = packed.uv32().astype(float)[own]
    assert gaps.narrowest([as_one, *others], 0.01).distance >= 0.005


@pytest.mark.parametrize("share", [False, True])
def test_layouts_are_packed_by_themselves_into_a_tile_each_or_into_one(share: bool) -> None:
    layout = drawn("mixed", 12, seed=4)
    number = np.where(layout.island < 6, 5, np.where(layout.island < 9, 2, 9))
    held = np.flatnonzero(layout.island == 11)[:1]
    uv = layout.uv.copy()
    own = layout.island == 11
    uv[own] = 0.3 + 0.2 * (uv[own] - uv[own].min((0, 1))) / np.ptp(uv[own])
    options: dict[str, Any] = {"layouts": number, "share_tile": share, "unmoved": 3 * held}
    packed = ff.pack(layout.vertices, layout.faces, uv, tile=1002, effort=0.1, **options)
    found = islands(layout, packed)
    assert np.array_equal(found[11], uv[own].astype(np.float32))
    for i in range(11):
        tile = 1 if share else 1 + [2, 5, 9].index(int(number[layout.island == i][0]))
        assert tile_of(packed.uv32()[layout.island == i]) == tile
    for k in (2, 5, 9):
        own_islands = [found[i] for i in range(12) if number[layout.island == i][0] == k]
        assert gaps.narrowest(own_islands, 0.01).distance >= 0.005
        alone = sum(gaps.area(one) for one in own_islands)
        assert k == 9 or alone > 0.3, "as large as its tile allows"
    assert packed.stats["tiles"] == 3 and packed.stats["margin_met"] == 1
    assert (packed.certificate.island_overlaps > 0) == share


def test_similar_islands_are_stacked_only_if_asked_to() -> None:
    layout = flat(np.concatenate([SQUARE + [3.0 * i, 0.0] for i in range(9)]))
    assert pack(layout).stats["stacked"] == 0
    packed = pack(layout, stack_similar=True)
    assert packed.stats["stacked"] == 8 and packed.certificate.ok
    assert packed.stats["fill"] > 0.9


@pytest.mark.parametrize("aspect", [1.0, 2.0])
def test_mirror_images_are_stacked_mirrored_only_if_asked_to(aspect: float) -> None:
    kite = np.array([[[0.0, 0], [3, 0], [3, 1]], [[0, 0], [3, 1], [1, 2]]])
    turned = (kite * [-1.0, 1.0])[:, ::-1]
    layout = flat(np.concatenate([kite, turned + [9.0, 0.0], kite + [18.0, 0.0]]))
    assert pack(layout, stack_similar=True, aspect=aspect).stats["stacked"] == 1
    packed = pack(layout, stack_similar=True, stack_mirrored=True, aspect=aspect)
    found = packed.certificate
    assert packed.stats["stacked"] == 2 and found.ok and found.mirrored_islands == 1
    assert found.mirrored_faces.tolist() == [2, 3] and found.island_overlaps == 3
    assert not ff.certify(layout.vertices, layout.faces, packed.uv).ok
    one, other, _ = (np.sort(u.reshape(-1, 2), axis=0) for u in islands(layout, packed))
    assert np.abs(one - other).max() < 1e-5
    again = layout.vertices, layout.faces, packed.uv  # what is mirrored is turned over first
    found = ff.pack(*again, stack_similar=True, stack_mirrored=True, aspect=aspect).certificate
    assert found.ok and found.mirrored_islands == 1
    with pytest.raises(ff.InvalidInput, match="2 triangles of the map are flipped"):
        ff.pack(*again, stack_similar=True)


def tile_of(stored: npt.NDArray[np.float32]) -> list[int]:
    """UDIM number less 1001 of the tile that each island of (m, 3, 2) lies in, whole."""
    corners = np.floor(stored.reshape(-1, 2)).astype(int)
    assert (corners == corners[0]).all()
    return int(corners[0, 0] + 10 * corners[0, 1])


@pytest.mark.parametrize(("count", "tiles"), [(40, 3), (40, 12), (5, 8), (120, 2)])
def test_islands_are_spread_over_tiles_at_one_scale(count: int, tiles: int) -> None:
    layout = drawn("mixed", count, seed=count)
    packed = pack(layout, tiles=tiles, tile=1009, margin=4 / 1024, effort=0.2)
    assert packed.certificate.ok and packed.certificate.island_overlaps == 0
    stored = packed.uv32()
    taken = {tile_of(stored[layout.island == i]) for i in range(layout.islands)}
    assert taken == set(range(8, 8 + min(tiles, layout.islands)))
    assert packed.stats["tiles"] == len(taken) and packed.stats["tile"] == 8
    assert packed.stats["margin_met"]
    found = islands(layout, packed)
    assert gaps.narrowest(found, 5 / 1024).distance >= 4 / 1024
    scales = [gaps.area(b) / gaps.area(layout.uv[layout.island == i]) for i, b in enumerate(found)]
    assert np.ptp(scales) < 1e-4 * max(scales)
    alone = pack(layout, margin=4 / 1024, effort=0.2)
    # The largest island of the five fills its tile; four thousandths of the scale are not worth turning it for.
    assert packed.stats["density"] > (1.2 if count > tiles else 0.996) * alone.stats["density"]


def test_spread_islands_keep_clear_of_what_stays_in_their_tiles() -> None:
    layout = drawn("blobs", 30, seed=3)
    full = np.array([[[0.0, 0], [2, 0], [2, 1]], [[0, 0], [2, 1], [0, 1]]])  # 1001 and 1002
    half = np.array([[[3.0, 0.5], [4, 0.5], [4, 1]], [[3, 0.5], [4, 1], [3, 1]]])  # of 1004
    packed = pack(layout, tiles=3, obstacles=np.concatenate([full, half]), effort=0.2)
    stored = packed.uv32()
    taken = {tile_of(stored[layout.island == i]) for i in range(layout.islands)}
    assert taken == {2, 3, 4} and packed.stats["margin_met"]
    for island in islands(layout, packed):
        assert gaps.between(island, half[0][None], 0.01) >= 0.005


def test_one_island_that_is_most_of_all_lies_along_the_diagonal() -> None:
    parts = [SQUARE * [3.0, 1.0], *(0.5 * SQUARE + [i, 2.0] for i in range(4))]
    layout = flat(np.concatenate(parts))
    boxes, nested = (
        pack(layout, effort=effort, rotation="free").stats["density"] for effort in (0.0, 0.1)
    )
    assert nested > 1.05 * boxes


@pytest.mark.parametrize("first", ["strip", "disk"])
def test_straight_and_round_islands_stay_along_the_axes_unless_any_angle_is_asked_for(
    first: str,
) -> None:
    rim = np.exp(2j * np.pi * np.arange(41) / 40)
    rim = np.stack([rim.real, rim.imag], -1)
    disk = np.stack([rim[:-1], rim[1:], np.zeros((40, 2))], 1)
    askew = np.array([[0.8, 0.6], [-0.6, 0.8]])
    island = (SQUARE * [3.0, 1.0] if first == "strip" else disk) @ askew
    layout = flat(np.concatenate([island, *(0.5 * SQUARE + [i, 9.0] for i in range(4))]))
    for rotation, along in (("straight", True), ("free", False)):
        uv = pack(layout, rotation=rotation).uv
        corners = uv[: len(island)]
        sides = np.abs(np.roll(corners, -1, axis=1) - corners)
        # By eighths of a turn a side of the disk may come to lie along an axis, too.
        if along or first == "strip":
            assert (sides.min(-1) < 1e-5 * sides.max(-1)).any() == along


def test_a_thousand_equal_squares_lie_in_rows() -> None:
    layout = flat(np.concatenate([SQUARE + [2.0 * (i % 32), 2.0 * (i // 32)] for i in range(1000)]))
    packed = pack(layout, margin=2 / 1024)
    assert gaps.narrowest(islands(layout, packed), 2.5 / 1024).distance >= 2 / 1024
    assert packed.stats["fill"] > 0.8


def test_slivers_dust_and_huge_islands_together() -> None:
    random = np.random.default_rng(0)
    triangles = [np.array([[0.0, 0], [1, 0], [0.5, 1]])]
    triangles += [np.array([[0.0, 0], [3, 0], [3, 1e-4]]) + [0.0, i + 2.0] for i in range(20)]
    triangles += [random.uniform(0, 1e-5, (3, 2)) + [9.0, i] for i in range(30)]
    uv = np.array(
        [t if np.linalg.det([t[1] - t[0], t[2] - t[0]]) > 0 else t[::-1] for t in triangles]
    )
    faces = np.arange(len(uv) * 3).reshape(-1, 3).astype(np.int32)
    vertices = np.column_stack([uv.reshape(-1, 2), np.zeros(3 * len(uv))])
    packed = ff.pack(vertices, faces, uv, effort=0.1)
    assert packed.certificate.ok and packed.certificate.island_overlaps == 0
    stored = packed.uv32().astype(float)
    assert gaps.narrowest([t[None] for t in stored], 0.006).distance >= 0.005


def test_a_density_that_32_bits_cannot_store_is_told_a_larger_one() -> None:
    layout = drawn("blobs", 2, seed=1)
    for density in (1e-42, 1e-30):
        with pytest.raises(ff.NotConverged, match="give a larger one, or none") as caught:
            pack(layout, density=density)
        assert "smaller" not in str(caught.value)
    assert pack(layout).certificate.ok  # the cure


@pytest.mark.parametrize("seed", [0, 20, 216, 10189, 10435])
def test_margins_hold_where_storing_moves_outlines_or_there_is_room_for_less(seed: int) -> None:
    assert case(seed, 0.0, []) == "packed"


def rectangles(sizes: Array) -> Layout:
    apart = sizes.max() * np.array([2.0, 0.0])
    return flat(np.concatenate([SQUARE * size + apart * i for i, size in enumerate(sizes)]))


@pytest.mark.parametrize("count", [2, 3, 6, 9])
def test_effort_is_not_spent_where_nothing_is_gained(count: int) -> None:
    layout = rectangles(np.ones((count, 2)))
    found = pack(layout, effort=1.0).stats["density"]
    # The whole of a hundred times the effort would be minutes.
    assert pack(layout, effort=100.0, max_seconds=60.0).stats["density"] == found
    largest = 1.0 / np.ceil(np.sqrt(count)) - 0.005
    assert (1 - 5e-4) * largest < found <= largest * (1 + 1e-9)


@pytest.mark.parametrize(("count", "fill"), [(8, 0.68), (100, 0.83), (1000, 0.89), (5000, 0.92)])
def test_boxes_fill_as_much_as_they_did(count: int, fill: float) -> None:
    found = [
        pack(
            rectangles(np.random.default_rng(seed).uniform(0.01, 1.0, (count, 2))),
            effort=0.0,
            margin=0.0,
        ).stats["fill"]
        for seed in range(3)
    ]
    assert np.mean(found) > fill


def test_obstacles_of_any_size_leave_a_place_or_none() -> None:
    layout = rectangles(np.ones((1, 2)))
    right = np.array([[[0.5, -1.0], [1.0, 1.0], [0.5, 1.0]]])
    packed = pack(layout, obstacles=right * [[1.0, 1e6]], margin=0.01)
    assert packed.stats["tile"] == 0 and packed.uv[:, :, 0].max() < 0.5
    everywhere = np.array([[[-50.0, -50.0], [500.0, -50.0], [-50.0, 500.0]]])
    for obstacles in (everywhere, 1e30 * everywhere):
        with pytest.raises(ff.InvalidInput, match="room"):
            pack(layout, obstacles=obstacles)
