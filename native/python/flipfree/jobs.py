"""The package's functions as jobs: same arguments, but they return at once with a :class:`flipfree.job.Job`.

For user interfaces: poll ``job.wait(0.0)`` and ``job.progress()``, offer ``job.cancel()``, collect ``job.result()``.
"""

from .calls import certification, cuts, improving, matching, unwrapping
from .calls import conformal as angles
from .calls import seamless as seamless_maps
from .job import Job as Job
from .job import job_of
from .quads import fit_tiles as _fit_tiles
from .quads import quads as _quads
from .quads import quads_from_map as _quads_from_map

admissible_cut = job_of(cuts.admissible_cut)
auto_seams = job_of(unwrapping.auto_seams)
boundary_angles = job_of(angles.boundary_angles)
certify = job_of(certification.certify)
conformal = job_of(angles.conformal)
conformal_metric = job_of(angles.conformal_metric)
cross_field = job_of(seamless_maps.cross_field)
embed = job_of(matching.embed)
field_aligned = job_of(seamless_maps.field_aligned)
fit_tiles = job_of(_fit_tiles)
improve = job_of(improving.improve)
match = job_of(matching.match)
pack = job_of(unwrapping.pack)
quads = job_of(_quads)
quads_from_map = job_of(_quads_from_map)
rectify = job_of(improving.rectify)
repair = job_of(improving.repair)
seamless = job_of(seamless_maps.seamless)
signature = job_of(seamless_maps.signature)
suggest_cones = job_of(angles.suggest_cones)
unwrap = job_of(unwrapping.unwrap)
with_pins = job_of(matching.with_pins)
