#include "flipfree/unwrap/seams/slits/search/search.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "flipfree/certify/measures/energy.h"
#include "flipfree/unwrap/islands/edge_costs.h"
#include "support/corner_maps.h"
#include "support/shapes.h"

namespace flipfree::unwrap {
namespace {

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
  SlitSearch search(ball, adjacency, cost, {}, context);
  const Slits loose = search.run(1.1);
  const double short_slits = length_of(ball, loose.cut);
  const Slits tight = search.run(1.01);
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
  SlitSearch search(ball, adjacency, cost, {}, context);
  const Slits slits = search.run(1.1);
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
  SlitSearch search(ball, adjacency, cost, {}, context);
  search.run(1.001);
  EXPECT_TRUE(search.exhausted());
  EXPECT_TRUE(search.opened_anyhow());
}

}  // namespace
}  // namespace flipfree::unwrap
