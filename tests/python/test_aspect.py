"""aspect=...: textures that are no squares."""

from __future__ import annotations

import numpy as np
import pytest

import flipfree as ff

from surfaces import bumpy_grid, joined, signed_areas


def sheets(count: int = 6) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Bumpy sheets of several sizes, each a chart: its map is its x, y."""
    vertices, faces = bumpy_grid(6, 6)
    parts = [vertices * (1.0 + 0.3 * i) + [9.0 * i, 0, 0] for i in range(count)]
    both, triangles = joined(*((part, faces) for part in parts))
    return both, triangles, both[triangles][:, :, :2].copy()


@pytest.mark.parametrize("aspect", [2.0, 0.5, 16 / 9, 3 / 4])
def test_islands_keep_their_shape_on_the_texture_and_lie_in_the_unit_square(aspect: float) -> None:
    vertices, faces, _ = sheets()
    stretched = vertices[faces][:, :, :2] / [aspect, 1.0]  # right on a texture of that shape
    packed = ff.pack(vertices, faces, stretched, aspect=aspect, scale_true=True, margin=0.01)
    uv = packed.uv32().astype(np.float64)
    assert packed.certificate.ok and packed.certificate.island_overlaps == 0
    assert (signed_areas(uv) > 0).all() and uv.min() >= 0.0 and uv.max() <= 1.0
    assert packed.stats["tile"] == 0 and packed.stats["margin_met"]
    # In pixels: similar to the surface seen from above, all at one scale.
    pixels = uv * [aspect, 1.0]
    plane = vertices[faces][:, :, :2]
    long = np.linalg.norm(pixels - np.roll(pixels, 1, axis=1), axis=2)
    given = np.linalg.norm(plane - np.roll(plane, 1, axis=1), axis=2)
    ratio = long / given
    m = len(faces) // 6
    for i in range(6):
        part = ratio[i * m : (i + 1) * m]
        assert np.ptp(part) < 1e-4 * part.mean()
    # And as distorted as they are there, not as in the unit square.
    straight = ff.certify(vertices, faces, plane)
    assert packed.certificate.energy == pytest.approx(straight.energy, rel=1e-3)


def test_gaps_are_measured_in_pixels() -> None:
    vertices, faces, _ = sheets(4)
    uv = vertices[faces][:, :, :2] / [4.0, 1.0]
    size, pixels = 1024, 8.0
    packed = ff.pack(
        vertices,
        faces,
        uv,
        aspect=4.0,
        margin_pixels=pixels,
        texture_size=size,
        rotation="quarters",
    )
    at = packed.uv32().astype(np.float64) * [size, size / 4]  # the longer side has that many
    m = len(faces) // 4
    corners = [at[i * m : (i + 1) * m].reshape(-1, 2) for i in range(4)]
    for i in range(4):
        assert corners[i].min() >= 0.49 * pixels
        assert (corners[i].max(axis=0) <= [size - 0.49 * pixels, size / 4 - 0.49 * pixels]).all()
        for j in range(i):
            apart = np.linalg.norm(corners[i][:, None] - corners[j][None], axis=2)
            assert apart.min() >= pixels


def test_a_square_is_what_it_was() -> None:
    vertices, faces, uv = sheets()
    one, other = (ff.pack(vertices, faces, uv, **options) for options in ({}, {"aspect": 1.0}))
    assert one.uv32().tobytes() == other.uv32().tobytes()


def test_charts_that_stay_keep_their_bits_and_are_kept_clear_of() -> None:
    vertices, faces, uv = sheets(4)
    m = len(faces) // 4
    uv[:m] = 0.1 + 0.3 * (uv[:m] - uv[:m].min()) / np.ptp(uv[:m])
    uv[:m] = uv[:m].astype(np.float32)
    packed = ff.pack(vertices, faces, uv, aspect=16 / 9, unmoved=np.arange(3 * m))
    assert (packed.uv32()[:m] == uv[:m]).all()
    assert packed.certificate.island_overlaps == 0


def test_the_tile_is_where_it_was_asked_for() -> None:
    vertices, faces, uv = sheets(3)
    packed = ff.pack(vertices, faces, uv, aspect=2.0, tile=1012)
    assert packed.stats["tile"] == 11
    assert (np.floor(packed.uv32()) == 1.0).all()


def stretched_sheet() -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """A bumpy sheet with its own unwrap: right on a square texture."""
    vertices, faces = bumpy_grid(8, 8)
    return vertices, faces, ff.unwrap(vertices, faces, seams="given").uv


@pytest.mark.parametrize("aspect", [2.0, 0.5, 16 / 9])
def test_certify_measures_distortion_in_pixels_and_judges_the_values_themselves(
    aspect: float,
) -> None:
    vertices, faces, uv = stretched_sheet()
    seen = ff.certify(vertices, faces, uv / [aspect, 1.0], aspect=aspect)
    square = ff.certify(vertices, faces, uv)
    assert seen.energy == pytest.approx(square.energy, rel=1e-5)
    assert seen.max_energy == pytest.approx(square.max_energy, rel=1e-4)
    assert ff.certify(vertices, faces, uv / [aspect, 1.0]).energy > square.energy * 1.05
    assert seen.ok and seen.flips32 == 0 and seen.overlaps == 0


@pytest.mark.parametrize("aspect", [2.0, 16 / 9, 1 / 3])
def test_improve_ends_where_the_texture_shows_the_best_map(aspect: float) -> None:
    vertices, faces, uv = stretched_sheet()
    uv = 0.5 + 0.4 * (uv - 0.5)  # with room in its tile
    best = ff.improve((vertices, faces, uv)).certificate.energy
    found = ff.improve((vertices, faces, uv), aspect=aspect)
    assert found.certificate.ok
    assert found.certificate.energy == pytest.approx(best, rel=1e-3)
    again = ff.certify(vertices, faces, found.uv32().astype(np.float64), aspect=aspect)
    assert again.energy == pytest.approx(best, rel=1e-3)
    # It stays about its centre, and is no larger or smaller on the texture than it was.
    assert np.allclose(
        found.uv.reshape(-1, 2).mean(axis=0), uv.reshape(-1, 2).mean(axis=0), atol=0.05
    )
    assert signed_areas(found.uv).sum() == pytest.approx(signed_areas(uv).sum(), rel=0.1)


def test_improve_makes_what_would_leave_its_tile_smaller() -> None:
    vertices, faces, uv = stretched_sheet()
    found = ff.improve((vertices, faces, uv), aspect=2.0)
    assert found.certificate.ok and found.stats["left_tiles"] == 0
    assert 0 <= found.uv.min() and found.uv.max() <= 1
    assert signed_areas(found.uv).sum() < signed_areas(uv).sum()


def test_improve_meets_pins_bit_for_bit_on_any_texture() -> None:
    vertices, faces, uv = stretched_sheet()
    stored = uv.astype(np.float32).astype(np.float64)
    corners = [(int(f), 0) for f in (0, 40, 90)]
    pins = {corner: tuple(stored[corner]) for corner in corners}
    found = ff.improve((vertices, faces, stored), pins=pins, aspect=1920 / 1080)
    assert all((found.uv32()[corner] == np.float32(pins[corner])).all() for corner in corners)
    without = ff.certify(vertices, faces, stored, aspect=1920 / 1080)
    assert found.certificate.ok and found.certificate.energy < without.energy


@pytest.mark.parametrize("aspect", [2.0, 16 / 9])
def test_repair_leaves_what_is_right_and_shapes_what_it_makes_anew_for_the_texture(
    aspect: float,
) -> None:
    vertices, faces, uv = stretched_sheet()
    n, m = len(vertices), len(faces)
    both = np.concatenate([vertices, vertices + [5.0, 0.0, 0.0]])
    triangles = np.concatenate([faces, faces + n]).astype(np.int32)
    right = (uv / [aspect, 1.0]).astype(np.float32).astype(np.float64) / 4.0
    lost = np.full_like(right, np.nan)  # the second sheet has no places at all
    given = np.concatenate([right, lost])
    found = ff.repair(both, triangles, given, aspect=aspect)
    assert found.certificate.ok
    assert np.array_equal(found.uv[:m], right)
    assert found.stats["charts_anew"] == 1
    assert found.stats["corners_kept"] == 3 * m
    for part in (slice(0, m), slice(m, 2 * m)):
        alone = ff.certify(vertices, faces, found.uv32()[part].astype(np.float64), aspect=aspect)
        assert alone.energy < 1.1
    assert ff.repair(both, triangles, given).certificate.energy > 1.02
