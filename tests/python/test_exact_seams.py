"""The certificate's G4 and G5 against a judge in rationals."""

from __future__ import annotations

import numpy as np

import flipfree as ff

from judges.seams import seam_count
from judges.unfoldings import SHAPES, unfolding
from surfaces import octahedron_sphere


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
    vertices, faces = octahedron_sphere(2)
    map = ff.seamless(vertices, faces)
    cones = dict(map.certificate.quarter_cones.tolist())
    assert cones == seam_count(faces, map.uv64).cones
    angles = {v: k * np.pi / 2 for v, k in cones.items()}
    assert ff.certify(vertices, faces, map.uv64, seamless=True, cones=angles).ok
    angles.pop(next(iter(angles)))
    missing = ff.certify(vertices, faces, map.uv64, seamless=True, cones=angles)
    assert missing.cone_failures == 1
