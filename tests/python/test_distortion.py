"""The stretch bound: what a certificate says is beyond it, against maps whose stretch is known."""

from __future__ import annotations

import numpy as np
import pytest

import flipfree as ff
from flipfree.distortion import BOUND_ENERGY, STRETCH_BOUND, energies

from surfaces import bumpy_grid, joined


def sheets(widths, heights):
    """((vertices, faces, uv) of unit squares side by side, each mapped to its width by its height."""
    square = np.array([(0, 0), (1, 0), (1, 1), (0, 1)], float)
    halves = np.array([(0, 1, 2), (0, 2, 3)])
    sizes = zip(widths, heights, strict=True)
    uv = [square[halves] * size + [3.0 * i, 0.0] for i, size in enumerate(sizes)]
    parts = [(np.c_[square + [2.0 * i, 0.0], np.zeros(4)], halves) for i in range(len(uv))]
    return *joined(*parts), np.concatenate(uv)


def test_a_map_of_stretch_s_has_the_energy_of_s():
    for stretch in (1.0, STRETCH_BOUND, 2.0, 9.0):
        mesh = sheets([stretch**0.5], [stretch**-0.5])
        found = ff.certify(*mesh)
        assert found.energy == pytest.approx((stretch + 1 / stretch) / 2, rel=1e-6)
        assert found.poor == (stretch > STRETCH_BOUND)
    assert 1.025 < BOUND_ENERGY < 1.05


def test_the_share_beyond_the_bound_is_by_area_and_the_islands_are_named_worst_first():
    vertices, faces, uv = sheets([1.0, 1.0, 2.0, 3.0], [1.0, 1.0, 0.5, 1 / 3])
    found = ff.certify(vertices, faces, uv)
    assert found.poor and found.stretched == pytest.approx(0.5)
    assert found.poor_islands.tolist() == [6, 4] and found.area == pytest.approx(4.0)
    large = ff.certify(vertices * 1e150, faces, uv)
    assert large.stretched == pytest.approx(0.5) and large.area == pytest.approx(4e300)
    assert "50 % of the surface is stretched beyond 1.25" in str(found)


@pytest.mark.parametrize(("others", "level"), [(20, 1), (120, 0)])
def test_a_stretched_island_counts_from_a_hundredth_of_the_surface_on(others, level):
    vertices, faces, uv = sheets([1.0] * others + [1.4], [1.0] * others + [1 / 1.4])
    found = ff.certify(vertices, faces, uv)
    assert found.level == level and found.stretched == pytest.approx(1 / (others + 1))
    assert found.poor_islands.tolist() == [2 * others]
    assert ("stretched" in str(found)) == found.poor == (level > 0)


def test_levels_are_by_the_mean_by_islands_and_by_triangles():
    assert [ff.certify(*sheets([s**0.5], [s**-0.5])).level for s in (1.2, 1.9, 2.1)] == [0, 1, 2]
    assert ff.certify(*sheets([1.0] * 9 + [2.0], [1.0] * 9 + [0.4])).level == 2
    vertices, faces, uv = sheets([1.0] * 40, [1.0] * 40)  # one triangle of a square of 80
    faces, uv = np.delete(faces, 1, 0), np.delete(uv, 1, 0)
    uv[0, 1] += [1.5, 0.0]
    found = ff.certify(vertices, faces, uv)
    assert found.level == 2 and "badly stretched" in str(found)


def test_needles_are_those_that_are_thin_on_the_surface_and_badly_stretched():
    vertices, faces, uv = sheets([1.0, 1.0], [1.0, 1.0])
    vertices[2] = [1.0, 1e-5, 0.0]
    found = ff.certify(vertices, faces, uv)
    assert found.needles == 1 and "1 needle: Merge by Distance or Limited Dissolve" in str(found)
    flat = vertices[faces][:, :, :2]
    assert ff.certify(vertices, faces, flat).needles == 0, "thin in the map as well"


@pytest.mark.parametrize("aspect", [1.0, 0.5, 3.0])
def test_energies_are_those_of_the_singular_values_at_the_median_scale(aspect):
    vertices, faces = bumpy_grid(9, 9)
    uv = (vertices[faces][:, :, :2] * [1.3, 0.9]).astype(np.float32)
    energy, area = energies(vertices, faces, uv, aspect)
    values, sizes = [], []
    for corner, plane in zip(vertices[faces], uv.astype(float) * [aspect, 1.0], strict=True):
        x, y = corner[1:] - corner[0]
        along = x / np.linalg.norm(x)
        across = np.cross(np.cross(x, y), along)
        across /= np.linalg.norm(across)
        flat = np.array([[x @ along, y @ along], [0.0, y @ across]])
        jacobian = (plane[1:] - plane[0]).T @ np.linalg.inv(flat)
        values.append(np.linalg.svd(jacobian)[1])
        sizes.append(np.linalg.norm(np.cross(x, y)) / 2)
    own = 1.0 / np.prod(values, axis=1)
    order = np.argsort(own)
    half = np.searchsorted(np.cumsum(np.array(sizes)[order]), np.sum(sizes) / 2)
    scaled = np.array(values) ** 2 * own[order[half]]
    expected = (scaled + 1 / scaled).sum(axis=1) / 4
    assert energy == pytest.approx(expected, rel=1e-9) and area == pytest.approx(np.array(sizes))
    found = ff.certify(vertices, faces, uv, aspect=aspect)
    assert found.stretched == area[energy > BOUND_ENERGY].sum() / area.sum()


def test_one_crushed_island_does_not_make_the_others_stretched():
    vertices, faces, uv = sheets([1.0] * 9 + [0.01], [1.0] * 10)
    found = ff.certify(vertices, faces, uv)
    assert found.poor and found.energy > 1.5
    assert found.stretched == pytest.approx(0.1) and found.poor_islands.tolist() == [18]


def test_faces_without_area_count_nowhere_in_space_and_as_stretched_in_the_map():
    vertices, faces, uv = sheets([1.0, 1.0], [1.0, 1.0])
    uv[0] = uv[0, 0]
    needle = np.vstack([faces, [0, 1, 1]])
    found = ff.certify(vertices, needle, np.concatenate([uv, np.zeros((1, 3, 2))]))
    assert found.stretched == pytest.approx(0.25) and found.flips32 >= 1


@pytest.mark.parametrize(("columns", "level"), [(80, 0), (40, 1)])
def test_a_few_faces_of_an_island_count_from_two_hundredths_on(columns, level):
    vertices, faces = bumpy_grid(columns, 4)
    vertices = vertices * [1.0, 1.0, 0.0]
    uv = vertices[faces][:, :, :2].copy()
    along = uv[..., 0]
    at = np.unique(along)
    uv[..., 0] = np.where(along > at[-2], at[-2] + 2.3 * (along - at[-2]), along)
    found = ff.certify(vertices, faces, uv)
    assert found.energy < BOUND_ENERGY and not len(found.poor_islands)
    assert found.level == level and found.stretched == pytest.approx(1 / columns, rel=1e-3)
