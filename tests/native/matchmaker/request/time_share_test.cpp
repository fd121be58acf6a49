#include "flipfree/matchmaker/request/time_share.h"

#include <gtest/gtest.h>

#include "matchmaker/refined_maps.h"

namespace flipfree::matchmaker {
namespace {

// A clock that goes on by one second at every look at it.
void tick(ExecutionContext& context) {
  context.clock = [now = 0.0]() mutable { return now += 1.0; };
}

TEST(TimeShare, AWayThatRunsOutOfItsShareIsGivenUp) {
  ExecutionContext context;
  tick(context);
  const TimeLimit all(context, 1000);
  EXPECT_TRUE(ended_in_share(context, [&] { context.check(); }));
  EXPECT_FALSE(ended_in_share(context, [&] {
    const TimeLimit share(context, 3);
    while (true) context.check();
  }));
}

TEST(TimeShare, WhenAllTimeIsOverTheCallEnds) {
  ExecutionContext context;
  tick(context);
  const TimeLimit all(context, 5);
  const auto endless = [&] {
    while (true) context.check();
  };
  EXPECT_THROW(ended_in_share(context, endless), TimeIsOver);
  EXPECT_FALSE(ended_in_time(endless));
}

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
}  // namespace flipfree::matchmaker
