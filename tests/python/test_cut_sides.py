"""Cuts whose two sides come to lie at the same place once rounded to 32 bits."""

from __future__ import annotations

import numpy as np
import pytest

import flipfree as ff


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
