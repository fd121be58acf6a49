"""Flipfree UV: UV maps that never fold over.

Arrays in: ``vertices (n, 3) float64``, ``faces (m, 3) int32``, triangles. ``unwrap``, ``auto_seams``, ``improve``,
``repair``, ``pack`` and ``certify`` take any; the others want them manifold and consistently oriented, and name the place
where they are not.
Angles in radians. Every result carries a certificate measured with exact predicates.
"""

from . import jobs as jobs
from ._native import version as _version
from .calls.certification import certify as certify
from .calls.conformal import boundary_angles as boundary_angles
from .calls.conformal import conformal as conformal
from .calls.conformal import conformal_metric as conformal_metric
from .calls.conformal import suggest_cones as suggest_cones
from .calls.improving import improve as improve
from .calls.improving import rectify as rectify
from .calls.improving import repair as repair
from .calls.matching import embed as embed
from .calls.matching import match as match
from .calls.mesh_files import MeshFile as MeshFile
from .calls.mesh_files import read as read
from .calls.mesh_files import write as write
from .calls.seamless import AdmissibleCut as AdmissibleCut
from .calls.seamless import CrossField as CrossField
from .calls.seamless import Signature as Signature
from .calls.seamless import admissible_cut as admissible_cut
from .calls.seamless import cross_field as cross_field
from .calls.seamless import field_aligned as field_aligned
from .calls.seamless import seamless as seamless
from .calls.seamless import signature as signature
from .calls.unwrapping import auto_seams as auto_seams
from .calls.unwrapping import pack as pack
from .calls.unwrapping import unwrap as unwrap
from .errors import Cancelled as Cancelled
from .errors import FlipfreeError as FlipfreeError
from .errors import Infeasible as Infeasible
from .errors import InvalidInput as InvalidInput
from .errors import NotConverged as NotConverged
from .points import SurfaceMap as SurfaceMap
from .points import compose as compose
from .quads import QuadCertificate as QuadCertificate
from .quads import QuadMesh as QuadMesh
from .quads import fit_tiles as fit_tiles
from .quads import quads as quads
from .quads import quads_from_map as quads_from_map
from .results import Certificate as Certificate
from .results import ConformalMetric as ConformalMetric
from .results import Mend as Mend
from .results import Parametrization as Parametrization
from .results import Transitions as Transitions
from .separated import SeparatedSurface as SeparatedSurface
from .separated import islands as islands
from .separated import separate as separate
from .separated import split_fans as split_fans

__version__: str = _version
__all__ = [  # what is of this package; modules are of none
    "__version__",
    *(name for name, one in vars().items() if getattr(one, "__module__", "").startswith(__name__)),
]
