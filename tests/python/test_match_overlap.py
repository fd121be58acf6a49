"""ff.match onto targets that overlap themselves: two disks with one boundary, pins and lines on sheets, movable parts."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt
import pytest

import flipfree as ff

from immersed_curves import CURVES, curve
from surfaces import disk_of_rings

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
