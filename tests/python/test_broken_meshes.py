"""Nothing that has a meaning is refused: every face of any triangles is mapped, and the map is judged by other code."""

from __future__ import annotations

import numpy as np
import pytest
from broken_meshes import KINDS, broken_mesh, t_wall

import flipfree as ff

from judges.any_triangles import judge_any


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
