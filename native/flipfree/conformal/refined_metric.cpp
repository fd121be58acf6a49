#include "flipfree/conformal/refined_metric.h"

#include <algorithm>
#include <numbers>
#include <string>
#include <utility>

#include "flipfree/base/error.h"
#include "flipfree/base/failure.h"
#include "flipfree/conformal/metric.h"

namespace flipfree::conformal {

namespace {

using std::numbers::pi;

// Newton steps of the refined start where the plain one failed: if it helps, it helps soon.
constexpr int kMostRefinedSteps = 150;
constexpr double kLeastSeconds = 1e-3;  // what a run that has no time left is given
constexpr double kFirstShare = 0.6;     // of the seconds, for the first of two ways
constexpr char kNotReached[] = "The conformal metric was not reached";
constexpr char kCure[] = "or spread the curvature over more vertices";

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

// The refined start's split surface, its targets' metric not yet computed.
struct RefinedStart {
  std::unique_ptr<intrinsic::SplitSurface> split;
  Stats stats;
};

RefinedStart find_refined_start(const mesh::Surface& surface, const Points3* lengths,
                                const ExecutionContext& context) {
  const Stopwatch watch;
  RefinedStart start;
  start.split = refine_start(surface, lengths, start.stats, context);
  start.stats["seconds_refinement"] = watch.seconds();
  if (start.split != nullptr)
    start.stats["intrinsic_refinement"] = static_cast<std::int64_t>(start.split->added.size());
  return start;
}

RefinedMetric metric_of(RefinedStart start, const std::vector<double>& target_angles,
                        const MetricOptions& options, ExecutionContext& context) {
  RefinedMetric result;
  result.split = std::move(start.split);
  const intrinsic::SplitSurface& split = *result.split;
  result.metric = compute_conformal_metric(split.vertex_count, split.faces, split.lengths,
                                           refined_targets(target_angles, split), options, context);
  result.metric.added = split.added;
  for (const auto& [name, value] : start.stats) result.metric.stats[name] = value;
  return result;
}

// Options of the second way, which takes what the first one left.
MetricOptions remaining(const MetricOptions& options, const Stopwatch& watch) {
  MetricOptions rest = options;
  rest.more_seconds = {};
  if (options.max_seconds > 0.0)
    rest.max_seconds = std::max(kLeastSeconds, options.max_seconds - watch.seconds());
  return rest;
}

void set_out_of_time(ConformalMetric& metric) {
  metric.end = NewtonEnd::kSeconds;
  metric.stats["stopped_by"] = std::string(name_of(metric.end));
}

// Refined first, plain if that fails.
RefinedMetric refined_first(const mesh::Surface& surface, const Points3* lengths,
                            const std::vector<double>& target_angles, const MetricOptions& options,
                            ExecutionContext& context) {
  const Stopwatch watch;
  validate_metric_input(surface, lengths, target_angles, options);
  context.report("refined start", 0.0);
  RefinedStart start = find_refined_start(surface, lengths, context);
  std::optional<double> reached;
  if (start.split != nullptr) {
    MetricOptions share = options;
    share.max_seconds = kFirstShare * options.max_seconds;
    share.max_iterations = std::min(options.max_iterations, kMostRefinedSteps);
    share.require_convergence = false;
    // Where not even its start is possible the plain way is left.
    Outcome<RefinedMetric> refined =
        attempt([&] { return metric_of(std::move(start), target_angles, share, context); });
    if (refined && refined->metric.converged) return std::move(*refined);
    if (refined) reached = refined->metric.angle_error;
  }
  RefinedMetric result;
  result.metric =
      compute_conformal_metric(surface, lengths, target_angles, remaining(options, watch), context);
  if (reached) result.metric.stats["refined_start_error"] = *reached;
  return result;
}

// Plain first, refined if that fails.
RefinedMetric plain_first(const mesh::Surface& surface, const Points3* lengths,
                          const std::vector<double>& target_angles, const MetricOptions& options,
                          ExecutionContext& context) {
  const Stopwatch watch;
  std::optional<RefinedStart> start;
  MetricOptions plain = options;
  plain.require_convergence = false;
  plain.max_seconds = kFirstShare * options.max_seconds;
  // Where there is nothing to refine the plain way goes on.
  plain.more_seconds = [&] {
    // If time is over meanwhile, what the plain way reached is the answer.
    if (!ended_in_time([&] { start = find_refined_start(surface, lengths, context); })) return 0.0;
    return start->split == nullptr ? options.max_seconds - watch.seconds() : 0.0;
  };
  RefinedMetric result;
  const std::optional<Error> not_started = failure_of([&] {
    const ProgressRange range(context, 0.0, 0.9);
    result.metric = compute_conformal_metric(surface, lengths, target_angles, plain, context);
  });
  if (!not_started && result.metric.converged) return result;
  // Where not even the start of the second way is possible, what the first one reached is the
  // answer.
  std::optional<RefinedMetric> refined;
  const bool in_time = ended_in_time([&] {
    failure_of([&] {
      if (!start) start = find_refined_start(surface, lengths, context);
      if (start->split == nullptr) return;
      MetricOptions rest = remaining(options, watch);
      rest.max_iterations = std::min(options.max_iterations, kMostRefinedSteps);
      rest.require_convergence = false;
      refined = metric_of(std::move(*start), target_angles, rest, context);
    });
  });
  if (refined && refined->metric.converged) return std::move(*refined);
  if (!in_time && (not_started || options.require_convergence || !(options.max_seconds > 0.0)))
    throw TimeIsOver();
  if (!in_time || (refined && refined->metric.end == NewtonEnd::kSeconds && !not_started))
    set_out_of_time(result.metric);
  if (not_started && not_started->code == ErrorCode::kTimeLimit)
    throw_out_of_time(kNotReached, options.max_seconds, kCure);
  if (not_started) throw NotConverged(*not_started);
  if (options.require_convergence) throw_not_reached(result.metric, options);
  return result;
}

}  // namespace

std::optional<RefinedMetric> refined_metric(const mesh::Surface& surface, const Points3* lengths,
                                            const std::vector<double>& target_angles,
                                            const MetricOptions& options,
                                            ExecutionContext& context) {
  validate_metric_input(surface, lengths, target_angles, options);
  context.report("refined start", 0.0);
  RefinedStart start = find_refined_start(surface, lengths, context);
  if (start.split == nullptr) return std::nullopt;
  return metric_of(std::move(start), target_angles, options, context);
}

RefinedMetric compute_refined_metric(const mesh::Surface& surface, const Points3* lengths,
                                     const std::vector<double>& target_angles,
                                     const MetricOptions& options, StartRefinement refinement,
                                     ExecutionContext& context) {
  const auto compute = [&] {
    switch (refinement) {
      case StartRefinement::kOn:
        return refined_first(surface, lengths, target_angles, options, context);
      case StartRefinement::kAuto:
        return plain_first(surface, lengths, target_angles, options, context);
      case StartRefinement::kOff:
        break;
    }
    RefinedMetric result;
    result.metric = compute_conformal_metric(surface, lengths, target_angles, options, context);
    return result;
  };
  return in_time(context, options.max_seconds, kNotReached, kCure, compute);
}

}  // namespace flipfree::conformal
