#include "flipfree/unwrap/packing/nest/fill.h"

#include <gtest/gtest.h>

#include "unwrap/packing/nest/shapes.h"

namespace flipfree::unwrap::fill_test {
namespace {

struct Squares {
  std::vector<Shape> shapes;
  std::vector<std::vector<Vector2>> turns;
  std::vector<std::size_t> order;
  ExecutionContext context;
  explicit Squares(std::size_t count) {
    for (std::size_t i = 0; i < count; ++i) {
      shapes.push_back(test::box_shape(0.1, 0.1));
      turns.push_back(even_turns(4));
      order.push_back(i);
    }
  }
  Masks masks(double scale) { return draw_shapes(shapes, turns, scale, 256, 0.001, context); }
};

TEST(Fill, quarter_turns_are_exact) {
  const std::vector<Vector2> turns = even_turns(8);
  EXPECT_EQ(turns[0], Vector2(1, 0));
  EXPECT_EQ(turns[2], Vector2(0, 1));
  EXPECT_EQ(turns[4], Vector2(-1, 0));
  EXPECT_EQ(turns[6], Vector2(0, -1));
}

TEST(Fill, what_fits_is_placed_and_what_does_not_is_counted) {
  Squares squares(100);
  const Masks masks = squares.masks(0.95);
  const Filling full =
      fill(squares.shapes, masks, Tile(256), squares.order, {}, 1.0, squares.context);
  EXPECT_TRUE(full.complete());
  const Filling partly =
      fill(squares.shapes, squares.masks(1.2), Tile(256), squares.order, {}, 1.0, squares.context);
  EXPECT_NEAR(partly.missing, 0.36, 0.01) << "64 of 100 fit";
}

TEST(Fill, places_do_not_overlap_and_lie_in_the_tile) {
  Squares squares(80);
  const Masks masks = squares.masks(1.0);
  const Filling filling =
      fill(squares.shapes, masks, Tile(256), squares.order, {0.5, 1.0}, 1.0, squares.context);
  ASSERT_TRUE(filling.complete());
  const std::vector<Pose> poses = poses_of(filling, masks, squares.turns);
  for (std::size_t i = 0; i < poses.size(); ++i) {
    EXPECT_GT(poses[i].centre.minCoeff(), 0.05);
    EXPECT_LT(poses[i].centre.maxCoeff(), 0.95);
    for (std::size_t j = 0; j < i; ++j)
      EXPECT_GT((poses[i].centre - poses[j].centre).cwiseAbs().maxCoeff(), 0.102);
  }
}

TEST(Fill, a_hole_that_was_left_is_mended) {
  Squares squares(80);
  const Masks masks = squares.masks(1.0);
  Filling filling = fill(squares.shapes, masks, Tile(256), squares.order, {}, 1.0, squares.context);
  filling.turn[17] = -1;
  filling.missing = 1.0 / 80.0;
  EXPECT_TRUE(
      mend(squares.shapes, masks, Tile(256), filling, 1, {100, 1e8}, squares.context).complete());
  EXPECT_FALSE(
      mend(squares.shapes, masks, Tile(256), filling, 1, {100, 0.0}, squares.context).complete());
  EXPECT_FALSE(
      mend(squares.shapes, masks, Tile(256), filling, 1, {0, 1e8}, squares.context).complete());
}

TEST(Fill, what_is_carried_to_a_larger_scale_is_missing_where_it_does_not_fit) {
  Squares squares(81);
  const Filling filling =
      fill(squares.shapes, squares.masks(1.0), Tile(256), squares.order, {}, 1.0, squares.context);
  EXPECT_TRUE(carry(squares.shapes, squares.masks(1.0), Tile(256), filling).complete());
  EXPECT_FALSE(carry(squares.shapes, squares.masks(1.3), Tile(256), filling).complete());
}

}  // namespace
}  // namespace flipfree::unwrap::fill_test
