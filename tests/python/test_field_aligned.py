"""Field-aligned maps by judges that know the UVs, or the field, only."""

from __future__ import annotations

import numpy as np
import pytest
from test_admissible_cut import of_genus, scattered, turned_field

import flipfree as ff

from judges import fields, holonomy
from judges.seams import seam_count
from mesh_files import read_mesh, shared
from surfaces import areas_of, bumpy_grid, compact, cylinder, octahedron_sphere, signed_areas, torus


def judged_alike(
    vertices: np.ndarray,
    faces: np.ndarray,
    field: ff.CrossField,
    map: ff.Parametrization,
    seed: int,
) -> bool:
    """Does the map turn as the field does, along a homology basis that nobody has seen, and around every vertex?"""
    basis = holonomy.random_homology_basis(map.faces, seed)
    strips = [fields.projected(faces, map.faces, map.parent_face, loop) for loop in basis]
    assert field.rotation is not None
    wanted = fields.judge(vertices, faces, field.rotation, strips)
    cones = {int(v): int(k) for v, k in enumerate(wanted.cones) if k != 4}
    judged = holonomy.judge(map.faces, map.uv64, cones, basis)
    assert judged.vertex_error < 1e-6 and judged.loop_error < 1e-6
    return judged.turns == wanted.turns


@pytest.mark.parametrize("seed", range(3))
def test_a_map_turns_as_its_field_on_loops_that_nobody_has_seen(seed: int) -> None:
    vertices, faces = torus()
    field = ff.cross_field(vertices, faces, alignment=0.3 * seed)
    map = ff.field_aligned(vertices, faces, field=field)
    assert map.certificate.ok and map.certificate.holonomy_failures == 0
    assert map.certificate.seams_exact32 == map.certificate.seam_edges
    assert judged_alike(vertices, faces, field, map, seed)
    assert map.stats["angle_mean"] < np.radians(10)


@pytest.mark.parametrize(
    ("genus", "given"),
    [
        *((1, cones) for cones in ([3, 3, 5, 5], [2, 3, 7], [3, 3, 6], [2, 5, 5], [1, 3, 8])),
        (1, [3, 3, 3, 5, 5, 5]),
        (2, [2, 14, 3, 3, 3, 5, 5, 5]),
    ],
)
def test_padding_follows_a_field_along_a_rerouted_cut(genus: int, given: list[int]) -> None:
    mesh = of_genus(genus)
    rerouted = 0
    for seed in range(3 if genus == 1 else 1):
        field = turned_field(mesh, scattered(mesh[0], given, seed), seed)
        map = ff.field_aligned(*mesh, field=field, engine="padding", optimise=False)
        assert map.stats["engine"] == "padding"
        assert map.stats["reroutings.loops"] == 2 * genus
        rerouted += map.stats["reroutings.quarters"]
        assert map.certificate.ok and map.certificate.holonomy_failures == 0
        assert judged_alike(*mesh, field, map, seed)
    assert rerouted > 0


def test_padding_follows_fields_among_even_cones_that_turn_by_odd_numbers() -> None:
    mesh = read_mesh(shared("fields/eight766.obj"))
    vertices, faces = mesh.vertices, mesh.faces
    places = np.random.default_rng(5).permutation(len(vertices))
    cones = {int(v): k for v, k in zip(places, [6] * 6 + [2] * 2, strict=False)}
    near = ff.cross_field(vertices, faces, signature=ff.Signature(cones, []))
    loops = ff.signature(vertices, faces, near).loops
    # Around one handle only, whatever it was: the first and none of the others by an odd number.
    turned = [(strip, turns + (turns + (i == 0)) % 2) for i, (strip, turns) in enumerate(loops)]
    field = ff.cross_field(vertices, faces, signature=ff.Signature(cones, turned))
    map = ff.field_aligned(vertices, faces, field=field, engine="padding")
    assert map.certificate.ok and map.certificate.holonomy_failures == 0
    assert judged_alike(vertices, faces, field, map, 1)


@pytest.mark.parametrize("name", ["torus", "eight766", "1146164", "rocker-arm2500"])
def test_fields_of_the_shared_data_are_followed(name: str) -> None:
    mesh = read_mesh(shared(f"fields/{name}.obj"))
    given = shared(f"fields/{name}_kappa_hat.gz")
    field = ff.CrossField.read(given, mesh.vertices, mesh.faces)
    map = ff.field_aligned(mesh.vertices, mesh.faces, field=field)
    assert map.certificate.ok
    assert judged_alike(mesh.vertices, mesh.faces, field, map, 2)
    assert map.stats["angle_mean"] < np.radians(10)


@pytest.mark.parametrize("turns", [(0, 0), (1, 0), (-1, 2)])
def test_a_signature_is_met_exactly(turns: tuple[int, int]) -> None:
    vertices, faces = torus()
    places = np.random.default_rng(4).permutation(len(vertices))[:8]
    cones = {int(v): 3 if i % 2 else 5 for i, v in enumerate(places)}
    near = ff.cross_field(vertices, faces, signature=ff.Signature(cones, []))
    start = ff.signature(vertices, faces, near)
    wanted = [(strip, t + d) for (strip, t), d in zip(start.loops, turns, strict=True)]
    signature = ff.Signature(cones, wanted)
    field = ff.cross_field(vertices, faces, signature=signature)
    map = ff.field_aligned(vertices, faces, signature=signature)
    assert map.certificate.ok
    assert judged_alike(vertices, faces, field, map, 5)


def test_another_homology_basis_of_a_signature_makes_the_same_map() -> None:
    vertices, faces = torus()
    places = np.random.default_rng(6).permutation(len(vertices))[:8]
    cones = {int(v): 3 if i % 2 else 5 for i, v in enumerate(places)}
    first = ff.cross_field(vertices, faces, signature=ff.Signature(cones, []))
    assert first.rotation is not None
    plain = ff.field_aligned(vertices, faces, field=first)
    for seed in range(3):
        basis = holonomy.random_homology_basis(faces, seed)
        turns = fields.judge(vertices, faces, first.rotation, basis).turns
        loops = [([h // 3 for h in loop], t) for loop, t in zip(basis, turns, strict=True)]
        signature = ff.Signature(cones, loops)
        again = ff.cross_field(vertices, faces, signature=signature)
        assert again.rotation is not None
        assert np.abs(again.rotation - first.rotation).max() < 1e-9
        map = ff.field_aligned(vertices, faces, signature=signature)
        assert abs(map.certificate.energy / plain.certificate.energy - 1) < 0.01


def test_the_certificate_of_any_map_counts_its_turns_exactly() -> None:
    vertices, faces = torus()
    field = ff.cross_field(vertices, faces, alignment=0.4)
    map = ff.field_aligned(vertices, faces, field=field)
    assert len(map.faces) == len(faces)
    signature = ff.signature(vertices, faces, field)
    right = ff.certify(vertices, faces, map.uv, signature=signature)
    assert right.ok and right.holonomy_failures == 0 and right.cone_failures == 0
    loops = [(strip, turns + 1) for strip, turns in signature.loops]
    wrong = ff.certify(vertices, faces, map.uv, signature=ff.Signature(signature.cones, loops))
    assert not wrong.ok and wrong.holonomy_failures == 2
    assert any("G6" in failure for failure in wrong.failures)
    other = ff.certify(vertices, faces, map.uv, signature=ff.Signature({}, signature.loops))
    assert other.cone_failures == len(signature.cones)
    with pytest.raises(ff.InvalidInput, match="Both cones and signature"):
        ff.certify(vertices, faces, map.uv, cones={0: 1.0}, signature=signature)
    with pytest.raises(ff.InvalidInput, match="must be a Signature"):
        ff.certify(vertices, faces, map.uv, signature={0: 3})  # type: ignore[arg-type]


def slanted(map: ff.Parametrization) -> int:
    """Boundary edges that run along no axis, as stored."""
    opposite = holonomy.opposite_halfedges(map.faces)
    uv = map.uv32()
    ahead = np.roll(uv, -1, axis=1)
    return int(((uv != ahead).all(axis=2).ravel() & (opposite < 0)).sum())


def open_surfaces() -> list[tuple[np.ndarray, np.ndarray]]:
    """A sheet, a tube, a torus with a hole, a sphere with three holes."""
    ring, ball = torus(), octahedron_sphere(4)
    near = np.abs(ball[0][ball[1]].mean(axis=1)).max(axis=1) > 0.97
    lids = np.linalg.norm(ball[0][ball[1]].mean(axis=1) @ np.diag([1.0, 1.0, 0.0]), axis=1) < 0.3
    return [bumpy_grid(12, 9), cylinder(), compact(ring[0], ring[1][8:])] + [
        compact(ball[0], ball[1][~(near | lids)])
    ]


@pytest.mark.parametrize("boundary", ["aligned", "free"])
@pytest.mark.parametrize("place", range(4))
def test_open_surfaces_follow_their_fields(place: int, boundary: str) -> None:
    vertices, faces = open_surfaces()[place]
    field = ff.cross_field(vertices, faces, boundary=boundary == "aligned")
    map = ff.field_aligned(vertices, faces, field=field, boundary=boundary)
    assert map.certificate.ok and map.certificate.holonomy_failures == 0
    assert map.stats["loops_checked"] >= 1
    assert map.stats["angle_mean"] < np.radians(10)
    assert boundary == "free" or slanted(map) == 0


def random_polygon(seed: int) -> tuple[np.ndarray, np.ndarray]:
    """A convex polygon without a vertex inside, divided into triangles at random."""
    random = np.random.default_rng(seed)
    n = int(random.integers(6, 40))
    angle = 2 * np.pi * (np.arange(n) + 0.3 * random.random(n)) / n
    ring, faces = list(range(n)), []
    while len(ring) > 2:
        i = int(random.integers(len(ring)))
        faces.append([ring[i - 1], ring[i], ring[(i + 1) % len(ring)]])
        del ring[i]
    return np.stack([np.cos(angle), np.sin(angle), 0 * angle], 1), np.array(faces, np.int32)


@pytest.mark.parametrize("seed", range(12))
def test_edges_that_a_straight_boundary_flattens_are_divided(seed: int) -> None:
    """Without a vertex on them no map has positive area behind them: it was refused."""
    vertices, faces = random_polygon(seed)
    map = ff.field_aligned(vertices, faces)
    assert map.certificate.ok
    assert map.stats["divided_chords"] >= 1
    assert map.stats["added_vertices"] == len(map.vertices) - len(vertices)
    for uv in (map.uv64, map.uv32()):
        judged = seam_count(map.faces, uv)
        assert judged.flipped == judged.slanted == 0 and judged.exact == judged.edges
        corners = sum(2 - k for k in judged.corners.values())
        assert corners + sum(4 - k for k in judged.cones.values()) == 4
    # Where the boundary is free, nothing is flat.
    free = ff.field_aligned(vertices, faces, boundary="free")
    assert "divided_chords" not in free.stats


@pytest.mark.parametrize("alignment", [0.0, 0.5])
def test_a_cube_of_twelve_triangles_has_a_map_however_its_squares_are_divided(
    alignment: float,
) -> None:
    """It bends nowhere more in one direction than in another, but for rounding; and no vertex is near to another."""
    vertices = np.array([(x, y, z) for x in (0, 1) for y in (0, 1) for z in (0, 1)], float)
    quads = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
    perfect = 0
    for divided in range(64):
        corners = [q if divided >> i & 1 else (*q[1:], q[0]) for i, q in enumerate(quads)]
        triangles = [t for a, b, c, d in corners for t in ((a, b, c), (a, c, d))]
        faces = np.array(triangles, np.int32)
        field = ff.cross_field(vertices, faces, alignment=alignment)
        map = ff.field_aligned(vertices, faces, field=field)
        assert map.certificate.ok
        perfect += map.certificate.energy < 1.000001
    assert perfect >= 60


def test_a_field_that_knows_the_sizes_lets_the_map_have_them() -> None:
    vertices, faces = torus(48, 24)
    sizing = np.exp(
        0.5 * np.sin(2 * np.arctan2(vertices[:, 1], vertices[:, 0])) + 0.5 * vertices[:, 2]
    )

    def spread(map: ff.Parametrization) -> float:
        """Of the sizes reached over those that were asked for, logarithms."""
        area = areas_of(map.vertices, map.faces)
        reached = 0.5 * np.log(signed_areas(map.uv) / area)
        wished = np.log(sizing)[faces[map.parent_face]].mean(axis=1)
        off = reached - wished
        return float(np.sqrt(np.average((off - np.average(off, weights=area)) ** 2, weights=area)))

    plain = ff.field_aligned(vertices, faces, field=ff.cross_field(vertices, faces), sizing=sizing)
    aware = ff.field_aligned(vertices, faces, sizing=sizing)
    assert aware.certificate.ok
    assert spread(aware) < 0.5 * spread(plain)
    assert aware.stats["angle_mean"] < plain.stats["angle_mean"]


def test_what_cannot_be_is_refused_with_a_reason() -> None:
    vertices, faces = torus()
    field = ff.cross_field(vertices, faces)
    with pytest.raises(ff.Infeasible, match="3 and 5"):
        ff.field_aligned(vertices, faces, signature=ff.Signature({0: 3, 7: 5}, []))
    with pytest.raises(ff.Infeasible, match="Add 1 to"):
        ff.field_aligned(vertices, faces, signature=ff.Signature({0: 3}, []))
    with pytest.raises(ff.InvalidInput, match="Both field and signature"):
        ff.field_aligned(vertices, faces, field=field, signature=ff.Signature({}, []))
    with pytest.raises(ff.InvalidInput, match="boundary"):
        ff.field_aligned(vertices, faces, boundary="straight")


@pytest.mark.parametrize("height", [1.0, 0.07])
def test_corners_of_the_border_stay_where_one_bends_out_beside_one_that_bends_in(
    height: float,
) -> None:
    cells = [(0, 0), (0, 1), (0, 2), (1, 2), (0, 3), (1, 4), (0, 4), (-1, 2)]
    corners = [(x + i, y + j) for x, y in cells for i, j in [(0, 0), (1, 0), (1, 1), (0, 1)]]
    flat, index = np.unique(corners, axis=0, return_inverse=True)
    a, b, c, d = index.reshape(-1, 4).T
    faces = np.concatenate([np.stack([a, b, c], 1), np.stack([a, c, d], 1)]).astype(np.int32)
    vertices = np.column_stack([flat, np.zeros(len(flat))]) * [1.0, height, 1.0]
    map = ff.field_aligned(vertices, faces)
    assert map.certificate.ok and map.certificate.energy < 1.0 + 1e-9
