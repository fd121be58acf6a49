#include "flipfree/seamless/padding/geometry/disks/disk_metric.h"

#include <optional>
#include <utility>

#include "flipfree/conformal/engine/engine.h"
#include "flipfree/conformal/metric/metric.h"
#include "flipfree/conformal/metric/newton.h"
#include "flipfree/seamless/padding/geometry/disks/near_metric.h"
#include "flipfree/seamless/penner/penner_newton.h"
#include "flipfree/seamless/penner/shortest_newton.h"

namespace flipfree::seamless {

using conformal::ConformalMetric;

namespace {

constexpr double kTolerance = 1e-10;  // radians
// Radians at which the quadratic end takes over.
constexpr double kNearlyMet = 1e-4;
constexpr int kShortestSteps = 60;
// Of the conformal metric, where that has to serve.
constexpr int kNearSteps = 8;
constexpr double kNearEnough = 10.0;

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

// The conformal metric, brought nearer.
ConformalMetric from_conformal(const mesh::Surface& disk, const conformal::EngineInput& input,
                               const PennerTargets& targets, ExecutionContext& context) {
  ConformalMetric metric =
      conformal::compute_conformal_metric(disk, targets.vertex_angle, {}, context);
  if (metric.bits > 53) return metric;
  conformal::EngineInput further;
  further.setup = {metric.mesh, metric.input_halfedge, metric.on_boundary};
  further.vertex_count = input.vertex_count;
  further.edge_length = intrinsic::to_doubles(metric.length);
  further.target = input.target;
  CarriedMetric carried{
      make_engine(further, 53, context), {metric.mesh, {}}, ReferenceMetric(metric)};
  if (!carried.engine->started()) return metric;
  intrinsic::replay_flips(carried.engine->flips(), 0, carried.engine->flips().size(), context,
                          [&](EdgeId e) {
                            carried.reference.flip(e);
                            carried.loops.flip(e);
                          });
  PennerRun run;
  metric.iterations += come_near(carried, targets, kNearlyMet, kNearSteps, kNearEnough, context);
  if (!finish(carried.engine, targets, run, context)) return metric;
  ConformalMetric near;
  carried.engine->finish(near, false, context);
  metric.flips.insert(metric.flips.end(), near.flips.begin(), near.flips.end());
  metric.mesh = std::move(near.mesh);
  metric.length = std::move(near.length);
  metric.iterations += run.iterations;
  metric.angle_error = run.error;
  return metric;
}

}  // namespace

ConformalMetric compute_disk_metric(const mesh::Surface& disk, const std::vector<double>& angle,
                                    ExecutionContext& context) {
  const conformal::EngineInput input = input_of(disk, angle);
  const PennerTargets targets{angle, {}};
  auto metric = shortest(input, targets, context);
  return metric ? std::move(*metric) : from_conformal(disk, input, targets, context);
}

}  // namespace flipfree::seamless
