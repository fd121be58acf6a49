"""Any triangles as a clean surface, and solvers that want one on meshes that are none: nothing that has a meaning is refused,
and the map is judged by other code."""

from __future__ import annotations

import re

import numpy as np
import numpy.typing as npt
import pytest
from broken_meshes import KINDS, broken_mesh, t_wall

import flipfree as ff

from judges.any_triangles import judge_any
from judges.exact import turns
from surfaces import bumpy_grid


def fin():
    """A sheet (faces 0 to 31) on which a fin (32 to 39) stands, every third face turned over."""
    vertices, faces = bumpy_grid(4, 4)
    spine = [v for v, p in enumerate(vertices) if abs(p[0] - np.median(vertices[:, 0])) < 1e-9]
    spine.sort(key=lambda v: vertices[v, 1])
    n = len(vertices)
    top = vertices[spine] + [0.0, 0.0, 0.5]
    fin_faces = []
    for k in range(4):
        a, b, c, d = spine[k], spine[k + 1], n + k + 1, n + k
        fin_faces += [(a, b, c), (a, c, d)]
    faces = np.vstack([faces, fin_faces]).astype(np.int64)
    faces[1::3] = faces[1::3, [0, 2, 1]]
    return np.vstack([vertices, top]), faces


@pytest.mark.parametrize("kind", KINDS, ids=lambda kind: kind.__name__)
def test_whatever_the_mesh_the_surface_is_clean(kind) -> None:
    vertices, faces = kind(np.random.default_rng(3))
    clean = ff.separate(vertices, faces)
    again = ff.separate(clean.vertices, clean.faces)
    assert again.mends == ()
    assert np.array_equal(again.faces, clean.faces)
    named = clean.vertex_origin[clean.faces]
    named[clean.turned] = named[clean.turned][:, [0, 2, 1]]
    assert np.array_equal(named, np.asarray(faces)[clean.face_origin])
    missing = np.setdiff1d(np.arange(len(faces)), clean.face_origin)
    assert np.array_equal(missing, clean.collapsed)


def test_a_clean_surface_stays_as_it_is() -> None:
    vertices, faces = bumpy_grid(3, 3)
    clean = ff.separate(vertices, faces)
    assert clean.mends == ()
    assert np.array_equal(clean.vertices, vertices)
    assert np.array_equal(clean.faces, faces)


def test_pins_cones_and_seams_go_to_every_copy() -> None:
    vertices, faces = fin()
    clean = ff.separate(vertices, faces)
    spine = faces[32, np.argmin(vertices[faces[32], 2])]
    copies = clean.copies({int(spine): "here"})
    assert sorted(copies) == np.flatnonzero(clean.vertex_origin == spine).tolist()
    assert len(copies) == 2
    uv = np.random.default_rng(1).random((len(faces), 3, 2))
    corners = clean.corners(uv)
    for f, o in enumerate(clean.face_origin):
        at = {int(v): tuple(p) for v, p in zip(faces[o], uv[o], strict=True)}
        for v, p in zip(clean.vertex_origin[clean.faces[f]].tolist(), corners[f], strict=True):
            assert at[v] == tuple(p)
    ends = clean.vertex_origin[clean.edges(faces[:1, :2])]
    assert {frozenset(pair) for pair in ends.tolist()} == {frozenset(faces[0, :2].tolist())}
    assert len(clean.edges(np.zeros((0, 2), int))) == 0


def against(faces: npt.NDArray[np.int64], some: npt.NDArray[np.bool_]) -> npt.NDArray[np.int64]:
    """With some of them wound against the others."""
    return np.where(some[:, None], faces[:, [0, 2, 1]], faces)


def test_stray_faces_are_turned_and_counted() -> None:
    vertices, faces = bumpy_grid(12, 12)
    stray = against(faces, np.isin(np.arange(len(faces)), [50, 51, 120]))
    found = ff.unwrap(vertices, stray)
    assert found.certificate.turned == ff.certify(vertices, stray, found.uv).turned == 3
    assert "flips 0 (64-bit) 0 (32-bit), 3 faces turned over, overlaps 0" in str(found.certificate)
    assert len(judge_any(stray, found.uv)) == 0


def test_whole_pages_are_turned_and_counted() -> None:
    vertices, faces = bumpy_grid(12, 12)
    right = vertices[faces][:, :, 0].mean(axis=1) > np.median(vertices[:, 0])
    pages = against(faces, right)
    found = ff.unwrap(vertices, pages, seams="given")
    assert found.certificate.turned == ff.certify(vertices, pages, found.uv).turned == right.sum()
    assert ff.separate(vertices, pages).turned.sum() == right.sum() == len(faces) // 2
    assert f"{right.sum()} faces turned over" in str(found.certificate)


@pytest.mark.parametrize("first", range(0, 48, 12))
def test_certificates_of_one_map_agree_about_windings(first: int) -> None:
    for seed in range(first, first + 12):
        _, (vertices, faces) = broken_mesh(seed)
        cuts = np.sort(faces[::7, :2], axis=1)
        cuts = cuts[cuts[:, 0] < cuts[:, 1]] if seed % 2 else None
        found = ff.unwrap(vertices, faces, cuts=cuts)
        again = ff.certify(vertices, faces, found.uv)
        assert again.ok
        for word in ("wound against", "one side"):
            own, read = (
                [(m.what, m.count, m.elements.tolist()) for m in c.mends if word in m.what]
                for c in (found.certificate, again)
            )
            assert own == read, seed
        # What is turned over runs clockwise in its own winding.
        solid = np.array([len(set(face)) == 3 for face in faces.tolist()], bool)
        assert (turns(*np.moveaxis(found.uv[solid], 1, 0)) < 0).sum() == again.turned


def test_a_refined_map_comes_back_on_the_input() -> None:
    vertices, faces = fin()
    faces = np.vstack([faces[:32], [(0, 0, 1)]])  # without the fin; a face that uses a vertex twice
    clean = ff.separate(vertices[:25], faces)
    assert clean.collapsed.tolist() == [32]
    # Pins that turn the middle round: no map on the given triangles meets them.
    inner = [v for v in range(25) if (np.abs(vertices[v, :2] - vertices[12, :2]) < 0.3).all()]
    boundary = [v for v in range(25) if v not in inner]
    targets = {v: (float(vertices[v, 0]), float(vertices[v, 1])) for v in boundary}
    middle = vertices[12, :2]
    targets |= {v: tuple((2 * middle - vertices[v, :2]).tolist()) for v in inner if v != 12}
    solved = ff.match(clean.vertices, clean.faces, points=clean.copies(targets))
    assert len(solved.vertices) > len(clean.vertices)
    result = clean.on_input(solved)
    assert np.array_equal(result.vertices[:25], vertices[:25])
    assert {mend.what for mend in result.certificate.mends} >= {"faces wound against their part"}
    # Every triangle lies in its parent, with the parent's winding.
    for f in range(len(result.faces)):
        parent = faces[result.parent_face[f]]
        if len(set(parent.tolist())) < 3:
            continue
        normal = [
            np.cross(p[1] - p[0], p[2] - p[0])
            for p in (result.vertices[result.faces[f]], vertices[parent])
        ]
        assert np.dot(*normal) > 0
    for v in range(len(result.vertices)):
        parent = result.vertex_parent[v]
        place = result.vertex_barycentric[v] @ vertices[faces[parent]]
        assert np.allclose(place, result.vertices[v], atol=1e-12)
    assert judge_any(result.faces, result.uv32(), disjoint=False) == []
    pinned = result.uv32()[result.faces == 0]
    assert (pinned == np.float32(targets[0])).all()


def test_meshes_without_meaning_are_refused_by_name() -> None:
    with pytest.raises(ff.InvalidInput, match="nothing to map"):
        ff.separate(np.eye(3), [(0, 0, 1)])
    with pytest.raises(ff.InvalidInput, match="finite"):
        ff.separate(np.full((3, 3), np.nan), [(0, 1, 2)])
    with pytest.raises(ff.InvalidInput, match="materials"):
        ff.separate(np.eye(3), [(0, 1, 2)], materials=[1, 2])


def test_materials_decide_between_faces_at_equal_angles() -> None:
    corner = [(np.cos(a), np.sin(a)) for a in np.arange(3) * 2 * np.pi / 3]
    vertices = [(0, 0, 0), (0, 0, 1), *[(x, y, 0) for x, y in corner]]
    faces = [(0, 1, 2), (0, 1, 3), (0, 1, 4)]
    for materials in ([0, 0, 1], [0, 1, 0], [1, 0, 0]):
        result = ff.unwrap(vertices, faces, materials=materials, seams="given")
        pairs = [
            (a, b)
            for a in range(3)
            for b in range(a)
            if np.array_equal(result.uv[a, :2], result.uv[b, :2])
        ]
        ((a, b),) = pairs
        assert materials[a] == materials[b]


def quads_with_spikes(seed: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Vertices, triangles and their polygons: a torus of quads with some turned over, triangles that stand on sides, doubles."""
    random = np.random.default_rng(seed)
    n, m = (int(k) for k in random.integers(4, 9, 2))
    grid = [[i * m + j for j in range(m)] for i in range(n)]
    polygons = [
        [grid[i][j], grid[(i + 1) % n][j], grid[(i + 1) % n][(j + 1) % m], grid[i][(j + 1) % m]]
        for i in range(n)
        for j in range(m)
    ]
    i, j = np.divmod(np.arange(n * m), m)
    a, b = 2 * np.pi * i / n, 2 * np.pi * j / m
    points = [
        *np.stack([(2 + np.cos(b)) * np.cos(a), (2 + np.cos(b)) * np.sin(a), np.sin(b)], axis=1)
    ]
    for _ in range(random.integers(1, 8)):
        face = polygons[random.integers(len(polygons))]
        polygons.append([face[0], face[1], len(points)])
        points.append(points[face[0]] + random.random(3))
    polygons += [list(polygons[k]) for k in random.integers(0, n * m, 2)]
    triangles, polygon = [], []
    for k, corners in enumerate(polygons):
        turn = int(random.integers(len(corners)))
        corners = corners[turn:] + corners[:turn]
        if random.random() < 0.3:
            corners = corners[::-1]
        for t in range(1, len(corners) - 1):
            triangles.append([corners[0], corners[t], corners[t + 1]])
            polygon.append(k)
    return np.array(points), np.array(triangles), np.array(polygon)


@pytest.mark.parametrize("seed", range(20))
def test_polygons_stay_in_one_piece(seed) -> None:
    vertices, faces, polygon = quads_with_spikes(seed)
    clean = ff.separate(vertices, faces, polygons=polygon)
    for k in np.unique(polygon):
        mates = clean.faces[polygon[clean.face_origin] == k]
        assert all(len(set(a) & set(b)) == 2 for a, b in zip(mates, mates[1:], strict=False))
    ends = np.sort(np.concatenate([faces[:, e] for e in ((0, 1), (1, 2), (2, 0))]), axis=1)
    rows = np.column_stack([np.tile(polygon, 3), ends])
    distinct, times = np.unique(rows, axis=0, return_counts=True)
    result = ff.unwrap(
        vertices, faces, uncuttable=distinct[times > 1][:, 1:], polygons=polygon, seams="given"
    )
    assert result.certificate.ok
    places: dict[tuple[int, int], bytes] = {}
    for f, k in enumerate(polygon.tolist()):
        for corner, vertex in enumerate(faces[f].tolist()):
            place = result.uv32()[f, corner].tobytes()
            assert places.setdefault((k, vertex), place) == place


def test_polygons_need_one_number_per_face() -> None:
    with pytest.raises(ff.InvalidInput, match="polygons"):
        ff.separate(np.eye(3), [(0, 1, 2)], polygons=[1, 2])
    with pytest.raises(ff.InvalidInput, match="polygons"):
        ff.unwrap(np.eye(3), [(0, 1, 2)], polygons=[1, 2], seams="given")


def test_faces_that_were_turned_over_by_mistake_still_go_with_their_neighbours() -> None:
    # A strip of quads, every other one turned over, with a triangle that stands on a side between two and runs as one of them.
    x = np.arange(4.0)
    vertices = np.array([(a, b, 0.0) for a in x for b in (0.0, 1.0)] + [(1.0, 0.5, 1.0)])
    quads = [[0, 2, 3, 1], [3, 2, 4, 5][::-1], [4, 6, 7, 5]]
    faces = np.array([f for a, b, c, d in quads for f in ((a, b, c), (a, c, d))] + [(3, 2, 8)])
    clean = ff.separate(vertices, faces)
    strip = clean.faces[clean.face_origin < 6]
    assert len(np.unique(strip)) == 8  # in one piece
    assert len(np.unique(clean.faces)) == 11


def test_a_signature_is_judged_by_the_ids_of_the_mesh_as_given() -> None:
    angles = np.arange(6) * (np.pi / 3.0)
    vertices = np.zeros((7, 3))
    vertices[1:, 0], vertices[1:, 1] = np.cos(angles), np.sin(angles)
    # The first face uses a vertex twice, so that the surface which is judged has other ids.
    faces = np.array([[0, 1, 0]] + [[0, i + 1, (i + 1) % 6 + 1] for i in range(6)])
    uv = vertices[faces][:, :, :2]

    def judged(strip: list[int], turns: int) -> ff.Certificate:
        return ff.certify(vertices, faces, uv, signature=ff.Signature({}, [(strip, turns)]))

    assert judged([1, 2, 3, 4, 5, 6], 4).ok
    wrong = judged([1, 2, 3, 4, 5, 6], 3)
    assert not wrong.ok and wrong.failures[0].endswith("through face 1")
    assert list(wrong.failed_faces) == [1]
    assert not judged([0, 0, 0], -1).ok
    alone = ff.certify(vertices, faces[:1], uv[:1], signature=ff.Signature({}, [([0, 0, 0], -1)]))
    assert not alone.ok


def moebius(rows: int, columns: int = 24) -> tuple[npt.NDArray[np.float64], npt.NDArray[np.int32]]:
    """Wound one way but for the last column, whose right side is the first column's left one upside down."""
    sheet, faces = bumpy_grid(columns, rows, 0.0)
    angle, across = 2 * np.pi * sheet[:, 0], sheet[:, 1] - 0.5
    radius = 2.0 + across * np.cos(angle / 2)
    last = faces % (columns + 1) == columns
    faces[last] = (rows - faces[last] // (columns + 1)) * (columns + 1)
    used, faces = np.unique(faces, return_inverse=True)
    points = np.column_stack(
        [radius * np.cos(angle), radius * np.sin(angle), across * np.sin(angle / 2)]
    )
    return points[used], faces.reshape(-1, 3).astype(np.int32)


@pytest.mark.parametrize("rows", [1, 4])
@pytest.mark.parametrize("fins", [0, 1, 2])
def test_a_surface_with_one_side_is_cut_where_its_windings_contradict(rows: int, fins: int) -> None:
    vertices, faces = moebius(rows)
    for z in (1.0, -1.0)[:fins]:  # at an edge of the cut, which is said to have many faces only
        vertices = np.vstack([vertices, [2.0, 0.0, z]])
        faces = np.vstack([faces, [[0, 24, len(vertices) - 1]]])
    result = ff.unwrap(vertices, faces, seams="given")
    assert result.certificate.ok
    found = {mend.what: mend.count for mend in result.certificate.mends}
    assert found.pop("edges cut, as the surface has one side only", 0) == rows - (fins > 0)
    assert found == ({"edges with more than two faces": 1} if fins else {})


def slow_islands(faces: list[list[int]], uv: npt.NDArray[np.float32]) -> list[int]:
    """As the contract says it."""
    label = list(range(len(faces)))
    places = [
        dict(zip(face, map(tuple, own), strict=True)) for face, own in zip(faces, uv, strict=True)
    ]
    joined = [
        (f, g)
        for f in label
        for g in range(f)
        if sum(v in places[g] and places[g][v] == place for v, place in places[f].items()) > 1
    ]
    while any(label[f] != label[g] for f, g in joined):
        for f, g in joined:
            label[f] = label[g] = min(label[f], label[g])
    return label


def test_islands_agree_with_slow_code() -> None:
    for seed in range(300):
        random = np.random.default_rng(seed)
        faces = [random.permutation(7)[:3].tolist() for _ in range(random.integers(1, 15))]
        uv = np.stack([np.array(faces), random.integers(0, 2, (len(faces), 3))], -1)
        uv = uv.astype(np.float32)
        assert ff.islands(faces, uv)[0].tolist() == slow_islands(faces, uv)


def said(call) -> str:
    try:
        return "\n".join(call().failures)
    except ff.FlipfreeError as error:
        return f"{error} {error.kind} {list(error.elements)}"


def one_flipped(vertices, faces) -> np.ndarray:
    uv = vertices[faces][:, :, :2].copy()
    uv[-3] = uv[-3, [0, 2, 1]]
    return uv


#: (vertices, faces, by how much vertices are counted on, by how much faces are) -> an error, or a certificate that fails
WRONG = {
    "pins at one point": lambda v, f, a, b: ff.unwrap(v, f, pins={20 + a: (0, 0), 30 + a: (0, 0)}),
    "pins of one vertex": lambda v, f, a, b: ff.unwrap(
        v, f, pins={(10 + b, 0): (0, 0), (11 + b, 0): (1, 1), (12 + b, 0): (1, 0)}
    ),
    "no edge": lambda v, f, a, b: ff.unwrap(v, f, cuts=[[a, 40 + a]]),
    "no edge among polygons": lambda v, f, a, b: ff.unwrap(
        v, f, uncuttable=[[8 + a, 30 + a]], seams="auto"
    ),
    "a pin too far": lambda v, f, a, b: ff.improve(
        (v, f, v[f][:, :, :2]), pins={20 + a: (0, 0), 21 + a: (0, 0)}
    ),
    "repaired pins": lambda v, f, a, b: ff.repair(
        v, f, one_flipped(v, f), pins={20 + a: (0, 0), 30 + a: (0, 0)}
    ),
    "a bad map": lambda v, f, a, b: ff.certify(
        v, f, one_flipped(v, f), pins={20 + a: (5, 5)}, cones={24 + a: 3}
    ),
}


@pytest.mark.parametrize("name", WRONG)
def test_what_is_wrong_is_said_in_the_users_own_numbers(name) -> None:
    vertices, faces = bumpy_grid(6, 6)
    before = said(lambda: WRONG[name](vertices, faces, 0, 0))
    unused = np.arange(12.0).reshape(4, 3)
    more = np.concatenate([[[4, 4, 5]] * 2, faces + 4])
    after = said(lambda: WRONG[name](np.concatenate([unused, vertices]), more, 4, 2))

    def counted_on(found: re.Match[str]) -> str:
        by = 2 if "face" in found[0] else 4
        return re.sub(r"\d+", lambda n: str(int(n[0]) + by), found[0])

    ids = r"(?:vert(?:ex|ices)|face) (?:\d+(?: and )?)+|(?:vertex|edge|face) \[.*\]"
    assert before
    assert after == re.sub(ids, counted_on, before, flags=re.IGNORECASE)


def solid(faces: np.ndarray) -> int:
    return sum(len(set(face)) == 3 for face in faces.tolist())


@pytest.mark.sample(48)
@pytest.mark.parametrize("seed", range(8 * len(KINDS)))
def test_every_face_of_a_broken_mesh_is_mapped(seed: int) -> None:
    kind, (vertices, faces) = broken_mesh(seed)
    result = ff.unwrap(vertices, faces, max_seconds=60, seams="given")
    assert result.certificate.ok
    assert result.certificate.triangles == solid(faces), kind
    assert np.array_equal(result.faces, faces) and np.array_equal(result.vertices, vertices)
    assert judge_any(faces, result.uv32()) == []
    assert judge_any(faces, result.uv) == []


def test_a_t_wall_keeps_its_flat_wall_as_one_island() -> None:
    for seed in range(20):
        vertices, faces = t_wall(np.random.default_rng(seed))
        result = ff.unwrap(vertices, faces, seams="given")
        assert result.stats["charts"] == 2
        assert result.certificate.energy == pytest.approx(1.0, abs=1e-6)
        assert "more than two faces" in result.certificate.mends[0].what


def test_mends_name_what_they_are_about() -> None:
    vertices = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [0.5, 0, 0], [1, 1, 0.0]])
    faces = np.array([[0, 1, 2], [0, 2, 3], [0, 2, 3], [0, 4, 1], [1, 5, 2], [3, 3, 0]])
    result = ff.unwrap(vertices, faces, seams="given")
    mends = {mend.what: mend for mend in result.certificate.mends}
    assert mends["duplicate faces"].elements.tolist() == [2]
    assert mends["faces without area, or thinner than 1e-8 of their length"].elements.tolist() == [
        3
    ]
    assert mends["edges of length zero"].elements.tolist() == [2, 5]
    assert mends["faces that use a vertex twice"].elements.tolist() == [5]
    assert mends["edges with more than two faces"].kind == "edge"
    assert all(
        mend.count * (2 if mend.kind == "edge" else 1) == len(mend.elements)
        for mend in mends.values()
    )
    assert "separated: " in str(result.certificate)


def test_a_mesh_of_faces_without_area_is_mapped_all_the_same() -> None:
    vertices = np.array([[0.0, 0, 0], [1, 0, 0], [2, 0, 0], [3, 0, 0]])
    faces = np.array([[0, 1, 2], [1, 3, 2]])
    result = ff.unwrap(vertices, faces, seams="given")
    assert result.certificate.ok and judge_any(faces, result.uv32()) == []
    assert result.certificate.energy == -1.0
    point = ff.unwrap(np.zeros((3, 3)), np.array([[0, 1, 2]]), seams="given")
    assert point.certificate.ok and judge_any([[0, 1, 2]], point.uv32()) == []


def test_a_foreign_map_of_a_broken_mesh_is_judged_face_by_face() -> None:
    vertices, faces = t_wall(np.random.default_rng(3))
    result = ff.unwrap(vertices, faces, seams="given")
    uv = np.array(result.uv)
    # A vertex of the map is thrown across the facing edge of its first face.
    across = uv[0, 1] + uv[0, 2] - uv[0, 0]
    uv[(uv == uv[0, 0]).all(-1)] = across
    bad = ff.certify(vertices, faces, uv)
    assert not bad.ok and bad.flips32 >= 1 and 0 in bad.failed_faces
    assert judge_any(faces, uv) != []


def test_pins_and_seams_of_a_broken_mesh_are_kept() -> None:
    vertices, faces = t_wall(np.random.default_rng(1))
    corner = (0, 1)
    result = ff.unwrap(vertices, faces, pins={corner: (0.25, 0.5)}, cuts=faces[:1, :2])
    assert tuple(result.uv64[corner]) == (0.25, 0.5)
    with pytest.raises(ff.InvalidInput, match="not an edge"):
        ff.unwrap(vertices, faces, cuts=[[0, len(vertices) - 1]], seams="given")


def two_quads(gap: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """A strip of two quads, cut in the middle; the right one lies `gap` further to the right."""
    vertices = np.array([[x, y, 0.0] for y in (0, 1) for x in (0, 1, 2)])
    faces = np.array([[0, 1, 4], [0, 4, 3], [1, 2, 5], [1, 5, 4]])
    uv = vertices[faces][:, :, :2] * 0.25 + 0.5
    uv[2:, :, 0] += gap
    return vertices, faces, uv


def test_sides_that_stay_apart_do_not_meet() -> None:
    certificate = ff.certify(*two_quads(1e-6), bijective=True, disjoint=True)
    assert certificate.ok and certificate.overlaps == 0


@pytest.mark.parametrize("gap", [1e-9, 1e-12, 1e-16])
def test_sides_that_coincide_once_stored_are_no_cut_there(gap: float) -> None:
    vertices, faces, uv = two_quads(gap)
    stored = uv.astype(np.float32)
    assert (stored[0, 1] == stored[2, 0]).all() and (stored[0, 2] == stored[3, 2]).all()
    certificate = ff.certify(vertices, faces, uv, bijective=True, disjoint=True)
    assert certificate.flips64 == certificate.flips32 == 0
    assert certificate.ok, str(certificate)
    assert ff.certify(vertices, faces, stored, bijective=True, disjoint=True).ok


def test_sides_that_cross_overlap() -> None:
    assert not ff.certify(*two_quads(-1e-3), bijective=True, disjoint=True).ok
