"""The slow judge and the certificate on one map after another."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np

import flipfree as ff

from .coverage import Coverage, coverage
from .generators import coverings, islands, slits
from .maps import PlaneMap, Random
from .mutations import mutations

Generator = Callable[[Random], PlaneMap]
GENERATORS: dict[str, Generator] = {g.__name__: g for g in (slits, coverings, islands, mutations)}


@dataclass
class Verdict:
    """Of one map, as given and as stored, whichever is worse."""

    # All triangles positive, winding once around inner vertices: overlaps are asked for.
    qualified: bool = False
    covered_twice: bool = False  # the judge's: a chart covers a point twice
    touching: bool = False  # the judge's: a chart's boundary meets itself
    refused: bool = False  # the certificate's: overlaps > 0
    islands: int = 0  # the judge's: pairs of charts
    islands_measured: bool = False
    disagreements: list[str] = field(default_factory=list)


def map_number(generator: str, seed: int, number: int) -> PlaneMap:
    """Always the same map for the same generator, seed and number."""
    return GENERATORS[generator](
        np.random.default_rng([seed, list(GENERATORS).index(generator), number])
    )


def compare(map_: PlaneMap) -> Verdict:
    certificate = ff.certify(map_.vertices, map_.faces, map_.uv, threads=1)
    # Each cut by its own values: sides of a cut that rounding makes equal are joined in what is stored.
    given = coverage(map_.faces, map_.uv)
    stored = coverage(map_.faces, map_.uv.astype(np.float32))
    said: list[str] = []
    islands = max(len(given.islands), len(stored.islands))
    measured = getattr(certificate, "island_overlaps", -1)
    if measured >= 0:
        _expect(said, "island_overlaps", measured, islands)
    verdict = Verdict(islands=islands, islands_measured=measured >= 0, disagreements=said)
    _expect(said, "flips64", certificate.flips64, len(given.flipped))
    _expect(said, "flips32", certificate.flips32, len(stored.flipped))
    if len(given.flipped) or len(stored.flipped):
        return verdict
    wound = _overwound_vertices(map_, given) | _overwound_vertices(map_, stored)
    _expect(said, "winding_failures", certificate.winding_failures, len(wound))
    if wound:
        return verdict

    verdict.qualified = True
    verdict.covered_twice = len(given.within) + len(stored.within) > 0
    verdict.touching = len(given.touching) + len(stored.touching) > 0
    verdict.refused = certificate.overlaps > 0
    if verdict.covered_twice and not verdict.refused:
        said.append(f"a chart covers a point twice, overlaps is {certificate.overlaps}")
    if not verdict.covered_twice and not verdict.touching and certificate.overlaps != 0:
        said.append(
            f"no chart covers a point twice or touches itself, overlaps is {certificate.overlaps}"
        )
    return verdict


def _expect(said: list[str], name: str, certificate: int, judge: int) -> None:
    if certificate != judge:
        said.append(f"{name} is {certificate}, by the judge {judge}")


def _overwound_vertices(map_: PlaneMap, view: Coverage) -> set[int]:
    """As vertices of the mesh."""
    return set(map_.faces[np.isin(view.charts.corner, view.overwound)].tolist())
