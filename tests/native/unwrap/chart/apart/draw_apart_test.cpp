#include "flipfree/unwrap/chart/apart/draw_apart.h"

#include <gtest/gtest.h>

#include <cmath>

#include "flipfree/unwrap/chart/overlapping_faces.h"
#include "unwrap/chart/touching.h"

namespace flipfree::unwrap::draw_apart_test {
namespace {

// Diagonals of the squares.
constexpr double kLongestEdge = 0.914;

TEST(DrawApart, opens_corners_that_lie_on_each_other_but_for_rounding) {
  const mesh::Surface chart = test::flat_and_touching_itself();
  const ExecutionContext context;
  int overlapping = 0;
  for (const double right : {-1.0, 0.0, 1.0}) {
    for (const double up : {-1.0, 0.0, 1.0}) {
      Points2 uv = chart.vertices.leftCols(2);
      uv(10, 0) = std::nextafter(uv(10, 0), uv(10, 0) + right);
      uv(10, 1) = std::nextafter(uv(10, 1), uv(10, 1) + up);
      const Points2 before = uv;
      overlapping += overlapping_faces(chart.faces, uv, context).empty() ? 0 : 1;
      EXPECT_TRUE(draw_apart(chart.faces, uv, context)) << right << ' ' << up;
      EXPECT_TRUE(overlapping_faces(chart.faces, uv, context).empty());
      for (VertexId v = 0; v < static_cast<VertexId>(uv.rows()); ++v) {
        if (v != 3 && v != 10 && v != 19 && v != 20) {
          EXPECT_EQ(uv.row(v), before.row(v));
        } else {
          const double moved = (uv.row(v) - before.row(v)).norm();
          EXPECT_GT(moved, 1e-5);
          EXPECT_LE(moved, kLongestEdge / 64.0);
        }
      }
    }
  }
  EXPECT_GT(overlapping, 0);
}

}  // namespace
}  // namespace flipfree::unwrap::draw_apart_test
