#include "flipfree/unwrap/packing/layout.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <random>

namespace flipfree::unwrap::layout_test {
namespace {

// Rounding of a few operations on numbers of size one.
constexpr double kRounding = 1e-14;

TEST(Layout, no_other_direction_gives_a_smaller_rectangle) {
  std::mt19937 random(11);
  std::normal_distribution<double> normal;
  for (int cloud = 0; cloud < 20; ++cloud) {
    Points2 points(40, 2);
    for (Eigen::Index i = 0; i < points.rows(); ++i)
      points.row(i) << 3.0 * normal(random) + normal(random), normal(random);
    Points2 turned = points;
    turn_to_smallest_rectangle(turned);
    const Vector2 extent = turned.colwise().maxCoeff().transpose();
    EXPECT_NEAR(turned.colwise().minCoeff().norm(), 0.0, kRounding);
    EXPECT_GE(extent.x(), extent.y());
    constexpr int kDirections = 1800;
    for (int d = 0; d < kDirections; ++d) {
      const double angle = std::numbers::pi * d / kDirections;
      const Eigen::VectorXd x = points * Vector2(std::cos(angle), std::sin(angle));
      const Eigen::VectorXd y = points * Vector2(-std::sin(angle), std::cos(angle));
      const double area = (x.maxCoeff() - x.minCoeff()) * (y.maxCoeff() - y.minCoeff());
      EXPECT_LE(extent.prod(), area * (1.0 + 1e-12));
    }
  }
}

TEST(Layout, a_similarity_is_found_again_from_its_points) {
  std::mt19937 random(5);
  std::normal_distribution<double> normal;
  Points2 from(9, 2);
  for (Eigen::Index i = 0; i < from.size(); ++i) from.data()[i] = normal(random);
  const Similarity known{Vector2(-0.3, 1.7), Vector2(4.0, -2.0)};
  Points2 to(9, 2);
  for (Eigen::Index i = 0; i < from.rows(); ++i)
    to.row(i) = known(from.row(i).transpose()).transpose();
  const Similarity found = fit_similarity(from, to);
  EXPECT_LT((found.linear - known.linear).norm(), kRounding);
  EXPECT_LT((found.translation - known.translation).norm(), kRounding);
}

TEST(Layout, a_motion_turns_and_moves_but_scales_nothing) {
  Points2 from(3, 2);
  from << 0, 0, 2, 0, 0, 1;
  Similarity larger;
  larger.linear = Vector2(0.0, 3.0);  // a quarter turn
  larger.translation = Vector2(5.0, -1.0);
  const Points2 to = moved(larger, from);
  const Points2 found = moved(fit_motion(from, to), from);
  EXPECT_NEAR((found.colwise().mean() - to.colwise().mean()).norm(), 0.0, kRounding);
  EXPECT_NEAR((found.row(1) - found.row(0) - Eigen::RowVector2d(0.0, 2.0)).norm(), 0.0, kRounding);
  EXPECT_EQ(moved(fit_motion(from, Points2::Zero(3, 2)), from).row(1) -
                moved(fit_motion(from, Points2::Zero(3, 2)), from).row(0),
            Eigen::RowVector2d(2.0, 0.0));
}

}  // namespace
}  // namespace flipfree::unwrap::layout_test
