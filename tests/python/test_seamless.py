"""Properties of seamless maps over generated surfaces, by a judge that knows the UVs only."""

from __future__ import annotations

import numpy as np
import pytest

import flipfree as ff
from flipfree.calls.seamless import SeamlessMap, seamless, start_penner
from flipfree.job import run

from judges import holonomy
from surfaces import octahedron_sphere, torus


def random_cones(faces: np.ndarray, genus: int, count: int, seed: int) -> dict[int, int]:
    """Cones of 3 and 5 quarter turns whose sum fits a closed surface of this genus."""
    places = np.random.default_rng(seed).permutation(faces.max() + 1)[:count]
    sharp = (count + 8 - 8 * genus) // 2
    return {int(v): 3 if i < sharp else 5 for i, v in enumerate(places)}


def solve(
    vertices: np.ndarray, faces: np.ndarray, cones: dict[int, int], **options: object
) -> SeamlessMap:
    return run(start_penner(vertices, faces, cones, **options), None)


@pytest.mark.parametrize("seed", range(4))
@pytest.mark.parametrize("genus", [0, 1])
def test_turns_by_quarters_on_loops_that_the_solver_has_not_seen(genus: int, seed: int) -> None:
    vertices, faces = octahedron_sphere(3) if genus == 0 else torus()
    cones = random_cones(faces, genus, 16, seed)
    result = solve(vertices, faces, cones)
    assert result.map.certificate.ok
    assert result.seam_error < 1e-12
    basis = holonomy.random_homology_basis(result.map.faces, seed)
    assert len(basis) == 2 * genus
    judged = holonomy.judge(result.map.faces, result.map.uv64, cones, basis)
    assert judged.vertex_error < 1e-9
    assert judged.loop_error < 1e-9


def test_reported_loops_turn_as_reported() -> None:
    vertices, faces = torus()
    cones = random_cones(faces, 1, 12, 5)
    result = solve(vertices, faces, cones)
    assert len(result.map.faces) == len(faces)
    judged = holonomy.judge(faces, result.map.uv64, cones, [h.tolist() for h, _ in result.loops])
    assert judged.turns == [turns for _, turns in result.loops]


def test_prescribed_loops_are_met() -> None:
    vertices, faces = torus()
    cones = random_cones(faces, 1, 12, 5)
    loops = [(h, turns + 1) for h, turns in solve(vertices, faces, cones).loops]
    result = solve(vertices, faces, cones, loops=loops)
    assert [turns for _, turns in result.loops] == [turns for _, turns in loops]
    judged = holonomy.judge(
        result.map.faces,
        result.map.uv64,
        cones,
        holonomy.random_homology_basis(result.map.faces, 1),
    )
    assert judged.loop_error < 1e-9


@pytest.mark.parametrize("stored", [False, True])
def test_transitions_join_the_sides_of_every_cut_edge_exactly(stored: bool) -> None:
    vertices, faces = torus()
    map = seamless(vertices, faces, random_cones(faces, 1, 12, 3))
    certificate = map.certificate
    assert certificate.seam_edges == certificate.seams_exact64 == certificate.seams_exact32 > 0
    uv = map.uv32().astype(np.float64) if stored else map.uv64
    corner = {
        (int(f[k]), int(f[(k + 1) % 3])): (uv[i, k], uv[i, (k + 1) % 3])
        for i, f in enumerate(map.faces)
        for k in range(3)
    }
    assert len(map.cut_edges) == len(map.transitions.quarter_turns) > 0
    for (a, b), turns, shift in zip(
        map.cut_edges.tolist(),
        map.transitions.quarter_turns,
        map.transitions.translation,
        strict=True,
    ):
        turned = np.linalg.matrix_power(np.array([[0, -1], [1, 0]]), int(turns))
        first, second = corner[a, b], corner[b, a]
        assert (turned @ first[0] + shift == second[1]).all()
        assert (turned @ first[1] + shift == second[0]).all()


def test_several_components_are_one_map() -> None:
    a, b = torus(), octahedron_sphere(3)
    vertices = np.concatenate([a[0], b[0] + [10, 0, 0]])
    faces = np.concatenate([a[1], b[1] + len(a[0])])
    cones = random_cones(a[1], 1, 8, 2)
    cones |= {v + len(a[0]): k for v, k in random_cones(b[1], 0, 12, 4).items()}
    map = seamless(vertices, faces, cones)
    assert map.certificate.ok
    assert map.certificate.seams_exact32 == map.certificate.seam_edges > 0


def test_optimising_lowers_the_energy() -> None:
    vertices, faces = octahedron_sphere(4)
    cones = random_cones(faces, 0, 24, 7)
    plain = seamless(vertices, faces, cones, optimise=False)
    assert seamless(vertices, faces, cones).certificate.energy < plain.certificate.energy


def test_impossible_cones_are_refused_with_a_reason() -> None:
    vertices, faces = torus()
    with pytest.raises(ff.Infeasible, match="3 and 5"):
        seamless(vertices, faces, {0: 3, 7: 5})
    with pytest.raises(ff.Infeasible, match="Add 1 to"):
        seamless(vertices, faces, {0: 3})
    with pytest.raises(ff.InvalidInput, match="quarter turns"):
        seamless(vertices, faces, {0: 0, 7: 8})
    with pytest.raises(ff.InvalidInput, match="vertex 99999"):
        seamless(vertices, faces, {99999: 3})


def test_progress_can_cancel() -> None:
    vertices, faces = octahedron_sphere(5)
    with pytest.raises(ff.Cancelled):
        seamless(
            vertices, faces, random_cones(faces, 0, 50, 1), progress=lambda stage, fraction: False
        )
