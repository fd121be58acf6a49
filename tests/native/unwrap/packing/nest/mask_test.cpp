#include "flipfree/unwrap/packing/nest/shape.h"

#include <gtest/gtest.h>

#include <cmath>

#include "unwrap/packing/nest/shapes.h"

namespace flipfree::unwrap::mask_test {
namespace {

bool at(const Mask& mask, int x, int y) {
  return ((mask.bits[static_cast<std::size_t>(y * mask.words + x / 64)] >> (x % 64)) & 1) != 0;
}

TEST(Mask, cells_of_a_row_are_set_across_words_and_cut_to_its_width) {
  Word row[3] = {0, 0, 0};
  set_cells(row, 150, 60.5, 131.0);
  for (int x = 0; x < 192; ++x)
    EXPECT_EQ((row[x / 64] >> (x % 64)) & 1, static_cast<Word>(x >= 60 && x <= 131)) << x;
  set_cells(row, 150, -5.0, 1000.0);
  EXPECT_EQ(row[2], (Word{1} << 22) - 1);
}

TEST(Mask, a_box_takes_its_cells_and_the_margin_around) {
  Pen pen;
  const Mask mask = draw_shape(test::box_shape(10.0, 4.0), {1.0, 0.0}, 1.0, 1.0, pen);
  EXPECT_EQ(mask.width, 13);
  EXPECT_EQ(mask.height, 7);
  EXPECT_TRUE(at(mask, 6, 3));
  EXPECT_EQ(mask.row_begin.size(), 8u);
}

TEST(Mask, every_cell_within_the_radius_is_taken) {
  // By sampling: points of a turned frame, moved by up to the radius, lie in cells of the mask.
  const Shape shape = test::frame(30.0);
  const double radius = 2.3;
  const Vector2 turn(std::cos(0.3), std::sin(0.3));
  Pen pen;
  const Mask mask = draw_shape(shape, turn, 1.0, radius, pen);
  const Pose pose{mask.origin, turn};
  for (const Loop& loop : shape.loops) {
    for (std::size_t i = 0; i < loop.size(); ++i) {
      for (int s = 0; s <= 200; ++s) {
        const Vector2 p = loop[i] + s / 200.0 * (loop[(i + 1) % loop.size()] - loop[i]);
        for (int d = 0; d < 32; ++d) {
          const Vector2 q = pose(p, 1.0) + radius * Vector2(std::cos(0.2 * d), std::sin(0.2 * d));
          ASSERT_TRUE(at(mask, static_cast<int>(q.x()), static_cast<int>(q.y())));
        }
      }
    }
  }
  EXPECT_FALSE(at(mask, mask.width / 2, mask.height / 2)) << "the hole is free";
}

TEST(Mask, runs_are_the_bits) {
  Pen pen;
  const Mask mask = draw_shape(test::frame(100.0), {std::cos(1.0), std::sin(1.0)}, 1.0, 1.0, pen);
  for (int y = 0; y < mask.height; ++y) {
    int count = 0;
    for (int x = 0; x < mask.width; ++x) count += at(mask, x, y) ? 1 : 0;
    for (int r = mask.row_begin[static_cast<std::size_t>(y)];
         r < mask.row_begin[static_cast<std::size_t>(y) + 1]; ++r)
      count -= mask.runs[static_cast<std::size_t>(r)].last -
               mask.runs[static_cast<std::size_t>(r)].first + 1;
    EXPECT_EQ(count, 0);
  }
}

}  // namespace
}  // namespace flipfree::unwrap::mask_test
