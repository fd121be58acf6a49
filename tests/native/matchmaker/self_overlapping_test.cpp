#include "flipfree/matchmaker/target/self_overlapping.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "flipfree/numeric/predicates.h"

namespace flipfree::matchmaker::self_overlapping_test {
namespace {

// A ribbon of the given width whose middle line winds `turns` times around a circle, drifting
// outwards by `drift` per turn: it overlaps itself when the drift is smaller than the width.
Polygon ribbon(double turns, double width, double drift, int steps) {
  Polygon outer;
  Polygon inner;
  for (int i = 0; i <= steps; ++i) {
    const double angle = 2 * std::numbers::pi * turns * i / steps;
    const double radius = 2 + drift * angle / (2 * std::numbers::pi);
    const Vector2 direction(std::cos(angle), std::sin(angle));
    outer.emplace_back((radius + width / 2) * direction);
    inner.emplace_back((radius - width / 2) * direction);
  }
  std::reverse(inner.begin(), inner.end());
  outer.insert(outer.end(), inner.begin(), inner.end());
  return outer;
}

double area(const Polygon& p) {
  double twice = 0;
  for (std::size_t i = 0; i < p.size(); ++i) {
    const Vector2& a = p[i];
    const Vector2& b = p[(i + 1) % p.size()];
    twice += a.x() * b.y() - a.y() * b.x();
  }
  return twice / 2;
}

void expect_disk(const Polygon& polygon, const SelfOverlap& result) {
  ASSERT_TRUE(result.exists);
  ASSERT_EQ(result.triangles.rows(), static_cast<Eigen::Index>(polygon.size()) - 2);
  double sum = 0;
  for (Eigen::Index t = 0; t < result.triangles.rows(); ++t) {
    const auto at = [&](Index k) {
      return polygon[static_cast<std::size_t>(result.triangles(t, k))];
    };
    EXPECT_GT(numeric::orientation(at(0), at(1), at(2)), 0);
    sum += area({at(0), at(1), at(2)});
  }
  EXPECT_NEAR(sum, area(polygon), 1e-9 * std::abs(sum));
}

TEST(SelfOverlapping, RibbonsThatOverlapOnceAndTwiceAreDisks) {
  ExecutionContext context;
  for (const double turns : {0.9, 1.6, 2.7}) {
    const Polygon polygon = ribbon(turns, 1.0, 0.3, 60);
    const SelfOverlap result = find_self_overlap(polygon, context);
    EXPECT_EQ(result.turning_number, 1);
    expect_disk(polygon, result);
    EXPECT_TRUE(result.singular_corners.empty());
  }
}

TEST(SelfOverlapping, FigureEightAndClockwisePolygonsAreRefused) {
  ExecutionContext context;
  EXPECT_FALSE(find_self_overlap({{0, 0}, {2, 2}, {2, 0}, {0, 2}}, context).exists);
  Polygon clockwise = ribbon(0.9, 1.0, 0.3, 20);
  std::reverse(clockwise.begin(), clockwise.end());
  EXPECT_FALSE(find_self_overlap(clockwise, context).exists);
}

TEST(SelfOverlapping, TurningNumberOneAloneIsNotEnough) {
  // One clockwise curl below the bottom side (winding number -1) and one counter-clockwise curl
  // inside.
  ExecutionContext context;
  const Polygon curled = {{0, 0},   {3, 0},   {3, -1}, {2, -1}, {2, 0.5}, {7, 0.5},
                          {7, 1.5}, {6, 1.5}, {6, 0},  {10, 0}, {10, 10}, {0, 10}};
  const SelfOverlap result = find_self_overlap(curled, context);
  EXPECT_EQ(result.turning_number, 1);
  EXPECT_FALSE(result.exists);
}

TEST(SelfOverlapping, DoubleLoopHasOneSingularCorner) {
  // Two rounds that share a corner region: the inner angle at one corner exceeds 2 pi.
  ExecutionContext context;
  const Polygon twice = {{0, 0}, {4, 0}, {4, 4}, {-1, 4}, {-1, 1}, {3, 1}, {3, 3}, {0, 3}};
  const SelfOverlap result = find_self_overlap(twice, context);
  EXPECT_EQ(result.turning_number, 2);
  expect_disk(twice, result);
  EXPECT_EQ(result.singular_corners.size(), 1U);
}

TEST(SelfOverlapping, SimplePolygonsWithCollinearSamplesAreDisks) {
  ExecutionContext context;
  Polygon comb;
  for (int i = 0; i < 8; ++i) {
    for (const double y : {0.25, 0.5, 1.0}) comb.emplace_back(i, y);
    for (const double y : {1.0, 0.5, 0.25}) comb.emplace_back(i + 0.5, y);
  }
  std::reverse(comb.begin(), comb.end());
  comb.emplace_back(0, 0);
  comb.emplace_back(4, 0);
  comb.emplace_back(8, 0);
  const SelfOverlap result = find_self_overlap(comb, context);
  expect_disk(comb, result);
}

TEST(SelfOverlapping, SlitMustLieInside) {
  ExecutionContext context;
  EXPECT_TRUE(
      find_self_overlap({{0, 0}, {0.5, 0.6}, {0, 0}, {1, 0}, {1, 1}, {0, 1}}, context).exists);
  EXPECT_FALSE(
      find_self_overlap({{0, 0}, {-0.5, -0.6}, {0, 0}, {1, 0}, {1, 1}, {0, 1}}, context).exists);
}

}  // namespace
}  // namespace flipfree::matchmaker::self_overlapping_test
