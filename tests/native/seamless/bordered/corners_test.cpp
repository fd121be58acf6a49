#include "flipfree/seamless/bordered/corners.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <numeric>
#include <random>

namespace flipfree::seamless::corners_test {
namespace {

using Points = std::vector<std::array<double, 2>>;

constexpr double kQuarterTurn = 0.5 * std::numbers::pi;

std::vector<std::vector<Index>> chosen(const std::vector<BorderCurve>& curves) {
  ExecutionContext context;
  return choose_corners(curves, context);
}

// A polygon, its inside on the left, that turns as polygons do.
BorderCurve curve_of(const Points& p) {
  BorderCurve curve;
  const std::size_t n = p.size();
  const auto angle = [&](std::size_t i) {
    const auto &a = p[i % n], &b = p[(i + 1) % n];
    return std::atan2(b[1] - a[1], b[0] - a[0]) / kQuarterTurn;
  };
  double turned = 0.0;
  for (std::size_t i = 0; i < n; ++i) {
    const auto &a = p[i], &b = p[(i + 1) % n];
    curve.length.push_back(std::hypot(b[0] - a[0], b[1] - a[1]));
    curve.turning.push_back(std::remainder(angle(i) - angle(i + n - 1), 4.0));
    turned += curve.turning.back();
  }
  curve.direction = angle(0);
  curve.wanted = static_cast<Index>(std::lround(turned));
  return curve;
}

std::vector<Index> corners_of(const std::vector<Index>& k) {
  std::vector<Index> corners;
  for (std::size_t i = 0; i < k.size(); ++i) {
    if (k[i] != 2) corners.push_back(static_cast<Index>(i));
  }
  return corners;
}

Index turning_of(const std::vector<Index>& k) {
  return std::accumulate(k.begin(), k.end(), Index{0}, [](Index s, Index a) { return s + 2 - a; });
}

// From point to point with so many edges each.
Points divided(const Points& corners, Index edges) {
  Points p;
  for (std::size_t i = 0; i < corners.size(); ++i) {
    const auto &a = corners[i], &b = corners[(i + 1) % corners.size()];
    for (Index j = 0; j < edges; ++j) {
      const double t = static_cast<double>(j) / edges;
      p.push_back({(1 - t) * a[0] + t * b[0], (1 - t) * a[1] + t * b[1]});
    }
  }
  return p;
}

TEST(Corners, OfAnLAreItsOwn) {
  const Points l = divided({{0, 0}, {3, 0}, {3, 1}, {1, 1}, {1, 3}, {0, 3}}, 4);
  for (const double turn : {0.0, 0.3, 1.1}) {
    Points turned;
    for (const auto& [x, y] : l)
      turned.push_back(
          {std::cos(turn) * x - std::sin(turn) * y, std::sin(turn) * x + std::cos(turn) * y});
    const auto k = chosen({curve_of(turned)}).front();
    EXPECT_EQ(corners_of(k), (std::vector<Index>{0, 4, 8, 12, 16, 20})) << turn;
    EXPECT_EQ(k[12], 3);
    EXPECT_EQ(turning_of(k), 4);
  }
}

TEST(Corners, OfACircleAreFourEvenlySpacedOnes) {
  Points circle;
  for (int i = 0; i < 40; ++i)
    circle.push_back(
        {std::cos(0.05 * i * std::numbers::pi), std::sin(0.05 * i * std::numbers::pi)});
  const auto corners = corners_of(chosen({curve_of(circle)}).front());
  ASSERT_EQ(corners.size(), 4U);
  for (std::size_t i = 1; i < 4; ++i) EXPECT_EQ(corners[i] - corners[i - 1], 10);
}

TEST(Corners, OfARingLieOppositeEachOther) {
  Points outer, inner;
  for (int i = 0; i < 40; ++i) {
    const double a = 0.05 * i * std::numbers::pi;
    outer.push_back({std::cos(a), std::sin(a)});
    inner.push_back({0.8 * std::cos(a), -0.8 * std::sin(a)});
  }
  const auto k = chosen({curve_of(outer), curve_of(inner)});
  const auto one = corners_of(k[0]), other = corners_of(k[1]);
  ASSERT_EQ(one.size(), 4U);
  ASSERT_EQ(other.size(), 4U);
  for (const Index i : other) {
    EXPECT_EQ(k[1][static_cast<std::size_t>(i)], 3);
    EXPECT_NE(std::find(one.begin(), one.end(), (40 - i) % 40), one.end());
  }
}

TEST(Corners, OfSidesAreNotTheTeethOnThem) {
  // A square, every other vertex between its corners moved out or in.
  std::mt19937 random(7);
  std::uniform_real_distribution<double> far(0.6, 1.2);
  Points square = divided({{0, 0}, {40, 0}, {40, 40}, {0, 40}}, 40);
  for (std::size_t i = 0; i < square.size(); ++i) {
    if (i % 40 == 0 || i % 2 == 0) continue;
    const double sign = i % 80 < 40 ? 1.0 : -1.0;
    square[i][i % 80 < 40 ? 1 : 0] += sign * far(random);
  }
  const BorderCurve curve = curve_of(square);
  const auto k = chosen({curve}).front();
  EXPECT_EQ(turning_of(k), 4);
  EXPECT_LE(corners_of(k).size(), 8U);
  for (const Index i : corners_of(k)) EXPECT_LE(std::min(i % 40, 40 - i % 40), 4) << i;
}

TEST(Corners, OfStepsAlongTheAxesAreAllOfThem) {
  Points steps;
  for (int i = 0; i < 10; ++i) {
    steps.push_back({1.0 * i, 1.0 * i});
    steps.push_back({1.0 * i + 1.0, 1.0 * i});
  }
  steps.push_back({10, 10});
  steps.push_back({0, 10});
  const auto k = chosen({curve_of(steps)}).front();
  EXPECT_EQ(turning_of(k), 4);
  EXPECT_EQ(corners_of(k).size(), 22U);
}

TEST(Corners, TurnAsWantedWhateverTheCurveDoes) {
  std::mt19937 random(11);
  std::uniform_real_distribution<double> length(0.1, 10.0), turning(-1.9, 1.9);
  for (Index n = 3; n < 40; ++n) {
    for (const Index wanted : {n, n - 1, Index{4}, Index{0}, Index{-4}, -3 * n}) {
      BorderCurve curve;
      for (Index i = 0; i < n; ++i) {
        curve.length.push_back(length(random));
        curve.turning.push_back(turning(random));
      }
      curve.wanted = wanted;
      const auto k = chosen({curve}).front();
      if (wanted > n) {
        EXPECT_TRUE(k.empty());
        continue;
      }
      ASSERT_EQ(k.size(), static_cast<std::size_t>(n)) << wanted;
      EXPECT_EQ(turning_of(k), wanted);
      EXPECT_GE(*std::min_element(k.begin(), k.end()), 1);
    }
  }
}

}  // namespace
}  // namespace flipfree::seamless::corners_test
