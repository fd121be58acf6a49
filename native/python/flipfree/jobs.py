"""The package's functions as jobs: same arguments, but they return at once with a :class:`flipfree.job.Job`.

For user interfaces: poll ``job.wait(0.0)`` and ``job.progress()``, offer ``job.cancel()``, collect ``job.result()``.
"""

from .certification import start_certify as certify
from .conformal import start_conformal_metric as conformal_metric
from .conformal_map import start_conformal as conformal
from .embedding import start_embed as embed
from .improving import start_improve as improve
from .job import Job
from .matching import start_match as match
from .packing import start_pack as pack
from .target_angles import start_boundary_angles as boundary_angles
from .target_angles import start_suggest_cones as suggest_cones
from .unwrapping import start_unwrap as unwrap

__all__ = [
    "Job",
    "boundary_angles",
    "certify",
    "conformal",
    "conformal_metric",
    "embed",
    "improve",
    "match",
    "pack",
    "suggest_cones",
    "unwrap",
]
