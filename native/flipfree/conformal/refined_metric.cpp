#include "flipfree/conformal/refined_metric.h"

#include <algorithm>
#include <numbers>
#include <optional>
#include <utility>

#include "flipfree/base/error.h"
#include "flipfree/base/failure.h"
#include "flipfree/conformal/metric.h"

namespace flipfree::conformal {

namespace {

using std::numbers::pi;

constexpr int kMostRefinedSteps = 150;  // of Newton's method: if it helps, it helps soon
constexpr double kLeastSeconds = 1e-3;  // what a run that has no time left is given
constexpr double kFirstShare = 0.6;     // of the seconds, for the first of two ways

// Vertices added at most: per vertex of the input, but this many are always allowed, and never
// more than that.
constexpr std::int64_t kMostGrowth = 30;
constexpr std::int64_t kMostAnyway = 1000;
constexpr std::int64_t kMostEver = 5'000'000;

// The surface with points added where its intrinsic Delaunay triangulation is bad; null if it is
// not, or cannot be split.
std::unique_ptr<intrinsic::SplitSurface> refine_start(const mesh::Surface& surface,
                                                      const Points3* lengths, Stats& stats,
                                                      const ExecutionContext& context) {
  const auto vertices = static_cast<Index>(surface.vertices.rows());
  const Points3 sides =
      lengths != nullptr ? *lengths : intrinsic::lengths_of(surface.vertices, surface.faces);
  // Edges that doubles cannot tell from points: there is nothing to work with.
  if (!sides.allFinite() || !(sides.minCoeff() > 0.0)) return nullptr;
  const intrinsic::FlatSurface flat = intrinsic::make_flat_surface(vertices, surface.faces, sides);
  intrinsic::RefinementOptions options;
  options.max_added =
      static_cast<Index>(std::clamp<std::int64_t>(kMostGrowth * vertices, kMostAnyway, kMostEver));
  const intrinsic::RefinementPoints found =
      intrinsic::find_refinement_points(flat, options, context);
  stats["smallest_start_angle"] = found.smallest_angle;
  stats["refinement_complete"] = static_cast<std::int64_t>(found.complete);
  auto split = std::make_unique<intrinsic::SplitSurface>();
  if (found.points.empty() || !intrinsic::split_surface(flat, found.points, context, *split))
    return nullptr;
  return split;
}

std::vector<double> refined_targets(const std::vector<double>& target_angles,
                                    const intrinsic::SplitSurface& split) {
  std::vector<double> targets = target_angles;
  for (const char boundary : split.added_on_boundary) targets.push_back(boundary ? pi : 2 * pi);
  return targets;
}

// The metric of the refined surface as far as it is reached; its `split` is null where there is
// nothing to refine.
RefinedMetric from_refined_start(const mesh::Surface& surface, const Points3* lengths,
                                 const std::vector<double>& target_angles,
                                 const MetricOptions& options, ExecutionContext& context) {
  const Stopwatch watch;
  RefinedMetric result;
  Stats stats;
  result.split = refine_start(surface, lengths, stats, context);
  if (result.split == nullptr) return result;
  stats["seconds_refinement"] = watch.seconds();
  const intrinsic::SplitSurface& split = *result.split;
  stats["intrinsic_refinement"] = static_cast<std::int64_t>(split.added.size());
  MetricOptions share = options;
  share.max_seconds = kFirstShare * options.max_seconds;
  share.max_iterations = std::min(options.max_iterations, kMostRefinedSteps);
  share.require_convergence = false;
  result.metric = compute_conformal_metric(split.vertex_count, split.faces, split.lengths,
                                           refined_targets(target_angles, split), share, context);
  result.metric.added = split.added;
  for (const auto& [name, value] : stats) result.metric.stats[name] = value;
  return result;
}

}  // namespace

RefinedMetric compute_refined_metric(const mesh::Surface& surface, const Points3* lengths,
                                     const std::vector<double>& target_angles,
                                     const MetricOptions& options, bool refine,
                                     ExecutionContext& context) {
  const auto compute = [&] {
    const Stopwatch watch;
    MetricOptions plain = options;
    std::optional<double> reached;
    if (refine) {
      validate_metric_input(surface, lengths, target_angles, options);
      context.report("refined start", 0.0);
      // Where not even its start is possible the plain way is left.
      Outcome<RefinedMetric> refined = attempt(
          [&] { return from_refined_start(surface, lengths, target_angles, options, context); });
      if (refined && refined->metric.converged) return std::move(*refined);
      if (refined && refined->split != nullptr) reached = refined->metric.angle_error;
      if (options.max_seconds > 0.0)
        plain.max_seconds = std::max(kLeastSeconds, options.max_seconds - watch.seconds());
    }
    RefinedMetric result;
    result.metric = compute_conformal_metric(surface, lengths, target_angles, plain, context);
    if (reached) result.metric.stats["refined_start_error"] = *reached;
    return result;
  };
  return in_time(context, options.max_seconds, "The conformal metric was not reached",
                 "or spread the curvature over more vertices", compute);
}

}  // namespace flipfree::conformal
