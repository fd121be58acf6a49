// Newton's method with the energy-free line search (thesis 4.3, Algorithm 3) on a MetricEngine.
#pragma once

#include <limits>
#include <vector>

#include "flipfree/base/stats.h"
#include "flipfree/conformal/engine/engine.h"
#include "flipfree/conformal/newton_system.h"

namespace flipfree::conformal {

struct NewtonOptions {
  double tolerance = 1e-10;
  int max_iterations = 500;
  double max_seconds = 0.0;  // 0 = never
  bool more_bits = true;     // are to be had: the run ends early where they would help
  // Flags of the unknowns that stay what they are, whose angles are as they come; null: none. The
  // system must have the same.
  const std::vector<char>* pinned = nullptr;
  std::size_t earlier_tests = 0;  // Delaunay tests in full precision of the rungs before
};

// How steps are found: by the line search of Algorithm 3, or, where the start is far away, by the
// energy after relaxation.
enum class Descent {
  kUnknown,  // decided by the first gradient
  kLineSearch,
  kRelaxed,
};

struct NewtonRun {
  NewtonEnd end = NewtonEnd::kIterations;
  const char* reason = "";  // with kPrecision: what rounding spoiled
  double error = std::numeric_limits<double>::infinity();
  double noise = 0.0;
  int iterations = 0;
  int evaluations = 0;
  int relaxed_iterations = 0;  // Newton steps followed by nonlinear relaxation
  std::vector<double> error_history;
};

// Iterates from the engine's present state. Every step either lowers the convex energy or ends the
// run. `descent` is carried from one engine to the next. Checks for cancellation in every
// evaluation, and more often with many bits. When max_seconds are over in the middle of a step, the
// engine goes back to where the step began.
NewtonRun run_newton(MetricEngine& engine, NewtonSystem& system, const NewtonOptions& options,
                     Descent& descent, ExecutionContext& context);

}  // namespace flipfree::conformal
