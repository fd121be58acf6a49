#include "flipfree/unwrap/packing/nest/inflate.h"

#include <gtest/gtest.h>

#include "unwrap/packing/nest/shapes.h"

namespace flipfree::unwrap::inflate_test {
namespace {

TEST(Inflate, squares_grow_until_they_fill_their_rows) {
  const ExecutionContext context;
  const std::vector<Shape> shapes(4, test::box_shape(1, 1));
  Layout start;
  start.scale = 0.4;
  for (const Vector2& p :
       {Vector2(0.25, 0.25), Vector2(0.74, 0.27), Vector2(0.26, 0.75), Vector2(0.75, 0.73)})
    start.poses.push_back({p, Vector2(1.0, 0.0)});
  InflateOptions options;
  options.margin = 0.01;
  options.work = 1e7;
  const Layout grown = inflate(shapes, start, options, context);
  EXPECT_GT(grown.scale, 0.488);
  EXPECT_LE(grown.scale, 0.4901);
  for (const Contact& c : test::contacts(shapes, grown.poses, grown.scale, {}, 0.02))
    EXPECT_GE(c.gap, 0.01 - 1e-6);
  options.most_scale = 0.45;
  EXPECT_EQ(inflate(shapes, start, options, context).scale, 0.45);
}

TEST(Inflate, shapes_that_may_not_turn_do_not) {
  const ExecutionContext context;
  const std::vector<Shape> shapes(2, test::box_shape(1, 0.5));
  const Layout start{{{Vector2(0.4, 0.2), Vector2(1, 0)}, {Vector2(0.6, 0.7), Vector2(1, 0)}}, 0.5};
  InflateOptions options;
  options.margin = 0.01;
  options.work = 1e6;
  options.may_turn.assign(shapes.size(), 0);
  const Layout grown = inflate(shapes, start, options, context);
  EXPECT_GT(grown.scale, 0.9);
  for (const Pose& pose : grown.poses) EXPECT_EQ(pose.turn, Vector2(1, 0));
}

}  // namespace
}  // namespace flipfree::unwrap::inflate_test
