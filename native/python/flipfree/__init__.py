"""Flipfree UV: UV maps that never fold over.

Arrays in: ``vertices (n, 3) float64``, ``faces (m, 3) int32``, consistently oriented, manifold, triangles.
Angles in radians. Every result carries a certificate measured with exact predicates.
"""

from . import jobs
from ._native import version as __version__
from .certification import certify
from .conformal import conformal_metric
from .conformal_map import conformal
from .embedding import embed
from .errors import Cancelled, FlipfreeError, Infeasible, InvalidInput, NotConverged
from .fans import split_fans
from .improving import improve
from .matching import match
from .mesh_files import MeshFile, read, write
from .packing import pack
from .results import Certificate, ConformalMetric, Parametrization, Transitions
from .target_angles import boundary_angles, suggest_cones
from .unwrapping import unwrap

__all__ = [
    "Cancelled",
    "Certificate",
    "ConformalMetric",
    "FlipfreeError",
    "Infeasible",
    "InvalidInput",
    "MeshFile",
    "NotConverged",
    "Parametrization",
    "Transitions",
    "__version__",
    "boundary_angles",
    "certify",
    "conformal",
    "conformal_metric",
    "embed",
    "improve",
    "jobs",
    "match",
    "pack",
    "read",
    "split_fans",
    "suggest_cones",
    "unwrap",
    "write",
]
