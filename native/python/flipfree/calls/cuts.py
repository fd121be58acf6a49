"""Cuts of closed surfaces into disks with right angles, on which seamless maps are made (thesis 5.2.1, 6.5)."""

from __future__ import annotations

from dataclasses import dataclass, fields
from typing import Any, Unpack

import numpy as np

from .. import _native
from ..checks import as_mesh, checked
from ..errors import bad_option
from ..job import Job, Limits, solver_call, start_job
from ..results import FloatArray, IntArray, Mesh, ReadOnly, all_frozen, frozen
from ..texts import counted
from .seamless import CrossField, arrays_of, as_quarter_turns


@dataclass(frozen=True, eq=False, repr=False)
class AdmissibleCut(ReadOnly):
    """A closed surface cut along branches that meet at right angles. Its arrays are read-only.

    Every component of what is left is a disk, of which ``len(corners in it) == 4 + sum(k - 4 for its cones)`` (thesis
    Definition 5.4). Nodes have four branches, all of whose sectors are corners, or three, one of whose sectors is flat.

    Attributes:
        vertices: (n', 3), the input's first. faces: (m', 3), refined where branches needed room.
        parent_face: (m',) input face that contains each. vertex_parent: (n',) input face with each vertex.
        vertex_barycentric: (n', 3) its place there.
        branches: vertex ids along each, from node to node; disjoint but for their ends, none through a cone.
        corners: (c, 2) right angles: the node, and the first face of the sector counter-clockwise.
        flat: (t, 2) the same of the flat sectors of nodes with three branches.
        stats: with a field, "loops", "quarters", "guided" and "fallback": how branches were rerouted to turn as it does.
    """

    vertices: FloatArray
    faces: IntArray
    parent_face: IntArray
    vertex_parent: IntArray
    vertex_barycentric: FloatArray
    branches: list[IntArray]
    corners: IntArray
    flat: IntArray
    stats: dict[str, Any]

    def __repr__(self) -> str:
        parts = (
            counted(len(self.branches), "branch", "branches"),
            counted(len(self.corners), "corner"),
        )
        return f"<AdmissibleCut: {', '.join(parts)}>"

    @property
    def cut_edges(self) -> IntArray:
        """(s, 2) vertex pairs of all branches."""
        pairs = [np.column_stack([branch[:-1], branch[1:]]) for branch in self.branches]
        return np.concatenate([np.zeros((0, 2), np.int32), *pairs])


def _cut_from(data: Any, mesh: Mesh) -> AdmissibleCut:
    names = (field.name for field in fields(AdmissibleCut))
    found = dict(zip(names, data, strict=True))
    found["vertices"] = mesh.restored(found["vertices"])
    found["branches"] = [frozen(path) for path in found["branches"]]
    for name in ("corners", "flat"):
        found[name] = np.array(found[name], np.int32).reshape(-1, 2)
    return AdmissibleCut(**all_frozen(found))


@solver_call
def admissible_cut(
    vertices: Any,
    faces: Any,
    cones: Any = None,
    *,
    field: CrossField | None = None,
    reroute: bool = True,
    **limits: Unpack[Limits],
) -> Job[AdmissibleCut]:
    """The cut that the engine "padding" of ``seamless`` and ``field_aligned`` starts from.

    Args:
        vertices: (n, 3) float64. faces: (m, 3), manifold, consistently oriented, closed; any number of components.
        cones: {vertex: k}: total angle k pi / 2, as for ``seamless``; all others are flat. None with a field.
        field: cones are the field's, and loops of the cut turn as it does. reroute: False: as they happen to.
        max_seconds: of the clock; None or 0 is no limit. NotConverged (code "time limit reached") when they are over.
        threads: as elsewhere. progress: called with (stage, fraction); returning False cancels.

    Returns:
        The cut; a sphere has none.

    Raises:
        InvalidInput (the mesh, open ones too; a cone), Infeasible (Gauss-Bonnet; cones that no surface of this genus has),
        NotConverged, Cancelled.
    """
    if field is not None and cones is not None:
        raise bad_option(
            "Both cones and field are given. Give one of them: a field has cones of its own."
        )
    mesh = as_mesh(vertices, faces)
    options = checked(locals(), "reroute")
    if field is not None:
        options["field"] = arrays_of(field, mesh.faces)
    else:
        options["cones"] = as_quarter_turns(cones, "cones", len(mesh.scaled), 4, 1)
    return start_job(_native.admissible_cut, mesh, options, limits, _cut_from)
