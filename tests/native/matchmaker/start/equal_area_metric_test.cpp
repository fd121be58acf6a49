#include "flipfree/matchmaker/start/first_try.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "flipfree/distortion/untangle.h"
#include "support/shapes.h"

namespace flipfree::matchmaker::equal_area_metric_test {
namespace {

double least_area(const Triangles& faces, const Points2& uv) {
  double least = std::numeric_limits<double>::infinity();
  for (Eigen::Index f = 0; f < faces.rows(); ++f) {
    const Vector2 a = (uv.row(faces(f, 1)) - uv.row(faces(f, 0))).transpose();
    const Vector2 b = (uv.row(faces(f, 2)) - uv.row(faces(f, 0))).transpose();
    least = std::min(least, 0.5 * (a.x() * b.y() - a.y() * b.x()));
  }
  return least;
}

TEST(EqualAreaMetric, GivesSqueezedTrianglesRoomAndHoldsTheBoundary) {
  const mesh::Surface surface = test::grid(24, 24);
  Points2 uv = surface.vertices.leftCols(2);
  for (Eigen::Index v = 0; v < uv.rows(); ++v) {
    uv(v, 0) +=
        0.14 * std::sin(2 * std::numbers::pi * uv(v, 0)) * std::sin(std::numbers::pi * uv(v, 1));
  }
  ExecutionContext context;
  ASSERT_TRUE(distortion::find_flips(surface.faces, uv, context).empty());
  const double mean = 1.0 / static_cast<double>(surface.faces.rows());
  ASSERT_LT(least_area(surface.faces, uv), 0.3 * mean);
  const mesh::RefinedSurface refined = mesh::make_refined_surface(surface);
  const mesh::Surface even = equal_area_metric(refined, uv, context);
  const Points2 there = even.vertices.leftCols(2);
  EXPECT_TRUE(distortion::find_flips(even.faces, there, context).empty());
  EXPECT_GT(least_area(even.faces, there), 0.7 * mean);
  EXPECT_TRUE((even.vertices.col(2).array() == 0).all());
  for (const VertexId b : refined.boundary) EXPECT_EQ(there.row(b), uv.row(b));
}

}  // namespace
}  // namespace flipfree::matchmaker::equal_area_metric_test
