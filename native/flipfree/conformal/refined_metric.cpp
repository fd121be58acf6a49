#include "flipfree/conformal/refined_metric.h"

#include <algorithm>
#include <numbers>
#include <string>
#include <utility>

#include "flipfree/base/error.h"

namespace flipfree::conformal {
namespace {

using std::numbers::pi;

// Newton steps of the refined start where the plain one failed: if it helps, it helps soon.
constexpr int kMostSteps = 150;
constexpr double kLeastSeconds = 1e-3;  // what a run that has no time left is given

// Vertices added at most: per vertex of the input, but this many are always allowed, and never
// more than that.
constexpr std::int64_t kMostGrowth = 30;
constexpr std::int64_t kMostAnyway = 20'000;
constexpr std::int64_t kMostEver = 5'000'000;

ConformalMetric plain_metric(const Surface& surface, const Points3* lengths,
                             const std::vector<double>& target_angles, const MetricOptions& options,
                             ExecutionContext& context) {
  return lengths == nullptr
             ? compute_conformal_metric(surface, target_angles, options, context)
             : compute_conformal_metric(static_cast<Index>(surface.vertices.rows()), surface.faces,
                                        *lengths, target_angles, options, context);
}

// The surface with points added where its intrinsic Delaunay triangulation is bad; null if it is
// not, or cannot be split.
std::unique_ptr<SplitSurface> refine_start(const Surface& surface, const Points3* lengths,
                                           Stats& stats, const ExecutionContext& context) {
  const auto vertices = static_cast<Index>(surface.vertices.rows());
  const FlatSurface flat = make_flat_surface(
      vertices, surface.faces,
      lengths != nullptr ? *lengths : lengths_of(surface.vertices, surface.faces));
  RefinementOptions options;
  options.max_added =
      static_cast<Index>(std::clamp<std::int64_t>(kMostGrowth * vertices, kMostAnyway, kMostEver));
  const RefinementPoints found = find_refinement_points(flat, options, context);
  stats["smallest_start_angle"] = found.smallest_angle;
  stats["refinement_complete"] = static_cast<std::int64_t>(found.complete);
  auto split = std::make_unique<SplitSurface>();
  if (found.points.empty() || !split_surface(flat, found.points, context, *split)) return nullptr;
  return split;
}

std::vector<double> refined_targets(const std::vector<double>& target_angles,
                                    const SplitSurface& split) {
  std::vector<double> targets = target_angles;
  for (const char boundary : split.added_on_boundary) targets.push_back(boundary ? pi : 2 * pi);
  return targets;
}

}  // namespace

std::optional<RefinedMetric> refined_metric(const Surface& surface, const Points3* lengths,
                                            const std::vector<double>& target_angles,
                                            const MetricOptions& options,
                                            ExecutionContext& context) {
  validate_metric_input(surface, lengths, target_angles, options);
  const Stopwatch watch;
  Stats stats;
  RefinedMetric result;
  context.report("refined start", 0.0);
  result.split = refine_start(surface, lengths, stats, context);
  if (result.split == nullptr) return std::nullopt;
  stats["seconds_refinement"] = watch.seconds();
  stats["intrinsic_refinement"] = static_cast<std::int64_t>(result.split->added.size());
  const SplitSurface& split = *result.split;
  result.metric = compute_conformal_metric(split.vertex_count, split.faces, split.lengths,
                                           refined_targets(target_angles, split), options, context);
  result.metric.added = split.added;
  for (const auto& [name, value] : stats) result.metric.stats[name] = value;
  return result;
}

RefinedMetric compute_refined_metric(const Surface& surface, const Points3* lengths,
                                     const std::vector<double>& target_angles,
                                     const MetricOptions& options, StartRefinement refinement,
                                     ExecutionContext& context) {
  if (refinement == StartRefinement::kOn) {
    if (auto refined = refined_metric(surface, lengths, target_angles, options, context))
      return std::move(*refined);
  }
  MetricOptions plain = options;
  if (refinement == StartRefinement::kAuto) plain.require_convergence = false;
  const Stopwatch watch;
  RefinedMetric result;
  {
    const ProgressRange range(context, 0.0, 0.9);
    result.metric = plain_metric(surface, lengths, target_angles, plain, context);
  }
  if (refinement != StartRefinement::kAuto || result.metric.converged) return result;
  MetricOptions rest = options;
  if (options.max_seconds > 0.0)
    rest.max_seconds = std::max(kLeastSeconds, options.max_seconds - watch.seconds());
  rest.max_iterations = std::min(options.max_iterations, kMostSteps);
  rest.require_convergence = false;
  auto refined = refined_metric(surface, lengths, target_angles, rest, context);
  if (refined && refined->metric.converged) return std::move(*refined);
  if (options.require_convergence) throw_not_reached(result.metric, options);
  return result;
}

}  // namespace flipfree::conformal
