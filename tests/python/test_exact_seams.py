"""What comes after an engine for seamless maps, and the certificate's G4 and G5, against a judge in rationals."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import flipfree as ff
from flipfree import _native

from judges.seams import seam_count
from judges.unfoldings import GENUS, SHAPES, Unfolding, unfolding

MAPS = 12  # of each shape; tests/judges/count_seams.py runs thousands


def exact(given: Unfolding, optimise: bool = True) -> dict[str, Any]:
    job = _native.exact_seams(
        given.vertices, given.faces, given.uv.reshape(-1, 2), given.cut_edges, optimise, 0.0, 2
    )
    assert job.wait(60.0)
    result: dict[str, Any] = job.result()
    return result


@pytest.mark.parametrize("shape", list(SHAPES))
def test_every_seam_edge_is_exact_in_64_and_in_32_bits(shape: str) -> None:
    for seed in range(MAPS):
        given = unfolding(SHAPES[shape], 2, seed)
        made = exact(given, seed % 3 > 0)
        certificate = ff.certify(given.vertices, given.faces, made["uv64"], seamless=True)
        assert certificate.ok, certificate
        for uv in (made["uv64"], made["uv32"]):
            judged = seam_count(given.faces, uv)
            assert judged.flipped == judged.torn == 0
            assert judged.edges == judged.exact == certificate.seams_exact64
            assert judged.cones == dict(certificate.quarter_cones.tolist())
            assert sum(4 - k for k in judged.cones.values()) == 8 - 8 * GENUS[shape]


def test_certificate_and_judge_agree_on_maps_that_are_not_exact() -> None:
    wrong = 0
    for seed in range(30):
        given = unfolding(SHAPES["bar"], 2, seed)
        certificate = ff.certify(given.vertices, given.faces, given.uv, seamless=True)
        judged = seam_count(given.faces, given.uv)
        assert (judged.edges, judged.exact) == (certificate.seam_edges, certificate.seams_exact64)
        stored = seam_count(given.faces, given.uv.astype(np.float32))
        assert stored.edges - stored.exact == certificate.seam_edges - certificate.seams_exact32
        assert not certificate.ok
        assert 0 < certificate.seam_deviation < 1e-12 * np.abs(given.uv).max()
        wrong += judged.edges - judged.exact
    assert wrong > 0


def test_cones_are_judged_exactly_where_the_map_is_seamless() -> None:
    given = unfolding(SHAPES["bar"], 2, 1)
    made = exact(given)
    cones = dict(
        ff.certify(given.vertices, given.faces, made["uv64"], seamless=True).quarter_cones.tolist()
    )
    angles = {v: k * np.pi / 2 for v, k in cones.items()}
    assert ff.certify(given.vertices, given.faces, made["uv64"], seamless=True, cones=angles).ok
    angles.pop(next(iter(angles)))
    missing = ff.certify(given.vertices, given.faces, made["uv64"], seamless=True, cones=angles)
    assert missing.cone_failures == 1


def test_the_figures_of_seams_are_not_measured_unless_asked_for() -> None:
    given = unfolding(SHAPES["cube"], 1, 0)
    certificate = ff.certify(given.vertices, given.faces, given.uv)
    assert certificate.seam_edges == certificate.seams_exact64 == certificate.seams_exact32 == -1
    assert np.isnan(certificate.seam_deviation)
    assert len(certificate.seam_vertices) == len(certificate.quarter_cones) == 0
