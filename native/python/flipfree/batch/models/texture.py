"""Textures that are no squares (--aspect): what commands make of maps for them."""

from __future__ import annotations

import argparse
from dataclasses import replace
from typing import Any

import numpy as np
import numpy.typing as npt

from ...calls.improving import improve
from ...calls.packing import pack
from ...results import Parametrization
from .. import numbers
from .model import Model


def argument(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "--aspect",
        type=numbers.aspect,
        default=1.0,
        metavar="W:H",
        help="of the texture, if it is no square: 2, 16:9, 2048x1024",
    )


def packed(model: Model, found: Parametrization, options: dict[str, Any]) -> Parametrization:
    """The islands of an unwrap, as the texture shows them."""
    packed = pack(
        model.vertices,
        model.faces,
        found.uv / [options["aspect"], 1.0],
        margin=options["margin"],
        scale_true=True,
        keep_bijective=not options["allow_overlaps"],
        effort=0.2,  # as unwrap itself packs
        aspect=options["aspect"],
        **model.limits,
    )
    return replace(
        found,
        uv=packed.uv,
        uv64=packed.uv64,
        _uv32=packed.uv32(),
        certificate=replace(packed.certificate, mends=found.certificate.mends),
        stats={**found.stats, "fill": packed.stats["fill"]},
    )


def of_pins(
    model: Model, met: Parametrization, held: npt.NDArray[np.bool_], options: dict[str, Any]
) -> Parametrization:
    """A map that met pins, with its shape on the texture as far as what is held leaves it open."""
    places = np.empty((len(met.vertices), 2))
    places[met.faces] = met.uv
    kept = np.flatnonzero(held).tolist()
    found = improve(
        met,
        pins=dict(zip(kept, map(tuple, places[kept].tolist()), strict=True)),
        keep_bijective=not options["allow_overlaps"],
        repair=False,
        aspect=options["aspect"],
        **model.limits,
    )
    return replace(
        met,
        uv=found.uv,
        uv64=found.uv64,
        _uv32=found.uv32(),
        certificate=replace(
            found.certificate, provenance_failures=met.certificate.provenance_failures
        ),
    )
