#include "flipfree/intrinsic/layout/chart_placement.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

#include "flipfree/base/plane.h"

namespace flipfree::intrinsic::chart_placement_test {
namespace {

// Two right triangles, charts of their own, turned and far away.
Development two_charts() {
  Development development;
  const auto put = [&](double x, double y, double angle, double a, double b) {
    const long double c = std::cos(angle), s = std::sin(angle);
    for (const auto& [u, v] : {std::pair{0.0, 0.0}, std::pair{a, 0.0}, std::pair{0.0, b}})
      development.corner.push_back({x + c * u - s * v, y + s * u + c * v});
  };
  put(100, 7, 0.7, 3, 1);
  put(-5, 1e3, 2.0, 1, 2);
  development.chart_of_face = {0, 1};
  development.chart_count = 2;
  return development;
}

mesh::Adjacency separate_faces() {
  Triangles faces(2, 3);
  faces << 0, 1, 2, 3, 4, 5;
  return mesh::build_adjacency(6, faces);
}

TEST(ChartPlacement, ChartsAreLevelInTheUnitSquareAtOneScaleAndApart) {
  const Development development = two_charts();
  const ChartPlacement placement = place_charts(development, separate_faces(), ExecutionContext());
  std::vector<Vector2> p;
  for (Index c = 0; c < 6; ++c)
    p.push_back(placement.apply(development.corner[static_cast<std::size_t>(c)], c / 3));
  for (const Vector2& x : p) {
    EXPECT_GE(x.minCoeff(), -1e-12);
    EXPECT_LE(x.maxCoeff(), 1 + 1e-12);
  }
  const auto scale = static_cast<double>(placement.scale);
  EXPECT_NEAR((p[1] - p[0]).norm(), 3 * scale, 1e-12);
  EXPECT_NEAR((p[5] - p[3]).norm(), 2 * scale, 1e-12);
  // The longest boundary edges are the hypotenuses.
  EXPECT_NEAR(p[1].y(), p[2].y(), 1e-12);
  EXPECT_NEAR(p[4].y(), p[5].y(), 1e-12);
  for (Index c = 0; c < 6; c += 3) {
    const auto i = static_cast<std::size_t>(c);
    EXPECT_GT(twice_area(p[i], p[i + 1], p[i + 2]), 0.0);
  }
  const auto extent = [&](std::size_t from, bool low) {
    const double x[3] = {p[from].x(), p[from + 1].x(), p[from + 2].x()};
    return low ? *std::min_element(x, x + 3) : *std::max_element(x, x + 3);
  };
  EXPECT_TRUE(extent(0, false) < extent(3, true) || extent(3, false) < extent(0, true) ||
              std::min(p[0].y(), p[2].y()) > std::max(p[3].y(), p[5].y()) ||
              std::min(p[3].y(), p[5].y()) > std::max(p[0].y(), p[2].y()));
}

TEST(ChartPlacement, TheFinestPlaceIsWhereTheLeastFaceIs) {
  Development development = two_charts();
  for (std::size_t c = 3; c < 6; ++c) {
    development.corner[c].x = -5 + 1e-6L * (development.corner[c].x + 5);
    development.corner[c].y = 1e3L + 1e-6L * (development.corner[c].y - 1e3L);
  }
  ChartPlacement placement = place_charts(development, separate_faces(), ExecutionContext());
  placement.origin = finest_place(development, placement, {0, 1});
  const Vector2 least = placement.apply(development.corner[3], 1);
  EXPECT_LT(least.norm(), 1e-12) << "32-bit numbers are finest around zero";
}

}  // namespace
}  // namespace flipfree::intrinsic::chart_placement_test
