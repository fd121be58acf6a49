// The conformal metric with a second way for starts that are too bad: points are added so that the
// intrinsic Delaunay triangulation has no needles (delaunay_refinement.h), then the metric of the
// refined surface is computed, flat at the points added.
//
// More vertices mean another discrete conformal class: the refined metric approximates the same
// smooth one, but is not the same as that of the input's own vertices. It is therefore never used
// where the plain way works, unless asked for.
#pragma once

#include <memory>
#include <optional>
#include <vector>

#include "flipfree/conformal/metric.h"
#include "flipfree/intrinsic/refined_start/split_surface.h"

namespace flipfree::conformal {

enum class StartRefinement {
  kAuto,  // if the plain way fails
  kOn,    // first; the plain way if the refined one fails
  kOff,
};

struct RefinedMetric {
  ConformalMetric metric;  // of `split` if there is one: the input's vertices first, then its own
  std::unique_ptr<intrinsic::SplitSurface> split;
};

// `lengths`: #F x 3, or null: those of the vertex positions. Errors as compute_conformal_metric.
// Of max_seconds the first way gets a share, all of it if there is no second one.
// stats: "intrinsic_refinement" (vertices added), and where refined "smallest_start_angle",
// "seconds_refinement", "refinement_complete".
RefinedMetric compute_refined_metric(const mesh::Surface& surface, const Points3* lengths,
                                     const std::vector<double>& target_angles,
                                     const MetricOptions& options, StartRefinement refinement,
                                     ExecutionContext& context);

// The metric of the refined surface; nothing if there is no bad triangle, or none that could be
// refined. stats and errors as above.
std::optional<RefinedMetric> refined_metric(const mesh::Surface& surface, const Points3* lengths,
                                            const std::vector<double>& target_angles,
                                            const MetricOptions& options,
                                            ExecutionContext& context);

}  // namespace flipfree::conformal
