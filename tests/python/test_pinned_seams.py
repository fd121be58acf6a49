"""Seamless and field-aligned maps with pins: everything on cuts and boundaries stays (thesis figure 3.9)."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import flipfree as ff

from mesh_files import read_mesh, shared
from surfaces import bumpy_grid, octahedron_sphere, torus


def pins_near(found: ff.Parametrization, count: int, seed: int) -> dict[int, tuple[float, float]]:
    """Vertices inside, most of the way to where a neighbour is."""
    faces, origin = ff.split_fans(found.faces, cuts=found.cut_edges)
    uv = np.empty((len(origin), 2))
    uv[faces] = found.uv
    ends = np.stack([faces, np.roll(faces, -1, axis=1)], -1).reshape(-1, 2)
    keys = ends @ [len(origin), 1]
    rim = ends[~np.isin(keys, ends @ [1, len(origin)])]
    chosen = np.random.default_rng(seed).permutation(np.setdiff1d(faces, rim))
    pins: dict[int, tuple[float, float]] = {}
    taken: set[int] = set()
    for v in chosen.tolist():
        ring = np.unique(faces[(faces == v).any(axis=1)])
        if len(pins) == count:
            break
        if not taken.isdisjoint(ring.tolist()):
            continue
        other = int(ring[ring != v][0])
        place = np.float32(0.2 * uv[v] + 0.8 * uv[other])
        pins[int(origin[v])] = (float(place[0]), float(place[1]))
        taken |= set(ring.tolist())
    return pins


def places_on_cuts(found: ff.Parametrization) -> set[tuple[float, ...]]:
    on_cut = np.isin(found.faces, found.cut_edges)
    return {
        (float(v), float(u), float(w))
        for v, (u, w) in zip(found.faces[on_cut], found.uv32()[on_cut], strict=True)
    }


def ball() -> ff.Parametrization:
    return ff.seamless(*octahedron_sphere(3), dict.fromkeys([0, 1, 2, 3, 4, 5, 40, 90], 3))


def ring() -> ff.Parametrization:
    return ff.seamless(*torus(), {0: 3, 60: 3, 130: 5, 200: 5})


def along_a_field() -> ff.Parametrization:
    vertices, faces = torus()
    return ff.field_aligned(
        vertices, faces, signature=ff.Signature({0: 3, 60: 3, 130: 5, 200: 5}, [])
    )


def sheet() -> ff.Parametrization:
    vertices, faces = bumpy_grid(16, 16)
    return ff.seamless(vertices, faces, {100: 3, 200: 5})


@pytest.mark.parametrize("make", [ball, ring, along_a_field, sheet])
def test_pins_are_met_and_seams_stay(make: Any) -> None:
    found = make()
    pins = pins_near(found, 3, 1)
    moved = found.with_pins(pins)
    certificate = moved.certificate
    assert certificate.ok and certificate.pin_failures == 0
    assert certificate.seams_exact32 == certificate.seam_edges > 0
    assert certificate.quarter_cones.tolist() == found.certificate.quarter_cones.tolist()
    assert np.array_equal(moved.cut_edges, found.cut_edges)
    for v, uv in pins.items():
        assert (moved.uv32()[moved.faces == v] == np.float32(uv)).all()
    assert places_on_cuts(moved) == places_on_cuts(found)
    at = moved.map_points(
        np.arange(len(found.input_faces)), np.full((len(found.input_faces), 3), 1 / 3)
    )
    assert np.isfinite(at).all()


def test_pins_that_cannot_be_are_named() -> None:
    found = ring()
    assert found.with_pins({}).certificate.ok
    (a, at), (b, _) = pins_near(found, 2, 1).items()
    with pytest.raises(ff.Infeasible) as same:
        found.with_pins({a: at, b: at})
    assert {a, b} <= set(same.value.elements) or same.value.witness
    on_cut = int(found.cut_edges[0, 0])
    sides = found.uv32()[found.faces == on_cut]
    if (sides == sides[0]).all():
        assert found.with_pins({on_cut: tuple(sides[0])}).certificate.ok
    with pytest.raises(ff.InvalidInput, match="which stay") as stays:
        found.with_pins({on_cut: at})
    assert stays.value.elements == [on_cut]
    with pytest.raises(ff.Infeasible, match="outside"):
        found.with_pins({a: (1e3, 1e3)})


def test_maps_that_overlap_themselves_keep_their_sheets() -> None:
    mesh = read_mesh(shared("fields/eight766.obj"))
    found = ff.field_aligned(mesh.vertices, mesh.faces)
    moved = found.with_pins(pins_near(found, 3, 2))
    assert moved.certificate.ok and moved.certificate.seams_exact32 == moved.certificate.seam_edges


# Around a corner of the ring's map is more than a whole turn: other disks have its outline, too.
@pytest.mark.parametrize(("make", "seed"), [(ball, 3), *((ring, seed) for seed in range(1, 6))])
def test_neighbours_that_change_places_may_need_new_vertices(make: Any, seed: int) -> None:
    found = make()
    (first, _), (second, _) = pins_near(found, 2, seed).items()
    place = {v: tuple(found.uv32()[found.faces == v][0].astype(float)) for v in (first, second)}
    moved = found.with_pins({first: place[second], second: place[first]})
    assert moved.certificate.ok and moved.certificate.pin_failures == 0
    assert moved.certificate.seams_exact32 == moved.certificate.seam_edges > 0
    assert places_on_cuts(moved) == places_on_cuts(found)
    face = np.arange(len(found.input_faces))
    weights = np.random.default_rng(4).dirichlet([1.0] * 3, len(face))
    index, back, shares = moved.find_points(moved.map_points(face, weights))
    near = np.full(len(face), np.inf)
    same = back == face[index]
    np.minimum.at(near, index[same], np.abs(shares - weights[index]).max(axis=1)[same])
    assert near.max() < 1e-9
