"""ff.pack: charts into the unit square by similarities."""

from __future__ import annotations

import numpy as np
import pytest

import flipfree as ff

from judges.gaps import area
from surfaces import bumpy_grid


def two_sheets(second: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Two components and a map of each that is its x, y; the second's is scaled."""
    vertices, faces = bumpy_grid(8, 6)
    n = len(vertices)
    both = np.concatenate([vertices, vertices + [5, 0, 0]])
    faces = np.concatenate([faces, faces + n]).astype(np.int32)
    uv = both[faces][:, :, :2].copy()
    uv[len(faces) // 2 :] *= second
    return both, faces, uv


def test_components_that_stay_together_lie_side_by_side_in_the_unit_square() -> None:
    vertices, faces, uv = two_sheets(3.0)
    packed = ff.pack(vertices, faces, uv, together=True, margin=0.01)
    assert packed.certificate.ok and packed.uv.min() > 0.0 and packed.uv.max() < 1.0
    parts = [part.reshape(-1, 2) for part in np.split(packed.uv, 2)]
    low, high = [part.min(0) for part in parts], [part.max(0) for part in parts]
    assert max((low[1] - high[0]).max(), (low[0] - high[1]).max()) > 0.007


@pytest.mark.parametrize(("scale_true", "ratio"), [(True, 1.0), (False, 9.0)])
def test_scales_keep_their_ratio_or_follow_the_surface(scale_true: bool, ratio: float) -> None:
    vertices, faces, uv = two_sheets(3.0)
    packed = ff.pack(vertices, faces, uv, scale_true=scale_true)
    m = len(faces) // 2
    assert area(packed.uv[m:]) / area(packed.uv[:m]) == pytest.approx(ratio, rel=1e-6)


def test_charts_of_one_component_keep_their_rotations_only_together() -> None:
    vertices, faces = bumpy_grid(8, 6)
    uv = vertices[faces][:, :, :2].copy()
    left = uv[:, :, 0].mean(1) < np.median(uv[:, :, 0])
    # The second half is turned by a quarter and lies elsewhere: its own chart.
    uv[~left] = np.stack([-uv[~left][:, :, 1], uv[~left][:, :, 0]], -1) * 1.0 + [7.0, 3.0]
    packed = ff.pack(vertices, faces, uv, together=True).uv

    def turn(part: np.ndarray) -> complex:
        before = uv[part][:, 1] - uv[part][:, 0]
        after = packed[part][:, 1] - packed[part][:, 0]
        z = (after[:, 0] + 1j * after[:, 1]) / (before[:, 0] + 1j * before[:, 1])
        assert np.abs(z - z[0]).max() < 1e-9
        return complex(z[0])

    assert turn(left) == pytest.approx(turn(~left), abs=1e-9)
