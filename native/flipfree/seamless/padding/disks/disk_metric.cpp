#include "flipfree/seamless/padding/disks/disk_metric.h"

#include <algorithm>
#include <optional>
#include <utility>

#include "flipfree/base/error.h"
#include "flipfree/base/failure/outcome.h"
#include "flipfree/conformal/engine/engine.h"
#include "flipfree/conformal/metric/metric.h"
#include "flipfree/conformal/metric/newton.h"
#include "flipfree/seamless/padding/disks/near_metric.h"
#include "flipfree/seamless/penner/penner_newton.h"
#include "flipfree/seamless/penner/shortest_newton.h"

namespace flipfree::seamless {

using conformal::ConformalMetric;

namespace {

constexpr double kTolerance = 1e-10;  // radians
constexpr int kShortestSteps = 60;
// Of the conformal metric, where that has to serve.
constexpr int kDiskNearSteps = 8;
constexpr double kDiskNearEnough = 10.0;
// Newton steps to angles between, and which share of the way they are tried at.
constexpr int kConformalSteps = 40;
constexpr double kFirstAngleShare = 0.25;
constexpr double kLeastAngleShare = 1.0 / 256.0;
// Of the conformal metric, in all precisions together. Where vertices nearly coincide every step
// takes seconds in the end, and there is none in sight.
constexpr int kMostIterations = 150;

conformal::EngineInput input_of(const mesh::Surface& disk, const std::vector<double>& angle) {
  conformal::EngineInput input;
  input.setup =
      intrinsic::build_intrinsic_mesh(static_cast<Index>(disk.vertices.rows()), disk.faces);
  input.vertex_count = static_cast<Index>(disk.vertices.rows());
  input.positions = &disk.vertices;
  input.target = angle;
  return input;
}

// All angles from where they are nearly met; false if that fails.
bool finish(std::unique_ptr<conformal::MetricEngine>& engine, const PennerTargets& targets,
            PennerRun& run, ExecutionContext& context) {
  intrinsic::LoopCarrier none(engine->mesh(), {});
  PennerNewtonOptions newton;
  newton.tolerance = kTolerance;
  run = run_penner(engine, none, targets, newton, context);
  return run.end == PennerEnd::kConverged;
}

// By the shortest steps from the disk's own metric.
std::optional<ConformalMetric> shortest(const conformal::EngineInput& input,
                                        const PennerTargets& targets, ExecutionContext& context) {
  auto engine = make_engine(input, 53, context);
  if (!engine->started()) return {};
  intrinsic::LoopCarrier none(engine->mesh(), {});  // which is Delaunay already
  PennerNewtonOptions newton;
  newton.tolerance = kNearlyMet;
  newton.max_iterations = kShortestSteps;
  PennerRun run = run_shortest(engine, none, targets, newton, context);
  const int iterations = run.iterations;
  if (run.end != PennerEnd::kConverged || !finish(engine, targets, run, context)) return {};
  ConformalMetric metric;
  engine->finish(metric, false, context);
  metric.iterations = iterations + run.iterations;
  metric.angle_error = run.error;
  return metric;
}

// What an engine on the triangulation of `metric` starts from. The engine reads it to its end.
conformal::EngineInput further_input(const ConformalMetric& metric,
                                     const std::vector<double>& target) {
  conformal::EngineInput further;
  further.setup = {metric.mesh, metric.input_halfedge, metric.on_boundary};
  further.vertex_count = static_cast<Index>(target.size());
  further.edge_length = intrinsic::to_doubles(metric.length);
  further.target = target;
  return further;
}

// The engine may not have started.
CarriedMetric carried_from(const conformal::EngineInput& further, const ConformalMetric& metric,
                           ExecutionContext& context) {
  CarriedMetric carried{
      make_engine(further, 53, context), {metric.mesh, {}}, ReferenceMetric(metric)};
  if (!carried.engine->started()) return carried;
  intrinsic::replay_flips(carried.engine->flips(), 0, carried.engine->flips().size(), context,
                          [&](EdgeId e) {
                            carried.reference.flip(e);
                            carried.loops.flip(e);
                          });
  return carried;
}

// `metric` with all angles met, once they nearly are; false if that fails.
bool finished(CarriedMetric& carried, const PennerTargets& targets, ConformalMetric& metric,
              ExecutionContext& context) {
  PennerRun run;
  if (!finish(carried.engine, targets, run, context)) return false;
  ConformalMetric near;
  carried.engine->finish(near, false, context);
  metric.flips.insert(metric.flips.end(), near.flips.begin(), near.flips.end());
  metric.mesh = std::move(near.mesh);
  metric.length = std::move(near.length);
  metric.iterations += run.iterations;
  metric.angle_error = run.error;
  return true;
}

// By way of angles between the disk's own and the targets, each met by conformal changes and the
// metric brought nearer before the next: so its scale never spans more than doubles hold.
std::optional<ConformalMetric> stepwise(const conformal::EngineInput& input,
                                        const PennerTargets& targets, ExecutionContext& context) {
  ConformalMetric metric;
  {
    const auto engine = make_engine(input, 53, context);
    if (!engine->started()) return {};
    engine->finish(metric, false, context);
  }
  const conformal::EngineInput further = further_input(metric, targets.vertex_angle);
  CarriedMetric now = carried_from(further, metric, context);
  if (!now.engine->started()) return {};
  PennerAngles own;
  measure(*now.engine, now.loops, targets, own, context);
  PennerNewtonOptions newton;
  newton.tolerance = kNearlyMet;
  newton.max_iterations = kConformalSteps;
  double reached = 0.0, share = kFirstAngleShare;
  while (reached < 1.0) {
    const double to = std::min(1.0, reached + share);
    PennerTargets part = targets;
    for (std::size_t v = 0; v < part.vertex_angle.size(); ++v)
      part.vertex_angle[v] -= (1.0 - to) * own.vertices.value[v];
    CarriedMetric trial = now.copy();
    const std::size_t first = trial.engine->flips().size();
    const PennerRun run = run_penner(trial.engine, trial.loops, part, newton, context);
    metric.iterations += run.iterations;
    if (run.end != PennerEnd::kConverged) {
      share *= 0.5;
      if (share < kLeastAngleShare) return {};
      continue;
    }
    intrinsic::replay_flips(trial.engine->flips(), first, trial.engine->flips().size(), context,
                            [&](EdgeId e) { trial.reference.flip(e); });
    metric.iterations +=
        come_near(trial, part, kNearlyMet, kDiskNearSteps, kDiskNearEnough, context);
    now = std::move(trial);
    reached = to;
    share = std::min(2.0 * share, kFirstAngleShare);
  }
  if (!finished(now, targets, metric, context)) return {};
  return metric;
}

// The conformal metric, brought nearer.
ConformalMetric from_conformal(const mesh::Surface& disk, const PennerTargets& targets,
                               ExecutionContext& context) {
  conformal::MetricOptions options;
  options.max_iterations = kMostIterations;
  auto found = attempt([&] {
    return conformal::compute_conformal_metric(disk, targets.vertex_angle, options, context);
  });
  if (!found) {
    throw_not_converged(found.error().code,
                        "The metric of a piece of the surface was not reached. Merge vertices that "
                        "nearly coincide (Merge by Distance), spread the cones further apart, or "
                        "use the engine \"penner\".");
  }
  ConformalMetric metric = std::move(*found);
  if (metric.bits > 53) return metric;
  const conformal::EngineInput further = further_input(metric, targets.vertex_angle);
  CarriedMetric carried = carried_from(further, metric, context);
  if (!carried.engine->started()) return metric;
  metric.iterations +=
      come_near(carried, targets, kNearlyMet, kDiskNearSteps, kDiskNearEnough, context);
  finished(carried, targets, metric, context);
  return metric;
}

}  // namespace

ConformalMetric compute_disk_metric(const mesh::Surface& disk, const std::vector<double>& angle,
                                    ExecutionContext& context) {
  const conformal::EngineInput input = input_of(disk, angle);
  const PennerTargets targets{angle, {}};
  auto metric = shortest(input, targets, context);
  if (!metric) metric = stepwise(input, targets, context);
  return metric ? std::move(*metric) : from_conformal(disk, targets, context);
}

}  // namespace flipfree::seamless
