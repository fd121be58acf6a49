"""The commands of `python -m flipfree`, and one model of a batch, from its file to its map's file."""

from __future__ import annotations

import glob
import json
import math
import os
import platform
import sys
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from ... import _native
from ...calls.mesh_files import write
from ...distortion import LEVELS, STRETCH_BOUND, derivatives, percentiles
from ...errors import InvalidInput
from ...results import Certificate, Parametrization
from ...texts import above_bound, turned_over
from ..child import Engine
from ..plan import Formats
from ..results import Record, beside
from ..run import not_written
from ..worker import Unit
from . import any_mesh, surfaces
from .model import Solve, Solved, arguments, as_written, read_model

FORMATS = Formats(reads=(".obj", ".off", ".ply", ".stl"), writes=(".obj", ".ply"))


@dataclass(frozen=True)
class Command:
    """usage: options beside those of all commands, for numbers.add_options; ``writes``: there is an output; ``cure``: what to do
    about a map above the stretch bound."""

    text: str
    solve: Solve
    usage: str
    writes: bool = True
    cure: str = "unwrap it, which finds seams"


_ASPECT = """
--aspect=1  of the texture, if it is no square: 2, 16:9, 2048x1024
"""
_MARGIN = """
--margin-pixels=4  least gap between islands, of the texture
--texture-size=1024  pixels to a side
"""
_OVERLAPS = """
--allow-overlaps  islands may overlap themselves
"""
_ALIGNED = """
--boundary aligned_or_free|aligned|free
"""
_SEAMLESS = f"""{_ALIGNED}
--no-optimise  leave the distortion as the engine does
--meet-pins  points of the file with the pins keep their place; cuts and boundaries stay as without them
--surface-scale  one UV unit is one unit of the model; otherwise the map fits the unit square
--engine auto|penner|padding
"""
_ALONG = """
--curvature=0.5  its weight, 0 to 1
--sharp-from=30  degrees, for edges
"""

COMMANDS = {
    "unwrap": Command(
        "islands onto the plane, packed",
        any_mesh.unwrap,
        f"""
--seams auto|given  auto: also where islands are closed, have handles, or would be stretched more than --stretch; given: no more
    than it takes to open them
--stretch={STRETCH_BOUND}  of automatic seams: lengths change by about this factor at most
--keep-charts  cut where the file's charts end
{_OVERLAPS}
--no-new-cuts  crush islands that would lie on top of themselves rather than cut them
--short-cuts  do not cut closed parts along legs and fingers
{_MARGIN}{_ASPECT}""",
        cure="--seams auto and a lower --stretch cut it further",
    ),
    "embed": Command(
        "disks onto a convex polygon",
        surfaces.embed,
        f"""
--boundary circle|square|triangle|pinned  pinned: straight between boundary points of the file with the pins
--method ladder|progressive|tutte
--optimise  lower the distortion, with the boundary held
--no-pack  all parts lie around the origin
{_MARGIN}""",
        cure="--optimise, or a boundary more like the part's own",
    ),
    "match": Command(
        "pins met exactly",
        surfaces.match,
        f"""{_OVERLAPS}
--no-new-vertices  refuse pins that cannot be met by the mesh as it is
--bend-lines  edges between two pins need not stay straight
--cut-open  cut parts with pins that are closed or have handles
--unwrap-rest  unwrap parts without pins, beside the others
{_ASPECT}""",
        cure="move pins nearer to where their surroundings are",
    ),
    "transfer": Command(
        "one surface in the shape of another, through their maps",
        surfaces.transfer,
        "--source=''  model whose shape is taken, at the same places of its map",
    ),
    "cones": Command(
        "suggested cones, into a file beside the output",
        surfaces.cones,
        """
--bound=4  of the scale
--quarter-turns  angles in multiples of 90 degrees
""",
    ),
    "cut": Command(
        "closed surfaces cut into disks with right angles",
        surfaces.cut,
        """
--follow cones|field  those of the file beside the model; or also the turns of the smoothest field with these, or of a signature
    there
""",
    ),
    "conformal": Command(
        "maps without shear",
        surfaces.conformal,
        f"""
--cones auto|suggested|none  auto: of the file beside the model, else suggested for closed parts
--boundary free|straight|circle
--refined-start auto|on|off  metric of a surface without needles
--bound=4  of the scale, for suggested cones
--precision=auto  bits of the metric's numbers, 53 to 4096, or auto
{_MARGIN}""",
        cure="more cones even it out: --cones suggested with a lower --bound",
    ),
    "seamless": Command(
        "seams match by quarters",
        surfaces.seamless,
        f"""
--cones auto|suggested  auto: of the file beside the model, else suggested
--bound={surfaces.BOUND}  of the scale, for suggested cones
{_SEAMLESS}""",
        cure="more cones, in the file beside the model, even it out",
    ),
    "field": Command(
        "seamless, along a field",
        surfaces.field,
        f"""
--field curvature|smooth|edges|flow|cones|file|signature  what the map's lines run along: edges at which the surface folds, the
    flow of quads; a field in a file beside the model (.rawfield, .ffield, .rotation); its cones, or its signature, of such a file
--field-file=''  with field or signature, instead of that beside the model
{_ALONG}
--edge-weight=1  of edges, 0.01 to 1
--keep-near-cones  that bend opposite ways
--no-reroute  of padding: loops turn as they happen to
{_SEAMLESS}""",
        cure="a finer mesh or another field follows the surface better",
    ),
    "tiles": Command(
        "textures that repeat run on through seams",
        surfaces.tiles,
        f"""
--tile-count=100  about how many cover the model
--tile-size=0  length of a tile's side, instead
--field curvature|smooth|edges|flow|map  what its lines run along; map: the file's own UVs, seamless, are fitted
--no-prefer-translations  seams that turn stay, however long
{_ALONG}{_ALIGNED}""",
        cure="more tiles, or a finer mesh, follow the surface better",
    ),
    "quads": Command(
        "a mesh of quads",
        surfaces.quads,
        """
--target=2000  about how many quads
--edge-length=0  of their sides, instead
--field automatic|curvature|smooth|edges|flow  what the edges of quads run along
--adaptive=0  0 to 100, how much denser quads are where the surface bends more
--symmetry none|x|y|z  the half on the positive side of the axis becomes quads and is mirrored, along a field of its own or edges
""",
    ),
    "improve": Command(
        "less distortion",
        any_mesh.improve,
        f"{_OVERLAPS}--iterations=200  most steps per island{_ASPECT}",
    ),
    "repair": Command(
        "flips mended",
        any_mesh.repair,
        f"""
--overlaps cut|open|keep  what becomes of islands on themselves
--stretched keep|improve  what becomes of islands drawn out much more than an unwrap of them is
{_MARGIN}
--move-apart  islands that lie on larger ones are put where there is room
{_ASPECT}""",
    ),
    "pack": Command(
        "islands nested into a tile",
        any_mesh.pack,
        f"""{_MARGIN}
--rotation straight|free|quarters|none
--tile=1001  UDIM tile to pack into
--tiles=1  UDIM tiles to spread islands over
--effort=1  of the search
--keep-sizes  islands keep their sizes relative to each other, not one texel density
--stack-similar  islands of equal outline lie on top of each other
--stack-mirrored  with it, mirror images too, mirrored
{_ASPECT}""",
    ),
    "rectify": Command(
        "islands of quads as straight strips and grids", any_mesh.rectify, _MARGIN + _ASPECT
    ),
    "check": Command(
        "the certificate of a map",
        any_mesh.check,
        f"--allow-stacked  islands may lie on each other{_ASPECT}",
        writes=False,
    ),
}


def versions() -> dict[str, str]:
    return {
        "flipfree": _native.version,
        "python": platform.python_version(),
        "numpy": np.__version__,
    }


def engine_of(settings: Mapping[str, Any]) -> Engine:
    """Children are this Python again, with the package from the same place."""
    package = str(Path(__file__).resolve().parents[3])
    search = [package, *filter(None, [os.environ.get("PYTHONPATH")])]
    command = [sys.executable, "-m", "flipfree", "--worker"]
    return Engine(command, {"PYTHONPATH": os.pathsep.join(search)}, settings)


def unit_of(settings: Mapping[str, Any]) -> Unit:
    command, options = COMMANDS[settings["command"]], arguments(settings["options"])

    def solve(source: Path, target: Path | None) -> Record:
        model = read_model(
            source,
            merge=not options["no_merge"],
            max_seconds=options["max_seconds"],
            threads=settings["threads"],
        )
        solved = command.solve(model, options)
        record = record_of(command, solved, options)
        if target is None or solved.map is None:
            return record
        try:
            target.parent.mkdir(parents=True, exist_ok=True)
            for left in target.parent.glob(f".{glob.escape(target.name)}.*.part"):
                left.unlink(missing_ok=True)  # of a process that was killed while it wrote
            same = source.suffix.lower() == target.suffix.lower()
            of_source = solved.map is model.file or isinstance(solved.map, Parametrization)
            keep = source if same and of_source else None
            write(target, as_written(model, solved.map), keep=keep)
            for kind, told in solved.beside.items():
                beside(target, kind).write_text(json.dumps(told) + "\n", encoding="utf-8")
        except (OSError, InvalidInput) as error:
            return not_written(target, error)
        surface = solved.map
        vertices = surface[0] if isinstance(surface, tuple) else surface.vertices
        added = len(vertices) - len(model.vertices)
        return record | {"written": True, "vertices_added": added}

    return solve


def record_of(command: Command, solved: Solved, options: Mapping[str, Any]) -> Record:
    certificate, found = solved.certificate, solved.map
    warnings = list(solved.warnings)
    if certificate is None:
        status = "warned" if warnings else "certified"
        told = {"status": status, "message": " ".join(warnings), "reason": ""}
        return {**told, **solved.figures}
    if certificate.poor:
        warnings.append(
            f"The map is {LEVELS[certificate.level]}: {above_bound(certificate.stretched)} "
            f"(mean energy {certificate.energy:.3g}, 1 is none): {command.cure}."
        )
    if certificate.turned:
        warnings.append(f"{turned_over(certificate.turned)}. Recalculate normals.")
    if isinstance(found, Parametrization) and found.stats.get("time_limit_reached", 0):
        warnings.append("Time was over (--max-seconds); this is the best map by then.")
    if not certificate.ok:
        status, message = "refused", "; ".join(certificate.failures)
    else:
        status, message = ("warned" if warnings else "certified"), " ".join(warnings)
    record: Record = {
        "status": status,
        "message": message,
        "reason": "" if certificate.ok else "certificate failed",
        "certificate": of_certificate(certificate),
        "energy": of_certificate(certificate)["energy"],
        **solved.figures,
    }
    if isinstance(found, Parametrization):
        record["percentiles"] = _percentiles(found, options.get("aspect", 1.0))
    return record


#: Percentiles by area.
_SHARES = (5, 50, 95, 99)

_COUNTS = (
    "triangles flips64 flips32 mirrored_islands turned overlaps island_overlaps "
    "winding_failures pin_failures seam_failures cone_failures seam_edges seams_exact32"
).split()


def of_certificate(certificate: Certificate) -> dict[str, Any]:
    """Counts of -1: not measured; figures that were not: null, as JSON has no NaN."""
    found: dict[str, Any] = {"ok": certificate.ok}
    found |= {name: int(getattr(certificate, name)) for name in _COUNTS}
    for name in ("energy", "energy_p99", "max_energy"):
        value = float(getattr(certificate, name))
        found[name] = value if math.isfinite(value) and value >= 0 else None
    found["stretched"] = certificate.stretched if certificate.stretched >= 0 else None
    found["poor"], found["level"] = certificate.poor, LEVELS[certificate.level]
    found["poor_islands"] = certificate.poor_islands.tolist()
    found["needles"] = certificate.needles
    found["mends"] = {mend.what: mend.count for mend in certificate.mends}
    found["failures"] = list(certificate.failures)
    return found


def _percentiles(found: Parametrization, aspect: float) -> dict[str, dict[str, float]] | None:
    """{"energy" | "angle" | "area": {"p5": ..., ...}} over the surface by area, at the scale that keeps the whole area.

    energy: (|J|^2 + |J^-1|^2) / 4; angle: larger by smaller stretch; area: UV area by surface area. 1 is isometric. None for a
    surface without area.
    """
    squares, area, twice = derivatives(found.vertices, found.faces, found.uv * [aspect, 1.0])
    good = (twice > 0) & (area > 0)
    if not good.any():
        return None
    squares, area, twice = squares[good], area[good], twice[good]
    with np.errstate(all="ignore"):
        scale = twice.sum() / (area * twice).sum()
        squares, area = squares * scale, area * scale
        root = np.sqrt(np.maximum(squares**2 - 4 * area**2, 0.0))
        values = {
            "energy": (squares + squares / area**2) / 4,
            "angle": (squares + root) / (2 * area),
            "area": area,
        }
        return {
            name: {
                f"p{share}": at if math.isfinite(at) else -1.0
                for share, at in zip(_SHARES, percentiles(value, twice, _SHARES), strict=True)
            }
            for name, value in values.items()
        }
