"""A file's mesh as the commands want it, what lies beside it about its pins, and one model of a batch, from its file to its map's
file."""

from __future__ import annotations

import glob
import inspect
import json
import math
import os
import platform
import sys
import time
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from functools import cached_property
from pathlib import Path
from typing import Any, TypeVar

import numpy as np

from ... import _native
from ...calls.mesh_files import MeshFile, read, write
from ...distortion import LEVELS, STRETCH_BOUND, derivatives, percentiles
from ...errors import InvalidInput, bad_option, bad_pins
from ...results import Certificate, FloatArray, IntArray, Parametrization
from ...separated import SeparatedSurface, edge_keys, separate
from ...texts import above_bound, turned_over
from ..child import Engine, Unit
from ..plan import Formats, Record, beside
from ..run import not_written

Result = TypeVar("Result")

#: What a call is left with when the time is over: it says so then, or has something to return.
LEAST_SECONDS = 1e-3


@dataclass(eq=False)
class Model:
    """What one input holds. ``faces`` name each vertex once that the file has several times.

    Attributes:
        max_seconds: of all solving, None is no limit. begin: when it began, by time.monotonic.
    """

    source: Path
    file: MeshFile
    faces: IntArray
    max_seconds: float | None
    threads: int
    begin: float = field(default_factory=time.monotonic)

    @property
    def limits(self) -> dict[str, Any]:
        """For the next call of a solver: the time that former ones left, and threads."""
        left = self.max_seconds
        if left is not None:
            left = max(left - (time.monotonic() - self.begin), LEAST_SECONDS)
        return {"max_seconds": left, "threads": self.threads}

    @property
    def vertices(self) -> FloatArray:
        return self.file.vertices

    def call(
        self, solver: Callable[..., Result], *arguments: Any, on: Any = None, **options: Any
    ) -> Result:
        """Of a function of the package, for this mesh. on: or for what else has vertices and faces."""
        mesh = self if on is None else on
        return solver(mesh.vertices, mesh.faces, *arguments, **options, **self.limits)

    @cached_property
    def diagonals(self) -> IntArray:
        """(k, 2) edges inside polygons, which no map is cut along: a corner of a polygon has one UV."""
        corners = self.file.corners
        if corners is None:
            return np.zeros((0, 2), np.int32)
        sides = np.sort(np.stack([corners, np.roll(corners, -1, axis=1)], -1).reshape(-1, 2))
        ends = np.stack([self.faces, np.roll(self.faces, -1, axis=1)], -1).reshape(-1, 2)
        # By corners: a side of a polygon is none, though the polygon may be on both sides of it.
        _, first, times = np.unique(sides, axis=0, return_index=True, return_counts=True)
        return np.unique(np.sort(ends[first[times > 1]]), axis=0).astype(np.int32)

    @cached_property
    def seams(self) -> IntArray:
        """(s, 2) edges where the file's charts end."""
        return replace(self.file, faces=self.faces).seams()

    def uv(self, *, whole: bool = True) -> FloatArray:
        """(n, 3, 2) as in the file. NaN where it has none, which only ``whole=False`` lets pass."""
        uv = self.file.uv
        if uv is None or (whole and not np.isfinite(uv).all()):
            some = "" if uv is None else " of some faces"
            raise InvalidInput(
                f"{self.source} has no texture coordinates{some}. Unwrap it first.", code="no map"
            )
        return uv

    def clean(self) -> SeparatedSurface:
        """For solvers that want an oriented, manifold surface; ``on_input`` leads back."""
        return separate(self.vertices, self.faces, polygons=self.file.polygons)

    def told(self, kind: str) -> dict[str, Any] | None:
        """What the file with this model's pins or cones says; None if there is none."""
        path = beside(self.source, kind)
        if not path.exists():
            return None
        try:
            found = json.loads(path.read_text(encoding="utf-8"))
        except (OSError, ValueError) as error:
            raise bad_option(f"{path} cannot be read: {error}. Correct it.") from error
        if not isinstance(found, dict):
            raise bad_option(f"{path} must hold one object {{...}}. Correct it.")
        return found


def refuse_unknown(clean: SeparatedSurface, vertices: Any) -> None:
    """Of the input, in a file beside it."""
    lost = set(vertices).difference(clean.vertex_origin.tolist())
    if lost:
        raise bad_pins(
            f"Vertex {min(lost)} is no face's (numbers from 0, the first of those in one place). "
            "Correct the file beside the model."
        )


@dataclass
class Pins:
    """What a file beside a model says about pins.

    Attributes:
        points: {vertex: place}. lines: (vertices, polyline). outline: {vertex: place} of whole boundaries, in order.
        paths: from vertices of the outline the way to one. movable: of the outline.
    """

    points: dict[int, tuple[float, float]]
    lines: list[tuple[list[int], FloatArray]]
    outline: dict[int, tuple[float, float]]
    paths: dict[int, list[int]]
    movable: list[int]

    def renumbered(self, number: Mapping[int, int]) -> Pins:
        """Those of vertices that have a number, by these."""
        return Pins(
            {number[v]: uv for v, uv in self.points.items() if v in number},
            [([number[v] for v in vs], uv) for vs, uv in self.lines if vs[0] in number],
            {number[v]: uv for v, uv in self.outline.items() if v in number},
            {number[v]: [number[w] for w in ws] for v, ws in self.paths.items() if v in number},
            [number[v] for v in self.movable if v in number],
        )


@contextmanager
def _written_as(example: str) -> Iterator[None]:
    try:
        yield
    except (AttributeError, IndexError, KeyError, TypeError, ValueError):
        raise bad_pins(f"{example}. Correct the file with the pins.") from None


def pins_of(model: Model, clean: SeparatedSurface) -> Pins:
    """In the numbers of the clean surface: points at all copies of a vertex, the rest at its first one."""
    told = model.told("pins")
    if told is None:
        raise bad_pins(
            f"{model.source.name}.pins.json is missing: the pins, such as "
            '{"points": {"0": [0.0, 0.5]}, "lines": [{"vertices": [3, 4], "uv": [[0, 0], [1, 0]]}]}.'
        )
    with _written_as('points must be {"vertex": [u, v], ...}'):
        points = {int(v): (float(uv[0]), float(uv[1])) for v, uv in told.get("points", {}).items()}
    with _written_as('lines must be [{"vertices": [...], "uv": [[u, v], ...]}, ...]'):
        lines = [
            (list(map(int, line["vertices"])), np.array(line["uv"], float).reshape(-1, 2))
            for line in told.get("lines", [])
        ]
    with _written_as(
        'outline must be {"vertices": [...], "uv": [[u, v], ...]}, one place for each, paths {"vertex": [...]}, and '
        "movable [vertices]"
    ):
        outline = told.get("outline", {"vertices": [], "uv": []})
        places = np.array(outline["uv"], float).reshape(-1, 2).tolist()
        loop = dict(zip(map(int, outline["vertices"]), map(tuple, places), strict=True))
        paths = {int(v): list(map(int, path)) for v, path in told.get("paths", {}).items()}
        movable = list(map(int, told.get("movable", [])))
    if any(len(vertices) < 2 for vertices, _ in lines):
        raise bad_pins("A line needs two vertices at least. Correct it.")
    several = [vertices for vertices, _ in lines] + list(paths.values())
    refuse_unknown(clean, [*points, *loop, *paths, *movable, *(v for vs in several for v in vs)])
    origin = clean.vertex_origin.tolist()
    first = {v: copy for copy, v in reversed([*enumerate(origin)])}
    found = Pins(points, lines, loop, paths, movable).renumbered(first)
    return replace(found, points=clean.copies(points))


@dataclass
class Solved:
    """A command's outcome: a map, or the certificate of one, or a mesh without a map.

    Attributes:
        beside: {kind: what is written into a file of that kind beside the output}.
    """

    certificate: Certificate | None
    map: Parametrization | MeshFile | tuple[FloatArray, IntArray] | None = None
    warnings: list[str] = field(default_factory=list)
    figures: dict[str, Any] = field(default_factory=dict)
    beside: dict[str, Any] = field(default_factory=dict)


#: What is made of a model with these options (arguments).
Solve = Callable[[Model, dict[str, Any]], Solved]


@dataclass(frozen=True)
class Command:
    """usage: options beside those of all commands, for add_options; ``writes``: there is an output; ``cure``: what to do
    about a map above the stretch bound."""

    text: str
    solve: Solve
    usage: str
    writes: bool
    cure: str


COMMANDS: dict[str, Command] = {}

#: Of the scale, in what ``seamless`` suggests.
BOUND = 2.0

#: Names in the usage of commands: options of several ones, and numbers.
_SHARED = {
    "aligned": "--boundary aligned_or_free|aligned|free",
    "along": """--curvature=0.5  its weight, 0 to 1
--sharp-from=30  degrees, for edges""",
    "aspect": "--aspect=1  of the texture, if it is no square: 2, 16:9, 2048x1024",
    "bound": BOUND,
    "margin": """--margin-pixels=4  least gap between islands, of the texture
--texture-size=1024  pixels to a side""",
    "overlaps": "--allow-overlaps  islands may overlap themselves",
    "placed": """--no-optimise  leave the distortion as the engine does
--meet-pins  points of the file with the pins keep their place; cuts and boundaries stay as without them
--surface-scale  one UV unit is one unit of the model; otherwise the map fits the unit square
--engine auto|penner|padding""",
    "stretch": STRETCH_BOUND,
}


def command(
    *, writes: bool = True, cure: str = "unwrap it, which finds seams"
) -> Callable[[Solve], Solve]:
    """What ``python -m flipfree NAME`` makes of a model, NAME that of the function, whose docstring is what users are told: what
    that is, and the command's own options."""

    def declared(solve: Solve) -> Solve:
        if solve.__doc__ is None:
            raise RuntimeError("Commands are described by docstrings: run Python without -OO.")
        text, _, options = inspect.cleandoc(solve.__doc__).format(**_SHARED).partition("\n")
        COMMANDS[solve.__name__] = Command(text, solve, options, writes, cure)
        return solve

    return declared


#: Arguments of calls -> options that say the contrary.
_CONTRARY = {
    **dict.fromkeys(("bijective", "keep_bijective"), "allow_overlaps"),
    **{"cut_extremities": "short_cuts", "disjoint": "allow_stacked", "may_add_cuts": "no_new_cuts"},
    **{"optimise": "no_optimise", "prefer_translations": "no_prefer_translations"},
    **{"reroute": "no_reroute", "scale_true": "keep_sizes"},
}


def arguments(options: Mapping[str, Any]) -> dict[str, Any]:
    """The options of a command line, and what calls are given for them."""
    found: dict[str, Any] = {a: not options[o] for a, o in _CONTRARY.items() if o in options}
    if "margin_pixels" in options:
        found["margin"] = float(options["margin_pixels"] / options["texture_size"])
    return {**options, **found}


def taken(options: Mapping[str, Any], names: str) -> dict[str, Any]:
    """Those of these names, which blanks part."""
    return {name: options[name] for name in names.split()}


def read_model(source: Path, *, merge: bool, max_seconds: float | None, threads: int) -> Model:
    file = read(source)
    faces = file.faces
    if merge and len(faces):
        faces = welded(file.vertices, faces)[faces]
    return Model(source, file, faces, max_seconds, threads)


def as_written(model: Model, result: Any) -> Any:
    """With the file's own vertices and polygons where the map adds nothing."""
    if not isinstance(result, Parametrization):
        return result
    if len(result.vertices) == len(model.vertices) and np.array_equal(result.faces, model.faces):
        uv = result.uv32().astype(np.float64)
        return replace(model.file, uv=uv)
    return result


def welded(vertices: FloatArray, faces: IntArray) -> IntArray:
    """(n,) vertex that each vertex is taken for; see :func:`welded_along`. faces: (m, 3)."""
    if len(faces) == 0 or not (0 <= faces.min() and faces.max() < len(vertices)):
        return np.arange(len(vertices), dtype=np.int32)
    face = np.repeat(np.arange(len(faces), dtype=np.int32), 3)
    return welded_along(vertices, faces.ravel(), np.roll(faces, -1, axis=1).ravel(), face)


def welded_along(vertices: FloatArray, start: IntArray, end: IntArray, face: IntArray) -> IntArray:
    """(n,) vertex that each vertex is taken for, itself or a smaller number at exactly the same place.

    Two boundary edges that lie on each other with opposite directions were one; where more lie there, none does. So no edge
    gets more than two faces, and parts that touch in points or along whole sheets stay apart. No two corners of a
    face become one. Linear but for sorting.

    Args:
        vertices: (n, 3). start, end: (s,) vertices of every side of every face, in the face's direction. face: (s,).
    """
    same = np.arange(len(vertices), dtype=np.int32)
    _, place = np.unique(vertices + 0.0, axis=0, return_inverse=True)  # + 0.0: -0.0 is 0.0
    place = place.reshape(-1)
    sides = edge_keys(np.stack([start, end], axis=1))
    _, edge, faces_there = np.unique(sides, return_inverse=True, return_counts=True)
    rim = np.flatnonzero(faces_there[edge.reshape(-1)] == 1)
    places = edge_keys(place[np.stack([start, end], axis=1)[rim]])
    order = rim[np.argsort(places, kind="stable")]
    _, first, sizes = np.unique(np.sort(places), return_index=True, return_counts=True)
    a, b = order[first[sizes == 2]], order[first[sizes == 2] + 1]
    opposite = (place[start[a]] == place[end[b]]) & (place[start[a]] != place[end[a]])
    a, b = a[opposite], b[opposite]
    label = _merged(same, np.r_[start[a], end[a]], np.r_[end[b], start[b]])
    return _without_pinched(label, start, face)


def _without_pinched(label: IntArray, corner: IntArray, face: IntArray) -> IntArray:
    """The same without classes to which two corners of one face belong."""
    rows = np.stack([face, label[corner], corner], axis=1)
    rows = np.unique(rows, axis=0)  # a face's vertices, each once
    twice = (rows[1:, 0] == rows[:-1, 0]) & (rows[1:, 1] == rows[:-1, 1])
    pinched = np.zeros(len(label), bool)
    pinched[rows[1:][twice, 1]] = True
    apart = pinched[label]
    found = label.copy()
    found[apart] = np.flatnonzero(apart)
    return found


def _merged(label: IntArray, a: IntArray, b: IntArray) -> IntArray:
    """The smallest vertex of every class that the pairs make; each round halves the longest chain at least."""
    while True:
        low = np.minimum(label[a], label[b])
        if np.array_equal(label[a], label[b]):
            return label
        np.minimum.at(label, label[a], low)
        np.minimum.at(label, label[b], low)
        label = label[label]


FORMATS = Formats(reads=(".obj", ".off", ".ply", ".stl"), writes=(".obj", ".ply"))


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
    if certificate is not None and certificate.poor:
        warnings.append(
            f"The map is {LEVELS[certificate.level]}: {above_bound(certificate.stretched)} "
            f"(mean energy {certificate.energy:.3g}, 1 is none): {command.cure}."
        )
    if certificate is not None and certificate.turned:
        warnings.append(f"{turned_over(certificate.turned)}. Recalculate normals.")
    if isinstance(found, Parametrization) and found.stats.get("time_limit_reached", 0):
        warnings.append("Time was over (--max-seconds); this is the best map by then.")
    status = "warned" if warnings else "certified"
    record: Record = {"status": status, "message": " ".join(warnings), "reason": ""}
    if certificate is not None:
        if not certificate.ok:
            why = "; ".join(certificate.failures)
            record = {"status": "refused", "message": why, "reason": "certificate failed"}
        told = of_certificate(certificate)
        record |= {"certificate": told, "energy": told["energy"]}
    record |= solved.figures
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
