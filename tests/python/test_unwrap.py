"""Properties of ff.unwrap over generated surfaces; the shared meshes are those of benchmarks/unwrap.py corpus."""

from __future__ import annotations

import threading
import time

import numpy as np
import pytest

import flipfree as ff

from judges.exact import flips
from surfaces import bumpy_grid, cylinder, octahedron_sphere, torus

SURFACES = {
    "disk": bumpy_grid,
    "annulus": cylinder,
    "sphere": octahedron_sphere,
    "torus": torus,
}


@pytest.mark.parametrize("name", SURFACES)
def test_every_topology_is_unwrapped_flip_free_and_without_overlaps(name: str) -> None:
    vertices, faces = SURFACES[name]()
    result = ff.unwrap(vertices, faces, seams="given")
    assert result.certificate.ok
    assert (
        result.certificate.flips64 == result.certificate.flips32 == result.certificate.overlaps == 0
    )
    assert flips(result.uv32()) == 0
    assert flips(result.uv) == 0
    assert np.array_equal(result.vertices, vertices)
    assert np.array_equal(result.faces, faces)
    assert result.uv32().min() >= 0.0 and result.uv32().max() <= 1.0


def test_a_developable_surface_is_unwrapped_isometrically() -> None:
    x, y = np.meshgrid(np.linspace(0, 1, 31), np.linspace(0, 1, 21))
    _, faces = bumpy_grid(30, 20)
    rolled = np.stack([np.cos(2 * x), np.sin(2 * x), y], -1).reshape(-1, 3)
    assert ff.unwrap(rolled, faces, seams="given").certificate.energy == pytest.approx(
        1.0, abs=1e-5
    )


def test_seams_become_charts_and_only_they_are_cut() -> None:
    vertices, faces = bumpy_grid(10, 8)
    column = np.arange(9) * 11 + 5
    seam = np.stack([column[:-1], column[1:]], -1)
    result = ff.unwrap(vertices, faces, cuts=seam, seams="given")
    assert result.stats["charts"] == 2
    assert result.stats["added_cuts"] == 0
    assert {tuple(e) for e in result.cut_edges.tolist()} == {
        tuple(sorted(e)) for e in seam.tolist()
    }


def test_closed_and_handled_pieces_report_their_added_cuts() -> None:
    for make, charts in ((octahedron_sphere, 1), (torus, 1)):
        result = ff.unwrap(*make(), seams="given")
        assert result.stats["opened_charts"] == charts
        assert result.stats["added_cuts"] == len(result.cut_edges) > 0


def test_the_annulus_keeps_its_hole() -> None:
    result = ff.unwrap(*cylinder(), seams="given")
    assert result.stats["added_cuts"] == 0


@pytest.mark.parametrize("scale", [1e-4, 1e-2, 1e2, 1e5])
@pytest.mark.parametrize("name", SURFACES)
def test_scale_place_and_rotation_of_the_input_change_nothing_but_rounding(
    name: str, scale: float
) -> None:
    vertices, faces = SURFACES[name]()
    rotation, _ = np.linalg.qr(np.random.default_rng(5).normal(size=(3, 3)))
    rotation *= np.sign(np.linalg.det(rotation))
    reference = ff.unwrap(vertices, faces, seams="given").certificate.energy
    moved = ff.unwrap((vertices @ rotation.T + 3.0) * scale, faces, seams="given")
    assert moved.certificate.ok
    assert moved.certificate.energy == pytest.approx(reference, rel=1e-3)


def test_the_gil_is_released_while_solving() -> None:
    ticks = 0
    stop = threading.Event()

    def count() -> None:
        nonlocal ticks
        while not stop.is_set():
            ticks += 1
            time.sleep(0.001)

    thread = threading.Thread(target=count)
    thread.start()
    ff.unwrap(*bumpy_grid(120, 120), seams="given")
    stop.set()
    thread.join()
    assert ticks > 3


def test_a_job_that_is_dropped_while_running_is_cancelled_quietly() -> None:
    job = ff.jobs.unwrap(*bumpy_grid(300, 300), seams="given")
    job.wait(0.05)
    del job


def test_one_triangle_and_two_triangles_are_charts_too() -> None:
    assert ff.unwrap(
        [[0, 0, 0], [3, 0, 0], [0, 1, 2]],
        [[0, 1, 2]],
        seams="given",
    ).certificate.energy == pytest.approx(1)
    square = [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]]
    assert ff.unwrap(
        square, [[0, 1, 2], [0, 2, 3]], seams="given"
    ).certificate.energy == pytest.approx(1)


def test_every_face_a_chart_of_its_own() -> None:
    vertices, faces = octahedron_sphere(2)
    edges = {tuple(sorted((int(f[k]), int(f[(k + 1) % 3])))) for f in faces for k in range(3)}
    result = ff.unwrap(vertices, faces, cuts=sorted(edges), seams="given")
    assert result.stats["charts"] == len(faces)
    assert result.certificate.energy == pytest.approx(1.0, abs=1e-6)


def spiky_sphere() -> tuple[np.ndarray, np.ndarray]:
    """A sphere with six long horns."""
    vertices, faces = octahedron_sphere(4)
    return vertices * (1.0 + 5.0 * np.abs(vertices).max(1, keepdims=True) ** 40), faces


def test_closed_islands_are_cut_along_their_horns_unless_told_not_to() -> None:
    vertices, faces = spiky_sphere()
    short = ff.unwrap(vertices, faces, cut_extremities=False, seams="given")
    slit = ff.unwrap(vertices, faces, seams="given")
    assert slit.stats["charts"] == short.stats["charts"] == 1
    assert slit.stats["added_cuts"] > short.stats["added_cuts"]
    assert slit.certificate.energy < 1.2 < 1.5 < short.certificate.energy


def test_islands_with_pins_are_not_slit_further() -> None:
    vertices, faces = spiky_sphere()
    short = ff.unwrap(vertices, faces, cut_extremities=False, seams="given")
    pinned = ff.unwrap(vertices, faces, pins={100: (0.25, 0.5)})
    assert np.array_equal(pinned.cut_edges, short.cut_edges)


def test_a_long_spiral_is_unfolded_as_it_lies() -> None:
    # Its conformal map drowns in rounding; from the circle it was a thousand times the work, and a cut.
    t = np.arange(50 * 80 + 1) / 80
    way = np.stack([np.cos(2 * np.pi * t), np.sin(2 * np.pi * t), 0 * t], -1)
    vertices = np.vstack([way * (t + 1.5)[:, None], way * (t + 1.0)[:, None]])
    a = np.arange(len(t) - 1)
    b, d = a + 1, a + len(t)
    faces = np.vstack([np.stack([a, b, d + 1], -1), np.stack([a, d + 1, d], -1)]).astype(np.int32)
    result = ff.unwrap(vertices, faces)
    assert result.stats["charts"] == 1 and result.stats["added_cuts"] == 0
    assert result.certificate.energy < 1 + 1e-9
