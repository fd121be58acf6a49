// Newton's method for cone and loop angles by the shortest steps, from the input's own metric
// (Capouellez, Zorin 2024, Algorithm 1, in the coordinates of the current triangulation).
//
// The way from the conformal metric (penner_newton.h) is shorter, refines less and keeps to the
// shape. But where cones are far from a handle, that handle is exponentially large in the conformal
// metric, its loops turn by next to nothing, and making it larger still brings them nearer to
// nothing for free, with no end. Here every change of a length costs.
#pragma once

#include <memory>

#include "flipfree/base/context.h"
#include "flipfree/conformal/engine/engine.h"
#include "flipfree/intrinsic/loops/loop_carrier.h"
#include "flipfree/seamless/penner/penner_newton.h"

namespace flipfree::seamless {

// As run_penner(). Loses its quadratic end to rounding earlier: run_penner() may follow.
PennerRun run_shortest(std::unique_ptr<conformal::MetricEngine>& engine,
                       intrinsic::LoopCarrier& loops, const PennerTargets& targets,
                       const PennerNewtonOptions& options, ExecutionContext& context);

}  // namespace flipfree::seamless
