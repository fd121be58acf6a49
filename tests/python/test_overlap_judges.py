"""The certificate's verdict on overlaps is that of the slow judge (tests/judges), on maps of every kind."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

import flipfree as ff

from judges.comparison import GENERATORS, Verdict, compare, compare_mirrored, map_number
from judges.generators import inverted_slit
from judges.maps import grid, map_of
from sampling import sampled

MAPS = 170  # of each kind, of which a run takes
SAMPLE = 45


@cache
def verdicts(generator: str) -> dict[int, Verdict]:
    numbers = sampled(range(MAPS), SAMPLE, generator)
    return {number: compare(map_number(generator, 12, number)) for number in numbers}


@pytest.mark.parametrize("generator", list(GENERATORS))
def test_agrees_with_the_slow_judge(generator: str) -> None:
    wrong = {n: v.disagreements for n, v in verdicts(generator).items() if v.disagreements}
    assert not wrong, f"{len(wrong)} maps: map_number({generator!r}, 12, n) for {wrong}"


@pytest.mark.parametrize("generator", list(GENERATORS))
def test_mirrored_islands_are_judged_as_the_slow_judge_has_it(generator: str) -> None:
    numbers = sampled(range(MAPS), 8, generator)
    found = {n: compare_mirrored(map_number(generator, 12, n)) for n in numbers}
    wrong = {n: said for n, said in found.items() if said}
    assert not wrong, f"{len(wrong)} maps: map_number({generator!r}, 12, n) for {wrong}"


@pytest.mark.parametrize("generator", list(GENERATORS))
def test_most_maps_are_worth_judging(generator: str) -> None:
    """Overlaps are asked for on most of them, and both answers are there."""
    asked = [v for v in verdicts(generator).values() if v.qualified]
    assert len(asked) >= len(verdicts(generator)) * 2 // 3
    assert 0 < sum(v.covered_twice or v.islands > 0 for v in asked) < len(asked)


def test_a_slit_turned_inside_out_covers_points_twice() -> None:
    verdict = compare(inverted_slit())
    assert verdict.qualified and verdict.covered_twice and not verdict.touching
    assert not verdict.disagreements


@pytest.mark.parametrize(
    ("inverted", "claim"),
    [
        (True, {"overlaps": 0}),
        (False, {"overlaps": 1}),
        (False, {"island_overlaps": 1}),
        (False, {"flips32": 1}),
    ],
)
def test_a_wrong_certificate_is_found_out(
    inverted: bool, claim: dict[str, int], monkeypatch: pytest.MonkeyPatch
) -> None:
    map_ = inverted_slit() if inverted else map_of(grid(3, 3), np.random.default_rng(1))
    said = replace(ff.certify(map_.vertices, map_.faces, map_.uv), **claim)
    assert not compare(map_).disagreements
    monkeypatch.setattr(ff, "certify", lambda *_, **__: said)
    assert len(compare(map_).disagreements) == 1
