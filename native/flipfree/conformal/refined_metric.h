// The conformal metric from a refined start: points are added so that the intrinsic Delaunay
// triangulation has no needles (delaunay_refinement.h), then the metric of the refined surface is
// computed, flat at the points added (thesis 4.6.4).
//
// More vertices mean another discrete conformal class: the refined metric approximates the same
// smooth one, but is not the same as that of the input's own vertices. It is therefore only used
// where it is asked for.
#pragma once

#include <memory>
#include <vector>

#include "flipfree/conformal/metric.h"
#include "flipfree/intrinsic/refined_start/split_surface.h"

namespace flipfree::conformal {

struct RefinedMetric {
  ConformalMetric metric;  // of `split` if there is one: the input's vertices first, then its own
  std::unique_ptr<intrinsic::SplitSurface> split;
};

// `lengths`: #F x 3, or null: those of the vertex positions. `refine`: first from a refined start,
// and only where there is nothing to refine, or that fails, the plain way. Errors as
// compute_conformal_metric. Of max_seconds the first of two ways gets a share. stats:
// "intrinsic_refinement" (vertices added), and where refined "smallest_start_angle",
// "seconds_refinement", "refinement_complete"; "refined_start_error" where that failed.
RefinedMetric compute_refined_metric(const mesh::Surface& surface, const Points3* lengths,
                                     const std::vector<double>& target_angles,
                                     const MetricOptions& options, bool refine,
                                     ExecutionContext& context);

}  // namespace flipfree::conformal
