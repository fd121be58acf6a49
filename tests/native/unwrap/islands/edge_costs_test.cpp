#include "flipfree/unwrap/seams/costs.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "flipfree/base/error.h"
#include "support/corner_maps.h"
#include "support/shapes.h"

namespace flipfree::unwrap::edge_costs_test {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();

// Two triangles over the edge 0 1 of length 2, the second raised by the angle.
mesh::Surface hinge(double angle) {
  mesh::Surface surface;
  surface.vertices.resize(4, 3);
  surface.vertices << 0, 0, 0, 2, 0, 0, 1, 1, 0, 1, -std::cos(angle), std::sin(angle);
  surface.faces.resize(2, 3);
  surface.faces << 0, 1, 2, 1, 0, 3;
  return surface;
}

double cost_of_hinge(double angle, const SeamOptions& options = {}) {
  const mesh::Surface surface = hinge(angle);
  return edge_costs(surface, test::adjacency_of(surface), {}, options)[0];
}

TEST(EdgeCosts, are_lengths_and_less_along_creases_and_in_hollows) {
  EXPECT_DOUBLE_EQ(cost_of_hinge(0.0), 2.0);
  EXPECT_LT(cost_of_hinge(-1.0), cost_of_hinge(-0.5));
  EXPECT_LT(cost_of_hinge(-0.5), 2.0);
  EXPECT_LT(cost_of_hinge(1.0), cost_of_hinge(-1.0));
  EXPECT_GT(cost_of_hinge(3.0), 0.0);
}

TEST(EdgeCosts, are_multiplied_by_weights) {
  SeamOptions options;
  options.weighted.resize(1, 2);
  options.weighted << 1, 0;
  options.weights = {3.0};
  EXPECT_DOUBLE_EQ(cost_of_hinge(0.0, options), 6.0);
  options.weights = {kInfinity};
  EXPECT_EQ(cost_of_hinge(0.0, options), kInfinity);
  options.weights = {0.0};
  EXPECT_LT(cost_of_hinge(0.0, options), 0.01);
  options.weights = {-1.0};
  EXPECT_THROW(cost_of_hinge(0.0, options), InvalidInput);
  options.weights = {1.0, 1.0};
  EXPECT_THROW(cost_of_hinge(0.0, options), InvalidInput);
  options.weights = {1.0};
  options.weighted << 2, 3;
  EXPECT_THROW(cost_of_hinge(0.0, options), InvalidInput);
}

TEST(EdgeCosts, are_infinite_along_diagonals) {
  const mesh::Surface surface = hinge(1.0);
  mesh::EdgeFlags uncuttable(6, 0);
  uncuttable[0] = uncuttable[3] = 1;
  const mesh::Adjacency adjacency = test::adjacency_of(surface);
  EXPECT_EQ(edge_costs(surface, adjacency, uncuttable, {})[0], kInfinity);
  EXPECT_EQ(with_sharp_edges(surface, adjacency, mesh::EdgeFlags(6, 0), uncuttable, 0.5)[0], 0);
}

TEST(EdgeCosts, sharp_edges_are_those_above_the_angle) {
  const mesh::Surface surface = hinge(1.0);
  const mesh::Adjacency adjacency = test::adjacency_of(surface);
  const mesh::EdgeFlags none(6, 0);
  EXPECT_EQ(with_sharp_edges(surface, adjacency, none, {}, 0.9)[0], 1);
  EXPECT_EQ(with_sharp_edges(surface, adjacency, none, {}, 0.9)[3], 1);
  EXPECT_EQ(with_sharp_edges(surface, adjacency, none, {}, 1.1), none);
  EXPECT_EQ(with_sharp_edges(surface, adjacency, none, {}, 0.0), none);
}

// A triangle whose corners are on one line but for rounding has a normal that says nothing.
TEST(EdgeCosts, faces_without_a_shape_have_no_sharp_edges) {
  mesh::Surface surface;
  surface.vertices.resize(5, 3);
  surface.vertices << 0, 0, 0, 1, 0, 0, 0.5, 0, 1e-17, 0.5, 1, 0, 0.5, -1, 0;
  surface.faces.resize(3, 3);
  surface.faces << 0, 1, 3, 1, 0, 2, 2, 4, 1;
  const mesh::Adjacency adjacency = test::adjacency_of(surface);
  const mesh::EdgeFlags none(adjacency.opposite.size(), 0);
  EXPECT_EQ(with_sharp_edges(surface, adjacency, none, {}, 0.5), none);
  const std::vector<double> cost = edge_costs(surface, adjacency, {}, {});
  EXPECT_DOUBLE_EQ(cost[0], 1.0);
}

}  // namespace
}  // namespace flipfree::unwrap::edge_costs_test
