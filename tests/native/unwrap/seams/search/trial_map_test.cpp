#include "flipfree/unwrap/seams/search/trial_map.h"

#include <gtest/gtest.h>

#include "flipfree/unwrap/chart/flattening.h"
#include "support/corner_maps.h"
#include "support/shapes.h"

namespace flipfree::unwrap::trial_map_test {
namespace {

TEST(TrialMap, goes_on_from_the_last_map_where_a_slit_is_added) {
  const mesh::Surface dome = test::bumpy_grid(16, 16, 0.6, 1.0);
  const mesh::Adjacency adjacency = test::adjacency_of(dome);
  ExecutionContext context;
  TrialMap map(dome);
  mesh::EdgeFlags cut(adjacency.opposite.size(), 0);
  const double whole = map.relax(adjacency, cut, 1e-4, context).energy;
  IndexPairs slit(8, 2);
  for (Index i = 0; i < 8; ++i) slit.row(i) << 17 * 8 + i, 17 * 8 + i + 1;
  cut = mesh::flag_edges(dome.faces, adjacency, slit);
  const double relieved = map.relax(adjacency, cut, 1e-4, context).energy;
  EXPECT_LT(relieved - 1.0, 0.8 * (whole - 1.0));
  TrialMap at_once(dome);
  EXPECT_NEAR(relieved, at_once.relax(adjacency, cut, 1e-4, context).energy, 1e-3);
  EXPECT_FALSE(map.overlaps_itself(context));
  EXPECT_EQ(map.corner_uv().rows(), 3 * dome.faces.rows());
}

// A saddle's angle is too large for the plane: the sides of a slit into it lie on each other.
TEST(TrialMap, is_held_apart_or_divided_where_it_overlaps) {
  mesh::Surface saddle = test::grid(16, 16);
  const double width = saddle.vertices.col(0).maxCoeff(),
               height = saddle.vertices.col(1).maxCoeff();
  for (Eigen::Index v = 0; v < saddle.vertices.rows(); ++v) {
    const double x = 2.0 * saddle.vertices(v, 0) / width - 1.0;
    const double y = 2.0 * saddle.vertices(v, 1) / height - 1.0;
    saddle.vertices.row(v) << x, y, 1.2 * x * y;
  }
  const mesh::Adjacency adjacency = test::adjacency_of(saddle);
  IndexPairs slit(8, 2);
  for (Index i = 0; i < 8; ++i) slit.row(i) << 17 * 8 + i, 17 * 8 + i + 1;
  const mesh::EdgeFlags cut = mesh::flag_edges(saddle.faces, adjacency, slit);
  ExecutionContext context;
  TrialMap map(saddle);
  const double free = map.relax(adjacency, cut, 1e-4, context).energy;
  ASSERT_TRUE(map.overlaps_itself(context));
  const TrialMap::Apart held = map.hold_apart({10.0, 100.0}, true, {}, context);
  EXPECT_TRUE(held.cut.empty());
  EXPECT_GT(held.stretch.energy, free);
  const TrialMap::Apart divided = map.hold_apart({1.0, 100.0}, true, {}, context);
  EXPECT_FALSE(divided.cut.empty());
  EXPECT_EQ(divided.apart.rows(), 3 * saddle.faces.rows());
  EXPECT_TRUE(map.hold_apart({1.0, 100.0}, false, {}, context).cut.empty());
}

}  // namespace
}  // namespace flipfree::unwrap::trial_map_test
