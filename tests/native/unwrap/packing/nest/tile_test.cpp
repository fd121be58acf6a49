#include "flipfree/unwrap/packing/nest/shape.h"

#include <gtest/gtest.h>

#include <cmath>

#include "unwrap/packing/nest/shapes.h"

namespace flipfree::unwrap::tile_test {
namespace {

Mask mask_of(const Shape& shape, double angle = 0.0) {
  Pen pen;
  return draw_shape(shape, {std::cos(angle), std::sin(angle)}, 1.0, 0.0, pen);
}

TEST(Tile, the_lowest_and_then_leftmost_place_is_found) {
  Tile tile(100);
  const Mask wide = mask_of(test::box_shape(59.5, 9.5));
  const Mask small = mask_of(test::box_shape(29.5, 9.5));
  tile.put(wide, *tile.lowest(wide, 0, 100));
  const auto beside = tile.lowest(small, 0, 100);
  ASSERT_TRUE(beside);
  EXPECT_EQ(beside->x, 60);
  EXPECT_EQ(beside->y, 0);
  tile.put(small, *beside);
  EXPECT_EQ(tile.lowest(small, 0, 100)->y, 10);
  EXPECT_EQ(tile.lowest(small, 30, 100)->y, 30);
  EXPECT_FALSE(tile.lowest(small, 0, 5));
  EXPECT_FALSE(tile.lowest(mask_of(test::box_shape(101.0, 1.0)), 0, 100));
}

TEST(Tile, it_agrees_with_trying_every_place) {
  Tile tile(130);
  const std::vector<Mask> masks = {mask_of(test::frame(40.0), 0.4),
                                   mask_of(test::box_shape(70, 3), 1.0),
                                   mask_of(test::box_shape(9, 9), 0.2), mask_of(test::frame(20.0))};
  for (int i = 0; i < 12; ++i) {
    const Mask& mask = masks[static_cast<std::size_t>(i % 4)];
    const auto cell = tile.lowest(mask, 0, 130);
    bool found = false;
    for (int y = 0; y < 130 && !found; ++y) {
      for (int x = 0; x < 130 && !found; ++x) {
        if (!tile.fits(mask, {x, y})) continue;
        found = true;
        ASSERT_TRUE(cell);
        EXPECT_EQ(cell->x, x);
        EXPECT_EQ(cell->y, y);
      }
    }
    ASSERT_EQ(found, cell.has_value());
    if (cell) tile.put(mask, *cell);
  }
}

TEST(Tile, what_is_taken_away_leaves_its_cells_free) {
  Tile tile(64);
  const Mask mask = mask_of(test::box_shape(40.0, 40.0), 0.3);
  tile.put(mask, {3, 5});
  EXPECT_FALSE(tile.fits(mask, {4, 5}));
  tile.take(mask, {3, 5});
  EXPECT_TRUE(tile.fits(mask, {4, 5}));
}

}  // namespace
}  // namespace flipfree::unwrap::tile_test
