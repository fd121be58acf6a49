"""A few of the random polygon files of tests/fuzz/polygon_batches.py; and what its judge says of maps that are wrong."""

from __future__ import annotations

from pathlib import Path

import pytest

from judges import polygon_files as judge
from polygon_batches import differences, run, worst_area
from random_polygons import files

pytestmark = pytest.mark.usefixtures("here")


def test_convex_polygons_come_out_as_they_went_in() -> None:
    assert run(range(24), Path("all"), concave=False) == {}


def test_concave_polygons_come_out_as_they_went_in() -> None:
    assert run(range(12), Path("all")) == {}


SQUARE = "v 0 0 0\nv 4 0 0\nv 4 4 0\nv 0 4 0\nv 6 0 0\nv 6 4 0\n"
MAP = "vt 0 0\nvt .4 0\nvt .4 .4\nvt 0 .4\nvt .6 0\nvt .6 .4\n"
FACES = "usemtl red\nf 1/1 2/2 3/3 4/4\nf 2/2 5/5 6/6 3/3\n"


def judged(text: str) -> tuple[list[str], bool]:
    source, target = Path("in.obj"), Path("out.obj")
    source.write_text(SQUARE + MAP + FACES)
    target.write_text(text)
    return differences(source, target), worst_area(target) <= 1.0


def test_the_judge_finds_what_is_wrong() -> None:
    assert judged(SQUARE + MAP + FACES) == ([], True)
    assert judged(SQUARE + MAP.replace("vt .6 .4", "vt .60001 .4") + FACES) == ([], False)
    assert judged(SQUARE + MAP + FACES.replace("1/1 2/2 3/3 4/4", "4/4 3/3 2/2 1/1"))[1] is False
    assert "other data" in judged(SQUARE + MAP + FACES.replace("red", "blue"))[0]
    turned = FACES.replace("1/1 2/2 3/3 4/4", "2/2 3/3 4/4 1/1")
    assert "polygons" in judged(SQUARE + MAP + turned)[0]
    assert "points" in judged(SQUARE.replace("6 4", "6 5") + MAP + FACES)[0]
    split = FACES.replace("f 1/1 2/2 3/3 4/4", "f 1/1 2/2 3/3\nf 1/1 3/3 4/4")
    assert "polygons" in judged(SQUARE + MAP + split)[0]
    assert judged(SQUARE + MAP + "usemtl red\nf 1 2 3 4\nf 2/2 5/5 6/6 3/3\n") == (
        ["a polygon without a map"],
        False,
    )


def test_areas_are_those_of_concave_polygons_and_windows() -> None:
    u = [(0, 0), (3, 0), (3, 3), (2, 3), (2, 1), (1, 1), (1, 3), (0, 3)]
    assert judge.area([(x, 0.0, y) for x, y in u]) == judge.area_of_map(u) == 7.0
    window = [(0, 0), (4, 0), (4, 4), (0, 4), (0, 0), (1, 1), (1, 2), (2, 2), (2, 1), (1, 1)]
    assert judge.area_of_map(window) == 15.0
    assert judge.area_of_map(window[::-1]) == -15.0


def test_files_are_of_all_types_and_have_all_that_is_judged() -> None:
    found = list(files(range(200)))
    assert {name.rpartition(".")[2] for name, _ in found} == {"obj", "ply", "off", "stl"}
    objects = [judge.obj(content) for name, content in found if name.endswith("obj")]
    assert any(len(set(p)) < len(p) for mesh in objects for p in mesh.polygons)
    assert any(len(set(mesh.points)) < len(mesh.points) for mesh in objects)
    keywords = {words[0] for mesh in objects for words in mesh.rest if words}
    assert keywords >= {"mtllib", "o", "g", "usemtl", "s", "v", "vn", "l", "p", "f", "#"}
