"""The slow judge and the certificate on one map after another."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np

import flipfree as ff

from .charts import charts_of
from .coverage import Coverage, coverage
from .exact import turns
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


def compare_mirrored(map_: PlaneMap) -> list[str]:
    """Disagreements on the map with every other chart mirrored: declared, found, and declared but for a face."""
    plain = ff.certify(map_.vertices, map_.faces, map_.uv, threads=1)
    charts = charts_of(map_.faces, map_.uv.astype(np.float32))
    declared = charts.face % 2 == 0
    uv = np.where(declared[:, None, None], map_.uv * [-1.0, 1.0], map_.uv)
    judge = coverage(map_.faces, uv.astype(np.float32))
    islands = max(len(judge.islands), len(coverage(map_.faces, uv).islands))
    said: list[str] = []

    def certify(mirrored: object) -> ff.Certificate:
        return ff.certify(map_.vertices, map_.faces, uv, mirrored=mirrored, threads=1)

    found = certify(declared.astype(int))
    for name in ("flips64", "flips32", "winding_failures", "overlaps", "energy"):
        _expect(said, name, getattr(found, name), getattr(plain, name))
    _expect(said, "island_overlaps", found.island_overlaps, islands)
    _expect(said, "mirrored_islands", found.mirrored_islands, (charts.count + 1) // 2)
    _expect(said, "flips32, none declared", certify(None).flips32, len(judge.flipped))
    points = uv.astype(np.float32).astype(np.float64)
    whole = ~np.isin(charts.face, charts.face[turns(*points.transpose(1, 0, 2)) >= 0])
    wrong = np.setxor1d(certify("islands").mirrored_faces, np.flatnonzero(whole))
    _expect(said, "faces found to be mirrored, or not", len(wrong), 0)
    several = np.flatnonzero(declared & (np.bincount(charts.face)[charts.face] > 1))
    if len(several):
        declared[several[0]] = False
        _expect(
            said,
            "ok with a face of a mirrored island that is none",
            certify(declared.astype(int)).ok,
            0,
        )
    return said


def _expect(said: list[str], name: str, certificate: int, judge: int) -> None:
    if certificate != judge:
        said.append(f"{name} is {certificate}, by the judge {judge}")


def _overwound_vertices(map_: PlaneMap, view: Coverage) -> set[int]:
    """As vertices of the mesh."""
    return set(map_.faces[np.isin(view.charts.corner, view.overwound)].tolist())
