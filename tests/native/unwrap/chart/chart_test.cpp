#include "flipfree/unwrap/chart/chart.h"

#include <gtest/gtest.h>

#include <cmath>

#include "flipfree/unwrap/chart/overlapping_faces.h"
#include "support/shapes.h"

namespace flipfree::unwrap {
namespace {

// 3 x 3 squares with slits: vertices 3 and 10, 19 and 20 are two corners each that lie
// in one place of the plane, where the chart is at rest.
mesh::Surface flat_and_touching_itself() {
  mesh::Surface chart;
  chart.faces.resize(24, 3);
  chart.faces << 0, 1, 2, 0, 2, 3, 1, 4, 5, 1, 5, 2, 4, 6, 7, 4, 8, 5, 3, 2, 9, 10, 11, 12,      //
      2, 5, 13, 2, 13, 11, 5, 8, 14, 5, 15, 13, 12, 11, 16, 12, 16, 17, 11, 13, 18, 11, 18, 16,  //
      13, 15, 19, 13, 20, 18, 2, 11, 9, 11, 10, 9, 8, 15, 14, 15, 5, 14, 6, 8, 7, 8, 4, 7;
  const double far = 0.96915635090782171;
  const double near = 0.32305211696927394;
  const double other = 0.32305211696927383;
  const double fold = 0.75378827292830552;
  const double inner = 0.10768403898975809;
  chart.vertices.resize(21, 3);
  chart.vertices << -far, -far, 0, -near, -far, 0, -near, -near, 0, -far, -near, 0, other, -far, 0,
      other, -near, 0, far, -far, 0, fold, -0.75378827292830586, 0, far, -near, 0,
      -0.5384201949487899, -inner, 0, -far, -near, 0, -near, other, 0, -far, other, 0, other, other,
      0, fold, -inner, 0, far, other, 0, -near, far, 0, -far, far, 0, other, far, 0, far, far, 0,
      far, far, 0;
  return chart;
}

TEST(FlattenChart, makes_no_cut_that_cuts_nothing_where_the_chart_only_touches_itself) {
  const mesh::Surface chart = flat_and_touching_itself();
  FlattenOptions options;
  options.may_add_cuts = true;
  ExecutionContext context;
  Stats stats;
  const FlatChart flat = flatten_chart(chart, options, context, stats);
  EXPECT_TRUE(flat.cut.empty());
  EXPECT_EQ(flat.uv.rows(), chart.vertices.rows());
  EXPECT_TRUE(overlapping_faces(chart.faces, flat.uv, context).empty());
}

TEST(DrawApart, opens_corners_that_lie_on_each_other_but_for_rounding) {
  const mesh::Surface chart = flat_and_touching_itself();
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
        }
      }
    }
  }
  EXPECT_GT(overlapping, 0);
}

}  // namespace
}  // namespace flipfree::unwrap
