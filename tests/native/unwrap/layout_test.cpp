#include "flipfree/unwrap/layout.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <random>

namespace flipfree {
namespace {

// Rounding of a few operations on numbers of size one.
constexpr double kRounding = 1e-14;

std::vector<Vector2> rectangles(std::size_t count, double longest, unsigned seed) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> side(0.01, 1.0);
  std::vector<Vector2> sizes;
  for (std::size_t i = 0; i < count; ++i) sizes.emplace_back(side(random), side(random) * longest);
  return sizes;
}

// The least distance between two packed rectangles, or one and the square's border; negative if
// they overlap.
double least_gap(const std::vector<Vector2>& sizes, const Placement& placement) {
  double least = std::numeric_limits<double>::infinity();
  const auto low = [&](std::size_t i) -> Vector2 { return placement.offset[i] * placement.scale; };
  const auto high = [&](std::size_t i) -> Vector2 {
    return (placement.offset[i] + sizes[i]) * placement.scale;
  };
  for (std::size_t i = 0; i < sizes.size(); ++i) {
    least = std::min({least, low(i).minCoeff(), 1.0 - high(i).maxCoeff()});
    for (std::size_t j = 0; j < i; ++j) {
      const Vector2 apart = (low(i) - high(j)).cwiseMax(low(j) - high(i));
      least = std::min(least, apart.maxCoeff());
    }
  }
  return least;
}

TEST(Layout, packed_rectangles_keep_the_margin_in_the_final_square) {
  for (const double margin : {0.0, 0.005, 0.02}) {
    for (const std::size_t count : {1U, 2U, 7U, 200U, 1500U}) {
      for (const double longest : {1.0, 30.0}) {
        const std::vector<Vector2> sizes = rectangles(count, longest, 7);
        const double asked =
            std::min(margin, 0.9 / (std::ceil(std::sqrt(static_cast<double>(count))) + 1.0));
        EXPECT_GE(least_gap(sizes, pack_rectangles(sizes, margin)), asked - kRounding)
            << count << " rectangles up to " << longest << ", margin " << margin;
      }
    }
  }
}

TEST(Layout, a_margin_without_room_is_lowered_instead_of_refused) {
  const std::vector<Vector2> sizes = rectangles(400, 1.0, 3);
  const Placement placement = pack_rectangles(sizes, 0.4);
  EXPECT_GE(least_gap(sizes, placement), 0.9 / 21.0 - kRounding);
  EXPECT_GT(placement.scale, 0.0);
}

TEST(Layout, equal_squares_fill_most_of_the_square) {
  const std::vector<Vector2> sizes(100, Vector2(1.0, 1.0));
  EXPECT_GE(pack_rectangles(sizes, 0.0).scale, 0.1 / 1.02);
}

TEST(Layout, rectangles_without_size_are_placed_without_scaling) {
  const Placement placement = pack_rectangles({Vector2::Zero(), Vector2::Zero()}, 0.1);
  EXPECT_EQ(placement.scale, 1.0);
  EXPECT_TRUE(placement.offset[0].allFinite() && placement.offset[1].allFinite());
}

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

}  // namespace
}  // namespace flipfree
