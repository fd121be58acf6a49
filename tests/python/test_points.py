"""Maps at points: linear or projective on every piece of the overlay, against the definition (thesis 4.5), and composed."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt
import pytest
from embedding_meshes import wavy_grid

import flipfree as ff

from surfaces import bumpy_grid, octahedron_sphere

Floats = npt.NDArray[np.float64]


def points_on(faces: Any, seed: int, count: int = 2000) -> tuple[npt.NDArray[Any], Floats]:
    random = np.random.default_rng(seed)
    return random.integers(len(faces), size=count), random.dirichlet([1.0] * 3, count)


def placed(vertices: Floats, faces: Any, face: Any, weights: Any) -> Floats:
    return np.einsum("qk,qkd->qd", weights, vertices[faces[face]])


def conformal_disk() -> tuple[Floats, Any, ff.Parametrization]:
    """Of a stretched grid whose corners become right angles: with flips, all away from each other."""
    vertices, faces = bumpy_grid(9, 9)
    angles = ff.boundary_angles(vertices, faces, "straight", corners=[0, 9, 99, 90])
    return vertices, faces, ff.conformal(vertices, faces, angles, original_triangles=False)


def refined_triangle() -> tuple[Floats, Any, ff.Parametrization]:
    disk = wavy_grid(8, 8)
    return disk.vertices, disk.faces, ff.embed(disk.vertices, disk.faces, boundary="triangle")


MAPS = {"conformal": conformal_disk, "refined": refined_triangle}


@pytest.mark.parametrize("name", MAPS)
def test_vertices_keep_their_places_and_points_come_back(name: str) -> None:
    vertices, faces, found = MAPS[name]()
    assert found.certificate.ok and len(found.vertices) > len(vertices)
    face, weights = points_on(faces, 1)
    uv = found.map_points(face, weights)
    index, back, shares = found.find_points(uv)
    assert np.array_equal(np.unique(index), np.arange(len(uv)))
    near = np.linalg.norm(
        placed(vertices, faces, back, shares) - placed(vertices, faces, face, weights)[index],
        axis=1,
    )
    assert near.max() < 1e-9
    for f, corners in enumerate(found.faces):  # every piece has its corners where they are stored
        if (corners < len(vertices)).all():
            own = np.stack([faces[found.parent_face[f]] == v for v in corners]).astype(float)
            at = found.map_points([found.parent_face[f]] * 3, own)
            assert np.array_equal(at, found.uv[f])


def test_maps_are_linear_on_every_piece() -> None:
    _, _, found = refined_triangle()
    parent = found.input_faces[found.parent_face]
    for f, corners in enumerate(found.faces):
        own = found.input_faces[found.vertex_parent[corners]]
        weights = np.array(
            [
                [(found.vertex_barycentric[v] * (own[c] == w)).sum() for w in parent[f]]
                for c, v in enumerate(corners)
            ]
        )
        share = np.random.default_rng(f).dirichlet([1.0] * 3, 4)
        at = found.map_points([found.parent_face[f]] * 4, share @ weights)
        assert np.allclose(at, share @ found.uv[f], rtol=0, atol=1e-9)


def circle_map(source: Floats, target: Floats, weights: Floats) -> Floats:
    """P[source -> target] of thesis 4.5.2 for triangles of points: the projective map that keeps the circumcircle."""

    def opposite(points: Floats) -> Floats:  # length of the side that corner i is not on
        sides: Floats = np.linalg.norm(np.roll(points, -1, 0) - np.roll(points, -2, 0), axis=1)
        return sides

    a, b = opposite(source), opposite(target)
    share = weights * np.roll(a, 1) * np.roll(a, 2) * b / (np.roll(b, 1) * np.roll(b, 2) * a)
    return np.asarray(share / share.sum() @ target)


def inside(triangle: Floats, point: Floats) -> Floats:
    return np.linalg.solve(np.vstack([triangle.T, np.ones(3)]), np.append(point, 1.0))


def test_conformal_maps_are_those_of_the_definition() -> None:
    vertices, faces = octahedron_sphere(3)
    random = np.random.default_rng(4)
    angles = np.full(len(vertices), 2 * np.pi)
    angles *= random.uniform(0.7, 1.3, len(vertices))
    angles *= 2 * np.pi * (len(vertices) - 2) / angles.sum()
    metric = ff.conformal_metric(vertices, faces, angles)
    assert metric.euclidean_flips == 0 < metric.flips
    found = ff.conformal(vertices, faces, angles, original_triangles=False)
    assert found.log_weight is not None

    def sides(of: Any) -> dict[tuple[int, int], int]:
        return {(int(t[k]), int(t[(k + 1) % 3])): f for f, t in enumerate(of) for k in range(3)}

    before, after = sides(faces), sides(metric.faces)
    corner = {}  # of (face, vertex): place
    for f, triangle in enumerate(found.faces):
        for k, v in enumerate(triangle):
            corner[int(found.parent_face[f]), int(v)] = found.uv[f, k]
    tested = {"kept": 0, "flipped": 0}
    for f, (i, j, k) in enumerate(faces.tolist()):
        lost = [e for e in ((i, j), (j, k), (k, i)) if e not in after]
        weights = random.dirichlet([1.0] * 3)
        at = found.map_points([f], [weights])[0]
        target = np.array([corner[f, v] for v in (i, j, k)])
        if not lost:
            expected = circle_map(vertices[[i, j, k]], target, weights)
            tested["kept"] += 1
        else:
            (i, j), other = lost[0], before[lost[0][::-1]]
            k = next(v for v in faces[f].tolist() if v not in (i, j))
            m = next(v for v in faces[other].tolist() if v not in (i, j))
            weights = weights[[faces[f].tolist().index(v) for v in (i, j, k)]]
            kept = [(m, k), (j, k), (k, i), (i, m), (m, j)]  # alone: no side was flipped as well
            cut = any((corner[f, v] != corner[other, v]).any() for v in (i, j))
            if cut or not all(e in after for e in kept):
                continue

            def length(a: int, b: int) -> float:
                return float(np.linalg.norm(vertices[a] - vertices[b]))

            ratio = length(j, k) * length(i, m) / (length(j, m) * length(k, i))
            r = (1 - ratio) / (1 + ratio)
            p, q = np.array([1.0, 0.0]), np.array([r, np.sqrt(1 - r * r)])
            chart = {i: -p, j: p, k: q, m: -q}
            here = circle_map(vertices[[i, j, k]], np.array([-p, p, q]), weights)
            piece = [j, k, m] if inside(np.array([p, q, -q]), here).min() >= 0 else [i, m, k]
            drawn = np.array([chart[v] for v in piece])
            place = corner | {(f, m): corner[other, m]}
            target = np.array([place[f, v] for v in piece])
            expected = circle_map(drawn, target, inside(drawn, here))
            tested["flipped"] += 1
        scale = np.linalg.norm(target - target.mean(axis=0), axis=1).max()
        assert np.linalg.norm(at - expected) < 1e-9 * scale, (f, lost, at, expected)
    assert min(tested.values()) > 50, tested


def on_square(vertices: Floats, faces: Any, corners: list[int], **options: Any) -> Any:
    at = dict(zip(corners, [(0, 0), (1, 0), (1, 1), (0, 1)], strict=True))
    return ff.embed(vertices, faces, boundary="corners", corners=at, **options)


def two_surfaces() -> tuple[Any, ff.Parametrization, Any, ff.Parametrization]:
    disk, other = wavy_grid(8, 8), bumpy_grid(6, 5)
    first = on_square(disk.vertices, disk.faces, [0, 8, 80, 72])
    second = on_square(*other, [0, 6, 41, 35], optimise=True)
    return (disk.vertices, disk.faces), first, other, second


def test_composed_maps_lead_there_and_back_without_a_fold() -> None:
    (vertices, faces), first, other, second = two_surfaces()
    there = ff.compose(first, second)
    face, weights = points_on(faces, 6)
    on_other, shares = there.map_points(face, weights)
    for k in range(0, len(face), 50):  # the same, by a walk over all triangles of the second map
        uv = first.map_points(face[k : k + 1], weights[k : k + 1])[0]
        inner = np.array([inside(triangle, uv) for triangle in second.uv])
        f = int(inner.min(axis=1).argmax())
        mine = placed(second.vertices, second.faces, np.array([f]), inner[f][None])
        assert np.abs(mine - placed(*other, on_other[k : k + 1], shares[k : k + 1])).max() < 1e-9
    back, own = ff.compose(second, first).map_points(on_other, shares)
    off = placed(vertices, faces, back, own) - placed(vertices, faces, face, weights)
    assert np.abs(off).max() < 1e-9
    # Small triangles within one piece of the overlay go to triangles of the same turn, linearly.
    steps = np.eye(3) * 1e-4
    near = [there.map_points(face, weights * (1 - 1e-4) + step) for step in steps]
    whole = np.logical_and.reduce([n[0] == on_other for n in near])
    turn = np.linalg.det(np.stack([n[1] for n in near], axis=1)[whole])
    assert whole.sum() > 0.9 * len(face) and (turn > 0.0).all()
    middle = there.map_points(face, weights * (1 - 1e-4) + steps.mean(axis=0))
    expected = np.mean([n[1] for n in near], axis=0)
    same = whole & (middle[0] == on_other)
    assert np.abs(middle[1] - expected)[same].max() < 1e-5


def test_stored_maps_onto_one_square_are_composed() -> None:
    maps = []
    for n, height in ((8, 0.1), (11, 0.7)):
        vertices, faces = bumpy_grid(n, n, height)
        places = (0.1, 0.1), (0.9, 0.1), (0.1, 0.9), (0.9, 0.9)
        corners = dict(zip((0, n, n * (n + 1), n * (n + 2)), places, strict=True))
        found = ff.embed(vertices, faces, boundary="corners", corners=corners)
        maps.append((vertices, faces, found.uv32()))
    face, weights = ff.compose(*maps).map_corners()
    there = maps[1][2][face]
    assert np.abs(np.einsum("mck,mckd->mcd", weights, there) - maps[0][2]).max() < 1e-6


def test_what_does_not_fit_is_refused_by_name() -> None:
    (vertices, faces), first, other, second = two_surfaces()
    with pytest.raises(ff.InvalidInput, match="outside the second map"):
        ff.compose(first, ff.embed(*other))
    ball = ff.seamless(*octahedron_sphere(2), dict.fromkeys(range(4), 2))
    if ball.certificate.overlaps:
        with pytest.raises(ff.InvalidInput, match="not one-to-one"):
            ff.compose(first, ball)
    for face, weights in (([999], [[1, 0, 0]]), ([0], [[0.5, 0.6, 0.0]]), ([0, 1], [[1, 0, 0]])):
        with pytest.raises(ff.InvalidInput):
            first.map_points(face, weights)
    index, _, _ = first.find_points([[0.5, 0.5], [2.0, 2.0]])
    assert 0 in index and 1 not in index
    empty = first.map_points(np.zeros(0, int), np.zeros((0, 3)))
    assert empty.shape == (0, 2)


def test_seamless_maps_have_several_places_and_one_of_them_is_the_point() -> None:
    vertices, faces = octahedron_sphere(3)
    found = ff.seamless(vertices, faces, dict.fromkeys(range(4), 2))
    face, weights = points_on(faces, 7)
    index, back, shares = found.find_points(found.map_points(face, weights))
    off = placed(vertices, faces, back, shares) - placed(vertices, faces, face, weights)[index]
    best = np.full(len(face), np.inf)
    np.minimum.at(best, index, np.linalg.norm(off, axis=1))
    assert best.max() < 1e-9
