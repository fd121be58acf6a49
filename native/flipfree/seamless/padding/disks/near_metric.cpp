#include "flipfree/seamless/padding/disks/near_metric.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <utility>
#include <vector>

#include "flipfree/seamless/penner/shortest_newton.h"
#include "flipfree/seamless/penner/shortest_system.h"

namespace flipfree::seamless {
namespace {

// A step is halved so many times.
constexpr int kNearHalvings = 3;
constexpr int kNearNewtonSteps = 10;
// Steps that may lead away.
constexpr int kMostDetours = 3;

// The metric after a step of this size and the way back to the targets, if there is one.
std::optional<CarriedMetric> stepped(const CarriedMetric& metric, const PennerTargets& targets,
                                     double tolerance, const std::vector<double>& direction,
                                     double step, ExecutionContext& context) {
  CarriedMetric trial = metric.copy();
  const std::size_t first = trial.engine->flips().size();
  std::vector<double> part = direction;
  for (double& d : part) d *= step;
  trial.engine->stretch(part, context);
  if (!trial.engine->restore_delaunay(context)) return {};
  intrinsic::replay_flips(trial.engine->flips(), first, trial.engine->flips().size(), context,
                          [&](EdgeId e) { trial.loops.flip(e); });
  PennerNewtonOptions newton;
  newton.tolerance = tolerance;
  newton.max_iterations = kNearNewtonSteps;
  if (run_shortest(trial.engine, trial.loops, targets, newton, context).end !=
      PennerEnd::kConverged) {
    return {};
  }
  intrinsic::replay_flips(trial.engine->flips(), first, trial.engine->flips().size(), context,
                          [&](EdgeId e) { trial.reference.flip(e); });
  return trial;
}

}  // namespace

double CarriedMetric::distance() const {
  double sum = 0.0;
  for (const double r : reference.ratios(engine->lengths())) sum += r * r;
  return std::isfinite(sum) ? sum : HUGE_VAL;
}

double CarriedMetric::energy() const {
  const std::vector<double> scale =
      vertex_means(engine->mesh(), reference.ratios(engine->lengths()));
  const double energy = scaling_energy(scale, std::vector<double>(scale.size(), 1.0));
  return std::isfinite(energy) ? energy : HUGE_VAL;
}

int come_near(CarriedMetric& metric, const PennerTargets& targets, double tolerance, int most,
              double enough, ExecutionContext& context) {
  CarriedMetric now = metric.copy();
  double distance = now.distance(), least = distance;
  ShortestSystem system;
  int detours = 0, steps = 0;
  for (; steps < most && now.energy() > enough; ++steps) {
    PennerAngles angles;
    measure(*now.engine, now.loops, targets, angles, context);
    std::vector<double> wish = now.reference.ratios(now.engine->lengths());
    for (double& w : wish) w = -w;
    std::vector<double> direction;
    if (!system.solve(now.engine->mesh(), now.loops, angles, wish, direction, context)) break;
    double largest = 1e-300;
    for (const double d : direction) largest = std::max(largest, std::abs(d));
    std::optional<CarriedMetric> next, detour;
    double reached = 0.0;
    double step = std::min(1.0, kMostRelaxationChange / largest);
    for (int halving = 0; halving < kNearHalvings; ++halving, step *= 0.5) {
      context.check();
      auto trial = stepped(now, targets, tolerance, direction, step, context);
      if (!trial) continue;
      reached = trial->distance();
      if (reached < distance) {
        next = std::move(trial);
        break;
      }
      if (!detour && std::isfinite(reached)) detour = std::move(trial);
    }
    if (!next) {
      if (!detour || ++detours > kMostDetours) break;
      next = std::move(detour);
      reached = next->distance();
    }
    now = std::move(*next);
    distance = reached;
    if (distance < least) {
      least = distance;
      metric = now.copy();
    }
  }
  return steps;
}

}  // namespace flipfree::seamless
