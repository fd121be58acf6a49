"""ff.embed: disks onto convex polygons, corners on their boundary, certified as stored; and the command."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from commands import mapped, put
from embedding_meshes import (
    Disk,
    boundary_loop,
    corpus,
    corridors,
    fingers,
    stacked,
    tube,
    wavy_grid,
)

import flipfree as ff

from mesh_files import data_folder


def corner_of_vertex(disk: Disk, result: ff.Parametrization) -> dict[int, np.ndarray]:
    return dict(zip(result.faces.ravel().tolist(), result.uv.reshape(-1, 2), strict=True))


def assert_certified(result: ff.Parametrization) -> None:
    c = result.certificate
    assert c.ok and c.flips64 == 0 and c.flips32 == 0 and c.winding_failures == 0, c.failures
    assert c.provenance_failures == 0 and c.overlaps == 0


@pytest.mark.parametrize("boundary", ["circle", "square", "triangle"])
@pytest.mark.parametrize(
    "disk", [wavy_grid(12, 9), tube(8, 120), tube(5, 200)], ids=lambda d: d.name.replace(" ", "")
)
def test_every_disk_goes_onto_every_shape(disk: Disk, boundary: str) -> None:
    result = ff.embed(disk.vertices, disk.faces, boundary=boundary)
    assert_certified(result)
    assert np.array_equal(result.uv, result.uv.astype(np.float32))
    assert np.array_equal(result.vertices[: len(disk.vertices)], disk.vertices)


def test_the_given_polygon_is_kept_bit_for_bit() -> None:
    disk = wavy_grid(10, 10)
    loop = boundary_loop(disk.faces)
    angle = 2 * np.pi * np.arange(len(loop)) / len(loop)
    polygon = np.stack([0.3 + np.cos(angle) / 3, np.sin(angle) * np.pi], -1)
    result = ff.embed(disk.vertices, disk.faces, boundary=polygon, boundary_loop=loop)
    assert_certified(result)
    where = corner_of_vertex(disk, result)
    assert all(np.array_equal(where[v], p) for v, p in zip(loop.tolist(), polygon, strict=True))
    # The same polygon with loop and positions reversed is the same request.
    again = ff.embed(disk.vertices, disk.faces, boundary=polygon[::-1], boundary_loop=loop[::-1])
    assert np.array_equal(result.uv, again.uv)


@pytest.mark.parametrize("seed", [1, 2, 3])
@pytest.mark.parametrize("method", ["ladder", "progressive"])
def test_random_starts_succeed(seed: int, method: str) -> None:
    disk = tube(7, 150)
    start = np.random.default_rng(seed).random((len(disk.vertices), 2))
    result = ff.embed(disk.vertices, disk.faces, initial_uv=start, method=method)
    assert_certified(result)
    assert result.stats["tutte_flips"] > 0


def test_methods_report_their_rung() -> None:
    disk = tube(8, 200)
    assert (
        ff.embed(disk.vertices, disk.faces, method="progressive", start="nothing").stats["rung"]
        == "progressive"
    )
    with pytest.raises(ff.NotConverged):
        ff.embed(disk.vertices, disk.faces, method="tutte")
    grid = wavy_grid(8, 8)
    assert ff.embed(grid.vertices, grid.faces).stats["rung"] == "tutte"


def test_optimisation_lowers_the_energy_and_keeps_the_boundary() -> None:
    disk = tube(8, 60)
    plain = ff.embed(disk.vertices, disk.faces)
    better = ff.embed(disk.vertices, disk.faces, optimise=True)
    assert_certified(better)
    assert better.certificate.energy < plain.certificate.energy
    assert better.certificate.energy <= better.stats["energy_embedding"]
    assert better.certificate.energy < 500
    loop = boundary_loop(disk.faces)
    a, b = corner_of_vertex(disk, plain), corner_of_vertex(disk, better)
    assert all(np.array_equal(a[v], b[v]) for v in loop.tolist())


def test_chords_of_one_side_are_split_and_every_new_vertex_has_its_place() -> None:
    disk = wavy_grid(6, 1)  # no inner vertex: every inner edge is a chord
    result = ff.embed(disk.vertices, disk.faces, boundary="triangle")
    assert_certified(result)
    assert result.stats["added_vertices"] == len(result.vertices) - len(disk.vertices) > 0
    kept = ff.embed(disk.vertices, disk.faces, boundary="circle")
    assert kept.stats["added_vertices"] == 0 and np.array_equal(kept.faces, disk.faces)


@pytest.mark.skipif(data_folder() is None, reason="shared data folder (FLIPFREE_DATA) is missing")
@pytest.mark.parametrize("boundary", ["circle", "triangle"])
def test_the_thesis_cases_are_certified(boundary: str) -> None:
    for disk in corpus():
        loop = boundary_loop(disk.faces)
        assert_certified(ff.embed(disk.vertices, disk.faces, boundary=boundary, boundary_loop=loop))
        if len(disk.faces) < 8000:
            start = np.random.default_rng(0).random((len(disk.vertices), 2))
            assert_certified(
                ff.embed(
                    disk.vertices,
                    disk.faces,
                    boundary=boundary,
                    boundary_loop=loop,
                    initial_uv=start,
                    method="progressive",
                )
            )


@pytest.mark.parametrize(
    ("disk", "boundary", "energy"),
    [
        (fingers(4, 20), "circle", 100),
        (corridors(4, 20), "square", 1000),
        (stacked(2000, "deep"), "triangle", 5000),
        (stacked(2000, "mixed"), "triangle", 5000),
    ],
    ids=lambda given: given.name.replace(" ", "") if isinstance(given, Disk) else "",
)
def test_where_tutte_folds_vertices_are_inserted_one_by_one(
    disk: Disk, boundary: str, energy: float
) -> None:
    seen: list[float] = []
    result = ff.embed(
        disk.vertices,
        disk.faces,
        boundary=boundary,
        max_seconds=300,
        progress=lambda stage, fraction: seen.append(fraction),
    )
    assert_certified(result)
    assert result.stats["tutte_flips"] > 0 and result.stats["rung"] == "progressive"
    assert result.stats["energy"] < energy
    assert seen == sorted(seen)


def test_where_a_polygon_is_too_narrow_is_said() -> None:
    thin = [[1, 1], [1, 1 + 2.0**-52], [0, 1 + 2.0**-52], [0, 1]]
    vertices = [[1, 0, 0], [1, 1, 0], [0, 1, 0], [0, 0, 0], [0.5, 0.5, 0.2]]
    faces = [[i, (i + 1) % 4, 4] for i in range(4)]
    with pytest.raises(ff.Infeasible, match=r"between the edge \(1, 2\) and vertex 0"):
        ff.embed(vertices, faces, boundary=thin, boundary_loop=[0, 1, 2, 3])


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
