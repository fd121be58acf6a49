#include "flipfree/conformal/metric/metric.h"

#include "flipfree/base/debug_check.h"
#include "flipfree/conformal/metric/metric_input.h"
#include "flipfree/conformal/metric/precision_ladder.h"

namespace flipfree::conformal {

ConformalMetric compute_conformal_metric(const mesh::Surface& surface, const Points3* lengths,
                                         const std::vector<double>& target_angles,
                                         const MetricOptions& options, ExecutionContext& context) {
  EngineInput input = checked_input(surface, lengths, options);
  input.target = checked_targets(target_angles, input, options.tolerance);
  ConformalMetric metric = climb_precision_ladder(input, options, context);
  debug_check("compute_conformal_metric", [&] { return find_broken_invariant(metric); });
  return metric;
}

ConformalMetric compute_conformal_metric(const mesh::Surface& surface,
                                         const std::vector<double>& target_angles,
                                         const MetricOptions& options, ExecutionContext& context) {
  return compute_conformal_metric(surface, nullptr, target_angles, options, context);
}

ConformalMetric compute_conformal_metric(Index vertex_count, const Triangles& faces,
                                         const Points3& lengths,
                                         const std::vector<double>& target_angles,
                                         const MetricOptions& options, ExecutionContext& context) {
  return compute_conformal_metric({Points3::Zero(vertex_count, 3), faces}, &lengths, target_angles,
                                  options, context);
}

void validate_metric_input(const mesh::Surface& surface, const Points3* lengths,
                           const std::vector<double>& target_angles, const MetricOptions& options) {
  checked_targets(target_angles, checked_input(surface, lengths, options), options.tolerance);
}

}  // namespace flipfree::conformal
