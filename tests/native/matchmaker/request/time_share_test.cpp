#include "flipfree/matchmaker/request/time_share.h"

#include <gtest/gtest.h>

#include "matchmaker/refined_maps.h"

namespace flipfree::matchmaker::time_share_test {
namespace {

TEST(TimeShare, WhatIsHalfDoneIsCompacted) {
  const mesh::Surface surface = test::grid(4, 4);
  mesh::RefinedMap map = test::split_flat(surface, 3);
  const Index count = map.surface.mesh.vertex_count();
  EXPECT_FALSE(while_time_lasts(map, [&] {
    ASSERT_TRUE(VertexRemover(map).remove(count - 1));
    throw TimeIsOver();
  }));
  EXPECT_EQ(map.surface.mesh.vertex_count(), count - 1);
  test::expect_valid(map);
}

}  // namespace
}  // namespace flipfree::matchmaker::time_share_test
