#include "flipfree/unwrap/packing/nest/nest.h"

#include <gtest/gtest.h>

#include <cmath>

#include "flipfree/unwrap/packing/nest/inflate.h"
#include "unwrap/packing/nest/shapes.h"

namespace flipfree::unwrap::nest_test {
namespace {

std::vector<Shape> mixed() {
  std::vector<Shape> shapes = {test::frame(1.0)};
  for (int i = 1; i < 12; ++i) shapes.push_back(test::box_shape(0.1 + 0.05 * i, 0.2));
  return shapes;
}

TEST(Nest, gaps_are_met_and_everything_lies_in_the_tile) {
  const std::vector<Shape> shapes = mixed();
  for (const Rotation rotation : {Rotation::kFree, Rotation::kQuarters, Rotation::kNone}) {
    ExecutionContext context;
    NestOptions options;
    options.margin = 0.004;
    options.rotation = rotation;
    const Layout layout = nest(shapes, options, context);
    ASSERT_GT(layout.scale, 0.0);
    EXPECT_FALSE(any_crossing(shapes, layout.poses, layout.scale, {}, context));
    for (const Contact& c : test::contacts(shapes, layout.poses, layout.scale, {}, 0.01))
      EXPECT_GE(c.gap, 0.004 - 1e-6);
    for (std::size_t i = 0; i < shapes.size(); ++i) {
      const Vector2& turn = layout.poses[i].turn;
      if (rotation == Rotation::kNone) {
        EXPECT_EQ(turn, Vector2(1, 0));
      }
      if (rotation == Rotation::kQuarters) {
        EXPECT_EQ(turn.cwiseAbs().maxCoeff(), 1.0);
      }
      for (const Vector2& p : shapes[i].loops.front()) {
        EXPECT_GE(layout.poses[i](p, layout.scale).minCoeff(), 0.002 - 1e-6);
        EXPECT_LE(layout.poses[i](p, layout.scale).maxCoeff(), 0.998 + 1e-6);
      }
    }
  }
}

TEST(Nest, what_is_most_of_all_turns_by_any_angle) {
  // A square that is turned by 23 degrees, alone and with a small one.
  Loop square = test::box(1.0, 1.0);
  for (Vector2& p : square) p = Pose{{}, {std::cos(0.4), std::sin(0.4)}}(p, 1.0);
  Vector2 middle;
  std::vector<Shape> shapes = {make_shape({square}, 0.0, middle)};
  NestOptions options;
  options.margin = 0.002;
  ExecutionContext context;
  EXPECT_GT(nest(shapes, options, context).scale, 0.99);
  shapes.push_back(test::box_shape(0.1, 0.1));
  EXPECT_GT(nest(shapes, options, context).scale, 0.89);
}

TEST(Nest, straight_shapes_stay_along_the_axes_where_that_is_asked) {
  std::vector<Shape> shapes = {test::box_shape(4.0, 1.0)};
  Loop triangle = {{0, 0}, {1, 0}, {0.5, 0.8}};
  Vector2 middle;
  shapes.push_back(make_shape({triangle}, 0.0, middle));
  NestOptions options;
  options.margin = 0.002;
  ExecutionContext context;
  const double free = nest(shapes, options, context).scale;
  options.rotation = Rotation::kStraight;
  const Layout layout = nest(shapes, options, context);
  EXPECT_EQ(layout.poses[0].turn.cwiseAbs().maxCoeff(), 1.0);
  EXPECT_LE(layout.scale, 0.25);
  EXPECT_GT(free, 0.26);  // on the diagonal
}

TEST(Nest, the_bits_do_not_depend_on_threads) {
  const std::vector<Shape> shapes = mixed();
  NestOptions options;
  options.effort = 0.2;
  ExecutionContext one;
  one.threads = 1;
  ExecutionContext four;
  four.threads = 4;
  const Layout a = nest(shapes, options, one);
  const Layout b = nest(shapes, options, four);
  EXPECT_EQ(a.scale, b.scale);
  for (std::size_t i = 0; i < shapes.size(); ++i) {
    EXPECT_EQ(a.poses[i].centre, b.poses[i].centre);
    EXPECT_EQ(a.poses[i].turn, b.poses[i].turn);
  }
}

TEST(Nest, a_scale_that_is_wanted_is_met_exactly_if_there_is_room) {
  ExecutionContext context;
  NestOptions options;
  options.scale = 0.3;
  EXPECT_EQ(nest(mixed(), options, context).scale, 0.3);
  options.scale = 30.0;
  const double largest = nest(mixed(), options, context).scale;
  EXPECT_LT(largest, 1.2);
  EXPECT_GT(largest, 0.5);
}

TEST(Nest, what_is_fixed_is_kept_clear_of) {
  ExecutionContext context;
  Points2 lower(6, 2);
  lower << 0, 0, 1, 0, 0, 0.5, 1, 0, 1, 0.5, 0, 0.5;
  NestOptions options;
  options.fixed = &lower;
  const std::vector<Shape> shapes = mixed();
  const Layout layout = nest(shapes, options, context);
  ASSERT_GT(layout.scale, 0.0);
  for (std::size_t i = 0; i < shapes.size(); ++i) {
    for (const Vector2& p : shapes[i].loops.front())
      EXPECT_GE(layout.poses[i](p, layout.scale).y(), 0.502 - 1e-6);
  }
}

TEST(Nest, effort_is_not_spent_where_nothing_is_gained) {
  // The whole of a hundred times the effort would be minutes.
  for (const int count : {2, 3, 6, 9}) {
    const std::vector<Shape> squares(static_cast<std::size_t>(count), test::box_shape(1.0, 1.0));
    ExecutionContext context;
    NestOptions options;
    const Layout layout = nest(squares, options, context);
    options.effort = 100.0;
    EXPECT_EQ(nest(squares, options, context).scale, layout.scale) << count;
    const double side = std::ceil(std::sqrt(count));
    const double largest = 1.0 / side - options.margin;
    EXPECT_LE(layout.scale, largest * (1.0 + 1e-9)) << count;
    EXPECT_GT(layout.scale, largest * (1.0 - 0.0005)) << count;  // the last step of the search
  }
}

TEST(Nest, cancelling_ends_it) {
  ExecutionContext context;
  context.cancel();
  EXPECT_ANY_THROW(nest(mixed(), {}, context));
}

}  // namespace
}  // namespace flipfree::unwrap::nest_test
