#include "flipfree/seamless/penner/penner_newton.h"

#include <gtest/gtest.h>

#include "seamless/penner/penner_state.h"

namespace flipfree::seamless::penner_system_test {
namespace {

TEST(Measure, ErrorsAreThoseOfSumsByTheLawOfCosines) {
  test::PennerState state;
  state.targets.loop_angle.assign(state.loops->size(), 0.3);
  const PennerAngles angles = state.measured();
  EXPECT_NEAR(angles.max_error, test::largest_error(state), 1e-12);
  const auto angle = test::angles_of(*state.engine);
  double squares = 0;
  for (const double x : angles.vertices.value) squares += x * x;
  for (const double x : angles.loops) squares += x * x;
  EXPECT_NEAR(angles.norm, std::sqrt(squares), 1e-12);
  for (std::size_t h = 0; h < angle.size(); ++h)
    EXPECT_NEAR(angles.cotangent[h], static_cast<double>(1 / std::tan(angle[h])), 1e-9);
}

// By differences of the loops' angles under changes of one length after the other.
TEST(LoopDerivatives, AreThoseOfTheAngles) {
  const test::PennerState fresh;
  test::PennerState state;
  const PennerAngles before = state.measured();
  const Eigen::MatrixXd derivative =
      loop_derivatives(state.engine->mesh(), *state.loops, before.cotangent);
  ASSERT_EQ(derivative.rows(), static_cast<Eigen::Index>(state.engine->mesh().edge_count()));
  const double small = 1e-6;
  for (std::size_t e = 0; e < state.engine->mesh().edge_count(); e += 11) {
    test::PennerState changed;
    std::vector<double> stretch(changed.engine->mesh().edge_count(), 0.0);
    stretch[e] = small;
    changed.engine->stretch(stretch, changed.context);
    const PennerAngles after = changed.measured();
    for (std::size_t i = 0; i < state.loops->size(); ++i) {
      EXPECT_NEAR((before.loops[i] - after.loops[i]) / small,
                  derivative(static_cast<Eigen::Index>(e), static_cast<Eigen::Index>(i)), 1e-4)
          << e << " " << i;
    }
  }
}

// A whole Newton step makes all errors vanish to first order: so does a small share of it by that
// share.
TEST(PennerSystem, StepsRemoveErrorsInProportion) {
  test::PennerState state;
  state.targets.loop_angle.assign(state.loops->size(), 0.3);
  const PennerAngles before = state.measured();
  PennerSystem system;
  PennerDirection direction;
  ASSERT_TRUE(system.solve(state.engine->mesh(), *state.loops, before, direction, state.context));
  const double share = 1e-6;
  conformal::FineVector u;
  for (const double x : direction.scale) u.high.push_back(0.5 * share * x);
  std::vector<double> s;
  for (const double x : direction.stretch) s.push_back(share * x);
  state.engine->scale(u, state.context);
  state.engine->stretch(s, state.context);
  const PennerAngles after = state.measured();
  for (std::size_t v = 0; v < state.cones.size(); ++v) {
    EXPECT_NEAR((before.vertices.value[v] - after.vertices.value[v]) / share,
                before.vertices.value[v], 2e-4);
  }
  for (std::size_t i = 0; i < state.loops->size(); ++i)
    EXPECT_NEAR((before.loops[i] - after.loops[i]) / share, before.loops[i], 2e-4);
}

// Where loops turn as they shall, the step is conformal: no edge is stretched.
TEST(PennerSystem, WithoutLoopsTheStepIsConformal) {
  test::PennerState state;
  const intrinsic::LoopCarrier none(state.engine->mesh(), {});
  state.targets.loop_angle.clear();
  PennerAngles angles;
  measure(*state.engine, none, state.targets, angles, state.context);
  PennerSystem system;
  PennerDirection direction;
  ASSERT_TRUE(system.solve(state.engine->mesh(), none, angles, direction, state.context));
  EXPECT_EQ(direction.most_stretch, 0.0);
  EXPECT_GT(direction.scale_range, 0.0);
  const auto [low, high] = std::minmax_element(direction.scale.begin(), direction.scale.end());
  EXPECT_NEAR(*low + *high, 0.0, 1e-12);
  EXPECT_NEAR(*high - *low, direction.scale_range, 1e-12);
}

// Where the cones are met, the step that turns loops by e has the length that the norm says.
TEST(PennerSystem, TheNormOfTurnsIsTheLengthOfTheStep) {
  test::PennerState state;
  state.targets.loop_angle.assign(state.loops->size(), 0.3);
  PennerAngles angles = state.measured();
  std::fill(angles.vertices.value.begin(), angles.vertices.value.end(), 0.0);
  PennerSystem system;
  ASSERT_TRUE(system.prepare(state.engine->mesh(), *state.loops, angles, state.context));
  const Eigen::MatrixXd norm = system.norm_of_turns();
  ASSERT_EQ(norm.rows(), static_cast<Eigen::Index>(state.loops->size()));
  std::mt19937 random(3);
  std::uniform_real_distribution<double> uniform(-1.0, 1.0);
  for (int i = 0; i < 10; ++i) {
    for (double& e : angles.loops) e = uniform(random);
    PennerDirection direction;
    ASSERT_TRUE(system.solve_prepared(state.engine->mesh(), angles, direction, state.context));
    double length = 0.0;
    for (const double s : direction.stretch) length += s * s;
    const Eigen::Map<const Eigen::VectorXd> e(angles.loops.data(), norm.rows());
    EXPECT_NEAR(length, e.dot(norm * e), 1e-9 * length);
  }
}

TEST(PennerSystem, AnglesThatAreNoNumbersHaveNoStep) {
  test::PennerState state;
  PennerAngles angles = state.measured();
  angles.max_error = std::numeric_limits<double>::infinity();
  PennerSystem system;
  PennerDirection direction;
  EXPECT_FALSE(system.solve(state.engine->mesh(), *state.loops, angles, direction, state.context));
  EXPECT_EQ(direction.scale.size(), at(0));
}

}  // namespace
}  // namespace flipfree::seamless::penner_system_test
