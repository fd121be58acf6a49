#include "flipfree/conformal/metric/newton.h"

#include <gtest/gtest.h>

#include <memory>
#include <utility>

#include "conformal/engine_inputs.h"

namespace flipfree::conformal::newton_test {
namespace {

struct Newton {
  explicit Newton(EngineInput from)
      : input(std::move(from)), engine(make_double_engine(input, context)) {}
  NewtonRun operator()(const NewtonOptions& options) {
    return run_newton(*engine, system, options, descent, context);
  }

  ExecutionContext context;
  EngineInput input;  // which the engine refers to
  std::unique_ptr<MetricEngine> engine;
  NewtonSystem system;
  Descent descent = Descent::kUnknown;
};

double largest_error(Newton& run) {
  Gradient gradient;
  run.engine->evaluate(1e-13, gradient, run.context);
  return gradient.max_error;
}

TEST(RunNewton, EndsWhereAllAnglesAreMetAndSaysHowItGotThere) {
  const mesh::Surface surface = test::torus(16, 12);
  ExecutionContext context;
  Newton run(test::waves(surface, 0.3, context));
  const NewtonRun result = run({});
  EXPECT_EQ(result.end, NewtonEnd::kConverged);
  EXPECT_LE(largest_error(run), 1.1e-10);
  EXPECT_LE(result.error, 1e-10);
  ASSERT_EQ(result.error_history.size(), static_cast<std::size_t>(result.iterations) + 1);
  EXPECT_GT(result.error_history.front(), 0.1);
  EXPECT_LE(result.error_history.back(), 1e-10);
  EXPECT_LT(result.iterations, 10) << "quadratic convergence";
}

TEST(RunNewton, ConvergesWithTheSquareNearTheEnd) {
  const mesh::Surface surface = test::torus(16, 12);
  ExecutionContext context;
  Newton run(test::waves(surface, 0.01, context));
  const NewtonRun result = run({});
  ASSERT_EQ(result.end, NewtonEnd::kConverged);
  ASSERT_GE(result.error_history.size(), 3U);
  EXPECT_LT(result.error_history[1], 0.1 * result.error_history[0]);
  EXPECT_LT(result.error_history[2], 0.01 * result.error_history[1]);
}

TEST(RunNewton, StopsAfterItsStepsAndGoesOnFromThere) {
  const mesh::Surface surface = test::torus(16, 12);
  ExecutionContext context;
  Newton run(test::waves(surface, 0.3, context));
  NewtonOptions options;
  options.max_iterations = 1;
  const NewtonRun first = run(options);
  EXPECT_EQ(first.end, NewtonEnd::kIterations);
  EXPECT_EQ(first.iterations, 1);
  options.max_iterations = 20;
  const NewtonRun rest = run(options);
  EXPECT_EQ(rest.end, NewtonEnd::kConverged);
  EXPECT_NEAR(rest.error_history.front(), first.error_history.back(), 1e-12);
}

// Wherever in a step its seconds are over.
TEST(RunNewton, OutOfTimeItIsWhereTheStepBegan) {
  const mesh::Surface surface = test::torus(12, 8);
  ExecutionContext context;
  const EngineInput input = test::waves(surface, 0.3, context);
  int ended = 0;
  for (int looks = 1; looks < 12; ++looks) {
    Newton run(input);
    const double energy = run.engine->energy(run.context).value;
    run.context.clock = [now = 0.0]() mutable { return now += 1.0; };
    NewtonOptions options;
    options.max_seconds = looks;
    const NewtonRun result = run(options);
    if (result.end != NewtonEnd::kSeconds) continue;
    ++ended;
    run.context.clock = nullptr;
    EXPECT_LE(run.engine->energy(run.context).value, energy);
    if (result.iterations == 0) {
      EXPECT_EQ(run.engine->energy(run.context).value, energy);
    }
  }
  EXPECT_GT(ended, 3);
}

}  // namespace
}  // namespace flipfree::conformal::newton_test
