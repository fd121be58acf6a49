"""The commands of `python -m flipfree`: one line each."""

from __future__ import annotations

import argparse
from collections.abc import Callable
from dataclasses import dataclass

from . import any_mesh, surfaces
from .model import Solve


@dataclass(frozen=True)
class Command:
    """``arguments`` adds the command's options to its parser; ``writes``: there is an output; ``cure``: what to do about a map
    above the stretch bound."""

    text: str
    solve: Solve
    arguments: Callable[[argparse.ArgumentParser], None]
    writes: bool = True
    cure: str = "unwrap it, which finds seams"


COMMANDS = {
    "unwrap": Command(
        "islands onto the plane, packed",
        any_mesh.unwrap,
        any_mesh.unwrap_arguments,
        cure="--seams auto and a lower --stretch cut it further",
    ),
    "match": Command(
        "pins met exactly",
        surfaces.match,
        surfaces.match_arguments,
        cure="move pins nearer to where their surroundings are",
    ),
    "conformal": Command(
        "maps without shear",
        surfaces.conformal,
        surfaces.conformal_arguments,
        cure="more cones even it out: --cones suggested with a lower --bound",
    ),
    "seamless": Command(
        "seams match by quarters",
        surfaces.seamless,
        surfaces.seamless_arguments,
        cure="more cones, in the file beside the model, even it out",
    ),
    "field": Command(
        "seamless, along a field",
        surfaces.field,
        surfaces.field_arguments,
        cure="a finer mesh or another field follows the surface better",
    ),
    "improve": Command("less distortion", any_mesh.improve, any_mesh.improve_arguments),
    "repair": Command("flips mended", any_mesh.repair, any_mesh.repair_arguments),
    "pack": Command("islands nested into a tile", any_mesh.pack, any_mesh.pack_arguments),
    "check": Command("the certificate of a map", any_mesh.check, any_mesh.check_arguments, False),
}
