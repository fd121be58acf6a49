#include "flipfree/unwrap/seams/search/search.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "flipfree/certify/measures.h"
#include "flipfree/unwrap/chart/stretch.h"
#include "flipfree/unwrap/islands/edge_costs.h"
#include "support/corner_maps.h"
#include "support/shapes.h"

namespace flipfree::unwrap::search_test {
namespace {

// Of any ratio.
Stretch mean_of(double energy) { return {energy, std::numeric_limits<double>::infinity()}; }

double length_of(const mesh::Surface& chart, const mesh::EdgeFlags& cut) {
  double sum = 0.0;
  for (HalfedgeId h = 0; h < static_cast<HalfedgeId>(cut.size()); ++h) {
    if (cut[static_cast<std::size_t>(h)] != 0) {
      sum += 0.5 * (chart.vertices.row(mesh::source(chart.faces, h)) -
                    chart.vertices.row(mesh::target(chart.faces, h)))
                       .norm();
    }
  }
  return sum;
}

TEST(SlitSearch, a_lower_bound_goes_on_from_the_slits_that_there_are) {
  const mesh::Surface ball = test::sphere(32, 24);
  const mesh::Adjacency adjacency = test::adjacency_of(ball);
  const std::vector<double> cost = edge_costs(ball, adjacency, {}, {});
  ExecutionContext context;
  SlitSearch search(ball, adjacency, cost, kNoMirror, {}, context);
  const Slits loose = search.run(mean_of(1.1));
  const double short_slits = length_of(ball, loose.cut);
  const Slits tight = search.run(mean_of(1.01));
  EXPECT_LE(certify::symmetric_dirichlet(ball, loose.corner_uv).mean, 1.1);
  EXPECT_LE(certify::symmetric_dirichlet(ball, tight.corner_uv).mean, 1.01);
  EXPECT_GT(length_of(ball, tight.cut), short_slits);
  EXPECT_FALSE(search.exhausted());
  EXPECT_FALSE(search.opened_anyhow());
}

TEST(SlitSearch, slits_are_no_longer_than_the_bound_asks_for) {
  const mesh::Surface ball = test::sphere(48, 48);
  const mesh::Adjacency adjacency = test::adjacency_of(ball);
  ExecutionContext context;
  const std::vector<double> cost = edge_costs(ball, adjacency, {}, {});
  SlitSearch search(ball, adjacency, cost, kNoMirror, {}, context);
  const Slits slits = search.run(mean_of(1.1));
  const double energy = certify::symmetric_dirichlet(ball, slits.corner_uv).mean;
  EXPECT_LE(energy, 1.1);
  EXPECT_GT(energy, 1.07);
  mesh::EdgeFlags again(adjacency.opposite.size(), 0);
  Sheet sheet(ball, adjacency, cost);
  for (const std::vector<VertexId>& way : search.made())
    EXPECT_TRUE(sheet.slit_between(way.front(), way.back(), context));
  EXPECT_EQ(sheet.cut(), slits.cut);
}

TEST(SlitSearch, tells_that_nothing_is_left_to_be_slit) {
  const mesh::Surface ball = test::sphere(8, 6);
  const mesh::Adjacency adjacency = test::adjacency_of(ball);
  const std::vector<double> cost(adjacency.opposite.size(), mesh::ShortestPaths::kUnreached);
  ExecutionContext context;
  SlitSearch search(ball, adjacency, cost, kNoMirror, {}, context);
  search.run(mean_of(1.001));
  EXPECT_TRUE(search.exhausted());
  EXPECT_TRUE(search.opened_anyhow());
}

// A lamp: a dome whose apex alone is stretched too much.
TEST(SlitSearch, slits_the_tips_of_maps_whose_mean_is_within_the_bound) {
  mesh::Surface peak = test::grid(40, 40);
  for (Eigen::Index v = 0; v < peak.vertices.rows(); ++v) {
    const double x = 2.0 * peak.vertices(v, 0) / peak.vertices.col(0).maxCoeff() - 1.0;
    const double y = 2.0 * peak.vertices(v, 1) / peak.vertices.col(1).maxCoeff() - 1.0;
    peak.vertices.row(v) << x, y, 0.6 * std::exp(-30.0 * (x * x + y * y));
  }
  const mesh::Adjacency adjacency = test::adjacency_of(peak);
  const std::vector<double> cost = edge_costs(peak, adjacency, {}, {});
  ExecutionContext context;
  const Stretch bound{1.06, 1.6};
  SlitSearch mean_only(peak, adjacency, cost, kNoMirror, {}, context);
  const Slits whole = mean_only.run(mean_of(bound.energy));
  ASSERT_GT(stretch_of(peak, whole.corner_uv).ratio, bound.ratio);
  SlitSearch search(peak, adjacency, cost, kNoMirror, {}, context);
  const Slits slit = search.run(bound);
  EXPECT_TRUE(stretch_of(peak, slit.corner_uv).within(bound));
  EXPECT_GT(length_of(peak, slit.cut), length_of(peak, whole.cut));
}

TEST(SlitSearch, slits_of_a_symmetric_chart_are_symmetric) {
  const mesh::Surface ball = test::sphere(32, 24);
  const mesh::Adjacency adjacency = test::adjacency_of(ball);
  std::vector<double> cost = edge_costs(ball, adjacency, {}, {});
  for (HalfedgeId h = 0; h < static_cast<HalfedgeId>(cost.size()); ++h) {
    // Quadrilaterals: their diagonals are no mirror images.
    const auto a = ball.vertices.row(mesh::source(ball.faces, h));
    const auto b = ball.vertices.row(mesh::target(ball.faces, h));
    const bool level = std::abs(a.z() - b.z()) < 1e-9;
    const bool upright = std::abs(a.x() * b.y() - a.y() * b.x()) < 1e-9;
    if (!level && !upright) cost[static_cast<std::size_t>(h)] = mesh::ShortestPaths::kUnreached;
  }
  ExecutionContext context;
  const Mirror mirror = find_mirror(ball, adjacency, cost);
  ASSERT_FALSE(mirror.empty());
  const std::vector<double> same = mirrored_costs(ball.faces, mirror, cost);
  SlitSearch search(ball, adjacency, same, mirror, {}, context);
  const Slits slits = search.run(mean_of(1.01));
  EXPECT_LE(certify::symmetric_dirichlet(ball, slits.corner_uv).mean, 1.01);
  for (std::size_t h = 0; h < slits.cut.size(); ++h) {
    if (slits.cut[h] != 0) {
      EXPECT_EQ(slits.cut[static_cast<std::size_t>(mirror.edge[h])], 1);
    }
  }
}

}  // namespace
}  // namespace flipfree::unwrap::search_test
