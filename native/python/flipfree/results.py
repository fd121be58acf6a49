"""What the solvers return: plain dataclasses over numpy arrays, made of what the compiled module returns."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any, TypeVar

import numpy as np
import numpy.typing as npt

from .distortion import LEVELS, energies, level_of, needles, stretched
from .distortion import Array as Array
from .texts import above_bound, counted, mended, mirrored, needles_named

Flags = npt.NDArray[np.bool_]
Ints = npt.NDArray[np.int64]
Float32Array = npt.NDArray[np.float32]
FloatArray = npt.NDArray[np.float64]
IntArray = npt.NDArray[np.int32]
Value = TypeVar("Value")

#: Names of the symmetric flip types in the order of ``ConformalMetric.flip_counts`` (faces left and right of the edge).
FLIP_TYPES = tuple("(1,1,1) (1,par,2) (t,perp,t) (1,1,t) (t,perp,q) (1,1,q) (q,perp,q)".split())


def in_unit(array: FloatArray, exponent: int) -> FloatArray:
    """``array`` divided by 2 to the exponent."""
    with np.errstate(over="ignore"):
        return np.ldexp(array, -exponent) if exponent else array


@dataclass(frozen=True, eq=False)
class Mesh:
    """A mesh: as given, and as the solvers take it.

    Attributes:
        given: (n, 3), vertices in the caller's unit.
        scaled: (n, 3), divided by 2 to the exponent, which is exact: squares of areas neither overflow nor vanish.
            Vertices that no face uses are at the origin there, so that they decide nothing.
        faces: (m, 3). exponent: 0 for ordinary coordinates.
    """

    given: FloatArray
    scaled: FloatArray
    faces: IntArray
    exponent: int

    def restored(self, vertices: FloatArray) -> FloatArray:
        """The vertices of a result, which begin with those that were given, in the caller's unit."""
        result = in_unit(vertices, -self.exponent)
        result[: len(self.given)] = self.given
        return result


def frozen(value: Value) -> Value:
    """``value``, an array or several, read-only from now on."""
    if isinstance(value, np.ndarray):
        value.flags.writeable = False
    elif isinstance(value, (list, tuple)):
        for one in value:
            frozen(one)
    return value


class ReadOnly:
    """Of dataclasses whose arrays nobody may change; copies and pickles would forget that."""

    def __post_init__(self) -> None:
        for name, value in vars(self).items():
            if isinstance(value, np.ndarray) and value.flags.writeable:
                self.__dict__[name] = frozen(value.view())  # it may be the caller's own

    def __setstate__(self, state: dict[str, Any]) -> None:
        self.__dict__.update(state)
        self.__post_init__()


@dataclass(frozen=True, eq=False)
class Transitions(ReadOnly):
    """Per cut edge: uv on the second side = quarter turns of uv on the first side + translation."""

    quarter_turns: IntArray
    translation: FloatArray


@dataclass(frozen=True, eq=False)
class Mend(ReadOnly):
    """What a mesh that is no clean surface was separated for; the mesh itself stays as it is.

    Attributes:
        what: in words, such as "edges with more than two faces".
        kind: "vertex", "edge" or "face". count: how many.
        elements: their ids in the caller's mesh, edges as vertex pairs one after the other; at most 1000 numbers.
    """

    what: str
    kind: str
    count: int
    elements: IntArray

    def __str__(self) -> str:
        return mended(self.count, self.what)


#: The mend of faces that are mapped against their own winding.
TURNED = "faces wound against their part"


@dataclass(frozen=True, eq=False)
class Certificate(ReadOnly):
    """What was measured about a map, on the given values and after rounding to what is stored. Counts of -1 and figures of
    nan: not measured.

    Attributes:
        ok: every guarantee that applies was measured and holds.
        triangles: how many were looked at. flips64, flips32: those without positive area, in 64 bits and as stored.
        mirrored_islands: charts that were judged as mirror images, as it was asked for. mirrored_faces: (k,), all of theirs.
        winding_failures: vertices around which the angles do not wind as they must (G2).
        pin_failures, seam_failures, cone_failures, holonomy_failures, provenance_failures: what misses G3 to G7.
        seam_edges: cut edges, where G4 was asked for; seams_exact64, seams_exact32: those of them whose two sides are
            related by a quarter turn and a translation exactly, in 64 bits and as stored. seam_deviation: the largest
            difference, after the nearest quarter turn, of an edge's vectors on the two sides, in UV lengths: how far a
            map is from seamless. seam_vertices: (s, 2), the edges, with the side that ``seam_transitions`` lead from on
            the left.
        quarter_cones: (k, 2) interior vertices and their quarter turns of angle, where these are not 4 and G4 holds.
        feature_edges: edges that were asked to be isolines (G8). features_missed: (k, 2), those of them that are none.
        overlaps: places where a chart covers points twice or touches itself; 0: the charts are one-to-one; -1: not
            counted, as they are not where the map has flips.
        island_overlaps: pairs of charts that share area. island_overlap_faces: (k,) faces of such charts, at most 1000.
        energy: symmetric Dirichlet, area-weighted mean at the best global scale, 1 = isometric; max_energy: of the
            worst triangle; energy_p99: 99th percentile by area. Of the 64-bit map or of the stored one, whichever is worse.
            -1: not measured (``conformal`` with ``lengths``).
        level: how stretched the map is to the eye, an index of ``distortion.LEVELS``: 0 fine; 1 above the stretch bound 1.25;
            2 badly, above 2: by its mean, or by islands that are a hundredth of the surface together; 1 also where two
            hundredths of its triangles are above 2.
        stretched: share of the surface's area whose own stretch is above the bound, 0 to 1. -1: not measured.
        area: of the surface, in the unit of its vertices; -1 where ``stretched`` was not measured.
        poor_islands: (k,) a face of each chart whose own mean energy is above the bound, worst first, at most 100.
        needles: triangles of the surface thinner than a thousandth of their length that are badly stretched.
        mends: what the mesh had to be separated for, empty for a clean surface. Faces that use a vertex twice have no
            triangle and are not judged; all others are.
        failures: what failed, in words. failed_faces: (k,) faces named there, at most 1000.
        tile_failures: where tiles were asked for (G9): seam edges, corners of cones and of the border, and edges of features
            that are not on whole numbers as stored.
    """

    ok: bool
    triangles: int
    flips64: int
    flips32: int
    mirrored_islands: int
    mirrored_faces: IntArray
    winding_failures: int
    pin_failures: int
    seam_failures: int
    seam_edges: int
    seams_exact64: int
    seams_exact32: int
    seam_deviation: float
    seam_vertices: IntArray
    seam_transitions: Transitions
    quarter_cones: IntArray
    cone_failures: int
    holonomy_failures: int
    provenance_failures: int
    feature_edges: int
    features_missed: IntArray
    overlaps: int
    island_overlaps: int
    island_overlap_faces: IntArray
    energy: float
    max_energy: float
    energy_p99: float
    level: int
    stretched: float
    area: float
    poor_islands: IntArray
    needles: int
    mends: tuple[Mend, ...]
    failures: list[str]
    failed_faces: IntArray
    tile_failures: int = -1

    @property
    def poor(self) -> bool:
        """Valid, but above the stretch bound."""
        return self.level > 0

    @property
    def turned(self) -> int:
        """Faces that are mapped against their own winding, as that of their part contradicts it: a renderer that culls
        backs shows the texture on them mirrored, or not at all. ``flips64`` and ``flips32`` do not count them."""
        return sum(mend.count for mend in self.mends if mend.what == TURNED)

    def __str__(self) -> str:
        overlaps = f"overlaps {self.overlaps}"
        if self.overlaps < 0:
            because = " where a map has flips" if max(self.flips64, self.flips32) > 0 else ""
            overlaps = f"overlaps of islands with themselves not counted{because}"
        on_top = counted(self.island_overlaps, "pair")
        off = f" (off by up to {self.seam_deviation:.3g})" if self.seam_deviation > 0 else ""
        parts = {
            f"certificate {'ok' if self.ok else 'FAILED'}: {counted(self.triangles, 'triangle')}": True,
            f"flips {self.flips64} (64-bit) {self.flips32} (32-bit)": True,
            f"{counted(self.turned, 'face')} turned over": self.turned,
            mirrored(self.mirrored_islands): self.mirrored_islands,
            overlaps: True,
            f"islands on top of each other {on_top}": self.island_overlaps > 0,
            f"energy {self.energy:.6g} (worst triangle {self.max_energy:.4g})": True,
            f"exact seam edges {self.seams_exact32}/{self.seam_edges}{off}": self.seam_edges >= 0,
        }
        lines = [", ".join(part for part, is_told in parts.items() if is_told)]
        if self.poor:
            lines.append(f"  {LEVELS[self.level]}: {above_bound(self.stretched)}")
        if self.needles:
            lines.append(f"  {needles_named(self.needles)}")
        if self.mends:
            lines.append("  separated: " + ", ".join(str(mend) for mend in self.mends))
        return "\n".join(lines + [f"  {failure}" for failure in self.failures])


@dataclass(frozen=True, eq=False, repr=False)
class Parametrization(ReadOnly):
    """A map to the plane. Its arrays are read-only: they are what was certified.

    Attributes:
        vertices: (n', 3), the input's n vertices first.
        faces: (m', 3).
        uv: (m', 3, 2), one per face corner. Rounded to the nearest 32-bit floats these are ``uv32()``, what is stored.
        uv64: (m', 3, 2), the solver's own values. Where rounding them would fold a triangle, the stored ones were
            chosen otherwise, and ``uv`` follows these: there it has the stored values instead. Elsewhere both are the same.
        parent_face: (m',), the input face that contains each face.
        vertex_parent, vertex_barycentric: (n',), (n', 3), where each vertex lies on the input.
        cut_edges: (s, 2), vertex pairs along which the map is cut.
        transitions: per cut edge, empty where the map is not seamless: from the face that has the edge's vertices in this
            order to the other one.
        certificate: measured on ``uv64`` and ``uv32()``; ``uv`` passes it too.
        stats: seconds per stage, iterations, added vertices, energy.
        input_faces: (m, 3), those that ``parent_face`` counts.
        log_weight: (n',) of a conformal map, logarithms of its vertices' weights: with it the map is projective, not linear,
            between them (``map_points``). None elsewhere.
    """

    vertices: FloatArray
    faces: IntArray
    uv: FloatArray
    uv64: FloatArray
    parent_face: IntArray
    vertex_parent: IntArray
    vertex_barycentric: FloatArray
    cut_edges: IntArray
    transitions: Transitions
    certificate: Certificate
    stats: dict[str, Any]
    _uv32: Float32Array
    input_faces: IntArray
    log_weight: FloatArray | None = None

    def __repr__(self) -> str:
        return (
            f"<Parametrization: {counted(len(self.vertices), 'vertex', 'vertices')}, {counted(len(self.faces), 'face')}, "
            f"{counted(len(self.cut_edges), 'cut edge')}; {str(self.certificate).splitlines()[0]}; "
            "uv rounds to uv32()>"
        )

    def at(self, other: Parametrization, **changes: Any) -> Parametrization:
        """The same with the UVs of another map of these faces, and its certificate unless there is another one."""
        changes = {"certificate": other.certificate, "log_weight": None} | changes
        return replace(self, uv=other.uv, uv64=other.uv64, _uv32=other._uv32, **changes)

    def uv32(self) -> Float32Array:
        """The (m', 3, 2) values that Blender stores: ``uv`` rounded to nearest. A copy."""
        return self._uv32.copy()

    def map_points(self, faces: Any, barycentrics: Any) -> FloatArray:
        """Where points of the input's surface lie in the map, continuous away from cuts and one-to-one on every chart.

        Linear on every triangle of the result. Of a conformal map projective there (thesis 4.5): so it is the exact one of
        the metric where the overlay is written (``original_triangles=False``) and the input is Delaunay; elsewhere it
        agrees with that at vertices, and along edges that both triangulations have.

        Args:
            faces: (k,) faces of the input. barycentrics: (k, 3) weights of their corners, from 0 on, with the sum 1.

        Returns:
            (k, 2) places as in ``uv``. On a cut: as seen from that face.

        Raises:
            InvalidInput: no such face, or none of the map; weights that are no point of a face.

        O(m log m + p) for m triangles and p of them in these faces.
        """
        from .points import map_points

        return map_points(self, faces, barycentrics)

    def find_points(self, uv: Any) -> tuple[IntArray, IntArray, FloatArray]:
        """The way back: what of the input's surface lies at places of the map.

        Args:
            uv: (k, 2).

        Returns:
            ((p,) rows of ``uv``, ascending, (p,) faces of the input, (p, 3) weights there): none where nothing lies, several
            where the map overlaps itself, and on an edge one for each triangle beside it.

        O((m + k) log m + p) for m triangles, where no place is in very many of their boxes.
        """
        from .points import find_points

        return find_points(self, uv)

    def with_pins(
        self,
        points: Any,
        *,
        max_seconds: float | None = None,
        threads: int | None = None,
        progress: Callable[[str, float], bool | None] | None = None,
    ) -> Parametrization:
        """The map with vertices at places of their own, and all of its cuts and boundaries as they are, bit for bit: so a
        seamless or field-aligned map stays one, with its cones, transitions and turns (thesis figure 3.9). Its charts may
        overlap themselves; features inside them are not held. As ``improve`` moves it there, or, where that finds no way, as
        ``match`` does, which may refine.

        Args:
            points: {vertex: (u, v)}; on cuts and boundaries only such as are there already. max_seconds, threads: of each of
                these two calls. progress: called with (stage, fraction) about 20 times per second; False cancels.

        Raises:
            InvalidInput: a vertex on a cut or the boundary. Infeasible: two vertices at one place, or one outside its chart:
            named, with a witness. NotConverged, also where an edge that stays would have to be split.
        """
        from .calls.matching import with_pins

        return with_pins(self, points, max_seconds=max_seconds, threads=threads, progress=progress)


@dataclass(frozen=True, eq=False)
class ConformalMetric:
    """A metric that is discretely conformally equivalent to the input, with the prescribed angles.

    Attributes:
        scale_factors: (n,) natural logarithms u of the scale factors, mean 0. Where no edge was flipped, the new length
            of edge (i, j) is the old one times exp((u_i + u_j) / 2).
        angles: (n,) total angle reached at every vertex. angle_error: the largest distance from the targets, radians,
            measured in the precision of the run.
        flips: Ptolemy flips from the Delaunay triangulation of the input to the final one; flip_counts: by type, see
            FLIP_TYPES. euclidean_flips: flips that made the input Delaunay first.
        iterations: Newton steps. bits: mantissa of the lengths. error_history: largest angle error at the start and
            after every step.
        scale_range: max u - min u. converged: angle_error is within the tolerance.
        faces, log_lengths: (k, 3) final intrinsic triangulation and logarithms of its lengths (corner j to j + 1). For a
            surface with boundary these are the faces of its symmetric double cover, both copies of a vertex bearing its
            number, with face_labels 0 = this copy, 1 = the mirrored one, 2 and 3 = symmetric triangle and (half of a)
            quadrilateral.
        symmetric: the double cover was used. stats: seconds and counts; "intrinsic_refinement" is the number of
            vertices added.
        added_scale_factors, added_parent, added_barycentric: (a,), (a,), (a, 3) of vertices added by intrinsic
            refinement, numbered from n on in ``faces``: u, the input face in which each lies, and its weights there.
    """

    scale_factors: FloatArray
    angles: FloatArray
    angle_error: float
    scale_range: float
    flips: int
    euclidean_flips: int
    flip_counts: tuple[int, ...]
    iterations: int
    bits: int
    converged: bool
    error_history: FloatArray
    symmetric: bool
    added_scale_factors: FloatArray
    added_parent: IntArray
    added_barycentric: FloatArray
    faces: IntArray
    log_lengths: FloatArray
    face_labels: npt.NDArray[np.int8]
    stats: dict[str, Any]


def certificate_from(
    data: dict[str, Any], mesh: Mesh | None = None, uv32: Any = None, aspect: float = 1.0
) -> Certificate:
    """Of a map of this mesh, scaled vertices and all, as stored. Errors have one without its map, and so without ``stretched``
    and what goes with it."""
    data = dict(data) | {"stretched": -1.0, "area": -1.0, "level": 0, "needles": 0}
    data["poor_islands"] = np.zeros(0, np.int32)
    if data["energy"] != -1.0:  # a metric that is not the surface's has none
        data["level"] = level_of(data["energy"])
        if mesh is not None:
            energy, area = energies(mesh.scaled, mesh.faces, uv32, aspect)
            with np.errstate(over="ignore", under="ignore"):
                data["area"] = float(np.ldexp(area.sum(), 2 * mesh.exponent))
            found = stretched(mesh.faces, uv32, energy, area, data["energy"])
            data["stretched"], data["level"] = found.share, found.level
            data["poor_islands"] = found.islands
            data["needles"] = needles(mesh.scaled, mesh.faces, energy)
    for name in ("quarter_cones", "features_missed"):
        data[name] = np.array(data[name], np.int32).reshape(-1, 2)
    data["mends"] = tuple(Mend(*mend) for mend in data["mends"])
    data["seam_transitions"] = Transitions(*data["seam_transitions"])
    return Certificate(**data)


def parametrization_from(data: dict[str, Any], mesh: Mesh, aspect: float = 1.0) -> Parametrization:
    """aspect: of the texture on which distortion is measured."""
    refined = replace(mesh, scaled=data["vertices"], faces=data["faces"])
    made = dict(
        vertices=mesh.restored(data["vertices"]),
        transitions=Transitions(*data["transitions"]),
        certificate=certificate_from(data["certificate"], refined, data["_uv32"], aspect),
        input_faces=mesh.faces.copy(),
    )
    frozen([*data.values()])  # one array may have two names
    return Parametrization(**data | made)


def metric_from(data: dict[str, Any], _mesh: Mesh, exponent: int) -> ConformalMetric:
    """Of lengths in units of 2 to the exponent."""
    metric = ConformalMetric(**data)
    if exponent:
        metric.log_lengths[...] += exponent * np.log(2.0)
    return metric
