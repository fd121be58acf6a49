#include "flipfree/unwrap/seams/search/sheet.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "flipfree/unwrap/islands/edge_costs.h"
#include "support/corner_maps.h"
#include "support/shapes.h"

namespace flipfree::unwrap::sheet_test {
namespace {

TEST(Sheet, slits_between_the_ends_of_others_are_the_same) {
  for (const mesh::Surface& chart : {test::sphere(24, 16), test::cylinder(24, 16)}) {
    const mesh::Adjacency adjacency = test::adjacency_of(chart);
    const std::vector<double> cost = edge_costs(chart, adjacency, {}, {});
    ExecutionContext context;
    Sheet sheet(chart, adjacency, cost);
    EXPECT_FALSE(sheet.open_closed(context));
    for (int i = 0; i < 3; ++i) sheet.slit_best(sheet.scale(context), 2, context);
    Sheet again(chart, adjacency, cost);
    for (const std::vector<VertexId>& way : sheet.made())
      EXPECT_TRUE(again.slit_between(way.front(), way.back(), context));
    EXPECT_GT(std::count(sheet.cut().begin(), sheet.cut().end(), 1), 0);
    EXPECT_EQ(again.cut(), sheet.cut());
  }
}

TEST(Sheet, tells_where_there_is_no_way) {
  const mesh::Surface chart = test::grid(6, 6);
  const mesh::Adjacency adjacency = test::adjacency_of(chart);
  const std::vector<double> cost(adjacency.opposite.size(), mesh::ShortestPaths::kUnreached);
  Sheet sheet(chart, adjacency, cost);
  ExecutionContext context;
  const VertexId middle = 3 * 7 + 3;
  EXPECT_FALSE(sheet.slit_between(middle, 0, context));
  EXPECT_EQ(std::count(sheet.cut().begin(), sheet.cut().end(), 1), 0);
}

// Two rims of a tube: whichever is the outside, the other is at the other end of the slit.
TEST(Sheet, the_ends_of_a_slit_may_be_given_either_way_round) {
  const mesh::Surface chart = test::cylinder(12, 4);
  const mesh::Adjacency adjacency = test::adjacency_of(chart);
  const std::vector<double> cost = edge_costs(chart, adjacency, {}, {});
  ExecutionContext context;
  const VertexId other = static_cast<VertexId>(chart.vertices.rows()) - 12;
  Sheet one(chart, adjacency, cost);
  Sheet two(chart, adjacency, cost);
  EXPECT_TRUE(one.slit_between(0, other, context));
  EXPECT_TRUE(two.slit_between(other, 0, context));
  EXPECT_EQ(one.cut(), two.cut());
  EXPECT_EQ(std::count(one.cut().begin(), one.cut().end(), 1), 2 * 4);
}

}  // namespace
}  // namespace flipfree::unwrap::sheet_test
