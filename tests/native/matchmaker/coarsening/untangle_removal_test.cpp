#include "flipfree/matchmaker/coarsening/untangle_removal.h"

#include <gtest/gtest.h>

#include "flipfree/distortion/untangle.h"
#include "flipfree/matchmaker/coarsening/remove_vertex.h"
#include "matchmaker/refined_maps.h"

namespace flipfree::matchmaker::untangle_removal_test {
namespace {

TEST(RemoveByUntangling, RemovesWhatThinningLeavesAndStaysValid) {
  ExecutionContext context;
  auto [surface, v, keep, map] = test::drawn_out_square(context);
  const Index there = map.surface.mesh.vertex_count() - keep;
  ASSERT_GT(there, 10);
  const Points2 before = map.uv;
  const Index removed = remove_by_untangling(map, {v}, keep, context);
  EXPECT_GT(2 * removed, there);
  map = mesh::compacted_map(map);
  EXPECT_EQ(map.surface.mesh.vertex_count(), keep + there - removed);
  test::expect_valid(map);
  EXPECT_TRUE(
      distortion::find_flips(map.surface.mesh.faces(), map.uv.cast<float>().cast<double>(), context)
          .empty());
  EXPECT_EQ(map.uv.row(v), before.row(v)) << "a held vertex has moved";
  for (const VertexId b : map.surface.boundary) EXPECT_EQ(map.uv.row(b), before.row(b));
}

TEST(RemoveByUntangling, LeavesHeldVerticesAndThoseBelowTheLimit) {
  ExecutionContext context;
  auto [surface, v, keep, map] = test::drawn_out_square(context);
  const Index count = map.surface.mesh.vertex_count();
  const Points2 before = map.uv;
  EXPECT_EQ(remove_by_untangling(map, {v}, count, context), 0);
  std::vector<VertexId> all;
  for (VertexId w = 0; w < count; ++w) all.push_back(w);
  EXPECT_EQ(remove_by_untangling(map, all, keep, context), 0);
  EXPECT_EQ(map.uv, before);
}

TEST(RemoveByUntangling, WhatFailedIsNotTriedAgainUntilItsNeighbourhoodHasChanged) {
  ExecutionContext context;
  auto [surface, v, keep, map] = test::drawn_out_square(context);
  UntangleRemovalOptions options;
  VainRemovals vain;
  options.iterations = 1;  // most need more
  options.vain = &vain;
  while (remove_by_untangling(map, {v}, keep, context, options) > 0) map = mesh::compacted_map(map);
  ASSERT_FALSE(vain.empty());
  const std::size_t known = vain.size();
  // All that is left failed in the last pass: nothing is new in another one.
  EXPECT_EQ(remove_by_untangling(map, {v}, keep, context, options), 0);
  EXPECT_EQ(vain.size(), known);
  // Larger neighbourhoods are others: they are tried, and fail on their own account or do not.
  options.rings = 3;
  const Index removed = remove_by_untangling(map, {v}, keep, context, options);
  EXPECT_TRUE(removed > 0 || vain.size() > known);
  test::expect_valid(mesh::compacted_map(map));
}

}  // namespace
}  // namespace flipfree::matchmaker::untangle_removal_test
