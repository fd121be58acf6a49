"""Embedding onto a polygon of the caller's: corners on the boundary, and the command."""

from pathlib import Path

import numpy as np
import pytest
from commands import mapped, put
from embedding_meshes import boundary_loop, wavy_grid

import flipfree as ff


def test_corners_are_kept_and_the_boundary_runs_straight_between_them() -> None:
    disk = wavy_grid(8, 8)
    loop = boundary_loop(disk.faces)
    places = [(0.1, 0.2), (0.9, 0.1), (0.8, 0.9), (0.4, 1.0)]
    corners = dict(zip(loop[::8], places, strict=True))
    found = ff.embed(disk.vertices, disk.faces, boundary="corners", corners=corners)
    assert found.certificate.ok and found.certificate.pin_failures == 0
    uv = np.empty((len(found.vertices), 2))
    uv[found.faces] = found.uv
    for v, place in corners.items():
        assert tuple(uv[v]) == place
    for k in range(4):
        a, b = np.array(places[k]), np.array(places[(k + 1) % 4])
        side = uv[[loop[i % len(loop)] for i in range(8 * k, 8 * k + 9)]]
        assert np.abs((side - a) @ [a[1] - b[1], b[0] - a[0]]).max() < 1e-6
        assert (np.diff(side @ (b - a)) > 0).all()


@pytest.mark.parametrize(
    ("corners", "said"),
    [
        ({0: (0, 0), 1: (1, 0)}, "three"),
        ({0: (0, 0), 8: (1, 0), 40: (0, 1)}, "vertex 40"),
        ({0: (0, 0), 8: (0, 1), 80: (1, 0)}, "clockwise"),
        (None, "three"),
    ],
)
def test_corners_that_make_no_polygon_are_refused(corners: object, said: str) -> None:
    disk = wavy_grid(8, 8)
    with pytest.raises(ff.InvalidInput, match=said):
        ff.embed(disk.vertices, disk.faces, boundary="corners", corners=corners)


def test_the_command_embeds_parts_onto_shapes_and_pins(here: Path) -> None:
    disk = wavy_grid(8, 8)
    loop = boundary_loop(disk.faces)
    pins = dict(zip(map(str, loop[::8]), [[0, 0], [1, 0], [1, 1], [0, 1]], strict=True))
    put("disk.obj", (disk.vertices, disk.faces), pins={"points": pins})
    for words in (["--boundary", "square"], ["--boundary", "pinned", "--optimise"]):
        mapped("embed", "disk.obj", "--out", words[1], *words)
        uv = ff.read(f"{words[1]}/disk.obj").uv
        assert uv is not None and uv.min() >= 0.0 and uv.max() <= 1.0
        assert ("square" in words) or (uv.min() == 0.0 and uv.max() == 1.0)
