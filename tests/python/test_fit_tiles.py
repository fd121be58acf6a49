"""Maps for textures that repeat: what is whole, by a judge in fractions; what the scale gave; what is refused."""

from __future__ import annotations

import integer_maps as maps
import numpy as np
import pytest
from test_features import sharp_edges

import flipfree as ff
from flipfree.calls.certification import with_tiles

from judges.quads import Extraction, fingerprint
from judges.tiles import off_tiles
from judges.whole_numbers import Program
from mesh_files import read_mesh, shared
from surfaces import areas_of, cylinder, octahedron_sphere, signed_areas, torus


def check(found: ff.Parametrization, before: ff.Parametrization | None = None) -> None:
    certificate = found.certificate
    assert certificate.ok and certificate.flips32 == 0 and certificate.tile_failures == 0
    assert not off_tiles(found.faces, found.uv32())
    again = ff.certify(found.vertices, found.faces, found.uv32(), tiled=True)
    assert again.ok and again.tile_failures == 0
    assert (found.transitions.translation == np.rint(found.transitions.translation)).all()
    assert len(found.cut_edges) == len(found.transitions.quarter_turns) == found.stats["seams"]
    tiles = found.stats["tiles"]
    assert tiles * found.stats["tile"] ** 2 == pytest.approx(
        areas_of(found.vertices, found.faces).sum()
    )
    if before is not None:
        assert (found.faces == before.faces).all() and (found.vertices == before.vertices).all()
        assert (certificate.quarter_cones == before.certificate.quarter_cones).all()


INTEGER_MAPS = {
    "cube": maps.box((1, 1, 1), (4, 4, 4)),
    "box": maps.box((2, 3, 5), (4, 6, 10)),
    "torus, twisted": maps.twisted_torus(6, 4, 3, 12, 8),
    "pillow": maps.pillow(3, 6),
    "annulus": maps.annulus(2, 3),
}


@pytest.mark.parametrize("tile", [0.1, 0.37, 1.0])
@pytest.mark.parametrize("name", INTEGER_MAPS)
def test_maps_in_any_charts_are_fitted(name: str, tile: float) -> None:
    vertices, faces, uv = maps.in_random_charts(INTEGER_MAPS[name], 3)
    found = ff.fit_tiles((vertices, faces, uv * 0.75), tile=tile)
    check(found)
    assert found.stats["tries"] == 1 and 0.7 < found.stats["tile"] / tile < 1.4


@pytest.mark.parametrize("count", [10_000, 1000, 60])
def test_maps_of_ours_are_fitted_at_about_the_size_asked_for(count: int) -> None:
    for vertices, faces in (octahedron_sphere(4), torus(48, 24), cylinder(24, 8)):
        given = ff.field_aligned(vertices, faces)
        tile = (areas_of(vertices, faces).sum() / count) ** 0.5
        found = ff.fit_tiles(given, tile=tile)
        check(found, given)
        assert 0.8 < found.stats["tile"] / tile < 1.25
        assert found.certificate.energy < given.certificate.energy + 0.05


def test_seams_without_a_turn_are_told() -> None:
    found = ff.fit_tiles(ff.field_aligned(*torus(48, 24)), tile=0.1)
    assert found.stats["seams"] > 0 and found.stats["seams_matched"] == 1.0
    found = ff.fit_tiles(ff.field_aligned(*octahedron_sphere(3)), tile=0.1)
    turns = found.transitions.quarter_turns
    assert found.stats["seams_quarter"] == (turns % 2 == 1).sum() > 0
    assert found.stats["seams_half"] == (turns == 2).sum()


def turned_length(found: ff.Parametrization) -> float:
    ends = found.vertices[found.cut_edges]
    turned = found.transitions.quarter_turns != 0
    return float(np.linalg.norm(ends[:, 0] - ends[:, 1], axis=1)[turned].sum())


def least_turned_length(mapped: maps.Mapped) -> float:
    """Brute force: least length of edges across which a map turns, over all quarter turns of its few faces."""
    vertices, faces, uv = mapped
    along = (np.roll(uv, -1, axis=1) - uv) @ [1, 1j]
    sides = {(int(f[k]), int(f[k - 2])): (i, k) for i, f in enumerate(faces) for k in range(3)}
    quarters = np.arange(4 ** (len(faces) - 1))[None] // 4 ** np.arange(len(faces))[:, None] % 4
    length = np.zeros(quarters.shape[1])
    for (a, b), (i, k) in sides.items():
        if a < b:
            j, m = sides[b, a]
            turn = round(np.angle(-along[j, m] / along[i, k]) / (np.pi / 2))
            other = (quarters[j - 1] - quarters[i - 1] - turn) % 4 != 0
            length += other * np.linalg.norm(vertices[a] - vertices[b])
    return float(length.min())


@pytest.mark.parametrize("size", [(1, 1, 1), (2, 3, 5), (1, 1, 4)])
def test_turned_seams_are_about_as_short_as_the_shortest_of_all(size: tuple[int, int, int]) -> None:
    mapped = maps.box(size, (1, 1, 1))
    least = least_turned_length(mapped)
    for seed in range(6):
        given = maps.in_random_charts(mapped, seed)
        before, after = (
            ff.fit_tiles(given, tile=0.5, prefer_translations=on) for on in (False, True)
        )
        check(after)
        assert least * (1 - 1e-9) <= turned_length(after) <= 1.3 * least < turned_length(before)


def test_few_turned_seams_are_of_the_same_map() -> None:
    for name in ("fields/eight766.obj", "hard/mug.obj", "hard/pipe.obj"):
        mesh = read_mesh(shared(name))
        given = ff.field_aligned(mesh.vertices, mesh.faces)
        tile = (areas_of(mesh.vertices, mesh.faces).sum() / 200) ** 0.5
        before, after = (
            ff.fit_tiles(given, tile=tile, prefer_translations=on) for on in (False, True)
        )
        check(after, given)
        one, other = (
            (np.roll(found.uv, -1, axis=1) - found.uv) @ [1, 1j] for found in (before, after)
        )
        turn = np.rint(other[:, :1] / one[:, :1])
        assert (np.abs(turn) == 1).all() and (other == turn * one).all()
        assert turned_length(after) < 0.9 * turned_length(before)


@pytest.mark.parametrize("size", [1e-6, 1e6])
def test_tiles_have_the_unit_of_the_vertices(size: float) -> None:
    vertices, faces = octahedron_sphere(3)
    given = ff.field_aligned(vertices * size, faces)
    found = ff.fit_tiles(given, tile=0.1 * size)
    check(found, given)
    assert 0.9 < found.stats["tile"] / (0.1 * size) < 1.1


def test_handles_and_parts_of_machines() -> None:
    for name in (
        "fields/eight766.obj",
        "fields/gtorus004_fine.obj",
        "hard/gear.obj",
        "hard/mug.obj",
    ):
        mesh = read_mesh(shared(name))
        given = ff.field_aligned(mesh.vertices, mesh.faces)
        for count in (3000, 300):
            check(
                ff.fit_tiles(
                    given, tile=(areas_of(mesh.vertices, mesh.faces).sum() / count) ** 0.5
                ),
                given,
            )


@pytest.mark.parametrize("name", ["hard/house.obj", "seams/bunny_decim_noInputUV.obj"])
def test_edges_that_whole_numbers_bend_get_points(name: str) -> None:
    mesh = read_mesh(shared(name))
    given = ff.field_aligned(mesh.vertices, mesh.faces)
    found = ff.fit_tiles(given, tile=(areas_of(mesh.vertices, mesh.faces).sum() / 100) ** 0.5)
    check(found)
    own = len(given.vertices)
    assert found.stats["tries"] == 1 and 0 < len(found.vertices) - own < 0.3 * own
    assert (found.vertices[:own] == given.vertices).all()
    assert (found.certificate.quarter_cones == given.certificate.quarter_cones).all()
    assert (found.input_faces == mesh.faces).all()
    corners = mesh.vertices[mesh.faces[found.vertex_parent]]
    places = np.einsum("vk,vkd->vd", found.vertex_barycentric, corners)
    np.testing.assert_allclose(places, found.vertices, atol=1e-12 * np.abs(mesh.vertices).max())
    covered = areas_of(found.vertices, found.faces)
    whole = areas_of(mesh.vertices, mesh.faces)
    np.testing.assert_allclose(
        np.bincount(found.parent_face, covered), whole, atol=1e-9 * whole.max()
    )
    for features in (None, sharp_edges(mesh.vertices, mesh.faces, 60.0)):
        cells = ff.quads(mesh.vertices, mesh.faces, target=300, features=features, with_map=True)
        assert cells.map is not None and cells.map.certificate.ok
        again = ff.quads_from_map(cells.map)
        assert fingerprint(again.quads.tolist()) == fingerprint(cells.quads.tolist())


def test_ragged_borders_stay_free() -> None:
    vertices, faces = cylinder(24, 8)
    vertices = vertices + 0.05 * np.sin(40 * vertices[:, [1, 2, 0]])
    given = ff.field_aligned(vertices, faces, boundary="free")
    found = ff.fit_tiles(given, tile=0.05)
    check(found, given)
    assert found.stats["seams"] > 0


def test_features_lie_between_tiles() -> None:
    vertices, faces, _ = maps.box((2, 3, 5), (4, 6, 10))
    on_two = (np.isclose(vertices, 0) | np.isclose(vertices, [2, 3, 5])).sum(axis=1) >= 2
    edges = np.concatenate([faces[:, [k, (k + 1) % 3]] for k in range(3)])
    edges = np.unique(np.sort(edges[on_two[edges].all(axis=1)], axis=1), axis=0)
    edges = edges[np.isclose(vertices[edges[:, 0]], vertices[edges[:, 1]]).sum(axis=1) == 2]
    given = ff.field_aligned(vertices, faces, features=edges)
    assert len(given.certificate.features_missed) == 0
    found = ff.fit_tiles(given, tile=0.3, features=edges)
    check(found, given)
    assert found.certificate.feature_edges == len(edges)
    assert len(found.certificate.features_missed) == 0
    assert not off_tiles(found.faces, found.uv32(), edges)
    again = ff.certify(vertices, faces, found.uv32(), tiled=True, features=edges)
    assert again.ok and again.tile_failures == 0


def test_the_certificate_is_that_of_a_judge_in_fractions() -> None:
    random = np.random.default_rng(39)
    for name, mapped in INTEGER_MAPS.items():
        for seed in range(10):
            vertices, faces, uv = maps.in_random_charts(mapped, seed)
            if name != "annulus":
                # Charts anywhere on a grid of eighths.
                uv = uv + random.integers(-16, 16, (len(uv), 1, 2)) * random.choice([0.125, 1.0])
            uv = (uv * random.choice([1.0, 1.0, 0.5])).astype(np.float32)
            given = ff.certify(vertices, faces, uv, seamless=True)
            assert given.seam_failures == 0
            edges = np.sort(faces[random.integers(0, len(faces), 12)][:, :2], axis=1)
            judged = off_tiles(faces, uv, edges)
            found = with_tiles(given, faces, uv, edges)
            assert found.tile_failures == judged.total(), (name, seed, judged, found.failures)
            assert found.ok == (given.ok and not judged)


def change(before: np.ndarray, after: np.ndarray) -> float:
    """Symmetric Dirichlet energy of triangles (m, 3, 2) that become others, by their area before."""
    a, b = (np.stack([t[:, 1] - t[:, 0], t[:, 2] - t[:, 0]], -1) for t in (before, after))
    jacobian = b @ np.linalg.inv(a)
    return float(np.linalg.det(a) @ shape(jacobian)) / 2


def shape(jacobian: np.ndarray) -> np.ndarray:
    return ((jacobian**2).sum((-2, -1)) + (np.linalg.inv(jacobian) ** 2).sum((-2, -1))) / 4


@pytest.mark.parametrize("seed", range(6))
def test_integers_are_as_good_as_the_best_of_all_on_a_torus(seed: int) -> None:
    random = np.random.default_rng(seed)
    columns, rows, twist = (int(random.integers(*span)) for span in ((3, 9), (3, 9), (0, 3)))
    scale = float(random.uniform(0.3, 1.2))
    vertices, faces, uv = maps.twisted_torus(columns, rows, twist, 2 * columns, 8)
    tile = (areas_of(vertices, faces).sum() / (columns * rows)) ** 0.5 / scale
    found = change(uv * scale, ff.fit_tiles((vertices, faces, uv), tile=tile).uv)
    periods = scale * np.array([[columns, twist], [0.0, rows]])
    near = np.stack(np.meshgrid(*[np.arange(-4, 14)] * 2), -1).reshape(-1, 2)
    one, other = (near[np.linalg.norm(near - periods[:, k], axis=1) < 2.6] for k in (0, 1))
    pairs = np.stack([np.repeat(one, len(other), axis=0), np.tile(other, (len(one), 1))], -1)
    pairs = pairs[np.linalg.det(pairs) > 0.5]
    best = float(np.linalg.det(periods) * shape(pairs @ np.linalg.inv(periods)).min())
    assert best * (1 - 1e-6) <= found <= 1.04 * best


@pytest.mark.parametrize("seed", range(6))
def test_integers_are_no_worse_than_the_best_box_of_all(seed: int) -> None:
    size = np.random.default_rng(seed).uniform(0.7, 6.0, 3)
    vertices, faces, _ = maps.box((2, 3, 5), (4, 6, 10))
    vertices = vertices / [2, 3, 5] * size
    given = ff.field_aligned(vertices, faces)
    found = ff.fit_tiles(given, tile=1.0)
    scale = (areas_of(vertices, faces).sum() / signed_areas(given.uv).sum()) ** 0.5
    whole = np.stack(np.meshgrid(*[np.arange(1, 9)] * 3), -1).reshape(-1, 3) / size
    boxes = sum(
        size[i]
        * size[k]
        * (whole[:, i] ** 2 + whole[:, k] ** 2 + whole[:, i] ** -2.0 + whole[:, k] ** -2.0)
        / 2
        for i, k in ((0, 1), (1, 2), (2, 0))
    )
    assert change(given.uv * scale, found.uv) <= boxes.min() * (1 + 1e-9)


@pytest.mark.parametrize("seed", range(6))
def test_integers_are_no_worse_than_those_of_a_mixed_integer_program(seed: int) -> None:
    random = np.random.default_rng(seed)
    solid = maps.box((1, 1, 1), (1, 1, 1))[:2] if seed < 3 else octahedron_sphere(1)
    vertices, faces = solid[0] * random.uniform(0.6, 2.0, 3), solid[1]
    given = ff.field_aligned(vertices, faces)
    program = Program(faces, given.uv, given.certificate.quarter_cones[:, 0].tolist())
    judged = 0
    for count in (30, 70):
        tile = (areas_of(vertices, faces).sum() / count) ** 0.5
        found = ff.fit_tiles(given, tile=tile)
        assert found.stats["tries"] == 1 and len(found.faces) == len(faces)
        wish = given.uv * (count / signed_areas(given.uv).sum()) ** 0.5
        ours, best = program.least(wish, found.uv), program.least(wish)
        assert ours is not None and best is not None and best[0] <= ours[0] * (1 + 1e-6)
        # The program knows no areas, and adds up what edges are off, not what shapes are.
        if (signed_areas(best[1]) > 5e-7).all():
            judged += 1
            assert change(wish, found.uv) <= change(wish, best[1]) * (1 + 1e-9)
    assert judged == 2


def test_the_map_of_quads_has_them_for_cells() -> None:
    for vertices, faces in (
        octahedron_sphere(3),
        torus(24, 12),
        cylinder(24, 8),
        maps.annulus(2, 3)[:2],
    ):
        mesh = ff.quads(vertices, faces, target=150, with_map=True)
        assert mesh.map is not None and mesh.map.certificate.ok
        assert with_tiles(mesh.map.certificate, mesh.map.faces, mesh.map.uv32()).ok
        again = ff.quads_from_map(mesh.map)
        assert fingerprint(again.quads.tolist()) == fingerprint(mesh.quads.tolist())
        assert again.map is mesh.map
        assert ff.quads(vertices, faces, target=150).map is None
    cones = mesh.map.certificate.quarter_cones
    corner = cones[0, 0] if len(cones) else mesh.certificate.irregular[0, 0]
    start = int(np.abs(mesh.map.vertices - mesh.vertices[corner]).sum(1).argmin())
    judged = Extraction(mesh.map.faces, mesh.map.uv32(), start).quads()
    assert fingerprint(judged) == fingerprint(mesh.quads.tolist())


def test_what_cannot_be_is_refused() -> None:
    vertices, faces, uv = maps.box((2, 3, 5), (2, 3, 5))
    given = maps.parametrization((vertices, faces, uv))
    for tile in (0.0, -1.0, np.nan, "x", 1e-300):
        with pytest.raises(ff.InvalidInput, match="tile"):
            ff.fit_tiles(given, tile=tile)
    with pytest.raises(ff.InvalidInput, match="Parametrization or"):
        ff.fit_tiles(vertices, tile=1.0)
    bent = uv.copy()
    bent[7] *= 2.0
    with pytest.raises(ff.InvalidInput, match="does not match across its seam"):
        ff.fit_tiles((vertices, faces, bent), tile=1.0)
    with pytest.raises(ff.InvalidInput, match="no edge|not an edge|is no"):
        ff.fit_tiles((vertices, faces, uv), tile=1.0, features=[(0, len(vertices) - 1)])


def test_arrays_that_are_no_surface_are_refused_by_name() -> None:
    vertices, faces, uv = maps.box((1, 1, 1), (2, 2, 2))
    beyond, third = faces.copy(), np.concatenate([faces, faces[:1]])
    beyond[3, 1] = len(vertices) + 5
    with pytest.raises(ff.InvalidInput, match="does not exist|out of range"):
        ff.fit_tiles((vertices, beyond, uv), tile=0.5)
    with pytest.raises(ff.InvalidInput, match="Edge|Face"):
        ff.fit_tiles((vertices, third, np.concatenate([uv, uv[:1]])), tile=0.5)
    with pytest.raises(ff.InvalidInput):
        ff.fit_tiles((vertices * 0.0, faces, uv), tile=0.5)
