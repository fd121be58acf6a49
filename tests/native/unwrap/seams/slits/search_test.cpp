#include "flipfree/unwrap/seams/slits/search.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "flipfree/certify/measures/energy.h"
#include "flipfree/unwrap/islands/edge_costs.h"
#include "support/corner_maps.h"
#include "support/shapes.h"

namespace flipfree::unwrap {
namespace {

TEST(SlitSearch, a_lower_bound_goes_on_from_the_slits_that_there_are) {
  const mesh::Surface ball = test::sphere(32, 24);
  const mesh::Adjacency adjacency = test::adjacency_of(ball);
  const std::vector<double> cost = edge_costs(ball, adjacency, {}, {});
  ExecutionContext context;
  SlitSearch search(ball, adjacency, cost, {}, context);
  const Slits loose = search.run(1.1);
  const std::size_t made = search.made().size();
  const Slits tight = search.run(1.01);
  EXPECT_LE(certify::symmetric_dirichlet(ball, loose.corner_uv).mean, 1.1);
  EXPECT_LE(certify::symmetric_dirichlet(ball, tight.corner_uv).mean, 1.01);
  EXPECT_GT(search.made().size(), made);
  for (std::size_t h = 0; h < tight.cut.size(); ++h) EXPECT_GE(tight.cut[h], loose.cut[h]);
  EXPECT_FALSE(search.exhausted());
  EXPECT_FALSE(search.opened_anyhow());
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
