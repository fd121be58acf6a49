#include "flipfree/seamless/penner/shortest_newton.h"

#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

#include "flipfree/seamless/penner/shortest_system.h"

namespace flipfree::seamless {
namespace {

constexpr double kMostNewtonChange = 1.0;  // of a logarithm of a length in one step
constexpr double kLeastShareOfStep = 1e-3;

}  // namespace

PennerRun run_shortest(std::unique_ptr<conformal::MetricEngine>& engine,
                       intrinsic::LoopCarrier& loops, const PennerTargets& targets,
                       const PennerNewtonOptions& options, ExecutionContext& context) {
  require_same_mesh(*engine, loops);
  PennerRun run;
  ShortestSystem system;
  PennerAngles angles, trial;
  const std::vector<double> no_wish(engine->mesh().edge_count(), 0.0);
  std::vector<double> direction;
  measure(*engine, loops, targets, angles, context);
  run.error_history.push_back(angles.max_error);
  run.end = PennerEnd::kIterations;
  while (angles.max_error > options.tolerance && run.iterations < options.max_iterations) {
    context.check();
    run.end = PennerEnd::kStalled;
    if (!system.solve(engine->mesh(), loops, angles, no_wish, direction, context)) break;
    double most = 0.0;
    for (const double d : direction) most = std::max(most, std::abs(d));
    const intrinsic::LoopCarrier saved = loops;
    const std::size_t first = engine->flips().size();
    engine->remember();
    bool found = false;
    for (double step = std::min(1.0, kMostNewtonChange / std::max(most, 1e-300));
         !found && step * most > kLeastShareOfStep * std::min(most, kMostNewtonChange);
         step *= 0.5) {
      ++run.evaluations;
      std::vector<double> part = direction;
      for (double& d : part) d *= step;
      engine->stretch(part, context);
      if (engine->restore_delaunay(context)) {
        intrinsic::replay_flips(engine->flips(), first, engine->flips().size(), context,
                                [&](EdgeId e) { loops.flip(e); });
        measure(*engine, loops, targets, trial, context);
        found = trial.norm < (1.0 - kArmijo * step) * angles.norm;
      }
      if (found) continue;
      engine->go_back();
      loops = saved;
    }
    if (!found) break;
    ++run.iterations;
    std::swap(angles, trial);
    run.error_history.push_back(angles.max_error);
    run.end = PennerEnd::kIterations;
  }
  if (angles.max_error <= options.tolerance) run.end = PennerEnd::kConverged;
  run.error = angles.max_error;
  return run;
}

}  // namespace flipfree::seamless
