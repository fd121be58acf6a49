"""Flipfree UV: UV maps that never fold over.

Arrays in: ``vertices (n, 3) float64``, ``faces (m, 3) int32``, triangles. ``unwrap``, ``auto_seams``, ``improve``,
``repair``, ``pack`` and ``certify`` take any; the others want them manifold and consistently oriented, and name the place
where they are not.
Angles in radians. Every result carries a certificate measured with exact predicates.
"""

from . import jobs
from ._native import version as __version__
from .calls.certification import certify
from .calls.conformal import boundary_angles, conformal, conformal_metric, suggest_cones
from .calls.improving import improve, rectify, repair
from .calls.matching import embed, match
from .calls.mesh_files import MeshFile, read, write
from .calls.seamless import (
    AdmissibleCut,
    CrossField,
    Signature,
    admissible_cut,
    cross_field,
    field_aligned,
    seamless,
    signature,
)
from .calls.unwrapping import auto_seams, pack, unwrap
from .errors import Cancelled, FlipfreeError, Infeasible, InvalidInput, NotConverged
from .points import SurfaceMap, compose
from .quads import QuadCertificate, QuadMesh, fit_tiles, quads, quads_from_map
from .results import Certificate, ConformalMetric, Mend, Parametrization, Transitions
from .separated import SeparatedSurface, islands, separate, split_fans

__all__ = [
    "AdmissibleCut",
    "Cancelled",
    "Certificate",
    "ConformalMetric",
    "CrossField",
    "FlipfreeError",
    "Infeasible",
    "InvalidInput",
    "Mend",
    "MeshFile",
    "NotConverged",
    "Parametrization",
    "QuadCertificate",
    "QuadMesh",
    "SeparatedSurface",
    "Signature",
    "SurfaceMap",
    "Transitions",
    "__version__",
    "admissible_cut",
    "auto_seams",
    "boundary_angles",
    "certify",
    "compose",
    "conformal",
    "conformal_metric",
    "cross_field",
    "embed",
    "field_aligned",
    "fit_tiles",
    "improve",
    "islands",
    "jobs",
    "match",
    "pack",
    "quads",
    "quads_from_map",
    "read",
    "rectify",
    "repair",
    "seamless",
    "separate",
    "signature",
    "split_fans",
    "suggest_cones",
    "unwrap",
    "write",
]
