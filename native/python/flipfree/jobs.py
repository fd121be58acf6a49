"""The package's functions as jobs: same arguments, but they return at once with a :class:`flipfree.job.Job`.

For user interfaces: poll ``job.wait(0.0)`` and ``job.progress()``, offer ``job.cancel()``, collect ``job.result()``.
"""

from .calls.certification import certify as _certify
from .calls.conformal import conformal_metric as _conformal_metric
from .calls.conformal_map import conformal as _conformal
from .calls.embedding import embed as _embed
from .calls.improving import improve as _improve
from .calls.improving import repair as _repair
from .calls.matching import match as _match
from .calls.packing import pack as _pack
from .calls.seamless import seamless as _seamless
from .calls.target_angles import boundary_angles as _boundary_angles
from .calls.target_angles import suggest_cones as _suggest_cones
from .calls.unwrapping import auto_seams as _auto_seams
from .calls.unwrapping import unwrap as _unwrap
from .fields.aligned import field_aligned as _field_aligned
from .fields.cross_fields import cross_field as _cross_field
from .fields.cross_fields import signature as _signature
from .job import Job, job_of

auto_seams = job_of(_auto_seams)
boundary_angles = job_of(_boundary_angles)
certify = job_of(_certify)
conformal = job_of(_conformal)
conformal_metric = job_of(_conformal_metric)
cross_field = job_of(_cross_field)
embed = job_of(_embed)
field_aligned = job_of(_field_aligned)
improve = job_of(_improve)
match = job_of(_match)
pack = job_of(_pack)
repair = job_of(_repair)
seamless = job_of(_seamless)
signature = job_of(_signature)
suggest_cones = job_of(_suggest_cones)
unwrap = job_of(_unwrap)

__all__ = [
    "Job",
    "auto_seams",
    "boundary_angles",
    "certify",
    "conformal",
    "conformal_metric",
    "cross_field",
    "embed",
    "field_aligned",
    "improve",
    "match",
    "pack",
    "repair",
    "seamless",
    "signature",
    "suggest_cones",
    "unwrap",
]
