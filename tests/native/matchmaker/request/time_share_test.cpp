#include "flipfree/matchmaker/request/time_share.h"

#include <gtest/gtest.h>

#include "matchmaker/refined_maps.h"

namespace flipfree::matchmaker::time_share_test {
namespace {

TEST(TimeShare, WhatIsHalfDoneIsCompacted) {
  const mesh::Surface surface = test::grid(4, 4);
  mesh::RefinedMap map = test::split_flat(surface, 3);
  ExecutionContext context;
  const Index count = map.surface.mesh.vertex_count();
  EXPECT_FALSE(while_time_lasts(map, [&] {
    std::vector<char> removable(static_cast<std::size_t>(count), 0);
    removable.back() = 1;
    ASSERT_EQ(remove_vertices(map, removable, context), 1);
    throw TimeIsOver();
  }));
  EXPECT_EQ(map.surface.mesh.vertex_count(), count - 1);
  test::expect_valid(map);
}

}  // namespace
}  // namespace flipfree::matchmaker::time_share_test
