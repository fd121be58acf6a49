"""Features: edges that are isolines as stored (G8), and rows of quad edges."""

from __future__ import annotations

import integer_maps as maps
import numpy as np
import pytest

import flipfree as ff

from surfaces import edges_of, prism, torus


def sharp_edges(vertices: np.ndarray, faces: np.ndarray, degrees: float = 30.0) -> np.ndarray:
    """(k, 2), the inner edges whose faces' normals differ by more."""
    a, b, c = (vertices[faces[:, k]] for k in range(3))
    normals = np.cross(b - a, c - a)
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    faces_of: dict[tuple[int, int], list[int]] = {}
    for f, face in enumerate(faces.tolist()):
        for i, j in zip(face, face[1:] + face[:1], strict=True):
            faces_of.setdefault((min(i, j), max(i, j)), []).append(f)
    limit = np.cos(np.radians(degrees))
    return np.array(
        [
            e
            for e, fs in faces_of.items()
            if len(fs) == 2 and normals[fs[0]] @ normals[fs[1]] < limit
        ],
        np.int32,
    ).reshape(-1, 2)


def cube(n: int) -> tuple[np.ndarray, np.ndarray]:
    """Of size 1, every edge divided into n."""
    return maps.box((1, 1, 1), (n, n, n))[:2]


def cut_corner(n: int, share: float) -> tuple[np.ndarray, np.ndarray]:
    """A cube without one corner: three of its edges meet three of a triangle at 45 degrees."""
    vertices, faces = cube(n)
    inward = vertices.max(axis=0) - vertices
    beyond = np.maximum(share - inward.sum(axis=1), 0.0)
    return vertices - beyond[:, None] / 3.0, faces


def missed(found: ff.Parametrization, features: np.ndarray, uv: np.ndarray) -> set[tuple[int, int]]:
    """By the definition: a feature is met if on either side every vertex of the map on it has one u, or one v, once the turns
    and translations of the seams that cross it are taken back; the way along it is followed edge by edge."""
    vertices, faces = found.vertices, found.faces
    sides: dict[tuple[int, int], tuple[int, int]] = {}
    for f, face in enumerate(faces.tolist()):
        for k in range(3):
            sides[face[k], face[(k + 1) % 3]] = (f, k)
    bad = set()
    for a, b in np.sort(features, axis=1).tolist():
        along = vertices[b] - vertices[a]
        length = np.linalg.norm(along)
        t = (vertices - vertices[a]) @ along / length**2
        off = np.linalg.norm(vertices - vertices[a] - t[:, None] * along, axis=1)
        chain = np.flatnonzero((off < 1e-9 * length) & (t > -1e-9) & (t < 1 + 1e-9))
        chain = chain[np.argsort(t[chain])]
        for way in (chain, chain[::-1]):
            axes = set()
            for i, j in zip(way[:-1].tolist(), way[1:].tolist(), strict=True):
                f, k = sides[i, j]
                step = uv[f, (k + 1) % 3] - uv[f, k]
                axes |= {tuple((step == 0.0).tolist())}
            if not axes <= {(True, False), (False, True)} or (len(chain) == 2 and len(axes) != 1):
                bad.add((a, b))
    return bad


def check(vertices: np.ndarray, faces: np.ndarray, features: np.ndarray) -> ff.Parametrization:
    found = ff.field_aligned(vertices, faces, features=features)
    assert found.certificate.ok and found.certificate.feature_edges == len(features)
    named = {tuple(sorted(e)) for e in found.certificate.features_missed.tolist()}
    judged = missed(found, features, found.uv) | missed(found, features, found.uv32())
    assert judged == named
    again = ff.certify(
        found.vertices,
        found.faces,
        found.uv,
        features=features,
        seamless=True,
        parent=(vertices, faces, found.parent_face, found.vertex_parent, found.vertex_barycentric),
    )
    assert {tuple(sorted(e)) for e in again.features_missed.tolist()} == named
    assert again.ok == (not named)
    return found


@pytest.mark.parametrize("n", [2, 5])
@pytest.mark.parametrize("size", [(1.0, 1.0, 1.0), (2.0, 3.0, 5.0)])
def test_all_edges_of_a_box_are_isolines(n: int, size: tuple[float, float, float]) -> None:
    vertices, faces = cube(n)
    vertices = vertices * size
    features = sharp_edges(vertices, faces)
    assert len(features) == 12 * n
    found = check(vertices, faces, features)
    assert len(found.certificate.features_missed) == 0
    assert found.certificate.energy < 1.0 + 1e-6


def test_closed_and_dangling_features_of_a_torus_are_isolines() -> None:
    vertices, faces = torus(24, 12)
    ring = np.array([(i, (i + 1) % 24) for i in range(24)], np.int32)
    assert {tuple(sorted(e)) for e in ring.tolist()} <= set(map(tuple, edges_of(faces).tolist()))
    for features in (ring, ring[:5], ring[::3]):
        assert len(check(vertices, faces, features).certificate.features_missed) == 0


def test_faces_that_features_would_flatten_are_divided() -> None:
    """A prism whose caps have no vertices inside: triangles of three vertices on one side have no area in any map."""
    n, rings = 16, 5
    angle = 2 * np.pi * np.arange(n) / n
    vertices = np.array(
        [(np.cos(a), np.sin(a), z) for z in np.linspace(0, 2, rings) for a in angle]
    )
    grid = np.arange(n * rings).reshape(rings, n)
    low, high = grid[:-1], grid[1:]
    right, above = np.roll(low, -1, axis=1), np.roll(high, -1, axis=1)
    zigzag = np.array([i // 2 if i % 2 == 0 else n - 1 - i // 2 for i in range(n)])
    cap = np.sort(np.stack([zigzag[:-2], zigzag[1:-1], zigzag[2:]], axis=1), axis=1)
    faces = np.concatenate(
        [
            np.stack([low, right, above], -1).reshape(-1, 3),
            np.stack([low, above, high], -1).reshape(-1, 3),
            cap[:, ::-1],
            cap + n * (rings - 1),
        ]
    ).astype(np.int32)
    rims = sharp_edges(vertices, faces)
    assert len(rims) == 2 * n
    found = check(vertices, faces, rims)
    assert len(found.certificate.features_missed) == 0
    assert 0 < len(found.vertices) - len(vertices) <= 2 * (n - 3)


def test_edges_between_features_make_room_for_cones() -> None:
    """Caps fanned from one vertex of the rim have no vertex inside, where their cones could lie."""
    vertices, faces = prism(16, 2.0)
    rims = sharp_edges(vertices, faces, 40.0)
    assert len(rims) == 32
    found = check(vertices, faces, rims)
    assert len(found.certificate.features_missed) == 0
    assert found.stats["divided_between"] > 0
    # A field that is given is one of the faces as they are.
    field = ff.cross_field(vertices, faces, sharp_edges=rims, simplify=True)
    given = ff.field_aligned(vertices, faces, features=rims, field=field)
    assert len(given.certificate.features_missed) > 0


def test_details_do_not_turn_the_field_of_what_they_lie_on() -> None:
    """Diagonals, each shorter than a 64th of the box's edges, are named; the edges stay isolines."""
    vertices, faces = cube(24)
    edges = sharp_edges(vertices, faces)
    ends = edges_of(faces)
    along = np.abs(vertices[ends[:, 1]] - vertices[ends[:, 0]])
    slanted = ends[(along > 0).sum(axis=1) == 2]
    details = slanted[np.random.default_rng(3).permutation(len(slanted))[:40]]
    details = details[~np.isin(details, edges).any(axis=1)]
    assert len(details) > 20
    found = check(vertices, faces, np.concatenate([edges, details]).astype(np.int32))
    assert {tuple(e) for e in found.certificate.features_missed.tolist()} == {
        tuple(e) for e in np.sort(details, axis=1).tolist()
    }


@pytest.mark.parametrize("share", [0.3, 0.6, 0.9])
def test_what_meets_at_half_right_angles_is_named_edge_by_edge(share: float) -> None:
    vertices, faces = cut_corner(6, share)
    features = sharp_edges(vertices, faces)
    found = check(vertices, faces, features)
    assert len(found.certificate.features_missed) < 0.4 * len(features)


def test_random_edges_are_met_or_named() -> None:
    random = np.random.default_rng(5)
    vertices, faces = torus(16, 8)
    edges = edges_of(faces)
    for count in (1, 4, 12, 40):
        check(vertices, faces, random.permutation(edges)[:count].astype(np.int32))


def test_a_map_that_does_not_follow_features_fails_their_certificate() -> None:
    vertices, faces = cube(4)
    features = sharp_edges(vertices, faces)
    uv = ff.seamless(vertices, faces).uv
    turned = np.stack(
        [uv[..., 0] * 0.6 - uv[..., 1] * 0.8, uv[..., 0] * 0.8 + uv[..., 1] * 0.6], -1
    )
    certificate = ff.certify(vertices, faces, turned, features=features)
    assert not certificate.ok and len(certificate.features_missed) == len(features)
    assert certificate.failures[0].startswith("G8")


def test_of_a_mesh_with_doubled_faces_what_was_asked_for_is_counted() -> None:
    vertices, faces = cube(4)
    features = sharp_edges(vertices, faces)
    uv = ff.field_aligned(vertices, faces, features=features).uv
    turned = np.stack(
        [uv[..., 0] * 0.6 - uv[..., 1] * 0.8, uv[..., 0] * 0.8 + uv[..., 1] * 0.6], -1
    )
    again = np.concatenate([faces, faces[:40]])
    for values, missed in ((uv, 0), (turned, len(features))):
        doubled = np.concatenate([values, values[:40]])
        found = ff.certify(vertices, again, doubled, features=features)
        assert found.mends and found.feature_edges == len(features)
        assert len(found.features_missed) == missed


def test_features_that_are_no_edges_are_refused_by_name() -> None:
    vertices, faces = cube(2)
    far = int(np.argmax(np.linalg.norm(vertices - vertices[0], axis=1)))
    uv = ff.seamless(vertices, faces).uv
    for call in (
        lambda: ff.certify(vertices, faces, uv, features=[(0, far)]),
        lambda: ff.field_aligned(vertices, faces, features=[(0, far)]),
        lambda: ff.quads(vertices, faces, target=50, features=[(0, far)]),
    ):
        with pytest.raises(ff.InvalidInput) as caught:
            call()
        assert set(caught.value.elements) == {0, far} or str(far) in str(caught.value)
    with pytest.raises(ff.InvalidInput, match="optimise"):
        ff.field_aligned(vertices, faces, features=[(0, 1)], optimise=False)


def uncovered(mesh: ff.QuadMesh, vertices: np.ndarray, features: np.ndarray) -> float:
    """Share of the features' length that no quad edge runs along, by samples against all quad edges."""
    quads = mesh.quads
    ends = np.stack([quads, np.roll(quads, -1, axis=1)], -1).reshape(-1, 2)
    a, b = mesh.vertices[ends[:, 0]], mesh.vertices[ends[:, 1]]
    along = b - a
    lengths, off = 0.0, 0.0
    for i, j in features.tolist():
        length = float(np.linalg.norm(vertices[j] - vertices[i]))
        for t in (0.25, 0.5, 0.75):
            p = vertices[i] + t * (vertices[j] - vertices[i])
            s = np.clip(((p - a) * along).sum(1) / (along * along).sum(1), 0.0, 1.0)
            distance = np.linalg.norm(a + s[:, None] * along - p, axis=1).min()
            lengths += length
            off += length if distance > 1e-6 else 0.0
    return off / lengths


@pytest.mark.parametrize("target", [24, 150, 900])
def test_quads_have_edges_along_all_edges_of_a_box(target: int) -> None:
    vertices, faces = cube(5)
    vertices = vertices * (2.0, 3.0, 5.0)
    features = sharp_edges(vertices, faces)
    mesh = ff.quads(vertices, faces, target=target, features=features)
    assert mesh.certificate.ok and mesh.stats["features_missed"] == 0
    assert uncovered(mesh, vertices, features) == 0.0


def test_quads_have_edges_along_a_closed_feature_without_cones() -> None:
    vertices, faces = torus(24, 12)
    ring = np.array([(i, (i + 1) % 24) for i in range(24)], np.int32)
    mesh = ff.quads(vertices, faces, target=300, features=ring)
    assert mesh.certificate.ok and mesh.stats["features_missed"] == 0
    a, b = vertices[ring[:, 0]], vertices[ring[:, 1]]
    s = np.clip(((mesh.vertices[:, None] - a) * (b - a)).sum(-1) / ((b - a) ** 2).sum(-1), 0.0, 1.0)
    off = np.linalg.norm(mesh.vertices[:, None] - a - s[..., None] * (b - a), axis=-1).min(1)
    on = off < 1e-9
    ends = np.stack([mesh.quads, np.roll(mesh.quads, -1, axis=1)], -1).reshape(-1, 2)
    row = np.unique(np.sort(ends[on[ends].all(1)], axis=1), axis=0)
    assert on.sum() >= 3 and (np.bincount(row.ravel(), minlength=len(on)) == 2 * on).all()
