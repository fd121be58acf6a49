// The shortest step against the dense pseudo-inverse.
#include "flipfree/seamless/penner/shortest_system.h"

#include <gtest/gtest.h>

#include <Eigen/Dense>

#include "seamless/penner/penner_state.h"
#include "support/dense.h"

namespace flipfree::seamless::shortest_system_test {
namespace {

Eigen::VectorXd vector_of(const std::vector<double>& x) {
  return Eigen::Map<const Eigen::VectorXd>(x.data(), static_cast<Eigen::Index>(x.size()));
}

// Derivatives of all vertices' angles, then the loops', by the logarithms of lengths, by the
// formula for one triangle: d alpha_a = (cot b + cot c) d log a - cot c d log b - cot b d log c.
Eigen::MatrixXd jacobian_of(const test::PennerState& state, const PennerAngles& angles) {
  const intrinsic::IntrinsicMesh& mesh = state.engine->mesh();
  const auto vertices = static_cast<Eigen::Index>(angles.vertices.value.size());
  const auto edges = static_cast<Eigen::Index>(mesh.edge_count());
  Eigen::MatrixXd j =
      Eigen::MatrixXd::Zero(vertices + static_cast<Eigen::Index>(state.loops->size()), edges);
  for (HalfedgeId h = 0; h < static_cast<HalfedgeId>(mesh.halfedge_count()); ++h) {
    const HalfedgeId n = mesh.next_of(h), p = mesh.previous(h);
    const double b = angles.cotangent[static_cast<std::size_t>(n)];
    const double c = angles.cotangent[static_cast<std::size_t>(p)];
    const Index v = mesh.unknown[static_cast<std::size_t>(mesh.origin_of(p))];
    j(v, h >> 1) += b + c;
    j(v, n >> 1) -= c;
    j(v, p >> 1) -= b;
  }
  j.bottomRows(static_cast<Eigen::Index>(state.loops->size())) =
      Eigen::MatrixXd(loop_derivatives(mesh, *state.loops, angles.cotangent)).transpose();
  return j;
}

TEST(ShortestSystem, TheStepMeetsAllEquationsAndIsTheOneNearestToTheWish) {
  test::PennerState state;
  state.targets.loop_angle.assign(state.loops->size(), 0.2);
  const PennerAngles angles = state.measured();
  const Eigen::MatrixXd j = jacobian_of(state, angles);
  Eigen::VectorXd right(j.rows());
  right << vector_of(angles.vertices.value), vector_of(angles.loops);
  std::mt19937 random(3);
  std::uniform_real_distribution<double> uniform(-0.1, 0.1);
  for (const bool wishing : {false, true}) {
    std::vector<double> wish(state.engine->mesh().edge_count(), 0.0);
    if (wishing) {
      for (double& w : wish) w = uniform(random);
    }
    ShortestSystem system;
    std::vector<double> direction;
    ASSERT_TRUE(
        system.solve(state.engine->mesh(), *state.loops, angles, wish, direction, state.context));
    const Eigen::VectorXd d = vector_of(direction), w = vector_of(wish);
    EXPECT_LT((j * d - right).cwiseAbs().maxCoeff(), 1e-9);
    const Eigen::VectorXd best = w + test::shortest_least_squares(j, right - j * w);
    EXPECT_LT((d - best).norm(), 1e-8 * (1 + best.norm()));
  }
}

TEST(ShortestSystem, WithoutLoopsVerticesAloneAreMet) {
  test::PennerState state;
  state.loops = std::make_unique<intrinsic::LoopCarrier>(state.engine->mesh(),
                                                         std::vector<intrinsic::DualLoop>{});
  state.targets.loop_angle.clear();
  const PennerAngles angles = state.measured();
  const Eigen::MatrixXd j = jacobian_of(state, angles);
  ShortestSystem system;
  std::vector<double> direction;
  ASSERT_TRUE(system.solve(state.engine->mesh(), *state.loops, angles,
                           std::vector<double>(state.engine->mesh().edge_count(), 0.0), direction,
                           state.context));
  EXPECT_LT((j * vector_of(direction) - vector_of(angles.vertices.value)).cwiseAbs().maxCoeff(),
            1e-9);
}

}  // namespace
}  // namespace flipfree::seamless::shortest_system_test
