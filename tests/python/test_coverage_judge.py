"""The slow judge of overlaps (tests/judges), itself judged: by hand-made cases and by arithmetic in rationals."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
import pytest

from judges.boxes import meeting_boxes
from judges.charts import charts_of
from judges.comparison import GENERATORS, map_number
from judges.coverage import coverage, share_covered_twice
from judges.exact import turns
from judges.generators import inverted_slit
from judges.maps import Sheet, grid, opened
from judges.rational import overlapping_pairs, triangles_of, turn
from surfaces import signed_areas

Floats = npt.NDArray[np.float64]
UP, DOWN = np.inf, -np.inf


def two_triangles(shift: float) -> tuple[npt.NDArray[np.int64], Floats]:
    """The second one stands on the first one's right side, further right by `shift`."""
    first = np.array([(0.0, 0.0), (1.0, 0.0), (1.0, 1.0)])
    second = np.array([(1.0, 0.25), (2.0, 0.0), (2.0, 1.0)]) + (shift, 0.0)
    return np.arange(6).reshape(2, 3), np.stack([first, second])


@pytest.mark.parametrize(
    ("shift", "pairs"), [(0.0, 0), (2.0**-52, 0), (-(2.0**-52), 1), (-0.5, 1), (5.0, 0)]
)
def test_islands_overlap_by_a_last_place_or_not(shift: float, pairs: int) -> None:
    found = coverage(*two_triangles(shift))
    assert found.charts.count == 2
    assert len(found.between) == len(found.islands) == pairs
    assert len(found.within) == len(found.touching) == 0


def test_what_doubles_overlap_by_floats_may_not() -> None:
    faces, uv = two_triangles(-(2.0**-40))
    assert len(coverage(faces, uv).between) == 1
    assert len(coverage(faces, uv.astype(np.float32)).between) == 0


def test_an_inverted_slit_overlaps_and_touches_nowhere() -> None:
    map_ = inverted_slit()
    found = coverage(map_.faces, map_.uv)
    assert found.charts.count == 1 and len(found.flipped) == len(found.overwound) == 0
    assert len(found.within) > 0 and len(found.touching) == 0
    assert signed_areas(map_.uv).sum() == pytest.approx(16.6)
    # Two faces of every pair share 0.6 of the area; both sides of the rest are sampled.
    assert share_covered_twice(map_.uv, found.within, 50_000) == pytest.approx(1.2 / 16.6, abs=0.01)


def slit(upper: float, lower: float) -> Sheet:
    """2 x 2 cells, opened from the left rim to the centre; the left end's two copies at these heights: where they are past each
    other, the rim lies on itself."""
    sheet = opened(grid(2, 2), [(3, 4)], in_mesh=False)
    place = sheet.place.copy()
    left = np.flatnonzero((place == (0.0, 1.0)).all(1))
    above = [sheet.uv()[(sheet.corner == p).any(1), :, 1].mean() > 1 for p in left]
    place[left[above.index(True)], 1] = upper
    place[left[above.index(False)], 1] = lower
    return sheet.with_place(place)


@pytest.mark.parametrize(
    ("upper", "lower", "overlapping", "touching"),
    [
        (1.2, 0.8, False, False),
        (1.0, 1.0, False, False),  # a cut whose sides coincide is none
        (np.nextafter(1.0, UP), 1.0, False, False),
        (np.nextafter(1.0, DOWN), 1.0, True, True),
        (0.8, 1.2, True, True),
    ],
)
def test_slits_with_one_tip(upper: float, lower: float, overlapping: bool, touching: bool) -> None:
    sheet = slit(upper, lower)
    assert sheet.vertex is not None
    found = coverage(sheet.vertex[sheet.corner], sheet.uv())
    assert found.charts.count == 1 and len(found.flipped) == 0
    assert (len(found.within) > 0) == overlapping
    assert (len(found.touching) > 0) == touching


def test_a_slit_of_the_mesh_whose_sides_coincide_touches_itself() -> None:
    sheet = opened(grid(2, 2), [(3, 4)], in_mesh=True)
    found = coverage(sheet.corner, sheet.uv())
    assert len(found.charts.boundary) == 10
    # The side and the rim at one copy of the left end meet those at the other.
    assert len(found.within) == 0 and len(found.touching) == 4


def test_a_disk_wound_twice_around_its_centre_is_overwound() -> None:
    angle = 4 * np.pi * np.arange(8) / 8
    place = np.vstack([np.stack([np.cos(angle), np.sin(angle)], 1), [(0.0, 0.0)]])
    faces = np.array([(i, (i + 1) % 8, 8) for i in range(8)])
    found = coverage(faces, place[faces])
    assert len(found.flipped) == 0 and found.overwound.tolist() == [found.charts.corner[0, 2]]
    assert len(found.within) > 0


def test_flipped_and_flat_triangles_are_named() -> None:
    uv = np.array([[(0, 0), (1, 0), (0, 1)], [(0, 0), (0, 1), (1, 0)], [(0, 0), (1, 1), (2, 2)]])
    found = coverage(np.arange(9).reshape(3, 3), uv)
    assert found.flipped.tolist() == [1, 2]
    assert found.between.tolist() == [[0, 1]]


def test_charts_are_joined_where_both_ends_agree() -> None:
    faces = np.array([(0, 1, 2), (0, 2, 3)])
    uv = np.array([[(0, 0), (1, 0), (1, 1)], [(0, 0), (1, 1), (0, 1)]], float)
    assert charts_of(faces, uv).count == 1
    uv[1, 1] += 1e-16, 2.0**-52
    assert charts_of(faces, uv).count == 2
    assert charts_of(faces, uv.astype(np.float32)).count == 1


@pytest.mark.parametrize("closed", [False, True])
@pytest.mark.parametrize("count", [0, 1, 2, 700])
def test_boxes_that_meet_are_those_of_all_pairs(count: int, closed: bool) -> None:
    random = np.random.default_rng(count)
    low = random.integers(0, 200, (count, 2)) / 4
    high = low + random.choice([0.0, 1.0, 2.0, 30.0], (count, 2), p=[0.1, 0.5, 0.38, 0.02])
    below = np.less_equal if closed else np.less
    meets = (below(low[:, None], high) & below(low, high[:, None])).all(2)
    expected = np.argwhere(np.triu(meets, 1))
    assert np.array_equal(meeting_boxes(low, high, closed=closed), expected)


def test_turns_are_exact_next_to_a_line() -> None:
    """Points a last place or less beside a line, at sizes from the smallest numbers on."""
    random = np.random.default_rng(5)
    a, b = random.uniform(-1, 1, (2, 400, 2))
    c = a + random.choice([0.0, 0.5, 1.0, 2.0], (400, 1)) * (b - a)
    c += random.choice([0.0, 1e-17, 3e-16], c.shape)
    scale = 2.0 ** random.choice([-1000.0, -300.0, 0.0, 300.0], (400, 1))
    corners = np.stack([a * scale, b * scale, c * scale], 1)
    areas = [turn(*t) for t in triangles_of(corners)]
    assert turns(*corners.transpose(1, 0, 2)).tolist() == [(t > 0) - (t < 0) for t in areas]
    assert 0 in areas


@pytest.mark.parametrize("generator", list(GENERATORS))
def test_pairs_are_those_of_rational_clipping(generator: str) -> None:
    compared = 0
    for number in range(100):
        if compared >= 6:
            break
        map_ = map_number(generator, 3, number)
        if len(map_.faces) > 60:
            continue
        for uv in (map_.uv, map_.uv.astype(np.float32)):
            found = coverage(map_.faces, uv)
            if len(found.flipped) == 0:
                pairs = sorted(
                    [*map(tuple, found.within.tolist()), *map(tuple, found.between.tolist())]
                )
                assert pairs == overlapping_pairs(uv), f"{generator} {number}"
                compared += 1
    assert compared >= 4
