#include "flipfree/unwrap/seams/search/shortened.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "flipfree/mesh/topology.h"
#include "flipfree/unwrap/islands/edge_costs.h"
#include "support/corner_maps.h"
#include "support/shapes.h"

namespace flipfree::unwrap::shortened_test {
namespace {

std::size_t edges_in(const std::vector<Sheet::Way>& ways) {
  std::size_t sum = 0;
  for (const Sheet::Way& way : ways) sum += way.edges.size();
  return sum;
}

mesh::Topology shape_of(const mesh::Surface& chart, const mesh::EdgeFlags& edges) {
  const mesh::CutMesh cut = mesh::cut_along(chart.faces, test::adjacency_of(chart), edges);
  return mesh::topology(
      cut.faces, mesh::build_adjacency(static_cast<Index>(cut.vertex_origin.size()), cut.faces));
}

TEST(Shortened, slits_are_taken_back_as_far_as_the_scale_field_allows) {
  const mesh::Surface ball = test::sphere(64, 48);
  const mesh::Adjacency adjacency = test::adjacency_of(ball);
  const std::vector<double> cost = edge_costs(ball, adjacency, {}, {});
  ExecutionContext context;
  Sheet sheet(ball, adjacency, cost);
  sheet.open_closed(context);
  for (int i = 0; i < 3; ++i) sheet.slit_best(sheet.scale(context), 2, context);
  const double tight = sheet.excess(sheet.scale(context));
  std::size_t edges = edges_in(sheet.ways());
  for (const double most : {2.0 * tight, 4.0 * tight, 8.0 * tight}) {
    const Shortened slits = shortened(sheet, most, context);
    EXPECT_LE(slits.excess, most);
    EXPECT_LT(edges_in(slits.ways), edges);
    edges = edges_in(slits.ways);
    EXPECT_TRUE(shape_of(ball, sheet.edges(slits.ways)).is_disk());
    // What it says is what the scale field of these slits says.
    Sheet anew(ball, adjacency, cost);
    for (const std::vector<VertexId>& way : sheet.parts(slits.ways))
      EXPECT_TRUE(anew.slit_between(way.front(), way.back(), context));
    EXPECT_EQ(anew.cut(), sheet.edges(slits.ways));
    EXPECT_NEAR(anew.excess(anew.scale(context)), slits.excess, 1e-9);
  }
  EXPECT_EQ(edges_in(shortened(sheet, tight, context).ways), edges_in(sheet.ways()));
}

TEST(Shortened, what_opens_a_tube_or_a_ball_stays) {
  ExecutionContext context;
  const mesh::Surface tube = test::cylinder(12, 4);
  const mesh::Adjacency of_tube = test::adjacency_of(tube);
  const std::vector<double> tube_cost = edge_costs(tube, of_tube, {}, {});
  Sheet sheet(tube, of_tube, tube_cost);
  ASSERT_TRUE(sheet.slit_best(sheet.scale(context), 1, context));
  EXPECT_TRUE(shape_of(tube, sheet.edges(shortened(sheet, 1e3, context).ways)).is_disk());
  const mesh::Surface ball = test::sphere(12, 8);
  const mesh::Adjacency of_ball = test::adjacency_of(ball);
  const std::vector<double> ball_cost = edge_costs(ball, of_ball, {}, {});
  Sheet round(ball, of_ball, ball_cost);
  round.open_closed(context);
  EXPECT_TRUE(shape_of(ball, round.edges(shortened(round, 1e9, context).ways)).is_disk());
}

// Ended sooner, it would stretch what can be rolled out.
TEST(Shortened, a_slit_to_the_tip_of_a_cone_stays) {
  mesh::Surface cone = test::grid(16, 16);
  for (Eigen::Index v = 0; v < cone.vertices.rows(); ++v) {
    const Eigen::Index far = std::max(std::abs(v % 17 - 8), std::abs(v / 17 - 8));
    cone.vertices.row(v) << static_cast<double>(v % 17 - 8), static_cast<double>(v / 17 - 8),
        -static_cast<double>(far);
  }
  const mesh::Adjacency adjacency = test::adjacency_of(cone);
  ExecutionContext context;
  const std::vector<double> cost = edge_costs(cone, adjacency, {}, {});
  Sheet sheet(cone, adjacency, cost);
  ASSERT_TRUE(sheet.slit_best(sheet.scale(context), 1, context));
  ASSERT_EQ(edges_in(sheet.ways()), 8);
  EXPECT_EQ(edges_in(shortened(sheet, 0.05, context).ways), 8);
}

TEST(Shortened, the_same_ends_are_reached_again) {
  const mesh::Surface ball = test::sphere(32, 24);
  const mesh::Adjacency adjacency = test::adjacency_of(ball);
  const std::vector<double> cost = edge_costs(ball, adjacency, {}, {});
  ExecutionContext context;
  Sheet sheet(ball, adjacency, cost);
  sheet.open_closed(context);
  for (int i = 0; i < 4; ++i) sheet.slit_best(sheet.scale(context), 2, context);
  const Shortened slits = shortened(sheet, 0.0, context);
  ASSERT_FALSE(slits.ends.empty());
  Sheet anew(ball, adjacency, cost);
  ASSERT_TRUE(anew.connect(slits.ends, context));
  EXPECT_TRUE(shape_of(ball, anew.cut()).is_disk());
  for (const VertexId end : slits.ends) EXPECT_NE(anew.open()[static_cast<std::size_t>(end)], 0);
}

}  // namespace
}  // namespace flipfree::unwrap::shortened_test
