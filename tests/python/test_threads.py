"""Every call gives the same bits for every number of threads.

Small meshes for 1 to 16 threads, middle ones, whose loops fall into several chunks everywhere, for some numbers.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
import pytest
from integer_maps import box, parametrization

import flipfree as ff

from surfaces import Mesh, bumpy_grid, cylinder, octahedron_sphere, torus


@dataclass
class Size:
    """Meshes of one size; seconds are of one run of all calls."""

    grid: Mesh
    ball: Mesh
    ring: Mesh
    threads: tuple[int, ...]


BOX = parametrization(box((4, 6, 10), (4, 3, 5)))

SIZES = {
    "small": Size(bumpy_grid(12, 10), octahedron_sphere(2), torus(16, 8), tuple(range(2, 17))),
    "middle": Size(bumpy_grid(100, 100), octahedron_sphere(6), torus(160, 80), (2, 3, 5, 8, 16)),
}


def bits(*arrays: Any) -> bytes:
    return b"".join(np.ascontiguousarray(array).tobytes() for array in arrays)


def map_bits(result: ff.Parametrization) -> bytes:
    return bits(
        result.uv, result.uv64, result.uv32(), result.vertices, result.faces, result.cut_edges
    )


def angles(mesh: Mesh) -> np.ndarray:
    """Half turns at four vertices of a sphere."""
    given = np.full(len(mesh[0]), 2 * np.pi)
    given[[0, 1, 2, 3]] = np.pi
    return given


def flat(mesh: Mesh) -> np.ndarray:
    return np.ascontiguousarray(mesh[0][:, :2][mesh[1]])


def spoilt(mesh: Mesh) -> np.ndarray:
    """The plan of a sheet with a part mirrored and some points thrown."""
    vertices, faces = mesh
    places = vertices[:, :2].copy()
    inside = np.linalg.norm(places - 0.4, axis=1) < 0.12
    places[inside, 0] = 0.8 - places[inside, 0]
    chosen = np.random.default_rng(3).choice(len(places), 3)
    places[chosen] = [[0.9, 0.9], [0.1, 0.3], [0.5, 1.4]]
    return np.ascontiguousarray(places[faces])


def stripes(mesh: Mesh) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """The triangles of a sheet in six islands, each laid out like the sheet."""
    vertices, faces = mesh
    middle = vertices[faces].mean(axis=1)[:, 0]
    label = np.minimum((6 * middle).astype(int), 5)
    corner = faces + len(vertices) * label[:, None]
    used, own = np.unique(corner, return_inverse=True)
    points = vertices[used % len(vertices)]
    own_faces = own.reshape(-1, 3).astype(np.int32)
    return points, own_faces, np.ascontiguousarray(points[:, :2][own_faces])


def field_of(mesh: Mesh, threads: int) -> ff.CrossField:
    return ff.cross_field(*mesh, threads=threads)


def sheet_cones(mesh: Mesh) -> dict[int, int]:
    return {v: 3 for v in range(8)}


CALLS: dict[str, Callable[[Size, int], bytes]] = {
    "unwrap": lambda s, t: map_bits(ff.unwrap(*s.grid, threads=t, seams="given")),
    "unwrap, closed": lambda s, t: map_bits(ff.unwrap(*s.ball, threads=t, seams="given")),
    "unwrap, automatic seams": lambda s, t: map_bits(ff.unwrap(*s.ball, seams="auto", threads=t)),
    "unwrap, islands": lambda s, t: map_bits(
        ff.unwrap(*stripes(s.grid)[:2], threads=t, seams="given")
    ),
    "auto_seams": lambda s, t: bits(ff.auto_seams(*s.ball, threads=t)),
    "improve": lambda s, t: map_bits(ff.improve((*s.grid, flat(s.grid)), threads=t)),
    "repair": lambda s, t: map_bits(ff.repair(*s.grid, spoilt(s.grid), threads=t)),
    "repair, opened": lambda s, t: map_bits(
        ff.repair(*s.grid, spoilt(s.grid), overlaps="open", threads=t)
    ),
    "match": lambda s, t: map_bits(
        ff.match(
            *s.grid,
            points={0: (0, 0), len(s.grid[0]) // 2: (1, 0.3), len(s.grid[0]) - 5: (0.2, 1)},
            threads=t,
        )
    ),
    "conformal_metric": lambda s, t: bits(
        ff.conformal_metric(*s.ball, angles(s.ball), threads=t).scale_factors
    ),
    "conformal": lambda s, t: map_bits(ff.conformal(*s.ball, angles(s.ball), threads=t)),
    "boundary_angles": lambda s, t: bits(ff.boundary_angles(*s.grid, "circle", threads=t)),
    "suggest_cones": lambda s, t: bits(np.asarray(ff.suggest_cones(*s.grid, threads=t))),
    "embed": lambda s, t: map_bits(ff.embed(*s.grid, optimise=True, threads=t)),
    "embed, progressive": lambda s, t: map_bits(
        ff.embed(*s.grid, boundary="triangle", method="progressive", threads=t)
    ),
    "seamless": lambda s, t: map_bits(ff.seamless(*s.ball, sheet_cones(s.ball), threads=t)),
    "seamless, torus": lambda s, t: map_bits(ff.seamless(*s.ring, {}, threads=t)),
    "admissible_cut": lambda s, t: bits(ff.admissible_cut(*s.ring, {}, threads=t).vertices),
    "cross_field": lambda s, t: bits(field_of(s.ball, t).directions),
    "signature": lambda s, t: repr(ff.signature(*s.ring, field_of(s.ring, 1), threads=t)).encode(),
    "field_aligned": lambda s, t: map_bits(ff.field_aligned(*s.ring, threads=t)),
    "quads": lambda s, t: bits(ff.quads(*s.ring, target=200, threads=t).vertices),
    "quads_from_map": lambda s, t: bits(ff.quads_from_map(BOX, threads=t).vertices),
    "fit_tiles": lambda s, t: map_bits(ff.fit_tiles(BOX, tile=0.3, threads=t)),
    "rectify": lambda s, t: map_bits(ff.rectify(*s.ring, threads=t)),
    "pack": lambda s, t: map_bits(ff.pack(*stripes(s.grid), effort=0.1, threads=t)),
    "certify": lambda s, t: repr(
        {
            name: value
            for name, value in vars(ff.certify(*s.grid, spoilt(s.grid), threads=t)).items()
            if "seconds" not in name
        }
    ).encode(),
}


def test_all_calls_that_take_threads_are_here() -> None:
    import inspect

    taking = {
        name
        for name in vars(ff)
        if inspect.isfunction(getattr(ff, name))
        and "threads" in inspect.signature(getattr(ff, name)).parameters
    }
    assert taking == {name.split(",")[0] for name in CALLS}


@pytest.mark.parametrize("size", ["small", pytest.param("middle", marks=pytest.mark.sample(3))])
@pytest.mark.parametrize("name", CALLS)
def test_the_bits_are_the_same_for_every_number_of_threads(name: str, size: str) -> None:
    meshes = SIZES[size]
    one = CALLS[name](meshes, 1)
    for threads in meshes.threads:
        assert CALLS[name](meshes, threads) == one, f"{threads} threads"


def test_more_threads_than_there_may_be_are_no_more_than_that() -> None:
    mesh = cylinder(60, 40)
    one = ff.unwrap(*mesh, threads=1, seams="given")
    assert np.array_equal(ff.unwrap(*mesh, threads=1024, seams="given").uv, one.uv)


def test_no_number_is_one_thread_for_each_core() -> None:
    mesh = bumpy_grid(6, 6)
    assert np.array_equal(
        ff.unwrap(*mesh, seams="given").uv, ff.unwrap(*mesh, threads=0, seams="given").uv
    )
