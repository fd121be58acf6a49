"""What comes back is what is stored, cannot be changed, and does not depend on units, numbers, and what no face uses."""

from __future__ import annotations

import copy
import itertools
import pickle
from collections.abc import Callable

import numpy as np
import pytest

import flipfree as ff

from judges.seams import seam_count
from surfaces import Mesh, bumpy_grid, joined, octahedron_sphere, shuffled, torus

Call = Callable[[np.ndarray, np.ndarray], ff.Parametrization]


MAPS: dict[str, Call] = {
    "unwrap": ff.unwrap,
    "unwrap, pins": lambda v, f: ff.unwrap(v, f, pins={0: (0.1, 0.3), 24: (0.9, 0.7)}),
    "embed": lambda v, f: ff.embed(v, f, optimise=True),
    "embed, refined": lambda v, f: ff.embed(v, f, boundary="triangle"),
    "match": lambda v, f: ff.match(v, f, points={0: (0.1, 0.2), 24: (1.1, 1.0)}),
    "improve": lambda v, f: ff.improve(ff.embed(v, f)),
    "pack": lambda v, f: ff.pack(v, f, ff.embed(v, f).uv),
    "conformal": lambda v, f: ff.conformal(v, f, ff.boundary_angles(v, f, "circle")),
    "seamless": ff.seamless,
    "field_aligned": ff.field_aligned,
}


def mesh_of(name: str) -> Mesh:
    return torus(8, 6) if name in ("seamless", "field_aligned") else bumpy_grid(4, 4)


@pytest.mark.parametrize("scale", [2.0**-1060, 2.0**-400, 2.0**-50, 2.0**400, 2.0**1000])
@pytest.mark.parametrize("name", MAPS)
def test_the_unit_of_length_does_not_matter(name: str, scale: float) -> None:
    vertices, faces = mesh_of(name)
    vertices = np.round(vertices * 2.0**10)  # powers of two times these are exact, even tiny ones
    usual = MAPS[name](vertices, faces)
    scaled = MAPS[name](vertices * scale, faces)
    assert scaled.certificate.ok
    assert scaled.certificate.energy == pytest.approx(usual.certificate.energy, rel=1e-6)
    assert np.array_equal(scaled.vertices[: len(vertices)], vertices * scale)


@pytest.mark.parametrize("name", [name for name in MAPS if name not in ("unwrap, pins", "match")])
def test_the_order_of_vertices_and_faces_does_not_decide(name: str) -> None:
    usual = MAPS[name](*mesh_of(name)).certificate.energy
    for seed in range(3):
        found = MAPS[name](*shuffled(mesh_of(name), seed)).certificate
        assert found.ok
        if name in ("unwrap", "conformal"):
            assert found.energy == pytest.approx(usual, rel=0.05)


@pytest.mark.parametrize(
    ("name", "size"),
    [
        *itertools.product(["unwrap", "seamless", "field_aligned"], [1e-8, 1e-30]),
        *(("unwrap", 1e-300), ("seamless", 1e-200)),
    ],
)
def test_a_speck_beside_a_large_part_is_enlarged_until_32_bits_hold_it(
    name: str, size: float
) -> None:
    vertices, faces = torus()
    both, pair = joined((vertices, faces), (size * vertices, faces))
    result = MAPS[name](both, pair)
    assert result.certificate.ok and result.stats["enlarged_islands"] == 1
    assert (result.vertices[: len(both)] == both).all()
    judged = seam_count(result.faces, result.uv32())
    assert judged.flipped == 0 and (name == "unwrap" or judged.exact == judged.edges > 0)
    assert result.certificate.energy < 1.5
    alone = MAPS[name](*joined((vertices, faces), (1e-2 * vertices, faces)))
    assert "enlarged_islands" not in alone.stats or alone.stats["enlarged_islands"] == 0


@pytest.mark.parametrize("name", MAPS)
def test_plain_rounding_of_the_map_is_what_is_stored(name: str) -> None:
    result = MAPS[name](*mesh_of(name))
    assert result.uv.dtype == np.float64 and result.uv32().dtype == np.float32
    assert np.array_equal(result.uv.astype(np.float32), result.uv32())
    assert np.abs(result.uv64 - result.uv).max() < 1e-5
    assert ff.certify(result.vertices, result.faces, result.uv).ok
    assert "uv rounds to uv32()" in repr(result)


def test_rounding_that_was_repaired_is_part_of_the_map() -> None:
    vertices, faces = bumpy_grid(5, 2)
    pins = {0: (0.1, 0.2), 1: (0.1 + 1e-6, 0.2)}
    result = ff.unwrap(vertices * [1e-4, 1.0, 1.0], faces, pins=pins)
    assert result.stats["rounding.repaired"] > 0
    repaired = result.uv64.astype(np.float32) != result.uv32()
    assert repaired.any() and not repaired.all()
    assert np.array_equal(result.uv.astype(np.float32), result.uv32())
    assert np.array_equal(result.uv[~repaired.any(axis=2)], result.uv64[~repaired.any(axis=2)])
    assert ff.certify(vertices, faces, result.uv, pins=pins, bijective=True).ok


@pytest.mark.parametrize("name", MAPS)
def test_results_are_read_only_also_after_copying(name: str) -> None:
    result = MAPS[name](*mesh_of(name))
    for other in (result, copy.deepcopy(result), pickle.loads(pickle.dumps(result))):
        for array in (other.uv, other.uv64, other.vertices, other.faces, other.cut_edges):
            with pytest.raises(ValueError, match="read-only"):
                array[...] = 0
    stored = result.uv32()
    stored[...] = 0  # a copy, for the caller
    assert result.uv32().any()


@pytest.mark.parametrize("far", [1e5, 1e100, 1e200, 1e308, -1e308, 1e-308])
@pytest.mark.parametrize(
    "name", list(MAPS)[:7]
)  # the others want an angle or a part of each vertex
def test_a_vertex_without_faces_decides_nothing(name: str, far: float) -> None:
    vertices, faces = mesh_of(name)
    usual = MAPS[name](vertices, faces)
    loose = np.vstack([vertices, [far, 1.0, -far]])
    result = MAPS[name](loose, faces)
    assert result.uv64.tobytes() == usual.uv64.tobytes()
    assert result.uv32().tobytes() == usual.uv32().tobytes()
    assert result.vertices[: len(loose)].tobytes() == loose.tobytes()
    assert result.vertices[len(loose) :].tobytes() == usual.vertices[len(vertices) :].tobytes()
    assert (result.certificate.energy, result.certificate.max_energy) == (
        usual.certificate.energy,
        usual.certificate.max_energy,
    )
    again = ff.certify(loose, faces, usual.uv) if len(usual.faces) == len(faces) else None
    assert again is None or (again.ok and np.isfinite(again.energy))


def test_a_vertex_without_faces_that_is_not_finite_is_named() -> None:
    vertices, faces = bumpy_grid(2, 2)
    with pytest.raises(ff.InvalidInput, match="Vertex 9"):
        ff.unwrap(np.vstack([vertices, [0.0, np.nan, 0.0]]), faces, seams="given")


def test_where_no_face_has_an_area_there_is_no_distortion_to_measure() -> None:
    vertices, faces = bumpy_grid(2, 2)
    uv = vertices[faces][:, :, :2]
    certificate = ff.certify(np.zeros_like(vertices) + 1.0, faces, uv)
    assert certificate.ok and certificate.energy == -1.0
    assert "without area" in certificate.mends[0].what or "length zero" in certificate.mends[0].what
    flat = ff.certify(vertices, faces, 1e-200 * uv)
    assert not flat.ok and not np.isfinite(flat.energy)


@pytest.mark.parametrize("ratio", [1e-12, 1e-100, 1e-200, 1e100])
def test_components_of_very_different_size_are_each_in_their_own_unit(ratio: float) -> None:
    vertices, faces = bumpy_grid(5, 4)
    alone = ff.unwrap(vertices, faces, max_seconds=20.0, seams="given")
    ratio = 2.0 ** np.round(np.log2(ratio))
    both, twice = joined((vertices, faces), (vertices * ratio, faces))

    def shape(uv: np.ndarray) -> np.ndarray:
        """Edge lengths, as shares of the whole."""
        lengths = np.linalg.norm(uv - np.roll(uv, 1, axis=1), axis=2)
        return lengths / lengths.sum()

    try:
        result = ff.unwrap(both, twice, seams="given")
    except ff.NotConverged as error:
        # In one square of 32-bit floats the smaller one may have no room.
        assert error.code == "rounding to 32 bits flips triangles"
        return
    for part in (result.uv64[: len(faces)], result.uv64[len(faces) :]):
        assert np.allclose(shape(part), shape(alone.uv64), rtol=1e-3)


def test_a_pin_is_no_reason_to_cut_through_it() -> None:
    vertices, faces = octahedron_sphere(0)
    for pinned in range(6):
        result = ff.unwrap(vertices, faces, pins={pinned: (0.25, 0.5)})
        assert result.certificate.ok and len(result.cut_edges) > 0
        assert (result.uv[faces == pinned] == (0.25, 0.5)).all()


def test_added_cuts_avoid_all_pins_that_they_can() -> None:
    vertices, faces = octahedron_sphere(1)
    for a in range(len(vertices)):
        for b in range(a):
            pins = {a: (0.0, 0.0), b: (1.0, 0.0)}
            try:
                result = ff.unwrap(vertices, faces, pins=pins)
            except ff.NotConverged as error:
                assert "pinned vertex" not in str(error)
                continue
            ends, counts = np.unique(result.cut_edges, return_counts=True)
            through = set(ends[counts > 1].tolist())
            assert not through & set(pins)


def test_a_cut_that_cannot_avoid_a_pin_is_no_proof() -> None:
    vertices, faces = octahedron_sphere(0)
    pins = {v: (float(v), float(v * v)) for v in range(6)}
    with pytest.raises(ff.NotConverged) as caught:
        ff.unwrap(vertices, faces, pins=pins)
    assert caught.value.kind in ("vertex", "face")


def test_two_sheets_may_have_pins_at_one_place_where_charts_may_overlap() -> None:
    vertices, faces = bumpy_grid(2, 2)
    pins = {0: (0.5, 0.5), 8: (0.5, 0.5)}
    with pytest.raises(ff.Infeasible):
        ff.unwrap(vertices, faces, pins=pins)
    with pytest.raises(ff.NotConverged):
        ff.unwrap(vertices, faces, pins=pins, bijective=False)
    with pytest.raises(ff.Infeasible):
        ff.unwrap(vertices, faces, pins={0: (0.5, 0.5), 1: (0.5, 0.5)}, bijective=False)


@pytest.mark.parametrize("exponent", [3, 6, 9, 12, 15])
def test_long_strips_are_unwrapped(exponent: int) -> None:
    for columns in (1, 4, 10):
        vertices, faces = bumpy_grid(columns, 1, height=0.0)
        vertices = vertices * [10.0**exponent, 1.0, 1.0]
        result = ff.unwrap(vertices, faces, seams="given")
        assert result.certificate.ok


def test_tuttes_map_does_not_depend_on_a_start() -> None:
    vertices, faces = bumpy_grid(4, 4)
    usual = ff.embed(vertices, faces, method="tutte")
    start = np.random.default_rng(0).normal(size=(len(vertices), 2))
    result = ff.embed(vertices, faces, method="tutte", initial_uv=start)
    assert result.uv64.tobytes() == usual.uv64.tobytes()
    assert result.stats["rung"] == "tutte"


@pytest.mark.parametrize("bijective", [True, False])
@pytest.mark.parametrize("far", [1e10, 1e20, 1e38])
def test_pins_far_away_are_met_or_not_reached(far: float, bijective: bool) -> None:
    vertices, faces = bumpy_grid(5, 5)
    for pins in (
        {0: (0.0, 0.0), 35: (far, 0.0)},
        {14: (far, far)},
        {0: (0.0, 0.0), 14: (far, 1.0)},
    ):
        try:
            assert ff.match(vertices, faces, points=pins, bijective=bijective).certificate.ok
        except ff.NotConverged as error:
            assert "nwrap it" not in str(error)


@pytest.mark.parametrize("seed", range(40))
def test_an_embedding_is_not_lost_by_optimising_it(seed: int) -> None:
    random = np.random.default_rng(seed)
    vertices, faces = bumpy_grid(int(random.integers(2, 6)), int(random.integers(2, 5)))
    vertices = vertices * [1.0, 10.0 ** -random.integers(0, 12), 10.0 ** -random.integers(0, 12)]
    a, b = faces[random.integers(len(faces))][:2]
    vertices[a] = vertices[b] + random.normal(size=3) * 10.0 ** -random.integers(2, 14)
    try:
        plain = ff.embed(vertices, faces)
    except ff.FlipfreeError:
        return  # it was not there in the first place
    optimised = ff.embed(vertices, faces, optimise=True)
    assert optimised.certificate.ok
    assert optimised.certificate.energy <= plain.certificate.energy * (1 + 1e-6)
    improved = ff.improve(plain)
    assert improved.certificate.energy <= plain.certificate.energy * (1 + 1e-6)
