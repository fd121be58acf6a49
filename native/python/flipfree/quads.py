"""Quads: a surface as a mesh of quads along a cross field, and the cells of a map as one."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from . import _native
from .calls.seamless import arrays_of
from .checks import as_mesh, as_number, as_optional_indices, as_positive, as_seconds, shown
from .errors import bad_option
from .job import Job, Progress, solver_call, start_job
from .results import FloatArray, IntArray, Mesh, Parametrization, ReadOnly, frozen, in_unit
from .texts import counted

#: More are refused.
MOST_QUADS = 10_000_000


@dataclass(frozen=True, eq=False)
class QuadCertificate:
    """What was measured about a quad mesh, from its arrays and the surface alone.

    Attributes:
        ok: all faces are quads of four vertices; no two edges have the same ends; manifold; components, genus and borders
            are the surface's; every vertex has as many quads as the map has quarter turns there, and there are as many as
            the map has cells; every vertex lies where its parent face and weights say.
        vertices, quads, components, genus, borders: counts. genus: summed over the components.
        irregular: (k, 2) inner vertices with other than 4 quads, those of the border with other than 2; and how many.
        edge_loops: chains of edges that go straight on through regular vertices.
        turned: (k,) quads that look against their parent face; not a failure: a coarse quad over a fold does.
        to_surface, to_quads: largest distances from the quads to the surface and back, over the diagonal of its bounding
            box, sampled at vertices, middles of sides and centres of faces. hausdorff: the larger one.
        failures: what failed, in words.
    """

    ok: bool
    vertices: int
    quads: int
    components: int
    genus: int
    borders: int
    irregular: IntArray
    edge_loops: int
    turned: IntArray
    to_surface: float
    to_quads: float
    failures: list[str]

    @property
    def hausdorff(self) -> float:
        return max(self.to_surface, self.to_quads)

    def __str__(self) -> str:
        return "\n".join(
            [
                f"certificate {'ok' if self.ok else 'FAILED'}: {counted(self.quads, 'quad')}, "
                f"{len(self.irregular)} irregular, {len(self.turned)} turned, genus {self.genus}, "
                f"{counted(self.borders, 'border')}, off by {100.0 * self.hausdorff:.2g} % at most",
                *(f"  {failure}" for failure in self.failures),
            ]
        )


@dataclass(frozen=True, eq=False, repr=False)
class QuadMesh(ReadOnly):
    """A mesh of quads on a surface. Its arrays are read-only: they are what was certified.

    Attributes:
        vertices: (n, 3). quads: (q, 4), counter-clockwise.
        parent_face: (n,), the input face that holds each vertex. barycentric: (n, 3), its weights there: whatever the
            input's corners carry is one gather.
        quad_parent: (q,), the input face at the middle of each quad.
        certificate: measured. stats: "target", seconds per stage, "count_raised" 1 where fewer quads would be no mesh,
            and the map's with the prefix "map.".
    """

    vertices: FloatArray
    quads: IntArray
    parent_face: IntArray
    barycentric: FloatArray
    quad_parent: IntArray
    certificate: QuadCertificate
    stats: dict[str, Any]

    def __repr__(self) -> str:
        return f"<QuadMesh: {str(self.certificate).splitlines()[0]}>"


def _quad_mesh_from(data: dict[str, Any], mesh: Mesh) -> QuadMesh:
    found = dict(data["certificate"])
    irregular = np.stack([found["irregular"], found.pop("valence")], axis=1)
    found |= dict(irregular=frozen(irregular), turned=frozen(found["turned"]))
    data = data | dict(vertices=in_unit(data["vertices"], -mesh.exponent))
    for value in data.values():
        if isinstance(value, np.ndarray):
            frozen(value)
    return QuadMesh(**data | dict(certificate=QuadCertificate(**found)))


@solver_call
def quads(
    vertices: Any,
    faces: Any,
    *,
    target: float | None = None,
    edge_length: float | None = None,
    field: Any = None,
    features: Any = None,
    max_seconds: float | None = None,
    threads: int | None = None,
    progress: Progress | None = None,
) -> Job[QuadMesh]:
    """A mesh of quads of the surface that follows a cross field, with the surface's topology.

    Args:
        vertices: (n, 3) float64. faces: (m, 3), manifold, consistently oriented; any number of components, with or without
            borders, which become rows of quad edges.
        target: how many quads. edge_length: how long their sides are instead. One of them is needed. The count is within
            5 % of what is asked for where whole numbers allow it: small counts are sparse, and where so few quads would be no
            mesh there are more.
        field: a :class:`CrossField` of this mesh; None: the smoothest, without cones of one quarter turn, along the borders.
        features: (k, 2) edges that shall be rows of quad edges: sharp ones, borders of materials. What the field forbids is
            left, and counted: ``stats["features_missed"]`` of ``stats["features"]``.
        max_seconds: of the clock; None or 0 is no limit. NotConverged (code "time limit reached") when they are over.
        threads: None is all cores; the result has the same bits for every number.
        progress: called with (stage, fraction) about 20 times per second; returning False cancels.

    Returns:
        The quads, certified.

    Raises:
        InvalidInput (also cones of one quarter turn), NotConverged, Cancelled.
    """
    if (target is None) == (edge_length is None):
        raise bad_option(
            "Give either target, how many quads, or edge_length, how long their sides are."
        )
    mesh = as_mesh(vertices, faces)
    options: dict[str, Any] = dict(max_seconds=as_seconds(max_seconds, "max_seconds"))
    if target is not None:
        options["target"] = as_number(
            target,
            "target",
            f"must be positive and at most {MOST_QUADS}",
            lambda count: 0.0 < count <= MOST_QUADS,
        )
    else:
        length = as_positive(edge_length, "edge_length")
        options["edge_length"] = float(np.ldexp(length, -mesh.exponent))
    if features is not None:
        options["features"] = as_optional_indices(features, "features", 2)
    if field is not None:
        options["field"] = arrays_of(field, mesh.faces)
    return start_job(_native.quads, mesh, options, threads, _quad_mesh_from)


@solver_call
def quads_from_map(
    parametrization: Parametrization,
    *,
    max_seconds: float | None = None,
    threads: int | None = None,
    progress: Progress | None = None,
) -> Job[QuadMesh]:
    """The unit cells of a seamless map, in which cones and corners are whole numbers apart, as a mesh of quads.

    Args:
        parametrization: a map whose seams match exactly as stored, with an aligned boundary if there is one.
        max_seconds, threads, progress: as in :func:`quads`.

    Returns:
        The quads, certified; ``parent_face``, ``barycentric`` and ``quad_parent`` are of the map's own faces.

    Raises:
        InvalidInput (no such map; names an edge; or its cells are no mesh: a torus of one cell), NotConverged,
        Cancelled.
    """
    if not isinstance(parametrization, Parametrization):
        raise bad_option(
            f"parametrization must be a Parametrization, not {shown(parametrization)}. Make one by field_aligned()."
        )
    mesh = as_mesh(parametrization.vertices, parametrization.faces)
    options = dict(
        uv32=parametrization.uv32().reshape(-1, 2),
        max_seconds=as_seconds(max_seconds, "max_seconds"),
    )
    return start_job(_native.quads_from_map, mesh, options, threads, _quad_mesh_from)
