#include "flipfree/seamless/penner/penner_newton.h"

#include <gtest/gtest.h>

#include <utility>

#include "flipfree/base/error.h"
#include "seamless/penner/newton_promises.h"
#include "seamless/penner/penner_state.h"

namespace flipfree::seamless::penner_newton_test {

TEST_P(NewtonInPennerCoordinates, MeetsConesAndLoopsFromTheSurfacesOwnMetric) {
  for (unsigned seed = 1; seed < 4; ++seed) {
    test::PennerState state(seed);
    state.round_loops();
    ASSERT_GT(test::largest_error(state), 0.1);
    const PennerRun run = GetParam()(state.engine, *state.loops, state.targets, {}, state.context);
    EXPECT_EQ(run.end, PennerEnd::kConverged);
    EXPECT_LE(run.error, 1e-10);
    EXPECT_NEAR(test::largest_error(state), 0.0, 1e-9);
    EXPECT_EQ(run.error_history.size(), static_cast<std::size_t>(run.iterations) + 1);
  }
}

TEST_P(NewtonInPennerCoordinates, LoopsAreThoseOfTheFlippedTriangulation) {
  test::PennerState state(2);
  state.round_loops();
  const intrinsic::LoopCarrier before = *state.loops;
  (void)GetParam()(state.engine, *state.loops, state.targets, {}, state.context);
  EXPECT_EQ(state.loops->mesh().next, state.engine->mesh().next);
  for (std::size_t i = 0; i < before.size(); ++i) {
    for (std::size_t k = 0; k < before.size(); ++k) {
      EXPECT_EQ(
          intersection_number(before.mesh(), before.loop(i), before.loop(k)),
          intersection_number(state.loops->mesh(), state.loops->loop(i), state.loops->loop(k)));
    }
  }
}

TEST_P(NewtonInPennerCoordinates, StopsAtItsLimitAndSaysSo) {
  test::PennerState state(1);
  state.round_loops();
  PennerNewtonOptions options;
  options.max_iterations = 1;
  const PennerRun run =
      GetParam()(state.engine, *state.loops, state.targets, options, state.context);
  EXPECT_EQ(run.end, PennerEnd::kIterations);
  EXPECT_EQ(run.iterations, 1);
  EXPECT_NEAR(run.error, test::largest_error(state), 1e-12);
  EXPECT_EQ(run.error_history.size(), 2U);
}

TEST_P(NewtonInPennerCoordinates, CanBeCancelled) {
  test::PennerState state(1);
  state.round_loops();
  state.context.cancel();
  EXPECT_THROW((void)GetParam()(state.engine, *state.loops, state.targets, {}, state.context),
               Cancelled);
}

TEST(PennerNewton, APreparedSystemChangesNothing) {
  test::PennerState state(3), other(3);
  state.round_loops();
  other.round_loops();
  const PennerRun run = run_penner(state.engine, *state.loops, state.targets, {}, state.context);
  auto system = std::make_unique<PennerSystem>();
  ASSERT_TRUE(system->prepare(other.engine->mesh(), *other.loops, other.measured(), other.context));
  const PennerRun same = run_prepared_penner(other.engine, *other.loops, other.targets, {},
                                             std::move(system), other.context);
  EXPECT_EQ(run.error_history, same.error_history);
  EXPECT_EQ(state.engine->lengths(), other.engine->lengths());
}

INSTANTIATE_TEST_SUITE_P(Newton, NewtonInPennerCoordinates, testing::Values(&run_penner));

}  // namespace flipfree::seamless::penner_newton_test
