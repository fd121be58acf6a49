#include "flipfree/unwrap/chart/chart.h"

#include <gtest/gtest.h>

#include "flipfree/unwrap/chart/overlapping_faces.h"
#include "unwrap/chart/touching.h"

namespace flipfree::unwrap::chart_test {
namespace {

TEST(FlattenChart, makes_no_cut_that_cuts_nothing_where_the_chart_only_touches_itself) {
  const mesh::Surface chart = test::flat_and_touching_itself();
  FlattenOptions options;
  options.may_add_cuts = true;
  ExecutionContext context;
  Stats stats;
  const FlatChart flat = flatten_chart(chart, options, context, stats);
  EXPECT_TRUE(flat.cut.empty());
  EXPECT_EQ(flat.uv.rows(), chart.vertices.rows());
  EXPECT_TRUE(overlapping_faces(chart.faces, flat.uv, context).empty());
}

}  // namespace
}  // namespace flipfree::unwrap::chart_test
