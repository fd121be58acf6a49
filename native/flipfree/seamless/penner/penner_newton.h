// Newton's method for cone and loop angles on a metric that is kept Delaunay by Ptolemy flips.
//
// Ptolemy flips are exact changes of coordinates of the space of metrics, so every step is taken in
// the edge lengths of the triangulation that is Delaunay at the moment, and loops are carried
// along.
#pragma once

#include <limits>
#include <memory>
#include <vector>

#include "flipfree/base/context.h"
#include "flipfree/conformal/engine/engine.h"
#include "flipfree/intrinsic/loops/loop_carrier.h"
#include "flipfree/seamless/penner/penner_system.h"

namespace flipfree::seamless {

// Sufficient decrease (Armijo): the share of what a step promises to first order that it must
// reach.
inline constexpr double kArmijo = 1e-4;
// Radians from which errors of angles fall quadratically, so that the rest costs little.
inline constexpr double kNearlyMet = 1e-4;

enum class PennerEnd {
  kConverged,
  kPrecision,  // rounding decides from here on: go on with more bits
  kStalled,    // no step lowers the error by much
  kIterations,
};

struct PennerNewtonOptions {
  double tolerance = 1e-10;  // of every angle, radians
  int max_iterations = 100;
  // A step changes no logarithm of an edge by more than this beside the conformal part, and no
  // difference of scale factors by more than that.
  double max_stretch = 2.0;
  double max_scale_range = 10.0;
};

struct PennerRun {
  PennerEnd end = PennerEnd::kIterations;
  double error = std::numeric_limits<double>::infinity();
  int iterations = 0;
  int evaluations = 0;
  int restored = 0;  // steps after which the cones were met again by conformal changes alone
  std::vector<double> error_history;
};

// Iterates from the engine's present state. `loops` holds the loops in the engine's triangulation,
// before and after. The norm of all errors falls with every step. Throws Cancelled, TimeIsOver.
PennerRun run_penner(std::unique_ptr<conformal::MetricEngine>& engine,
                     intrinsic::LoopCarrier& loops, const PennerTargets& targets,
                     const PennerNewtonOptions& options, ExecutionContext& context);

// The same, to the bit, where the first step's system is prepared already (penner_system.h): for
// these loops in the engine's present state. Not null.
PennerRun run_prepared_penner(std::unique_ptr<conformal::MetricEngine>& engine,
                              intrinsic::LoopCarrier& loops, const PennerTargets& targets,
                              const PennerNewtonOptions& options,
                              std::unique_ptr<PennerSystem> prepared, ExecutionContext& context);

}  // namespace flipfree::seamless
