"""Where unwraps of the command line cut: the rule is the package's (``flipfree.unwrap``), here are its options."""

from __future__ import annotations

import argparse

from ..calls.unwrapping import SEAMS
from ..maps.distortion import STRETCH_BOUND
from . import numbers


def arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "--seams",
        choices=("auto", "given"),
        default=SEAMS,
        help="auto: also where islands are closed, have handles, or would be stretched more than --stretch; given: no more than "
        "it takes to open them",
    )
    parser.add_argument(
        "--stretch",
        type=numbers.stretch,
        default=STRETCH_BOUND,
        help="of automatic seams: lengths change by about this factor at most",
    )
