"""ff.match: hard constraints met bit for bit, contradictions named; targets that overlap themselves: two disks with one
boundary, pins and lines on sheets, movable parts."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest

import flipfree as ff

from immersed_curves import CURVES, curve
from surfaces import bumpy_grid, cylinder, disk_of_rings


def boundary_of_grid(columns: int, rows: int) -> list[int]:
    index = np.arange((columns + 1) * (rows + 1)).reshape(rows + 1, columns + 1)
    sides = [index[0, :-1], index[:-1, -1], index[-1, :0:-1], index[:0:-1, 0]]
    return np.concatenate(sides).tolist()


def assert_pins_met(result: ff.Parametrization, points: dict[int, tuple[float, float]]) -> None:
    for vertex, target in points.items():
        corners = result.faces == vertex
        assert corners.any()
        assert (result.uv[corners] == np.array(target)).all()
        assert (result.uv32()[corners] == np.array(target, dtype=np.float32)).all()


@pytest.mark.parametrize("count", [1, 2, 3, 10])
@pytest.mark.parametrize("engine", ["auto", "matchmaker"])
def test_random_pins_are_met_bit_for_bit(count: int, engine: str) -> None:
    vertices, faces = bumpy_grid(14, 12)
    for seed in range(3):
        random = np.random.default_rng(seed)
        ids = random.choice(len(vertices), count, replace=False)
        points = {
            int(v): (float(u[0]), float(u[1]))
            for v, u in zip(ids, random.random((count, 2)), strict=True)
        }
        result = ff.match(vertices, faces, points=points, engine=engine)
        assert result.certificate.ok
        assert result.certificate.flips64 == result.certificate.flips32 == 0
        assert_pins_met(result, points)
        assert result.stats["added_vertices"] == len(result.vertices) - len(vertices)


@pytest.mark.parametrize("boundary", ["free", "square"])
def test_far_pins_on_a_large_surface_are_walked_on_a_coarse_one(boundary: str) -> None:
    columns, rows = 70, 65
    vertices, faces = bumpy_grid(columns, rows, height=0.1)
    ids = [22 * 71 + 20, 30 * 71 + 52]
    places = [(0.62, 0.48), (0.35, 0.55)]
    points = dict(zip(ids, places, strict=True))
    loop = boundary_of_grid(columns, rows)
    whole = {} if boundary == "free" else {"boundary_loop": loop, "boundary_uv": vertices[loop, :2]}
    result = ff.match(vertices, faces, points=points, **whole)
    assert result.certificate.ok
    assert_pins_met(result, points)
    assert result.stats["continuation.coarsest"] < len(vertices) / 2
    assert result.stats["added_vertices"] < len(vertices) / 50


def exchanged_pins(columns: int, vertices: np.ndarray) -> dict[int, tuple[float, float]]:
    """A dozen vertices of the grid in each other's places."""
    ids = [(columns + 1) * (3 + 5 * (i // 4)) + 3 + 5 * (i % 4) for i in range(12)]
    return {
        v: (
            float(vertices[ids[(5 * i + 2) % 12], 0]) + 0.01,
            float(vertices[ids[(5 * i + 2) % 12], 1]),
        )
        for i, v in enumerate(ids)
    }


def test_pins_that_change_places_get_arms_for_few_added_vertices() -> None:
    vertices, faces = bumpy_grid(22, 18)
    points = exchanged_pins(22, vertices)
    result = ff.match(vertices, faces, points=points)
    assert result.certificate.ok
    assert_pins_met(result, points)
    assert result.stats["engine"] == "arms"
    assert result.stats["added_vertices"] < len(vertices) / 4


def test_a_map_that_must_be_one_to_one_has_no_arms() -> None:
    vertices, faces = bumpy_grid(22, 18)
    points = exchanged_pins(22, vertices)
    with pytest.raises(ff.NotConverged, match="overlap"):
        ff.match(vertices, faces, points=points, engine="arms", bijective=True)


def test_small_moves_add_no_vertices() -> None:
    vertices, faces = bumpy_grid(20, 15)
    free = ff.match(vertices, faces)
    uv = np.zeros((len(vertices), 2))
    uv[faces.reshape(-1)] = free.uv.reshape(-1, 2)
    points = {int(v): tuple(uv[v] + 0.03) for v in (40, 120, 200)}
    points[250] = tuple(uv[250] - 0.03)
    result = ff.match(vertices, faces, points=points)
    assert result.certificate.ok
    assert result.stats["added_vertices"] == 0
    assert_pins_met(result, points)


@pytest.mark.parametrize("engine", ["auto", "first try"])
def test_a_triangle_pinned_the_wrong_way_round_ends(engine: str) -> None:
    vertices, faces = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0]], float), [[0, 1, 2]]
    points = {0: (0.0, 0.0), 1: (0.0, 1.0), 2: (1.0, 0.0)}
    try:
        result = ff.match(vertices, faces, points=points, engine=engine)
    except (ff.Infeasible, ff.NotConverged) as error:
        assert str(error)
    else:  # the boundary is free between the pins, so a refined map may exist
        assert result.certificate.ok
        assert_pins_met(result, points)


def test_whole_boundary_with_collinear_samples() -> None:
    vertices, faces = bumpy_grid(10, 10)
    loop = boundary_of_grid(10, 10)
    # The letter L, forty samples along its six straight sides.
    corners = np.array([[0, 0], [2, 0], [2, 1], [1, 1], [1, 2], [0, 2]], float)
    lengths = np.array([2, 1, 1, 1, 1, 2]) * 5
    sides = zip(corners, np.roll(corners, -1, 0), lengths, strict=True)
    target = np.concatenate([a + (b - a) * np.arange(n)[:, None] / n for a, b, n in sides])
    result = ff.match(vertices, faces, boundary_loop=loop, boundary_uv=target)
    assert result.certificate.ok
    assert_pins_met(result, {v: tuple(t) for v, t in zip(loop, target, strict=True)})
    assert result.certificate.overlaps == 0


Request = dict[str, Any]


def held(vertices: np.ndarray, side: int, lobes: float = 0.0, size: float = 0.0) -> Request:
    """The boundary of a grid as it is; with a size on a circle, or an outline of two lobes."""
    loop = boundary_of_grid(side, side)
    turn = 2 * np.pi * np.arange(len(loop)) / len(loop)
    radius = size * (1 + lobes * np.cos(2 * turn + np.pi))
    round_ = np.stack([radius * np.cos(turn), radius * np.sin(turn)], 1)
    return {"boundary_loop": loop, "boundary_uv": round_ if size else vertices[loop, :2]}


def stirred(vertices: np.ndarray, side: int) -> Request:
    """Thirty inner vertices about the centre of a circle on which the boundary is held."""
    loop = boundary_of_grid(side, side)
    random = np.random.default_rng(7)
    inner = np.setdiff1d(np.arange(len(vertices)), loop)
    ids = random.choice(inner, 30, replace=False)
    p = 3.0 * (vertices[ids, :2] - 0.5)
    turn = np.exp(3.0j * np.exp(-(p**2).sum(1)))
    moved = 0.8 * ((p @ [1.0, 1.0j]) * turn + 0.2 * (random.random((30, 2)) @ [1.0, 1.0j]))
    rim = vertices[loop, :2] - 0.5
    points = dict(zip(ids.tolist(), zip(moved.real, moved.imag, strict=True), strict=True))
    rim *= 2.0 / np.linalg.norm(rim, axis=1)[:, None]
    return {"boundary_loop": loop, "boundary_uv": rim, "points": points}


IN_CIRCLE = {"points": {11 * 5 + 3: (0.4, 0.1), 11 * 5 + 8: (-0.4, 0.0)}}
IN_LEAF = {"points": {11 * 5 + 3: (0.4, 0.1), 11 * 5 + 7: (-0.3, 0.0), 11 * 3 + 5: (0.0, 0.3)}}


@pytest.mark.parametrize(
    ("side", "request_of", "engine", "most"),
    [
        (22, lambda v, n: {"points": exchanged_pins(n, v)}, "arms", 1.3),
        (22, lambda v, n: held(v, n) | {"points": exchanged_pins(n, v)}, "auto", 2.0),
        (10, lambda v, n: held(v, n, size=1.0) | IN_CIRCLE, "auto", 1.0),
        (10, lambda v, n: held(v, n, size=1.0) | IN_CIRCLE, "matchmaker", np.inf),
        (10, lambda v, n: held(v, n, 0.4, 1.0), "first try", 1.0),
        (10, lambda v, n: held(v, n, 0.4, 1.0), "outline", 1.0),
        (10, lambda v, n: held(v, n, 0.4, 1.0), "matchmaker", 1.0),
        (10, lambda v, n: held(v, n, 0.4, 1.0) | IN_LEAF, "auto", 2.0),
        (10, lambda v, n: held(v, n, 0.4, 1.0) | IN_LEAF, "matchmaker", np.inf),
        (24, stirred, "auto", 3.0),
    ],
)
def test_outlines_and_pins_are_met_by_every_engine_for_few_added_vertices(
    side: int, request_of: Callable[[np.ndarray, int], Request], engine: str, most: float
) -> None:
    vertices, faces = bumpy_grid(side, side, 0.15, 3)
    wanted = request_of(vertices, side)
    result = ff.match(vertices, faces, **wanted, engine=engine)
    assert result.certificate.ok
    assert np.array_equal(result.vertices[: len(vertices)], vertices)
    rim = zip(wanted.get("boundary_loop", ()), wanted.get("boundary_uv", ()), strict=True)
    assert_pins_met(result, dict(rim) | wanted.get("points", {}))
    assert len(result.vertices) <= most * len(vertices)


def test_pins_that_are_one_point_as_stored_are_named() -> None:
    vertices, faces = bumpy_grid(10, 10)
    with pytest.raises(ff.Infeasible) as caught:
        ff.match(vertices, faces, points={30: (1.0, 0.5), 60: (1.0 + 1e-12, 0.5)}, bijective=True)
    assert sorted(caught.value.elements) == [30, 60]


def test_pins_at_one_point_are_no_contradiction_where_the_map_may_overlap_itself() -> None:
    vertices, faces = bumpy_grid(10, 10)
    with pytest.raises(ff.NotConverged, match="none is looked for") as caught:
        ff.match(vertices, faces, points={30: (0.5, 0.5), 60: (0.5, 0.5)})
    assert (caught.value.code, sorted(caught.value.elements)) == ("contradictory pins", [30, 60])


def test_a_closed_line_keeps_the_side_that_it_encloses() -> None:
    vertices, faces = bumpy_grid(6, 6)
    ring = [16, 17, 18, 25, 32, 31, 30, 23, 16]
    square = [(0, 0), (1, 0), (1, 1), (0, 1), (0, 0)]
    for chain, points in ((ring, square), (ring[::-1], square[::-1])):
        result = ff.match(vertices, faces, lines=[(chain, points)])
        assert result.certificate.ok
    for chain, points in ((ring, square[::-1]), (ring[::-1], square)):
        with pytest.raises(ff.Infeasible, match="other way round") as caught:
            ff.match(vertices, faces, lines=[(chain, points)])
        assert sorted(caught.value.elements) == sorted(ring[:-1])


def swapped_pins(vertices: np.ndarray) -> dict[int, tuple[float, float]]:
    half = len(vertices) // 2
    return {half + 3: (0.25, 0.45), half - 3: (0.75, 0.55), len(vertices) // 4: (0.5, 0.5)}


@pytest.mark.parametrize("seconds", [None, 0, 1000])
def test_time_enough_is_as_good_as_no_limit(seconds: float | None) -> None:
    vertices, faces = bumpy_grid(10, 10)
    free = ff.match(vertices, faces, points=swapped_pins(vertices))
    result = ff.match(vertices, faces, points=swapped_pins(vertices), max_seconds=seconds)
    assert result.stats["time_limit_reached"] == 0
    assert (result.uv == free.uv).all()


def test_any_limit_of_time_gives_a_certified_map_or_names_itself() -> None:
    vertices, faces = bumpy_grid(60, 60)
    ids = np.random.default_rng(0).choice(len(vertices), 20, replace=False)
    places = np.random.default_rng(1).random((20, 2))
    points = {int(v): (float(u[0]), float(u[1])) for v, u in zip(ids, places, strict=True)}
    for seconds in (0.01, 0.03, 0.1, 0.3, 1.0):
        try:
            result = ff.match(vertices, faces, points=points, max_seconds=seconds)
        except ff.NotConverged as error:
            assert error.code == "time limit reached"
        else:
            assert result.certificate.ok
            assert_pins_met(result, points)


def places_of(result: ff.Parametrization) -> np.ndarray:
    """(n, 2) of maps of one chart."""
    uv = np.empty((len(result.vertices), 2))
    uv[result.faces] = result.uv
    return uv


def on_a_circle(count: int) -> np.ndarray:
    angle = 2 * np.pi * np.arange(count) / count
    return np.column_stack([np.cos(angle), np.sin(angle)])


def test_a_boundary_may_begin_anywhere_and_run_either_way() -> None:
    vertices, faces = bumpy_grid(6, 6)
    loop, circle = boundary_of_grid(6, 6), on_a_circle(24)
    wanted = ff.match(vertices, faces, boundary_loop=loop, boundary_uv=circle)
    for order in (np.roll(np.arange(24), 7), np.arange(24)[::-1]):
        turned = ff.match(
            vertices, faces, boundary_loop=np.array(loop)[order], boundary_uv=circle[order]
        )
        assert np.array_equal(turned.uv, wanted.uv)


@pytest.mark.parametrize(
    ("options", "match"),
    [
        ({"lines": [([15, 17], [(0, 0), (1, 0)])]}, "15 to vertex 17"),
        ({"lines": [([15], [(0, 0), (1, 0)])]}, "line"),
        ({"lines": [([15, 16], [(0, 0)])]}, "line"),
        ({"points": {49: (0, 0)}}, "49"),
        ({"points": {9: (0.1, 0.1)}, "paths": {10: [10, 3]}}, "A path must"),
        ({"points": {9: (0.1, 0.1)}, "paths": {9: [9, 16]}}, "A path must"),
        ({"points": {9: (0.1, 0.1)}, "paths": {9: [9, 3]}}, "9 to vertex 3"),
        ({"points": {4: (9.0, 0.0)}}, "4"),
        ({"points": {4: tuple(on_a_circle(24)[4])}, "movable": [4]}, "4"),
        ({"movable": [24]}, "24"),
        ({"boundary_loop": [0, 2, 1, *range(3, 7), *range(13, 49, 7)]}, "oundary"),
    ],
)
def test_constraints_without_meaning_are_refused_by_name(
    options: dict[str, object], match: str
) -> None:
    vertices, faces = bumpy_grid(6, 6)
    whole = {"boundary_loop": boundary_of_grid(6, 6), "boundary_uv": on_a_circle(24)}
    with pytest.raises((ff.InvalidInput, ff.Infeasible), match=match):
        ff.match(vertices, faces, **{**whole, **options})


def test_vertices_of_a_line_lie_on_its_points_or_are_spread_between_them_by_length() -> None:
    vertices, faces = bumpy_grid(6, 6, 0.0)
    bent = [(0.0, 0.0), (1.0, 0.5), (2.0, 0.0)]
    result = ff.match(vertices, faces, lines=[([15, 16, 17], bent)])
    assert np.array_equal(places_of(result)[[15, 16, 17]], bent)
    row = [15, 16, 17, 18, 19]
    result = ff.match(vertices, faces, lines=[(row, [(0.0, 0.0), (8.0, 0.0)])])
    assert np.abs(places_of(result)[row] - [[2.0 * i, 0.0] for i in range(5)]).max() < 1e-6


def sheet_with_holes() -> tuple[np.ndarray, np.ndarray]:
    """12 x 12 squares but for 2 x 2 and 1 x 2 of them."""
    vertices, faces = bumpy_grid(12, 12)
    x, y = 12 * vertices[faces].mean(axis=1)[:, :2].T
    hole = (x > 2) & (x < 4) & (y > 3) & (y < 5) | (x > 8) & (x < 9) & (y > 6) & (y < 8)
    return vertices, faces[~hole]


@pytest.mark.parametrize("make", [lambda: bumpy_grid(6, 6), sheet_with_holes])
def test_a_line_with_more_points_than_vertices_gets_more_vertices(
    make: Callable[[], tuple[np.ndarray, np.ndarray]],
) -> None:
    vertices, faces = make()
    points = [(0.0, 0.0), (1.0, 1.0), (2.0, 1.0), (3.0, 0.0)]
    result = ff.match(vertices, faces, lines=[([15, 16], points)])
    assert result.certificate.ok and result.stats["added_vertices"] >= 2
    uv = places_of(result)
    ids = [int(np.flatnonzero((uv == point).all(axis=1))[0]) for point in points]
    assert (ids[0], ids[-1]) == (15, 16)
    for a, b in zip(ids, ids[1:], strict=False):
        assert ((result.faces == a).any(1) & (result.faces == b).any(1)).any()


@pytest.mark.parametrize(
    ("options", "points"),
    [
        ({"bijective": True}, {14: (0.1, 0.1), 37: (0.9, 0.3), 56: (0.5, 0.25)}),
        (
            {"engine": "matchmaker"},
            {28: (0.7, 0.5), 84: (0.2, 0.5), 140: (0.4, 0.9), 41: (0.3, 0.1)},
        ),
    ],
)
def test_holes_stay_open(
    options: dict[str, object], points: dict[int, tuple[float, float]]
) -> None:
    vertices, faces = sheet_with_holes()
    result = ff.match(vertices, faces, points=points, **options)
    assert result.certificate.ok and result.parent_face.max() < len(faces)
    assert_pins_met(result, points)
    assert "bijective" not in options or result.certificate.overlaps == 0
    used = np.unique(result.faces)
    ends = np.sort(result.faces[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2), axis=1)
    euler = len(used) - len(np.unique(ends, axis=0)) + len(result.faces)
    assert euler == -1  # a disk with two holes


def test_of_several_boundaries_one_is_named() -> None:
    vertices, faces = cylinder(8, 3)
    circle = on_a_circle(8)
    with pytest.raises(ff.InvalidInput, match="boundary_loop"):
        ff.match(vertices, faces, boundary_uv=circle)
    for movable in ([], [2]):
        result = ff.match(
            vertices, faces, boundary_loop=list(range(8)), boundary_uv=circle, movable=movable
        )
        assert result.certificate.ok
        held = [v for v in range(8) if v not in movable]
        assert np.array_equal(places_of(result)[held], circle[held])


def test_a_hole_whose_rim_is_straight_is_filled() -> None:
    vertices, faces = bumpy_grid(4, 4)
    above = vertices[faces].mean(axis=1)[:, 1] > 0.5
    faces[above[:, None] & (faces == 12)] = len(vertices)
    points = {0: (0.0, 0.0), 24: (1.0, 1.2)}
    result = ff.match(np.vstack([vertices, vertices[12]]), faces, points=points)
    assert result.certificate.ok
    assert_pins_met(result, points)


@pytest.mark.parametrize(
    ("turns", "width", "drift", "engine"),
    [(1.75, 0.3, 0.6, "outline"), (1.4, 1.0, 0.3, "auto"), (1.4, 1.0, 0.3, "matchmaker")],
)
def test_an_outline_that_winds_is_met(
    turns: float, width: float, drift: float, engine: str
) -> None:
    """A spiral, and a band whose ends lie over each other."""
    vertices, faces = bumpy_grid(12, 12, 0.0)
    share = np.linspace(0.0, 1.0, 24)
    along = np.concatenate([share, share[::-1]])
    radius = 1.0 + width * (np.arange(48) < 24) + drift * turns * along
    angle = 2 * np.pi * turns * along
    target = radius[:, None] * np.column_stack([np.cos(angle), np.sin(angle)])
    loop = boundary_of_grid(12, 12)
    result = ff.match(vertices, faces, boundary_loop=loop, boundary_uv=target, engine=engine)
    assert result.certificate.ok and (result.certificate.overlaps == 0) == (drift > width)
    assert_pins_met(result, {v: tuple(t) for v, t in zip(loop, target, strict=True)})
    if engine == "outline":
        assert result.certificate.energy < 500 and len(result.faces) <= 2 * len(faces)


def test_coarse_level_of_a_long_boundary() -> None:
    vertices, faces = bumpy_grid(520, 16)  # 1072 boundary vertices
    vertices[:, 0] *= 4.0
    points = {v: (vertices[v, 0] + 0.05, vertices[v, 1]) for v in (2000, 7000)}
    result = ff.match(vertices, faces, points=points)
    assert result.certificate.ok and result.stats["engine"] == "coarse to fine"


SPOKES = 40
RINGS = 6


def disk() -> tuple[npt.NDArray[np.float64], npt.NDArray[np.int32], list[int]]:
    vertices, faces = disk_of_rings(SPOKES, RINGS)
    return vertices, faces, list(range(len(vertices) - SPOKES, len(vertices)))


def onto(name: str, **given: Any) -> ff.Parametrization:
    vertices, faces, loop = disk()
    return ff.match(vertices, faces, boundary_loop=loop, boundary_uv=curve(name, SPOKES), **given)


def spoke(i: int) -> list[int]:
    return [0] + [1 + r * SPOKES + i for r in range(RINGS)]


def turn(
    a: npt.NDArray[np.float64], b: npt.NDArray[np.float64], c: npt.NDArray[np.float64]
) -> float:
    return float((b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]))


def sees(result: ff.Parametrization, start: int, end: int) -> bool:
    """Does the straight segment from inner vertex `start`, laid out in the immersed disk, end at vertex `end`?"""
    place = {
        int(v): result.uv[f, k] for f, face in enumerate(result.faces) for k, v in enumerate(face)
    }
    across = {
        (int(t[k]), int(t[(k + 1) % 3])): int(t[(k + 2) % 3])
        for t in result.faces
        for k in range(3)
    }
    p, goal = place[start], place[end]
    for face in result.faces:
        if start in face:
            k = list(face).index(start)
            a, b = int(face[(k + 1) % 3]), int(face[(k + 2) % 3])
            if turn(p, place[a], goal) >= 0 > turn(p, place[b], goal):
                break
    while end not in (a, b):
        if turn(place[a], place[b], goal) >= 0 or (b, a) not in across:
            return False
        c = across[b, a]
        if turn(p, goal, place[c]) > 0:
            b = c
        else:
            a = c
    return True


@pytest.mark.parametrize(
    ("name", "pin"), [("lobes", (0.0, 0.9)), ("doodle", (0.0, -1.0)), ("doodle", (0.0, 0.6))]
)
def test_paths_choose_between_the_disks_of_one_boundary(
    name: str, pin: tuple[float, float]
) -> None:
    loop, target = disk()[2], curve(name, SPOKES)
    seen = []
    for i in (4, SPOKES - 1 - 4):
        result = onto(name, points={0: pin}, paths={0: spoke(i)})
        assert result.certificate.ok
        assert result.certificate.overlaps > 0
        assert (result.uv[result.faces == 0] == pin).all()
        for v, place in zip(loop, target, strict=True):
            assert (result.uv[result.faces == v] == place).all()
        # The slit along the path lies in the disk; the other path's does not.
        seen.append({k for k, v in enumerate(loop) if sees(result, 0, v)})
        assert i in seen[-1]
        assert SPOKES - 1 - i not in seen[-1]
    assert seen[0] != seen[1]


@pytest.mark.parametrize("name", CURVES)
def test_a_boundary_of_two_disks_alone_is_met_by_one_of_them(name: str) -> None:
    result = onto(name)
    assert result.certificate.ok
    assert result.certificate.overlaps > 0


def test_a_path_whose_slit_leaves_every_disk_is_refused() -> None:
    with pytest.raises(ff.NotConverged, match="give other paths"):
        onto("lobes", points={0: (0.0, -1.5)}, paths={0: spoke(4)})


def test_a_pin_on_several_sheets_asks_for_a_path() -> None:
    with pytest.raises(ff.InvalidInput, match="Give a path"):
        onto("doodle", points={0: (0.0, 0.6)})


def test_movable_boundary_vertices_move_and_others_stay() -> None:
    vertices, faces, loop = disk()
    angle = 2 * np.pi * np.arange(SPOKES) / SPOKES
    radius = 1 + 0.4 * np.cos(5 * angle)
    target = np.stack([radius * np.cos(angle), radius * np.sin(angle)], 1)
    held = ff.match(vertices, faces, boundary_loop=loop, boundary_uv=target)
    movable = loop[::2]
    result = ff.match(vertices, faces, boundary_loop=loop, boundary_uv=target, movable=movable)
    assert result.certificate.ok
    assert result.certificate.overlaps == 0
    assert result.certificate.energy < held.certificate.energy
    for v, place in zip(loop, target, strict=True):
        assert (result.uv[result.faces == v] == place).all() == (v not in movable)
    with pytest.raises(ff.InvalidInput, match="Movable vertex 0"):
        ff.match(vertices, faces, boundary_loop=loop, boundary_uv=target, movable=[0])


@pytest.mark.parametrize("engine", ["auto", "matchmaker"])
@pytest.mark.parametrize(("name", "pin"), [("lobes", (0.0, 0.9)), ("doodle", (0.0, 0.6))])
def test_lines_inside_are_met_on_the_sheet_of_their_pin(
    engine: str, name: str, pin: tuple[float, float]
) -> None:
    vertices, faces, loop = disk()
    target = curve(name, SPOKES)
    away = np.array(pin) - target[4]
    ends = [pin, tuple(np.array(pin) + 0.2 * away / np.linalg.norm(away))]
    line = spoke(4 + SPOKES // 2)[:3]
    result = ff.match(
        vertices,
        faces,
        boundary_loop=loop,
        boundary_uv=target,
        lines=[(line, ends)],
        paths={0: spoke(4)},
        engine=engine,
    )
    assert result.certificate.ok and result.certificate.overlaps > 0
    assert engine in ("auto", result.stats["engine"])
    place = {int(v): result.uv[f, k] for f, t in enumerate(result.faces) for k, v in enumerate(t)}
    stored = np.float32(ends)
    assert (np.float32(place[line[0]]) == stored[0]).all()
    assert (np.float32(place[line[-1]]) == stored[-1]).all()
    assert sees(result, line[0], line[-1])
    for v, at in zip(loop, target, strict=True):
        assert (result.uv[result.faces == v] == at).all()


def test_a_line_that_leaves_its_sheet_is_refused_by_name() -> None:
    vertices, faces, loop = disk()
    target = curve("lobes", SPOKES)
    line = spoke(4 + SPOKES // 2)[:2]
    with pytest.raises(ff.Infeasible, match="leaves|outside") as refused:
        ff.match(
            vertices,
            faces,
            boundary_loop=loop,
            boundary_uv=target,
            lines=[(line, [(0.0, 0.9), (0.0, 9.0)])],
            paths={0: spoke(4)},
            engine="matchmaker",
        )
    assert refused.value.kind == "vertex" and line[-1] in refused.value.elements
    assert refused.value.witness


def test_lines_that_cross_on_one_sheet_are_refused_by_name() -> None:
    chains = spoke(4)[1:3], spoke(20)[1:3]
    places = [(-0.1, -1.0), (0.1, -1.0)], [(0.0, -1.1), (0.0, -0.9)]
    with pytest.raises(ff.Infeasible, match="on one sheet") as refused:
        onto("lobes", lines=list(zip(chains, places, strict=True)))
    assert set(refused.value.elements) == {*chains[0], *chains[1]}
    assert refused.value.witness
