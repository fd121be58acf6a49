#include "flipfree/unwrap/seams/search.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "flipfree/certify/measures.h"
#include "flipfree/mesh/shortest_paths.h"
#include "flipfree/mesh/topology.h"
#include "flipfree/unwrap/seams/costs.h"
#include "support/corner_maps.h"
#include "support/shapes.h"

namespace flipfree::unwrap::carried_slits_test {
namespace {

mesh::Topology shape_of(const mesh::Surface& chart, const Slits& slits) {
  const mesh::CutMesh cut = mesh::cut_along(chart.faces, test::adjacency_of(chart), slits.cut);
  return mesh::topology(
      cut.faces, mesh::build_adjacency(static_cast<Index>(cut.vertex_origin.size()), cut.faces));
}

TEST(CarriedSlits, open_a_large_ball_within_the_bound) {
  const mesh::Surface ball = test::sphere(160, 100);
  const mesh::Adjacency adjacency = test::adjacency_of(ball);
  ExecutionContext context;
  const Slits slits = find_slits(ball, adjacency, edge_costs(ball, adjacency, {}, {}), {}, context);
  EXPECT_TRUE(shape_of(ball, slits).is_disk());
  ASSERT_EQ(slits.corner_uv.rows(), 3 * ball.faces.rows());
  EXPECT_LE(certify::symmetric_dirichlet(ball, slits.corner_uv).mean, 1.025);
}

TEST(CarriedSlits, open_a_large_tube_along_its_length) {
  const mesh::Surface tube = test::cylinder(160, 100);
  const mesh::Adjacency adjacency = test::adjacency_of(tube);
  ExecutionContext context;
  const Slits slits = find_slits(tube, adjacency, edge_costs(tube, adjacency, {}, {}), {}, context);
  EXPECT_TRUE(shape_of(tube, slits).is_disk());
  EXPECT_LT(std::count(slits.cut.begin(), slits.cut.end(), 1), 2 * 130);
}

TEST(CarriedSlits, never_run_along_edges_that_cost_infinitely_much) {
  const mesh::Surface ball = test::sphere(160, 100);
  const mesh::Adjacency adjacency = test::adjacency_of(ball);
  std::vector<double> cost = edge_costs(ball, adjacency, {}, {});
  for (HalfedgeId h = 0; h < static_cast<HalfedgeId>(cost.size()); ++h) {
    // All but meridians and circles of latitude.
    const auto a = ball.vertices.row(mesh::source(ball.faces, h));
    const auto b = ball.vertices.row(mesh::target(ball.faces, h));
    const bool level = std::abs(a.z() - b.z()) < 1e-9;
    const bool upright = std::abs(a.x() * b.y() - a.y() * b.x()) < 1e-9;
    if (!level && !upright) cost[static_cast<std::size_t>(h)] = mesh::ShortestPaths::kUnreached;
  }
  ExecutionContext context;
  const Slits slits = find_slits(ball, adjacency, cost, {}, context);
  ASSERT_FALSE(slits.cut.empty());
  EXPECT_TRUE(shape_of(ball, slits).is_disk());
  for (std::size_t h = 0; h < cost.size(); ++h)
    EXPECT_FALSE(slits.cut[h] != 0 && cost[h] == mesh::ShortestPaths::kUnreached);
}

TEST(CarriedSlits, are_the_same_for_any_number_of_threads) {
  const mesh::Surface ball = test::sphere(160, 100);
  const mesh::Adjacency adjacency = test::adjacency_of(ball);
  const std::vector<double> cost = edge_costs(ball, adjacency, {}, {});
  ExecutionContext one;
  one.threads = 1;
  ExecutionContext four;
  four.threads = 4;
  const Slits a = find_slits(ball, adjacency, cost, {}, one);
  const Slits b = find_slits(ball, adjacency, cost, {}, four);
  EXPECT_EQ(a.cut, b.cut);
  EXPECT_EQ(a.corner_uv, b.corner_uv);
}

}  // namespace
}  // namespace flipfree::unwrap::carried_slits_test
